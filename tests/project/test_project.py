"""A project from responses to answers: limits beside closed checks, doubts that travel, tried cuts, bad input."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.app.main import main
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    BodyDescription,
    IdentifiedDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.description.project_plan import TriedCut
from toolpoint.project import Project, write_folder
from toolpoint.project.limits.changes import RankedChange, lead_of, rank_joints
from toolpoint.project.limits.drawn_limits import COEFFICIENTS_SOURCE, CutQuestion, DrawnLimits, draw_limits, quantile_of
from toolpoint.project.limits.next_cut import choose_cut
from toolpoint.project.limits.systems import MachineDraws, coefficient_factors
from toolpoint.project.limits.tried_cuts import weigh_draws
from toolpoint.project.steps.answering import question_draws
from toolpoint.vibration import Modes, eigen

CUT = CuttingDescription.of(diameter=0.05, teeth=4, immersion=0.5, tangential=8e8, normal=3e8, speeds=(800.0, 4000.0))
PROJECT = """toolpoint: 1
name: slide
machine: machine.yaml
cuts:
  half: {diameter: 50 mm, teeth: 4, immersion: 0.5, tangential: 800 MPa, normal: 300 MPa, speeds: 800 4000 rpm,
         coefficient_deviation: 10 %}
goals:
  rough: {speed: 2500 rpm, depth: 1 mm}
