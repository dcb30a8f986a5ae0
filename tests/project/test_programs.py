"""NC programs of a project: draws beside a closed law, advice, what is run again, tilted planes, a tip, bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.project import Project
from toolpoint.project.limits.systems import coefficient_factors
from toolpoint.project.programs.drawn_places import ProgramDraws, draw_places
from toolpoint.project.programs.run_files import systems_of_program
from toolpoint.project.programs.settings import program_command, program_inputs, program_settings
from toolpoint.vibration import Frf, Modes
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.views.pages_view import page_text, pages_of

SLOT = "N10 G21 G90\nN20 S{speed} M3\nN30 G0 X-40 Y0 Z{z}\nN40 G1 X40 F800\nN50 G0 Z20\nN60 G0 X-40 Y50\nN70 Z{z}\n" \
    "N80 G1 X40 F800\nM30\n"
PROJECT = """toolpoint: 1
name: slide
machine: machine.yaml
cuts:
  half: {{diameter: 50 mm, teeth: 4, immersion: 0.5, tangential: 800 MPa, normal: 300 MPa, speeds: 800 4000 rpm,
         coefficient_deviation: {deviation} %}}
programs:
  slots: {{program: slots.nc, stock: "box=0,-25,-20,20,75,0"{more}}}
draws: 20
"""


def slide():
    """A head on springs along x and y."""
    joint = JointDescription("ground", "head", stiffness={"x": 4e7, "y": 9e7}, loss_factor=0.04)
    head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    return MachineDescription("slide", {"head": head}, {"slide": joint}, points={"tip": PointDescription("head")}, tool="tip")


def write_project(place, *, depth=3.0, speed=2500, deviation=10, more=""):
    place.mkdir(exist_ok=True)
    io.write_machine(slide(), place / "machine.yaml")
    (place / "slots.nc").write_text(SLOT.format(speed=speed, z=-depth))
    (place / "project.yaml").write_text(PROJECT.format(deviation=deviation, more=more))
    return place


def data_of(place):
    return json.loads((place / "results/program/slots/program.json").read_text())


@pytest.mark.slow
def test_limits_over_draws_fall_with_the_coefficients_and_places_fail_together(tmp_path):
    """On an exact machine the limit of every place is that of the file times 1 / K where K_t and K_n change alike, so places of
    one arc fail in the same draws, and P(all stable) is that of one place, not the product."""
    place = write_project(tmp_path / "mill")
    run = Project.open(place).program("slots", lobes=0)
    systems = systems_of_program(place / "machine.yaml", None, None, zero={}, draws=40, seed=3)[0]
    judged = run.stages[0].judged
    places = draw_places(ProgramDraws(systems, run.tips), [judged], run.deviation_of)
    factors = coefficient_factors("half", 0.1, systems)
    near = np.abs(factors[:, 1] / factors[:, 0] - 1) < 0.05
    assert near.sum() >= 3
    assert np.allclose(places.draws[near, 0] * factors[near, 0], places.limit[0], rtol=0.03)
    weights = np.full(40, 1 / 40)
    alike = np.isclose(places.limit, places.limit[0], rtol=0.02)
    assert places.chance(weights) == pytest.approx(places.chances(weights).min(), abs=0.03) or not alike.all()
    assert np.array_equal(places.stable, places.draws >= places.depth) or (places.limit < places.depth).any()


def test_program_is_a_goal_in_one_sentence_and_only_what_changed_runs_again(tmp_path):
    place = write_project(tmp_path / "mill", depth=0.5)
    results = Project.open(place).run()
    assert results.answers[0].startswith("slots: ") and "every block is stable with a probability of" in results.answers[0]
    data = results.to_dict()["programs"]["slots"]
    assert 0 < data["stable_probability"] < 1 and data["places"][0]["line"] in (4, 8)
    assert any("states no uncertainty" in doubt for doubt in results.doubts)
    before = (place / "results/project.json").read_bytes()
    Project.open(place).run()
    assert (place / "results/project.json").read_bytes() == before
    (place / "slots.nc").write_text(SLOT.format(speed=2500, z=-0.6))
    actions = {}
    Project.open(place).run(listen=lambda event: actions.update({event.decision.step: event.decision.action}))
    assert actions == {"machine": "fresh", "program/slots": "run"}


@pytest.mark.slow
def test_chatter_is_answered_with_its_line_and_the_speed_that_keeps_it_stable(tmp_path):
    place = write_project(tmp_path / "mill")
    limit = data_of_run(place)["places"][0]["limit_m"]
    (place / "slots.nc").write_text(SLOT.format(speed=2500, z=-1.4e3 * limit))
    results = Project.open(place).run()
    data = results.to_dict()["programs"]["slots"]
    assert "chatters at 2500 rev/min" in results.answers[0] and results.answers[0].startswith("slots: no")
    advised = data["advice"][0]["advised_rpm"]
    if advised != 2500:
        assert f"S {advised:.0f} keeps every block stable" in results.answers[0]
        assert data["stable_probability_advised"] > data["stable_probability"]
        assert any(f"take S {advised:.0f}" in line for line in results.next_steps)
    page = page_text(Desk(place), "program/slots")
    assert "How sure" in page and "program/slots" in pages_of(Desk(place))


def data_of_run(place):
    Project.open(place).run()
    return data_of(place)


def test_without_dynamics_stability_is_said_to_be_unknown_and_what_one_part_more_gives(tmp_path):
    place = write_project(tmp_path / "mill")
    text = (place / "project.yaml").read_text()
    (place / "project.yaml").write_text(text.replace("machine: machine.yaml\n", ""))
    results = Project.open(place).run()
    assert results.answers[0].startswith("slots: not known; 2 cutting blocks of unknown stability")
    assert any("which of its blocks chatter" in line for line in results.next_steps)


def test_tilted_program_is_judged_over_all_its_stages(tmp_path):
    place = write_project(tmp_path / "mill", more=", spacing: 2 mm")
    (place / "slots.nc").write_text("S2500 M3\nG68.2 X0 Y0 Z0 J90\nG53.1\nG0 X-40 Y-10 Z35\nZ24.5\nG1 X60 F800\nG0 Z50\nG69\n"
                                    "G0 X-40 Y60 Z20\nZ-0.5\nG1 X60\n")
    text = (place / "project.yaml").read_text()
    (place / "project.yaml").write_text(text.replace("machine: machine.yaml\n", ""))
    results = Project.open(place).run()
    assert "2 cutting blocks of unknown stability" in results.answers[0]
    assert len(Project.open(place).program("slots").stages) == 2


@pytest.mark.slow
def test_struck_tip_stands_for_the_whole_program_and_is_doubted(tmp_path):
    place = write_project(tmp_path / "mill", depth=0.5)
    frequency = np.linspace(20.0, 300.0, 561)
    receptance = 1 / (4e7 * (1 + 0.04j) - 100.0 * (2 * np.pi * frequency) ** 2)
    io.write_frf(Frf(frequency, receptance[:, None, None], ("tip:+x",), ("tip:+x",)), place / "tip.h5")
    text = (place / "project.yaml").read_text()
    tests = "tests:\n  tip: {of: tip x, responses: [tip.h5]}\n"
    (place / "project.yaml").write_text(text.replace("machine: machine.yaml\n", tests))
    results = Project.open(place).run(["program/slots"])
    assert "every block is stable with a probability" in results.answers[0]
    assert any("taken all along the program" in doubt for doubt in results.doubts)


@pytest.mark.parametrize(("entry", "words"), [
    ('{program: slots.nc, stock: "box=1,2"}', "box=X1,Y1,Z1"),
    ('{program: slots.nc, stock: part.stl, cut: thread}', "there is no cut 'thread'"),
    ('{program: slots.nc, stock: part.stl, speed: 3000}', "has no unit"),
    ('{program: slots.nc, stock: part.stl, spindle: {curve: steep}}', "RPM:NM"),
    ('{program: slots.nc, stock: part.stl, tool: 3}', "tool"),
])
def test_faults_of_a_program_are_told_with_the_file(tmp_path, entry, words):
    place = write_project(tmp_path / "mill")
    text = (place / "project.yaml").read_text()
    start = text.index("  slots:")
    (place / "project.yaml").write_text(text[:start] + f"  slots: {entry}\n")
    with pytest.raises(ToolpointError, match=words):
        io.read_project(place / "project.yaml")


def test_program_that_meets_no_material_and_files_that_are_not_there_are_refused(tmp_path):
    place = write_project(tmp_path / "mill", depth=-5.0)
    results = Project.open(place).run()
    assert "met by no cutting move" in results.answers[0]
    (place / "project.yaml").write_text(PROJECT.format(deviation=10, more=", record: power.csv"))
    with pytest.raises(ToolpointError, match=r"power\.csv is not there"):
        Project.open(place).run()


def test_stick_outs_and_wear_of_a_program_go_from_its_file_into_run_and_command(tmp_path):
    more = ", stick_out: 60 mm, stick_outs: {3: 45 mm}, wear_only: true"
    write_project(tmp_path, more=more)
    text = (tmp_path / "project.yaml").read_text()
    assert "stick_outs" in text
    description = io.read_project(tmp_path / "project.yaml")
    program = next(iter(description.programs.values()))
    settings, command = program_settings(program, description), program_command(program, description, {})
    assert settings["stick_outs"] == [(3, pytest.approx(0.045))] and settings["wear_only"] is True
    assert command[command.index("--stick-out-of") + 1] == "3=45" and "--wear-only" in command


@pytest.mark.parametrize(("entry", "words"), [
    ("{part: wall.yaml, held: [foot], stage_change: 3 %}", ["--work", "wall.yaml", "--held", "foot", "--stage-change", "3"]),
    ("{responses: {1: early.h5, 40: late.h5}}", ["--work-response", "1=early.h5", "--work-response", "40=late.h5"])])
def test_work_and_rotary_limits_of_a_program_go_into_its_files_options_and_command(tmp_path, entry, words):
    write_project(tmp_path, more=f", work: {entry}, rotary_speed: 180 deg/s, rotary_acceleration: 1200 deg/s^2")
    description = io.read_project(tmp_path / "project.yaml")
    program = next(iter(description.programs.values()))
    command = program_command(program, description, {})
    assert command[(start := command.index(words[0])):start + len(words)] == words
    assert command[command.index("--rotary-speed") + 1] == "180"
    settings, inputs = program_settings(program, description), program_inputs(program, None)
    assert settings["rotary"] == [pytest.approx(np.pi), pytest.approx(1200 * np.pi / 180), None]
    assert {"work", "responses"} & set(inputs) == ({"work"} if "part" in entry else {"responses"})


@pytest.mark.parametrize(("entry", "words"), [("{part: wall.yaml}", "held: missing"), ("{held: [foot]}", "must have part"),
                                              ("{part: a.yaml, held: [b], responses: {1: c.h5}}", "must have part")])
def test_work_that_is_described_by_halves_is_refused(tmp_path, entry, words):
    write_project(tmp_path, more=f", work: {entry}")
    with pytest.raises(ToolpointError, match=words):
        io.read_project(tmp_path / "project.yaml")


@pytest.mark.slow
def test_draws_of_a_program_have_the_work_beside_the_machine(tmp_path):
    """On an exact machine every draw's limit is that of tool and work together times 1 / K; without the work it is another."""
    io.write_noun(Modes([120.0], [0.03], [[0.3]], ["wall:+y"]), (tmp_path / "wall.h5"))
    place = write_project(tmp_path, more=", work: {responses: {1: wall.h5}}")
    run = Project.open(place).program("slots", lobes=0)
    systems = systems_of_program(place / "machine.yaml", None, None, zero={}, draws=20, seed=3)[0]
    judged = run.stages[0].judged
    places = draw_places(ProgramDraws(systems, run.tips), [judged], run.deviation_of)
    factors = coefficient_factors("half", 0.1, systems)
    own = judged.margins.limit[judged.nearest(1)[0]]
    assert np.median(places.draws[:, 0] * factors.mean(axis=1)) == pytest.approx(own, rel=0.05)
    alone = Project.open(write_project(tmp_path)).program("slots", lobes=0).stages[0].margins.limit.min()
    assert own < 0.9 * alone
