"""Chatter limits over a grid: those of single charts, warm in chains, the worst place, resumed, on workers, with poses that
fail or kill their worker."""

import importlib
import itertools
from dataclasses import dataclass, field

import numpy as np
import pytest
from study_functions import Deadly, static

from toolpoint import ToolpointError
from toolpoint.cutting import PanelArnoldi, ZeroOrder, stability
from toolpoint.studies import machine_dynamics, modal_dynamics, with_work
from toolpoint.studies.cuts.chatter_map import chatter_map
from toolpoint.studies.execute import Dask, Serial
from toolpoint.studies.machines.tool_point import depth_limit, milling_problem, tool_point
from toolpoint.vibration import Modes

AXES = {"X": [-0.2, 0.1], "Z": [0.0, 0.3]}
SPEEDS = np.linspace(900.0, 1600.0, 8)
ANGLES = np.radians([0.0, 60.0])


@pytest.fixture(scope="module")
def found(vertical_drives):
    return chatter_map(vertical_drives, AXES, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder())


def test_every_place_of_the_grid_has_the_limits_of_its_own_chart(found, vertical_drives):
    cut = vertical_drives.description.cutting
    assert found.limit.shape == found.frequency.shape == (2, 2, 2, 8)
    for i, x in enumerate(AXES["X"]):
        for k, z in enumerate(AXES["Z"]):
            study = tool_point(vertical_drives, [{"X": x, "Z": z}])
            problem = milling_problem(cut, study.modes.at_pose(0), f"{study.point}:+x", y=f"{study.point}:+y")
            for way, angle in enumerate(ANGLES):
                chart = stability.chart(problem.at_feed_angle(angle), SPEEDS, ZeroOrder(), depth_max=depth_limit(problem))
                np.testing.assert_allclose(found.limit[i, k, way], chart.limit, rtol=1e-9)
                np.testing.assert_allclose(found.frequency[i, k, way], chart.frequency[chart.limit_points()], rtol=1e-9)
            assert found.depth_max[i, k] == pytest.approx(depth_limit(problem))


def test_a_work_that_gives_way_counts_at_every_place(found, vertical_drives):
    """The chart of one place with the sum of both responses on lines; a work of nothing changes nothing."""
    wall = modal_dynamics(Modes([70.0], [0.02], [[3e-2]], ["wall:+x"]), y="rigid")
    mapped = chatter_map(vertical_drives, AXES, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder(), work=wall)
    pose = {"X": AXES["X"][1], "Z": AXES["Z"][0]}
    both = with_work(machine_dynamics(vertical_drives, pose), wall)
    problem = milling_problem(vertical_drives.description.cutting, both.response, both.x, y=both.y)
    chart = stability.chart(problem.at_feed_angle(ANGLES[1]), SPEEDS, ZeroOrder(), depth_max=mapped.depth_max[1, 0])
    np.testing.assert_allclose(mapped.limit[1, 0, 1], chart.limit, rtol=1e-6)
    assert (mapped.limit < 0.9 * found.limit).any()
    assert any("the work gives way too" in note for note in mapped.notes)
    nothing = modal_dynamics(Modes([70.0], [0.02], [[1e-9]], ["wall:+x"]), y="rigid")
    still = chatter_map(vertical_drives, AXES, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder(), work=nothing)
    np.testing.assert_allclose(still.limit, found.limit, rtol=1e-6)


def test_the_worst_place_is_the_smallest_of_all_and_nothing_stable_everywhere_lies_above(found):
    worst = found.worst()
    assert worst.depth == found.limit.min()
    index = (AXES["X"].index(worst.pose["X"]), AXES["Z"].index(worst.pose["Z"]), int(np.argmin(abs(ANGLES - worst.feed_angle))))
    at = int(np.argmin(abs(SPEEDS - worst.speed)))
    assert found.limit[(*index, at)] == worst.depth and found.frequency[(*index, at)] == worst.frequency
    assert found.worst(1).depth == found.limit[:, :, 1].min() and found.worst(1).feed_angle == ANGLES[1]
    np.testing.assert_array_equal(found.everywhere, found.limit.reshape(-1, 8).min(axis=0))
    np.testing.assert_array_equal(found.lowest, found.limit.min(axis=-1))


def test_an_interrupted_map_goes_on_where_it_stopped(found, vertical_drives, tmp_path):
    class Stopped(Exception):
        pass

    def stop(done, total):
        raise Stopped

    # Chunks are saved before they are told; all of this small study is one chunk unless a second has passed.
    with pytest.raises(Stopped):
        chatter_map(vertical_drives, AXES, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder(), folder=tmp_path,
                    progress=stop)
    assert list(tmp_path.glob("chunk-*.npz"))
    steps = []
    again = chatter_map(vertical_drives, AXES, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder(), folder=tmp_path,
                         progress=lambda done, total: steps.append((done, total)))
    assert steps[0][0] >= 1 and steps[-1] == (4, 4)
    np.testing.assert_array_equal(again.limit, found.limit)
    with pytest.raises(ToolpointError, match="another study"):
        chatter_map(vertical_drives, AXES, speeds=SPEEDS, feed_angles=ANGLES[:1], method=ZeroOrder(), folder=tmp_path)


