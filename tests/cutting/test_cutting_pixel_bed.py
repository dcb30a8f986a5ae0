"""The pixel bed: material removed, engagement and force of a slot follow the analytic cut."""

from __future__ import annotations

import numpy as np
import pytest

from cutting.cutting_cases import benchmark
from toolpoint import ToolpointError
from toolpoint.cutting import Engagement, Tool
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.cutting.simulation.pixel_bed import PixelBed, cut


def test_slot_forces_and_volume() -> None:
    """Steady slotting: volume removed is feed x width, mean force within 5 % of the analytic one, peak chip = feed."""
    feed, pixel = 0.1e-3, 10e-6
    problem = benchmark(Engagement.slot(), feed_per_tooth=feed, tool=Tool(0.004, 2))
    bed = PixelBed.block((0.0, -2.2e-3), (3.5e-3, 2.2e-3), pixel)
    before = bed.area()
    run = cut(problem, bed, (0.2e-3, 0.0), speed=6000.0, depth=1e-3, revolutions=5, steps=240)
    assert (before - bed.area()) * 1e-3 == pytest.approx(run.removed.sum(), rel=1e-9)
    steady = slice(3 * 240, 5 * 240)
    assert run.removed[steady].sum() == pytest.approx(2 * 2 * feed * 4e-3 * 1e-3, rel=0.01)
    analytic = rigid_forces(problem, 1e-3, np.linspace(0, 2 * np.pi, 2000, endpoint=False), trochoidal=True)
    assert run.force[steady, :2].mean(0) == pytest.approx(analytic.force[:, :2].mean(0), rel=0.05)
    assert run.chip[steady].max() == pytest.approx(feed, rel=0.05)


@pytest.mark.slow
def test_a_helical_edge_cuts_every_layer_at_its_own_angle() -> None:
    """Half immersion up milling of a helical cutter: force over the revolution as the analytic one, volume exact."""
    feed, depth = 0.1e-3, 3e-3
    problem = benchmark(Engagement.up(0.5), feed_per_tooth=feed, tool=Tool(0.004, 2, helix=np.radians(35)))
    bed = PixelBed.block((0.0, 0.0), (3.5e-3, 2.2e-3), 10e-6, layers=6)
    run = cut(problem, bed, (0.2e-3, 0.0), speed=6000.0, depth=depth, revolutions=5, steps=180)
    steady = run.force[3 * 180:5 * 180]
    analytic = rigid_forces(problem, depth, np.linspace(0, 2 * np.pi, 2000, endpoint=False), slices=6, trochoidal=True)
    assert steady[:, :2].mean(0) == pytest.approx(analytic.force[:, :2].mean(0), rel=0.05)
    assert np.ptp(steady[:, 0]) == pytest.approx(np.ptp(analytic.force[:, 0]), rel=0.15)
    straight = cut(problem.changed(tool=Tool(0.004, 2)), PixelBed.block((0.0, 0.0), (3.5e-3, 2.2e-3), 10e-6),
                   (0.2e-3, 0.0), speed=6000.0, depth=depth, revolutions=5, steps=180).force[3 * 180:5 * 180]
    assert np.ptp(steady[:, 0]) < 0.9 * np.ptp(straight[:, 0])


def test_air_and_bad_input() -> None:
    """Beside the block nothing is cut; a helical tool and an absurd pixel are refused."""
    problem = benchmark(Engagement.slot(), feed_per_tooth=1e-4, tool=Tool(0.004, 2))
    bed = PixelBed.block((0.0, 0.0), (1e-3, 1e-3), 20e-6)
    assert not cut(problem, bed, (-0.05, 0.0), speed=6000.0, depth=1e-3, revolutions=1).force.any()
    with pytest.raises(ToolpointError, match="pixel"):
        PixelBed.block((0.0, 0.0), (1.0, 1.0), 1e-6)
    with pytest.raises(ToolpointError, match="helical"):
        cut(problem.changed(tool=Tool(0.004, 2, helix=0.5)), bed, (0.0, 0.0), speed=6000.0, depth=1e-3, revolutions=1)
