"""What a file may say in the words of its writer, and what it is told where it may not."""

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint import ToolpointError, io
from toolpoint.io import read_machine, write_machine
from toolpoint.io.quantities import units
from toolpoint.machine.description.gravity import gravity_of
from toolpoint.studies.machines.base_reaction_study import study_base_reactions
from toolpoint.studies.machines.check.machine_check import check_machine

TEXT = (MACHINES / "three_axis_vertical.yaml").read_text(encoding="utf-8")


def machine(tmp_path, old, new):
    assert old in TEXT
    (tmp_path / "m.yaml").write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    return io.read_machine(tmp_path / "m.yaml")


@pytest.mark.parametrize(("text", "values"), [
    ("3000 12000", (3000.0, 12000.0)), ("3000 12000 rpm", (3000.0, 12000.0)), ("3000, 12000 rpm", (3000.0, 12000.0)),
    ("3000 rpm; 12000 rpm", (3000.0, 12000.0)), ("[3e3  -12e3]", (3000.0, -12000.0))])
def test_lists_may_be_parted_by_commas_semicolons_and_blanks(text, values):
    assert units.quantities(text, units.SPEED, 2) == values
    assert units.quantities("0 1063 -1500 mm", units.LENGTH, 3) == (0.0, 1.063, -1.5)


@pytest.mark.parametrize(("text", "words"), [
    ("0,5, 1,2 m", "4 values.*must be 2.*decimal points"), ("0,5; 1,2 m", "decimal comma.*0.5"),
    ("5", r"1 value in '5'.*\[0, 0\]"),
    ("5 mm", "1 value "), ("1 2 3", "3 values")])
def test_lists_of_another_length_are_told_how_they_are_written(text, words):
    with pytest.raises(units.UnitError, match=words):
        units.quantities(text, units.LENGTH, 2)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("damping_ratio: 3 %", "damping_ratio: 3", r"3 is a ratio; must be below 1 \(3 %\?\)"),
    ("damping_ratio: 3 %", "damping_ratio: 30", r"\(30 %\?\)"),
    ("direction: down", "direction: climb", "did you mean 'down'"),
    ("direction: down", "direction: conventional", "did you mean 'up'"),
    ("damping_ratio: 3 %", "damping_ratio: 3 %\ngravity: -9.8 m/s^2", "its size downwards"),
    ("damping_ratio: 3 %", "damping_ratio: 3 %\ngravity: 9.8 m", "acceleration")])
def test_slips_are_answered_with_what_was_meant(tmp_path, old, new, words):
    with pytest.raises(ToolpointError, match=words):
        machine(tmp_path, old, new)


@pytest.mark.parametrize(("text", "vector"), [
    ("9.8 m/s^2", (0, 0, -9.8)), ("9.8", (0, 0, -9.8)), ("[0, -9.8, 0]", (0, -9.8, 0)),
    ('"0, 0, -9.8 m/s^2"', (0, 0, -9.8))])
def test_gravity_is_a_vector_or_its_size_downwards(tmp_path, text, vector):
    described = machine(tmp_path, "damping_ratio: 3 %", f"damping_ratio: 3 %\ngravity: {text}").description
    np.testing.assert_allclose(described.gravity, vector)


@pytest.mark.parametrize(("up", "vector"), [("y", (0, -9.8, 0)), ("-x", (9.8, 0, 0)), ("[0, 3, 4]", (0, -5.88, -7.84))])
def test_the_size_of_gravity_acts_against_up(tmp_path, up, vector):
    """Loads, base reaction and what is written follow `up`; where no gravity is stated it is the standard one against `up`."""
    read = machine(tmp_path, "damping_ratio: 3 %", f"damping_ratio: 3 %\nup: {up}\ngravity: 9.8")
    np.testing.assert_allclose(read.description.gravity, vector, atol=1e-12)
    again = tmp_path / "again.yaml"
    write_machine(read.description, again)
    np.testing.assert_allclose(read_machine(again).description.gravity, vector, atol=1e-12)
    np.testing.assert_allclose(read_machine(again).description.up, read.description.up)
    force = study_base_reactions(read).wrench[0, :3]
    weight = sum(body.mass[0, 0] for body in read.bodies)
    np.testing.assert_allclose(force, -weight * np.array(vector), atol=1e-9 * weight)
    unstated = machine(tmp_path, "damping_ratio: 3 %", f"damping_ratio: 3 %\nup: {up}")
    assert unstated.description.gravity is None
    np.testing.assert_allclose(gravity_of(unstated.description), 9.80665 / 9.8 * np.array(vector), atol=1e-12)
    standing = study_base_reactions(unstated)
    np.testing.assert_allclose(standing.wrench[0, :3], -9.80665 / 9.8 * weight * np.array(vector), atol=1e-9 * weight)


