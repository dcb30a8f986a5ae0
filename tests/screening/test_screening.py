"""Screening: designs, effects against closed forms, resuming, workers, confidence, the fast path; and wrong input."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from study_functions import DeadlyMetric

from toolpoint import ToolpointError, io
from toolpoint.io.yaml import machine_file
from toolpoint.machine.description.screening_plan import MilledSquare
from toolpoint.machine.description.variation import Factor, Option, Swap, resting_shares, vary
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.studies.execute import Dask
from toolpoint.studies.screening.designs import (
    fractional_factorial,
    full_factorial,
    given_points,
    latin_hypercube,
    one_at_a_time,
    sobol_pairs,
    sobol_sequence,
)
from toolpoint.studies.screening.effects import rank_changes
from toolpoint.studies.screening.fast import screen_frequencies
from toolpoint.studies.screening.metrics import NamedMetrics
from toolpoint.studies.screening.planned import accuracy_of
from toolpoint.studies.screening.screen import screen

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
SPRINGS = tuple(Factor(f"spring {i}", (f"joints.joint_q{i}.stiffness.rz",), 0.8, 1.2) for i in (1, 2, 3))


@pytest.fixture(scope="module")
def robot():
    return machine_file.read(MACHINES / "elastic_robot.yaml")


class Linear:
    """A metric with known effects: 100 + 3 a + 2 b + a b of the shares of two springs."""

    def __init__(self, cross=0.0):
        self.cross = cross

    def __call__(self, machine):
        a, b = (machine.value(f"joints.joint_q{i}.stiffness.rz") / k for i, k in ((1, 1.2e5), (2, 1e5)))
        a, b = (a - 0.8) / 0.4, (b - 0.8) / 0.4
        return {"answer": 100 + 3 * a + 2 * b + self.cross * a * b}


def test_changes_reach_their_numbers_and_rest_leaves_the_machine(robot):
    changes = (Factor("all torsion", ("joints.*.stiffness.rz",), 1.0, 2.0), Factor("mass", ("bodies.link1.mass",), 0.0, 4.0,
                                                                                   "add"),
               Swap("spring", {"as it is": Option(), "stiff": Option(values={"joints.joint_q1.stiffness.rx": 9e5},
                                                                   scale={"joints.joint_q2.stiffness.rx": 2.0})}))
    assert vary(robot.description, changes, resting_shares(changes)) == robot.description.with_values({})
    varied = vary(robot.description, changes, (0.5, 1.0, 0.9))
    assert varied.value("joints.joint_q6.stiffness.rz") == pytest.approx(1.5 * 8e3)
    assert varied.value("bodies.link1.mass") == 16.0
    assert varied.value("joints.joint_q1.stiffness.rx") == 9e5 and varied.value("joints.joint_q2.stiffness.rx") == 6e5


def test_designs_have_their_points():
    swap = Swap("s", {"a": Option(), "b": Option(), "c": Option()})
    assert len(one_at_a_time((*SPRINGS, swap)).points) == 1 + 2 * 3 + 2
    assert len(full_factorial((*SPRINGS, swap), 2).points) == 24
    # Orthogonal columns, and at resolution 4 also to all pairs of columns.
    points = fractional_factorial(SPRINGS).points - 0.5
    np.testing.assert_allclose(points.T @ points, np.eye(3) * len(points) / 4)
    pairs = np.column_stack([points[:, i] * points[:, j] for i in range(3) for j in range(i)])
    np.testing.assert_allclose(points.T @ pairs, 0)
    rng = np.random.default_rng(0)
    for column in latin_hypercube(SPRINGS, 20, rng).points.T:
        assert sorted(np.floor(20 * column)) == list(range(20))
    assert len(sobol_sequence(SPRINGS, 20, rng).points) == 32


def test_effects_of_a_linear_metric(robot):
    alone = rank_changes(screen(robot, one_at_a_time(SPRINGS[:2]), Linear()))
    base = 102.5
    assert {e.name: e.value for e in alone.effects} == pytest.approx({
        "spring 1 +20 %": 1.5 / base, "spring 1 -20 %": -1.5 / base, "spring 2 +20 %": 1 / base, "spring 2 -20 %": -1 / base})
    assert alone.effects[0].name == "spring 1 +20 %" and "no uncertain inputs" in alone.doubt
    contrasts = rank_changes(screen(robot, full_factorial(SPRINGS[:2], 3), Linear()))
    assert [e.value for e in contrasts.effects] == pytest.approx([3 / base, 2 / base])


@pytest.mark.slow
def test_sobol_indices_against_the_closed_form(robot):
    # y = 3 a + 2 b + 4 (a - 1/2)(b - 1/2) + ... of uniform a, b: variances 9/12, 4/12 and 16/144.
    class Crossed(Linear):
        def __call__(self, machine):
            a, b = (machine.value(f"joints.joint_q{i}.stiffness.rz") / k for i, k in ((1, 1.2e5), (2, 1e5)))
            a, b = (a - 1.0) / 0.4, (b - 1.0) / 0.4
            return {"answer": 3 * a + 2 * b + 4 * a * b}

    ranking = rank_changes(screen(robot, sobol_pairs(SPRINGS[:2], 128, np.random.default_rng(1)), Crossed()))
    total = 9 / 12 + 4 / 12 + 16 / 144
    first, second = ranking.effects
    assert (first.name, second.name) == ("spring 1", "spring 2")
    assert first.value == pytest.approx(9 / 12 / total, abs=0.06) and second.value == pytest.approx(4 / 12 / total, abs=0.06)
    assert first.total == pytest.approx((9 / 12 + 16 / 144) / total, abs=0.06)


def test_ranking_with_uncertain_inputs_has_intervals_and_odds(robot):
    result = screen(robot, one_at_a_time(SPRINGS), NamedMetrics(("frequency 1",)),
                    doubts=[Factor("m", ("bodies.*.mass",), 0.7, 1.3)],
                    draws=8, rng=np.random.default_rng(2))
    ranking = rank_changes(result)
    assert sum(e.first for e in ranking.effects) == pytest.approx(1)
    assert all(e.low <= e.high for e in ranking.effects) and ranking.doubt is None


def test_a_screening_resumes_to_the_same_table_byte_for_byte(robot, tmp_path):
    design, metric = one_at_a_time(SPRINGS), NamedMetrics(("frequency 1", "static stiffness"))
    whole = screen(robot, design, metric).table()

    def stop(done, total):
        if done >= 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        screen(robot, design, metric, folder=tmp_path / "kept", progress=stop, chunk_seconds=1e-6)
    kept = len(list((tmp_path / "kept").glob("chunk-*")))
    assert 0 < kept < len(design.points)
    assert screen(robot, design, metric, folder=tmp_path / "kept").table().encode() == whole.encode()
    shutil.rmtree(tmp_path / "kept")


def test_a_failed_variant_is_a_result(robot):
    class Fails(Linear):
        def __call__(self, machine):
            if machine.value("joints.joint_q1.stiffness.rz") > 1.3e5:
                raise ToolpointError("too stiff for this test")
            return super().__call__(machine)

    result = screen(robot, one_at_a_time(SPRINGS[:2]), Fails())
    assert list(result.failures.values()) == ["ToolpointError: too stiff for this test"]
    assert "too stiff" in result.table() and result.status.startswith("1 variants failed")


def test_fast_frequencies_are_those_of_the_full_model(robot):
    changes = (*SPRINGS, Factor("mass", ("bodies.link2.mass",)), Factor("bending", ("joints.*.stiffness.rx",)))
    design = latin_hypercube(changes, 300, np.random.default_rng(3))
    fast = screen_frequencies(robot, design, 4, pose={"q2": 0.4})
    for i in (0, 150, 299):
        full = natural_frequencies(robot.rebuild(vary(robot.description, changes, design.points[i])), {"q2": 0.4}, 4)[0]
        np.testing.assert_allclose(fast[i], full, rtol=1e-9)
    with pytest.raises(ToolpointError, match="affine"):
        screen_frequencies(robot, latin_hypercube((Factor("centre", ("bodies.link2.centre.0",), 0.2, 3.0),), 50,
                                                  np.random.default_rng(1)))


@pytest.mark.parametrize(("call", "words"), [
    (lambda robot: Factor("a", ("x",), 1.2, 0.8), "reversed"),
    (lambda robot: screen(robot, one_at_a_time([Factor("a", ("joints.joint_q9.stiffness.rz",))]), Linear()), "joint_q9"),
    (lambda robot: screen(robot, one_at_a_time([Factor("a", ("bodies.*.colour",))]), Linear()), "no parameter is like"),
    (lambda robot: screen(robot, one_at_a_time([SPRINGS[0], SPRINGS[0]]), Linear()), "appears twice"),
    (lambda robot: NamedMetrics(("frequenzy 1",)), "did you mean"),
    (lambda robot: screen(robot, one_at_a_time(SPRINGS), Linear(), draws=3), "needs doubts"),
    (lambda robot: Swap("s", {"a": Option()}), "at least two"),
    (lambda robot: given_points(SPRINGS, np.array([[0.5, 0.5, 1.5]])), "within 0 .. 1"),
])
def test_bad_input(robot, call, words):
    with pytest.raises(ToolpointError, match=words):
        call(robot)


@pytest.mark.slow
@pytest.mark.cluster
@pytest.mark.filterwarnings("ignore")
def test_a_killed_worker_leaves_the_same_table(robot, tmp_path, monkeypatch):
    """One of two Dask workers dies within the screening; then a run that resumes what it kept."""
    monkeypatch.setenv("PYTHONPATH", f"{Path(__file__).parents[1] / 'studies'}:{Path(__file__).parents[2] / 'src'}")
    design = full_factorial(SPRINGS, 3)
    plain = screen(robot, design, DeadlyMetric(""))
    shared = screen(robot, design, DeadlyMetric(str(tmp_path / "died")), engine=Dask(2), folder=tmp_path / "kept",
                    chunk_seconds=0.01)
    assert (tmp_path / "died").exists()
    again = screen(robot, design, DeadlyMetric(str(tmp_path / "died")), folder=tmp_path / "kept")
    assert plain.table() == shared.table() == again.table() and plain.to_dict() == shared.to_dict() == again.to_dict()


def test_a_screening_of_a_cut_that_chatters_is_doubted():
    """Its errors are those of a chip that does not feed back: only the stability of the cut says what they are worth."""
    path = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/milling_robot.yaml"
    robot = machine_file.read(path)
    part = MilledSquare(0.05, 2000.0, 5e-3, (0.77, 0.0, 0.26), (0, 1, 0), (0, 0, 1), feed=0.04 / 60, window=0.1, sides=(1,))
    deep, shallow = (accuracy_of(replace(part, depth=depth)).judge(robot) for depth in (5e-3, 1e-6))
    assert shallow == () and len(deep) == 1 and "chatters at 3 of 3 poses" in deep[0]


@pytest.mark.slow
def test_sides_along_which_axes_turn_fast_are_judged_as_they_are_run():
    """Nodes farther apart than those of the runs took such a side for a singular one, and the screening was lost."""
    path = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/milling_robot.yaml"
    square = io.read_plan(path.with_name("milling_robot_screening.yaml")).square
    assert square is not None and not any("not judged" in line for line in accuracy_of(square).judge(machine_file.read(path)))


def test_a_side_that_cannot_be_judged_loses_no_screening():
    path = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/milling_robot.yaml"
    part = MilledSquare(0.05, 2000.0, 5e-3, (3.0, 0.0, 0.26), (0, 1, 0), (0, 0, 1), window=0.1, sides=(1,))
    assert "not judged" in accuracy_of(part).judge(machine_file.read(path))[0]


@pytest.mark.parametrize(("limits", "expected"), [([2e-3, np.inf], 2e-3), ([np.inf, np.inf], 0.8), ([np.nan, 2e-3], None)])
def test_depth_limits_of_failed_poses_are_no_limits(limits, expected, monkeypatch):
    """A pose without a chart fails the variant; where no limit is, the metric is the depth looked at."""
    from toolpoint.studies.cuts.chatter_limits import ChatterMap
    from toolpoint.studies.screening import metrics

    limit = np.array(limits)[:, None, None]
    chart = ChatterMap({}, np.zeros(1), np.array([3000.0]), limit, limit, np.array([1.0, 0.8]), cut=None,
                       failures={(0, 0): "no modes"} if np.isnan(limits[0]) else {}, poses=({}, {}))
    monkeypatch.setattr(metrics, "chatter_map", lambda machine, poses: chart)
    if expected is None:
        with pytest.raises(ToolpointError, match=r"no depth limit at 1 of 2 \(no modes\)"):
            metrics.METRICS["depth limit"](None, ({}, {}))
    else:
        assert metrics.METRICS["depth limit"](None, ({}, {})) == expected
