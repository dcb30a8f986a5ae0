"""Planned hammer tests: points by effective independence, Dofs to strike, virtual outcome, and the files that are written."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from toolpoint import Modes, ToolpointError
from toolpoint.app.main import main
from toolpoint.io import read_machine
from toolpoint.io.measured import geometry_files
from toolpoint.io.measured.record_files import read_test
from toolpoint.io.yaml.testing import plan_writing, test_file
from toolpoint.machine import build
from toolpoint.machine.description import PointDescription
from toolpoint.studies.machines.virtual_test import Hammer, hammer_records, list_points
from toolpoint.studies.measured.hammer_study import study_hammer_records
from toolpoint.studies.testing.modal_test_plan import plan_test
from toolpoint.studies.testing.point_choice import choose_points, choose_struck, expand, visibility
from toolpoint.vibration import Dof
from toolpoint.vibration.correlation import mac

MACHINE = "src/toolpoint/app/machines/three_axis_vertical.yaml"


def random_modes(points: int, count: int, seed: int) -> Modes:
    rng = np.random.default_rng(seed)
    labels = [Dof(p, way) for p in range(1, points + 1) for way in ("+x", "+y", "+z")]
    return Modes(np.arange(1, count + 1) * 10.0, 0.02, rng.standard_normal((3 * points, count)), labels)


@pytest.mark.parametrize("seed", range(4))
def test_effective_independence_comes_near_the_best_of_all_choices(seed):
    modes = random_modes(9, 4, seed)

    def information(points):
        rows = [k for k, dof in enumerate(modes.dofs) if dof.point in set(points)]
        shape = modes.shape[rows] / np.linalg.norm(modes.shape, axis=0)
        return np.linalg.det(shape.T @ shape)

    every = [information(some) for some in combinations(range(1, 10), 4)]
    chosen = information(choose_points(modes, 4))
    assert chosen > 0.5 * max(every) and chosen > np.quantile(every, 0.9)
    assert {2, 5} <= set(choose_points(modes, 4, [2, 5]))


def test_one_point_that_alone_sees_a_mode_is_kept_and_struck():
    shape = np.zeros((15, 2))
    shape[:, 0] = 1.0
    shape[10, 1] = 1.0  # point 4, y
    modes = Modes([10.0, 20.0], 0.02, shape, [Dof(p, way) for p in range(1, 6) for way in ("+x", "+y", "+z")])
    assert 4 in choose_points(modes, 1) and choose_struck(modes, modes.dofs, 1) == [Dof(4, "+y")]
    assert visibility(modes, [Dof(4, "+y")]).tolist() == [1.0, 1.0]
    assert visibility(modes, [Dof(1, "+y")]).tolist() == [1.0, 0.0]


def test_expansion_of_exact_shapes_is_exact():
    modes = random_modes(10, 5, 0)
    dofs = [dof for dof in modes.dofs if dof.point in (1, 4, 8)]
    seen = Modes(modes.frequency, 0.02, modes.shape_at(dofs), dofs)
    assert np.allclose(expand(modes, seen, dofs), modes.shape)


def test_too_few_points_and_no_mode_are_refused():
    with pytest.raises(ToolpointError, match="as many directions as modes"):
        choose_points(random_modes(9, 8, 0), 2)
    with pytest.raises(ToolpointError, match="its first is at 21"):
        plan_test(read_machine(MACHINE), 12, highest=5.0, rng=np.random.default_rng(0))


@pytest.mark.slow
def test_twelve_points_of_the_demo_machine_find_what_131_find():
    plan = plan_test(read_machine(MACHINE), 12, rng=np.random.default_rng(1))
    assert plan.expected.seen == plan.modes.count == 6 and len(plan.points) == 12
    assert plan.expected.least_mac >= 0.99 and plan.expected.false == 0
    assert plan.expected.least_mac >= max(outcome.least_mac for outcome in plan.random)
    assert {dof.point for dof in plan.struck} <= set(plan.points)
    # The ring-down ends within the block, and the pulse reaches the highest mode.
    assert np.exp(-(plan.modes.damping_ratio * 2 * np.pi * plan.modes.frequency).min() * plan.block) <= 0.011
    assert plan.sample_rate >= 2.56 * plan.modes.frequency.max()


@pytest.mark.slow
def test_with_eighteen_modes_random_points_do_worse():
    plan = plan_test(read_machine("src/toolpoint/app/machines/three_axis_vertical_drives.yaml"), 12,
                     rng=np.random.default_rng(1))
    assert plan.expected.seen == plan.modes.count == 18 and plan.expected.least_mac >= 0.99
    assert max(outcome.seen for outcome in plan.random) < 18


@pytest.mark.slow
def test_the_written_test_reads_the_records_that_it_asks_for(tmp_path, capsys):
    test, points = tmp_path / "test.yaml", tmp_path / "points.csv"
    main(["plan", MACHINE, "--points", "4", "--test", str(test), "--geometry", str(points), "-o", str(tmp_path / "page"),
          "--json"])
    planned = json.loads(capsys.readouterr().out)
    assert set(map(str, geometry_files.read(points).points)) == set(map(str, planned["points"]))
    assert "strike here" in (tmp_path / "page" / "index.html").read_text()
    plan = plan_test(read_machine(MACHINE), 4, rng=np.random.default_rng(1))
    rng, volts = np.random.default_rng(0), np.array([2.25e-3, *[0.1 / 9.80665] * 3])
    for point in plan.points:
        for struck in plan.struck:
            record = hammer_records(plan.modes, struck, [Dof(point, way) for way in ("+x", "+y", "+z")], rng=rng,
                                    hammer=Hammer(contact=plan.contact, block=1.05 * plan.block, sample_rate=plan.sample_rate))
            rows = (",".join(f"{v:.9g}" for v in row) for row in np.column_stack([record.time, record.samples * volts]))
            (tmp_path / f"P{point}_at{str(struck).replace(':', '=')}_1.csv").write_text(
                "time [s],c1 [V],c2 [V],c3 [V],c4 [V]\n" + "\n".join(rows) + "\n")
    study = study_hammer_records(read_test(test_file.read(test), tmp_path), duration=plan.block)
    assert {str(dof.point) for dof in study.frf.outputs} == set(map(str, plan.points)) and study.frf.inputs == plan.struck
    from toolpoint.modal_identification import identify

    found = identify(study.frf, band=(8, 75)).modes
    near = [int(np.argmin(np.abs(found.frequency - true))) for true in plan.modes.frequency]
    assert np.abs(found.frequency[near] / plan.modes.frequency - 1).max() < 1e-3
    assert np.diag(mac(found.shape[:, near], plan.modes.shape_at(found.dofs))).min() > 0.999
    with pytest.raises(ToolpointError, match="exists already"):
        plan_writing.write_geometry(plan.candidates.coordinates, plan.points, points)
    with pytest.raises(SystemExit):
        main(["plan", MACHINE, "--test", str(test)])
    assert "nothing was written" in capsys.readouterr().err


@pytest.mark.slow
def test_points_that_the_file_names_are_chosen_among_where_asked():
    machine = read_machine(MACHINE)
    rng = np.random.default_rng(3)
    bodies = list(machine.description.bodies)
    more = {f"m{i}": PointDescription(bodies[i % len(bodies)], tuple(rng.uniform(-0.4, 0.4, 3))) for i in range(20)}
    machine = build(replace(machine.description, points={**machine.description.points, **more, "floor": PointDescription(
        "ground", (0.0, 0.0, 0.0))}))
    places = list_points(machine)
    assert "floor" not in places.places and set(more) <= set(places.places)
    plan = plan_test(machine, 8, candidates=places, rng=np.random.default_rng(1))
    assert set(plan.points) <= set(places.places) and len(plan.points) == 8
    for name in plan.points:
        body, at = plan.candidates.places[name]
        frame = machine.body_frames[machine.link(body)]
        assert at == pytest.approx(frame[:3, :3] @ machine.description.points[name].at + frame[:3, 3])


def test_fewer_points_than_asked_for_are_refused():
    with pytest.raises(ToolpointError, match="name more points"):
        plan_test(read_machine(MACHINE), 500, rng=np.random.default_rng(1))


def test_the_command_names_the_points_that_are_missing(capsys):
    with pytest.raises(SystemExit):
        main(["plan", MACHINE, "--file-points", "--points", "12"])
    assert "12 points of 5" in capsys.readouterr().err


@pytest.mark.slow
def test_what_is_left_out_of_a_plan_is_said():
    """Thirty modes are no test of a day: the lowest eighteen are planned for, unless a person says otherwise."""
    plan = plan_test(read_machine("src/toolpoint/app/machines/gantry.yaml"), rng=np.random.default_rng(1))
    assert plan.modes.count == 18 and len(plan.points) == 12
    assert any("planned for the lowest 18 of" in note for note in plan.notes)