draws: 20
"""


def slide(deviation: float = 0.05) -> MachineDescription:
    """A head on springs along x and y; the stiffness along x is identified with this relative deviation."""
    joint = JointDescription("ground", "head", stiffness={"x": 4e7, "y": 9e7}, loss_factor=0.04)
    head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    identified = IdentifiedDescription(("joints.slide.stiffness.x",), (((deviation * 4e7) ** 2,),), "a test")
    return MachineDescription("slide", {"head": head}, {"slide": joint}, points={"tip": PointDescription("head")}, tool="tip",
                              identified=identified if deviation else None)


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "mill"
    place.mkdir()
    io.write_machine(slide(), place / "machine.yaml")
    (place / "project.yaml").write_text(PROJECT)
    return place


def question(depth: float = 1e-3, speed: float = 2500.0, deviation: float = 0.1) -> CutQuestion:
    return CutQuestion("half", CUT, deviation, (speed,), {}, depth)


def test_limit_is_inversely_proportional_to_both_coefficients():
    """With an exact machine the limit falls as 1 / K where K_t and K_n change alike (Altintas, Manufacturing Automation)."""
    systems = MachineDraws(build(slide(0.0)), 12, 3)
    limits = draw_limits(systems, question())
    factors = coefficient_factors("half", 0.1, systems)
    expected = limits.limit[0] / factors[:, 0]
    near = np.abs(factors[:, 1] / factors[:, 0] - 1) < 0.05
    assert near.any() and np.allclose(limits.draws[near, 0], expected[near], rtol=0.03)
    assert limits.shares == {COEFFICIENTS_SOURCE: 1.0}
    assert "no uncertainty" in systems.doubts[0]


@pytest.mark.slow
def test_shares_go_over_to_the_joint_as_it_becomes_uncertain():
    shares = [draw_limits(MachineDraws(build(slide(deviation)), 40, 1), question(deviation=0.05)).shares
              for deviation in (0.005, 0.15)]
    assert shares[0][COEFFICIENTS_SOURCE] > 0.8 and shares[1]["joint slide"] > 0.6
    assert all(sum(part.values()) == pytest.approx(1.0) for part in shares)


def test_quantiles_of_equal_weights_hold_what_they_say():
    """P(next draw below the quantile of n draws) is the level: order statistics of a uniform law."""
    rng = np.random.default_rng(0)
    inside = [float(rng.random() < quantile_of(rng.random(39), np.full(39, 1 / 39), 0.025)) for _ in range(4000)]
    assert abs(np.mean(inside) - 0.025) < 0.008


def test_probability_of_a_cut_falls_with_its_depth_and_is_never_certain():
    systems = MachineDraws(build(slide()), 20, 1)
    weights = np.full(20, 1 / 20)
    middle = float(draw_limits(systems, question()).limit[0])
    chances = [float(draw_limits(systems, question(share * middle)).chance(weights)[0]) for share in (0.3, 1.0, 3.0)]
    assert 1 > chances[0] > 0.95 and 0.2 < chances[1] < 0.8 and 0 < chances[2] < 0.05


@pytest.mark.slow
def test_tried_cut_moves_the_interval_to_its_side_and_a_contradiction_is_named():
    systems = MachineDraws(build(slide()), 45, 1)
    before = draw_limits(systems, question())
    weights, middle = np.full(45, 1 / 45), float(np.median(before.draws))
    stable = weigh_draws(systems, [TriedCut(2500.0, middle, True)], {"half": question()})
    assert before.interval(stable.weights)[0, 0] > before.interval(weights)[0, 0] and not stable.doubts
    shallow = draw_limits(systems, question(0.5 * middle))
    assert shallow.chance(stable.weights)[0] >= shallow.chance(weights)[0] - 1e-12  # a deeper cut was stable
    other = weigh_draws(systems, [TriedCut(2500.0, middle, False)], {"half": question()})
    assert before.interval(other.weights)[1, 0] < before.interval(weights)[1, 0]
    wrong = weigh_draws(systems, [TriedCut(2500.0, 0.1 * middle, False)], {"half": question()})
    assert any("contradicts the model" in doubt for doubt in wrong.doubts)
    both = weigh_draws(systems, [TriedCut(2500.0, 1.3 * middle, True), TriedCut(2500.0, 0.7 * middle, False)],
                       {"half": question()})
    assert any("contradicts" in doubt for doubt in both.doubts)


def test_chatter_at_a_frequency_of_no_draw_names_a_part_that_the_model_lacks():
    systems = MachineDraws(build(slide()), 30, 1)
    depth = 2 * float(draw_limits(systems, question()).limit[0])
    result = weigh_draws(systems, [TriedCut(2500.0, depth, False, 900.0)], {"half": question()})
    assert "another part vibrates" in result.doubts[0] and result.effective == pytest.approx(30, rel=0.2)


def test_next_cut_is_where_the_outcome_is_open():
    systems = MachineDraws(build(slide()), 30, 1)
    cut = choose_cut(draw_limits(systems, question()), np.full(30, 1 / 30))
    assert 0.1 < cut.stable_probability < 0.9 and cut.width_ratio < 0.95


def test_a_cut_that_was_made_is_not_proposed_again():
    limits, weights = draw_limits(MachineDraws(build(slide()), 30, 1), question()), np.full(30, 1 / 30)
    first = choose_cut(limits, weights)
    second = choose_cut(limits, weights, [(first.speed, first.depth)])
    assert abs(second.depth / first.depth - 1) > 0.03 and second.width_ratio >= first.width_ratio
    assert choose_cut(limits, weights, [(0.9 * first.speed, first.depth)]) == first


def test_soft_joint_is_the_first_to_change():
    stiff = JointDescription("head", "spindle", stiffness={"x": 4e9, "y": 4e9}, loss_factor=0.04)
    spindle = BodyDescription(20.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    base = slide(0.0)
    machine = MachineDescription("two", {**base.bodies, "spindle": spindle}, {**base.joints, "bearing": stiff},
                                 points={"tip": PointDescription("spindle")}, tool="tip")
    ranked = rank_joints(MachineDraws(build(machine), 0, 1), {"rough": question()}, {})
    assert ranked[0].joint == "slide" and ranked[0].gain > 5 * abs(ranked[1].gain)


def test_project_of_a_drawn_machine_answers_its_goal_and_an_edited_cut_recomputes_cuts_alone(folder, capsys):
    results = Project.open(folder).run()
    assert results.answers[0].startswith("rough: ") and results.goal("rough")["interval_m"][0] > 0
    before = (folder / "results/project.json").read_bytes()
    Project.open(folder).run()
    assert (folder / "results/project.json").read_bytes() == before
    (folder / "project.yaml").write_text(PROJECT.replace("800 MPa", "900 MPa"))
    events = []
    Project.open(folder).run(listen=events.append)
    ran = {event.decision.step for event in events if event.ended and event.decision.action == "run"}
    assert ran == {"limits/rough", "changes"}
    (folder / "project.yaml").write_text(PROJECT.replace("800 MPa", "0.9 GPa").replace("50 mm", "0.05 m"))
    Project.open(folder).run(listen=events.append)
    assert all(event.decision.action != "run" for event in events[-3:])
    older, newer = Project.open(folder).states  # the second and the fourth run changed nothing
    difference = Project.open(folder).compare_states(older.date[:4])
    assert difference.newer == newer and difference.older == older
    (row,) = difference.limit_rows
    assert newer.data["goals"]["rough"]["limit_m"] == pytest.approx(8 / 9 * results.goal("rough")["limit_m"], rel=0.1)
    assert row[0] == "rough" and row[6] == "intervals overlap"
    assert difference.changed_inputs == ("cuts.half.tangential: 800000000 -> 900000000",)
    assert any("do not show that nothing changed" in doubt for doubt in difference.doubts)
    with pytest.raises(ToolpointError, match=older.key):
        Project.open(folder).compare_states("1999")


@pytest.mark.slow
def test_commands_run_and_tried(folder, capsys):
    main(["run", str(folder), "--explain"])
    shown = capsys.readouterr().out
    assert "limits/rough: run, it was never run" in shown and (folder / "report.html").is_file()
    main(["tried", str(folder), "--speed", "2500", "--depth", "1", "--stable"])
    main(["run", str(folder), "--json"])
    data = json.loads(capsys.readouterr().out.partition("\n{")[2].join(["{", ""]) or "{}")
    assert any(step["step"] == "tried/machine" for step in data["steps"])
    with pytest.raises(SystemExit):
        main(["tried", str(folder), "--speed", "2500", "--depth", "1"])
    assert "must be one of them" in capsys.readouterr().err


def test_new_project_runs_as_it_is_and_says_what_is_missing(tmp_path):
    write_folder(tmp_path / "mine")
    results = Project.open(tmp_path / "mine").run()
    assert not results.answers and any("a cut" in line for line in results.next_steps)
    with pytest.raises(ToolpointError, match="nothing is overwritten"):
        write_folder(tmp_path / "mine")


@pytest.mark.parametrize(("text", "words"), [
    ("goals:\n  rough: {speed: 2500, depth: 1 mm}\n", "2500 has no unit"),
    ("goals:\n  rough: {speed: 2500 rpm, depth: 3}\n", "3 has no unit"),
    ("goals:\n  rough: {speed: 2500 rpm, depth: 1 mm, cut: slott}\n", "there is no cut 'slott'"),
    ("tests:\n  a: {modes: a.h5, date: 2026-05-01}\n  b: {modes: b.h5, date: 2026-04-01}\n", "before that of the test above"),
    ("tests:\n  a: {date: 2026-05-01}\n", "must have one of test, records, responses, modes"),
    ("tests:\n  a: {modes: a.h5, date: May}\n", "write it as 2026-11-26"),
])
def test_faults_of_a_project_file_are_said_with_line_and_caret(folder, text, words):
    head = PROJECT.partition("goals:")[0]
    (folder / "project.yaml").write_text(head + text)
    with pytest.raises(ToolpointError) as error:
        Project.open(folder).run()
    assert words in str(error.value) and "^" in str(error.value)
    assert not (folder / "results").exists()


def test_missing_file_and_newer_version_are_one_message(folder):
    (folder / "machine.yaml").rename(folder / "other.yaml")
    with pytest.raises(ToolpointError, match=r"machine\.yaml is not there"):
        Project.open(folder).run()
    (folder / "project.yaml").write_text(PROJECT.replace("toolpoint: 1", "toolpoint: 2"))
    with pytest.raises(ToolpointError, match="this program reads version 1"):
        Project.open(folder).run()


@pytest.mark.slow
def test_pose_that_the_machine_has_not_stops_its_goal_alone(folder):
    (folder / "project.yaml").write_text(PROJECT.replace("draws: 20", "  side: {speed: 2500 rpm, depth: 1 mm, pose: {Q: 1}}\n"
                                                         "draws: 20"))
    results = Project.open(folder).run()
    assert results.answers[0].startswith("rough: yes") or "rough: " in results.answers[0]
    assert "side: no answer" in results.answers[1]


@pytest.mark.slow
def test_moved_project_has_nothing_to_do(folder, tmp_path):
    Project.open(folder).run()
    shutil.move(folder, tmp_path / "elsewhere")
    events = []
    Project.open(tmp_path / "elsewhere").run(listen=events.append)
    assert {event.decision.action for event in events} == {"fresh"}


@pytest.mark.slow
def test_a_later_test_that_differs_is_named_and_doubted_down_to_the_answer(folder):
    """A second test of the same pose, its springs along x a fifth softer: changed, and every later answer says so."""
    for name, stiffness in (("new", 4e7), ("old", 4e7), ("worn", 3.2e7)):
        description = slide(0.0)
        joint = replace(description.joints["slide"], stiffness={"x": stiffness, "y": 9e7})
        machine = build(replace(description, joints={"slide": joint}))
        modes = eigen.solve_undamped(assemble(machine, outputs=["tip:+x", "tip:+y"]))
        variance = np.array([np.diag([(1e-4 * f) ** 2, 1e-6]) for f in modes.frequency])
        io.write_nouns(Modes(modes.frequency, np.full(2, 0.02), modes.shape, modes.dofs, covariance=variance),
                       folder / f"{name}.h5")
    text = (folder / "project.yaml").read_text()
    tests = "tests:\n  new: {modes: new.h5, date: 2026-01-10}\n  worn: {modes: worn.h5, date: 2026-11-02}\n"
    (folder / "project.yaml").write_text(text + tests)
    results = Project.open(folder).run(["limits/rough"])
    drift = json.loads((folder / "results/drift/drift.json").read_text())
    assert drift["changed"] and drift["parts"][0]["part"] == "joint slide"
    assert any("it has changed between the tests new and worn" in doubt for doubt in results.doubts)
    records = {file.stem.split("-")[0]: json.loads(file.read_text()) for file in (folder / ".toolpoint/steps").iterdir()}
    for step in ("update", "machine", "limits_rough"):
        assert any(doubt["step"] == "drift" and "has changed" in doubt["why"] for doubt in records[step]["doubts"]), step

    (folder / "project.yaml").write_text(text + tests.replace("worn.h5", "old.h5"))
    results = Project.open(folder).run(["drift"])
    assert not json.loads((folder / "results/drift/drift.json").read_text())["changed"]
    assert not any("it has changed" in doubt for doubt in results.doubts)


def test_record_of_another_pose_is_refused(tmp_path):
    """The joints are those of the pose that the component file tells; a project that tells another is refused."""
    from toolpoint.project.demo import _component_text, demo_machine
    from toolpoint.project.steps.modelling import find_joints
    from toolpoint.studies.machines.virtual_test import surface_points

    points = surface_points(demo_machine(), 24, np.random.default_rng(0))
    (tmp_path / "components.yaml").write_text(_component_text(demo_machine(), points))
    with pytest.raises(ToolpointError, match=r"X at 0\.2; the component file says at_test 0"):
        find_joints(tmp_path, tmp_path / "m.h5", tmp_path / "g.csv", components=tmp_path / "components.yaml", pose={"X": 0.2})
    with pytest.raises(ToolpointError, match="must be an axis of the component file: X, Z"):
        find_joints(tmp_path, tmp_path / "m.h5", tmp_path / "g.csv", components=tmp_path / "components.yaml", pose={"B": 0.2})


def test_a_project_stands_for_its_machine_file_in_every_command(folder, capsys):
    def table(place):
        main(["modes", str(place)])
        printed = capsys.readouterr()
        return printed.out, printed.err

    by_file, by_folder = table(folder / "machine.yaml"), table(folder)
    assert by_folder[0] == by_file[0] and "not of today" in by_folder[1]  # it was never run
    (folder / "project.yaml").write_text(PROJECT.replace("machine: machine.yaml\n", ""))
    with pytest.raises(SystemExit) as end:
        main(["modes", str(folder)])
    assert end.value.code == 2 and "no machine file" in capsys.readouterr().err


def test_the_mass_of_a_moved_sensor_in_a_test_file_reaches_the_identification(tmp_path):
    channels = [{"channel": "1", "quantity": "force", "dof": "1:+z"},
                {"channel": "2", "quantity": "acceleration", "dof": "*:+z", "mass": "120 g"}]
    record = {"files": ["P*.csv"], "pattern": "P{output}"}
    (tmp_path / "test.yaml").write_text(json.dumps({"toolpoint": 1, "test": "bed", "channels": channels, "records": [record]}))
    (tmp_path / "P1.csv").write_text("")
    for told, mass in (("", 0.12), (", sensor_mass: 80 g", 0.08)):
        (tmp_path / "project.yaml").write_text(f"toolpoint: 1\nname: bed\ntests: {{first: {{test: test.yaml{told}}}}}\n")
        step = next(step for step in Project.open(tmp_path).chain.steps if step.name == "modes/first")
        assert step.options["sensor_mass"] == pytest.approx(mass)


@pytest.mark.parametrize(("drawn", "is_grave"), [((8e-3, 14e-3), True), ((4e-3, 9e-3), False)])
def test_a_limit_outside_the_interval_of_its_draws_is_not_believed(drawn, is_grave):
    draws = np.linspace(*drawn, 40)[:, None]
    limits = DrawnLimits(CutQuestion("half", CUT, 0.1, (2500.0,), {}, 4e-3), np.array([7e-3]), np.array([1e-5]),
                         np.array([50.0]), draws, np.ones((40, 1)), np.full((40, 1), 50.0), 0.02, {}, ())
    assert [doubt.grave for doubt in question_draws(limits)] == [True] * is_grave


@pytest.mark.parametrize(("gain", "half", "lead", "end"), [
    (0.1, 0.02, "first: plate", "+12 %"),
    (0.01, 0.02, "none of these is sure to raise the least limit; the best: plate", "+3 %"),
    (-0.05, 0.01, "none of these is sure to raise the least limit; the best: plate", "worse than today")])
def test_a_change_that_does_not_raise_the_limit_is_not_advised_first(gain, half, lead, end):
    change = RankedChange("plate", "feet", 0.1, gain, (gain - half, gain + half), 1.0).to_dict()
    words = lead_of([change])
    assert words.startswith(lead) and words.endswith(end)
    assert lead_of([]) == "no joint can be changed"
