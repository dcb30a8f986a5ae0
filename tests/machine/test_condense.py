"""Elastic bodies condensed to what a stated error of the frequencies asks for, in a beam that slides on a block."""

from pathlib import Path

import numpy as np
import pytest

from beam_on_block import pair
from toolpoint import ToolpointError
from toolpoint.io import read_machine
from toolpoint.io.yaml.machine_file import write
from toolpoint.machine import assemble
from toolpoint.machine.assembly.condense import condense_bodies
from toolpoint.machine.assembly.condensed_store import condense_once
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.studies import compare_full_mesh


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    return read_machine(pair(tmp_path_factory.mktemp("pair")))


@pytest.fixture(scope="module")
def loose(machine):
    return condense_bodies(machine, error=5e-3, band=2000.0)


@pytest.mark.slow
def test_every_position_is_within_the_error_and_above_the_whole_reduction(machine, loose):
    tight = condense_bodies(machine, error=1e-4, band=2000.0)
    assert loose.machine.size < tight.machine.size < machine.size
    positions = {"X": np.linspace(-0.15, 0.15, 13)}
    rich = natural_frequencies(machine, positions, 12)
    for result, error in ((loose, 5e-3), (tight, 1e-4)):
        assert result.error <= error
        rise = natural_frequencies(result.machine, positions, 12) / rich - 1
        assert rise.min() > -1e-10 and rise[rich <= 2000.0].max() <= error


@pytest.mark.slow
def test_all_elements_agree_with_what_condensed_bodies_state(loose):
    result = compare_full_mesh(loose.machine, {"X": 0.043}, 4)
    assert result.stated is not None and (np.abs(result.rise) <= result.stated + 1e-7).all()
    assert result.rise.max() > 1e-6


def test_numbers_change_with_the_shapes_kept(machine, loose):
    small = loose.machine
    path = "bodies.beam.elastic.materials.body.modulus"
    softer = small.with_values({path: 0.9 * small.value(path)})
    assert softer.size == small.size
    assert natural_frequencies(softer, {"X": np.zeros(1)}, 2)[0] == pytest.approx(
        natural_frequencies(machine.with_values({path: 0.9 * machine.value(path)}), {"X": np.zeros(1)}, 2)[0], rel=5e-3)


def test_static_flexibility_is_within_the_error_too(machine, loose):
    pose = {"X": 0.0777}
    flexibility = []
    for each in (machine, loose.machine):
        system = assemble(each, pose, ["end:+x", "end:+y", "end:+z"])
        flexibility.append(np.diag(system.output_map @ np.linalg.solve(system.stiffness, system.input_map)))
    assert flexibility[1] == pytest.approx(flexibility[0], rel=5e-3)
    assert (flexibility[1] <= flexibility[0] * (1 + 1e-9)).all()  # fewer shapes are stiffer


def test_a_file_asks_for_it_and_is_condensed_once(machine, tmp_path, monkeypatch):
    file = pair(tmp_path, extra="reduction_error: 0.5 %\n")
    monkeypatch.setenv("TOOLPOINT_CACHE", str(tmp_path / "cache"))
    first = read_machine(file)
    assert not any("condensed from" in note for body in machine.bodies for note in body.notes)
    assert any("condensed from" in note for body in first.bodies for note in body.notes)
    monkeypatch.setattr("toolpoint.machine.assembly.condensed_store.condense_bodies", None)
    again = read_machine(file)
    assert again.size == first.size
    write(first.description, tmp_path / "written.yaml")
    assert "reduction_error: 0.005" in (tmp_path / "written.yaml").read_text()


def test_two_bodies_that_slide_on_each_other_are_condensed_unless_the_file_says_otherwise(machine, tmp_path, monkeypatch):
    monkeypatch.setenv("TOOLPOINT_CACHE", str(tmp_path / "cache"))
    asked = []
    monkeypatch.setattr("toolpoint.machine.assembly.condensed_store.condense_once",
                        lambda built, error: asked.append(error) or built)
    read_machine(pair(tmp_path, reduction=""))
    read_machine(pair(tmp_path))
    assert asked == [1e-3]


@pytest.mark.slow
def test_an_error_that_the_reduction_itself_exceeds_is_refused(machine):
    with pytest.raises(ToolpointError, match="all shapes give"):
        condense_bodies(machine, error=1e-12)


def test_a_machine_without_castings_is_refused(tmp_path):
    machines = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
    with pytest.raises(ToolpointError, match="no casting or solid"):
        condense_once(read_machine(machines / "three_axis_vertical.yaml"), 1e-3)