@pytest.mark.slow
def test_workers_give_the_same_map(found, vertical_drives):
    pytest.importorskip("distributed")
    spread = chatter_map(vertical_drives, AXES, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder(), engine=Dask(2))
    np.testing.assert_allclose(spread.limit, found.limit, rtol=1e-12)


@dataclass(frozen=True)
class Told:
    """PanelArnoldi, telling how many speeds of a neighbour each chart began with."""

    begun: list = field(default_factory=list)

    def __str__(self):
        return "Told"

    def solve(self, problem, speeds, depth_max, *, warm=None):
        self.begun.append(len(warm.roots))
        return PanelArnoldi().solve(problem, speeds, depth_max, warm=warm)


WIDE = {"X": [-0.2, -0.15, -0.1], "Z": [0.0, 0.05, 0.1]}


@pytest.mark.slow
def test_warm_chains_give_the_cold_charts_within_their_errors(vertical_drives):
    method, speeds = Told(), SPEEDS[::3]
    found = chatter_map(vertical_drives, WIDE, speeds=speeds, feed_angles=ANGLES, method=method)
    # Nine poses are chains of two, in snake order, and one of one: a chain begins cold, its second pose with all three speeds.
    begun = np.reshape(method.begun, (9, 2))
    assert (begun[0::2, 0] == 0).all() and (begun[1::2] == 3).all()
    assert found.depth_max[0, 0] == found.depth_max[0, 1] and found.depth_max[0, 2] == found.depth_max[1, 2]
    assert found.depth_max[1, 1] == found.depth_max[1, 0]
    cut = vertical_drives.description.cutting
    for i, k in itertools.product(range(3), range(3)):
        study = tool_point(vertical_drives, [found.pose((i, k))])
        problem = milling_problem(cut, study.modes.at_pose(0), f"{study.point}:+x", y=f"{study.point}:+y")
        for way, angle in enumerate(ANGLES):
            chart = stability.chart(problem.at_feed_angle(angle), speeds, PanelArnoldi(), depth_max=depth_limit(problem))
            error = chart.error[chart.limit_points()]
            assert (abs(found.limit[i, k, way] - chart.limit) <= 2 * error).all()  # each of the two has its own
            assert (error < 1e-5 * chart.limit).all()


@dataclass(frozen=True)
class OneByOne:
    """The serial engine with a chunk a point, and how many it ran."""

    ran: list = field(default_factory=list)

    def run(self, function, points, todo, seconds):
        for index in todo:
            self.ran.append(len(points[index]))
            yield from Serial().run(function, points, [index], seconds=seconds)


def test_finished_chains_are_kept(vertical_drives, tmp_path):
    class Stopped(Exception):
        pass

    def stop(done, total):
        steps.append((done, total))
        if done > 4:
            raise Stopped

    steps, whole = [], chatter_map(vertical_drives, WIDE, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder())
    with pytest.raises(Stopped):
        chatter_map(vertical_drives, WIDE, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder(), engine=OneByOne(),
                    folder=tmp_path, progress=stop)
    again = OneByOne()
    found = chatter_map(vertical_drives, WIDE, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder(), engine=again,
                        folder=tmp_path,
                         progress=lambda done, total: steps.append((done, total)))
    assert steps == [(1, 9), (3, 9), (5, 9), (5, 9), (7, 9), (9, 9)] and again.ran == [2, 1]
    np.testing.assert_array_equal(found.limit, whole.limit)


@dataclass(frozen=True)
class Choosy:
    """A method that refuses one feed direction, and breaks where the tool is soft."""

    softest: float

    def solve(self, problem, speeds, depth_max, *, warm=None):
        if problem.feed_angle > 1:
            raise ToolpointError("no feed beyond 1 rad")
        if np.abs(problem.plane.response(np.array([1.0]))).max() > self.softest:
            raise RuntimeError("too soft")
        return ZeroOrder().solve(problem, speeds, depth_max)