def test_gravity_that_points_up_is_doubted(tmp_path):
    read = machine(tmp_path, "damping_ratio: 3 %", "damping_ratio: 3 %\nup: y\ngravity: [0, 9.81, 0]")
    assert any(doubt.what == "gravity" and "up is +y" in doubt for doubt in check_machine(read).doubts)
    read = machine(tmp_path, "damping_ratio: 3 %", "damping_ratio: 3 %\ngravity: 98.1")
    assert any(doubt.what == "gravity" for doubt in check_machine(read).doubts)


def test_merge_keys_bring_what_is_not_said(tmp_path):
    """YAML 1.1 merge keys: a key of the mapping itself wins, then the first of several mappings."""
    head = TEXT.index("  tool: {body: head")
    old = TEXT[head:TEXT.index("\n", head)]
    new = ('  corner: &corner {body: head, at: "0, 0.1, 0.2 m"}\n  other: &other {body: table, at: "0, 0, 0 m"}\n'
           '  tool: {<<: *corner, at: "0, 0.75, 0.25 m"}\n  both: {<<: [*other, *corner]}')
    points = machine(tmp_path, old, new).description.points
    assert points["tool"].body == "head" and points["tool"].at == (0.0, 0.75, 0.25)
    assert points["corner"].at == (0.0, 0.1, 0.2) and points["both"].body == "table" and points["both"].at == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("text", ["{<<: 3, body: head}", "{<<: [3], body: head}"])
def test_a_merge_key_of_no_mapping_is_a_fault(tmp_path, text):
    with pytest.raises(ToolpointError, match="alias of a mapping"):
        machine(tmp_path, "  tool: {body: head", f"  odd: {text}\n  tool: {{body: head")


def test_faults_of_merged_keys_name_the_place_where_they_stand(tmp_path):
    with pytest.raises(ToolpointError, match=r"m.yaml:\d+:\d+: points.tool.at"):
        machine(tmp_path, '  tool: {body: head, at: "0, 0.75, 0.25 m"}',
                '  corner: &corner {body: head, at: "0, 0.1 m"}\n  tool: {<<: *corner}')


def test_a_hammer_test_is_read_by_its_path_alone(tmp_path):
    with pytest.raises(ToolpointError, match=r"test.yaml: cannot be read"):
        io.read_hammer_test(tmp_path / "test.yaml")
    with pytest.raises(ToolpointError, match="beside the test file"):
        io.read_hammer_test([tmp_path / "test.yaml", tmp_path / "more.csv"])


@pytest.mark.parametrize(("text", "value"), [("200 mm", 0.2), ("0.2", 0.2), ("30 deg", np.pi / 6)])
def test_the_pose_of_a_plan_has_units(tmp_path, text, value):
    plan = tmp_path / "plan.yaml"
    plan.write_text("toolpoint: 1\nmachine: m.yaml\nmetrics: [frequency 1]\n"
                    "factors: [{name: a, paths: [damping_ratio], low: 0.5, high: 2}]\n" f"pose: {{X: {text}}}\n")
    assert io.read_plan(plan).pose == {"X": pytest.approx(value)}
    plan.write_text(plan.read_text().replace(text, "3 kg"))
    with pytest.raises(ToolpointError, match=r"plan.yaml:5:\d+: pose.X: .*kg"):
        io.read_plan(plan)
