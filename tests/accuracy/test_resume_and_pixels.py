"""Runs that go on where they were stopped, and engagement from the pixels of a block."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine import build
from toolpoint.machine import description as d
from toolpoint.studies.accuracy import side_run
from toolpoint.studies.accuracy.cut_course import WorkBlock, mill_bed
from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_path, mill_side
from toolpoint.studies.accuracy.tool_paths import line, square

CUT = CuttingDescription.of(diameter=0.006, teeth=2, tangential=1780e6, normal=593e6, direction="slot", feed_per_tooth=1e-5)
SETUP = MillingSetup(15000, 0.5e-3, halved=False, steps=32)
R, PIXEL = 3e-3, 5e-5


def slide():
    """A slide that is driven along x and gives way along y on one spring."""
    body = d.BodyDescription(mass=8.0, inertia=d.InertiaDescription(1, 1, 1))
    joint = d.JointDescription("ground", "slide", stiffness={"y": 4e5}, damping={"y": 60.0})
    return build(d.MachineDescription("slide", {"slide": body}, {"guide": joint}, {"X": d.AxisDescription("guide", "x")},
                                      {"tip": d.PointDescription("slide")}, tool="tip", cutting=CUT))


class Stopped(Exception):
    """Stands for a run that is killed."""


@pytest.mark.slow
def test_a_stopped_run_goes_on_to_the_same_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr(side_run, "_SIDE_BLOCK_STEPS", 10_000)
    machine, path = slide(), line([0, 0, 0], [0.01, 0, 0])
    setup = replace(SETUP, halved=True, regenerative=True, depth=0.1e-3)

    def stop(done, every):
        if done > 0.4 * every:
            raise Stopped

    with pytest.raises(Stopped):
        mill_path(machine, path, setup, folder=tmp_path, progress=stop)
    kept = {p: p.stat().st_mtime_ns for p in tmp_path.glob("*.npz")}
    assert 1 < len(kept) < 10
    again, whole = (mill_path(machine, path, setup, folder=folder) for folder in (tmp_path, None))
    assert again.sides[0].relative.tobytes() == whole.sides[0].relative.tobytes()
    assert again.table() == whole.table()
    assert all(p.stat().st_mtime_ns == old for p, old in kept.items())
    deeper = mill_path(machine, path, replace(setup, depth=0.2e-3, regenerative=False, halved=False), folder=tmp_path)
    assert deeper.position_error != whole.position_error


def test_a_block_that_cannot_be_read_is_named(tmp_path):
    machine, path = slide(), line([0, 0, 0], [0.002, 0, 0])
    mill_path(machine, path, SETUP, folder=tmp_path)
    first = sorted(tmp_path.glob("*.npz"))[0]
    first.write_bytes(first.read_bytes()[:100])
    with pytest.raises(ToolpointError, match=r"side-1-fine-.*cannot be read .*delete this file"):
        mill_path(machine, path, SETUP, folder=tmp_path)


def arc_at(arcs, length):
    return [arc for at, arc in arcs if at <= length][-1]


@pytest.mark.parametrize("distance", [2e-3, 1e-3, 0.0])
def test_the_arc_on_the_way_into_a_block(distance):
    """The edge of the block is `distance` before the centre: asin(d / R) to 180 degrees less that."""
    bed = WorkBlock((0.0, -0.01), (0.02, 0.01), PIXEL).bed()
    arcs = mill_bed(bed, line([-0.01, 0, 0], [0.01, 0, 0])[0], R, is_left=True)
    assert arcs[0][1] is None and arc_at(arcs, 0.019) == pytest.approx((0, np.pi))
    arc = arc_at(arcs, 0.01 - distance)
    expected = np.arcsin(distance / R)
    assert arc == pytest.approx((expected, np.pi - expected), abs=np.radians(5 if distance == 0 else 3))


@pytest.mark.parametrize(("is_left", "arc"), [(True, (0, 90)), (False, (90, 180))])
def test_the_side_on_which_the_work_is(is_left, arc):
    """Work to the left of the feed: from the normal (0) to the feed (90) where the normal points left."""
    bed = WorkBlock((-0.02, 0.0), (0.02, 0.01), PIXEL).bed()
    arcs = mill_bed(bed, line([-0.01, 0, 0], [0.01, 0, 0])[0], R, is_left=is_left)
    assert np.degrees(arc_at(arcs, 0.01)) == pytest.approx(arc, abs=2)


def test_after_a_corner_the_slot_before_it_is_free():
    """A quarter at first; the free side is met up to n = sqrt(R^2 - (R - s)^2) after s, the whole slot after R."""
    bed = WorkBlock((-0.02, -0.02), (0.02, 0.02), PIXEL).bed()
    first, second = square(0.016)[:2]
    mill_bed(bed, first, R, is_left=True)
    arcs = mill_bed(bed, second, R, is_left=True)
    for s in (5e-4, 1.5e-3, 2.5e-3):
        # The slot came along x, the feed is y now: its left is -x, where the slot is free.
        free = np.sqrt(R**2 - (R - s) ** 2)
        assert np.degrees(arc_at(arcs, s)) == pytest.approx((np.degrees(np.arccos(free / R)), 180), abs=5)
    assert arc_at(arcs, 4e-3) == pytest.approx((0, np.pi))


def test_pixels_of_a_wide_block_are_the_slot_and_air_gives_no_error():
    machine, path = slide(), line([0, 0, 0], [0.01, 0, 0])
    window = replace(SETUP, window=0.05)
    slot = mill_side(machine, path[0], window)
    wide = mill_side(machine, path[0], replace(window, work=WorkBlock((-0.02, -0.02), (0.03, 0.02), 1e-4)))
    assert wide.position_error == pytest.approx(slot.position_error, rel=1e-12)
    assert "10 of 10 mm in the full slot, 0 mm in the air" in wide.notes[-1]
    air = mill_side(machine, path[0], replace(window, work=WorkBlock((0.02, -0.02), (0.03, 0.02), 1e-4)))
    assert air.position_error == 0


def test_a_block_upside_down_is_refused():
    with pytest.raises(ToolpointError, match=r"work: .* must have its high corner above the low one"):
        WorkBlock((0.0, 0.0), (0.01, -0.01)).bed()