def test_places_that_fail_are_kept_with_their_reason(vertical_drives):
    static = [float(np.abs(tool_point(vertical_drives, [{"X": 0.0, "Z": z}], np.array([1.0])).frf.values[0, 0, :2, :2]).max())
              for z in (0.0, 0.3)]
    limit = sum(static) / 2
    soft = int(static[1] > static[0])
    found = chatter_map(vertical_drives, {"Z": [0.0, 0.3]}, speeds=SPEEDS, feed_angles=ANGLES, method=Choosy(limit))
    assert "too soft" in found.failures[(soft, 0)] and "no feed beyond" in found.failures[(1 - soft, 1)]
    assert np.isnan(found.limit[soft]).all() and np.isfinite(found.limit[1 - soft, 0]).all()
    assert found.worst().pose == {"Z": [0.0, 0.3][1 - soft]}
    np.testing.assert_array_equal(found.everywhere, found.limit[1 - soft, 0])
    with pytest.raises(ToolpointError, match="every pose failed"):
        chatter_map(vertical_drives, {"Z": [0.0]}, speeds=SPEEDS, feed_angles=ANGLES, method=Choosy(0.0)).worst()


def static_of(vertical_drives, index):
    pose = {name: at[i] for (name, at), i in zip(WIDE.items(), index)}
    study = tool_point(vertical_drives, [pose])
    return static(milling_problem(vertical_drives.description.cutting, study.modes.at_pose(0), f"{study.point}:+x",
                                  y=f"{study.point}:+y").plane)


def test_a_pose_that_breaks_does_not_take_its_chain_along(vertical_drives, tmp_path):
    steps = []
    options = {"folder": tmp_path, "progress": lambda done, total: steps.append((done, total))}
    soft, softest = max((static_of(vertical_drives, index), index) for index in itertools.product(range(3), range(3)))
    method = Choosy(soft * (1 - 1e-9))
    found = chatter_map(vertical_drives, WIDE, speeds=SPEEDS, feed_angles=[0.0], method=method, **options)
    whole = chatter_map(vertical_drives, WIDE, speeds=SPEEDS, feed_angles=[0.0], method=ZeroOrder())
    assert set(found.failures) == {(*softest, 0)} and "too soft" in found.failures[*softest, 0]
    others = ~np.isnan(found.limit)
    assert others.sum() == 8 * SPEEDS.size and steps[-1] == (9, 9)
    np.testing.assert_allclose(found.limit[others], whole.limit[others], rtol=1e-9)
    again = OneByOne()
    kept = chatter_map(vertical_drives, WIDE, speeds=SPEEDS, feed_angles=[0.0], method=method, engine=again, folder=tmp_path)
    np.testing.assert_array_equal(kept.limit, found.limit)
    assert not again.ran


@pytest.mark.slow
def test_a_pose_that_kills_its_worker_is_found(vertical_drives):
    pytest.importorskip("distributed")
    found = chatter_map(vertical_drives, WIDE, speeds=SPEEDS, feed_angles=[0.0],
                        method=Deadly(static_of(vertical_drives, (1, 1))),
                         engine=Dask(2))
    assert set(found.failures) == {(1, 1, 0)} and "died" in found.failures[1, 1, 0]
    assert np.isfinite(found.limit).sum() == 8 * SPEEDS.size


def test_wrong_input(vertical_drives, vertical):
    with pytest.raises(ToolpointError, match="at least one axis"):
        chatter_map(vertical_drives, {})
    with pytest.raises(ToolpointError, match=r"must be within"):
        chatter_map(vertical_drives, {"X": [0.0, 5.0]})


def test_a_list_of_poses_has_the_limits_of_the_grid(found, vertical_drives):
    """The four places of the grid as a list; the described poses where nothing is said; what is printed names the worst."""
    poses = [{"X": x, "Z": z} for x in AXES["X"] for z in AXES["Z"]]
    listed = chatter_map(vertical_drives, poses, speeds=SPEEDS, feed_angles=ANGLES, method=ZeroOrder())
    np.testing.assert_allclose(listed.limit, found.limit.reshape(4, 2, 8), rtol=1e-9)
    assert listed.worst().pose == found.worst().pose and listed.to_dict()["poses"] == poses
    assert f"Worst: {found.worst()}" in found.table() and "60°" in found.table()
    described = chatter_map(vertical_drives, speeds=SPEEDS[:2], method=ZeroOrder())
    assert described.poses == tuple(map(dict, vertical_drives.description.poses))


def test_a_map_without_limits_looks_deeper(vertical_drives, monkeypatch):
    """The first depth is that of the softest mode; where teeth pass too fast for it, stiffer modes limit, and deeper."""
    options = {"speeds": SPEEDS, "feed_angles": ANGLES, "method": ZeroOrder()}
    whole = chatter_map(vertical_drives, {"Z": [0.0]}, **options)
    module = importlib.import_module("toolpoint.studies.cuts.chatter_map")
    monkeypatch.setattr(module, "depth_limit", lambda problem: 0.4 * float(whole.lowest.min()))
    deeper = chatter_map(vertical_drives, {"Z": [0.0]}, **options)
    assert np.isfinite(deeper.lowest).all() and deeper.depth_max[0] > float(whole.lowest.min())
    np.testing.assert_allclose(deeper.lowest, whole.lowest, rtol=1e-3)
