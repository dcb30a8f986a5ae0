"""Two states of a machine: what did not move is said to have once in twenty, what moved by its law, and kinds do not mix."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from conftest import MACHINES
from toolpoint import ToolpointError
from toolpoint.app.main import cli
from toolpoint.io import read_machine, read_two_states
from toolpoint.studies import compare_two_states
from toolpoint.vibration import Dof, Modes, frequency_response

FILE = MACHINES / "three_axis_vertical.yaml"
DOFS = [Dof(point, way) for point in range(12) for way in ("+x", "+y")]


def modes(rng, *, factor=1.0, noise=0.01, spread=1e-3):
    """Return five modes with noise of a stated size; `factor` is that of their frequencies."""
    shape = np.random.default_rng(7).normal(size=(len(DOFS), 5))
    frequency = factor * np.array([20.0, 35.0, 50.0, 70.0, 90.0])
    covariance = (spread * frequency[:, None, None]) ** 2 * np.diag([1.0, 0.0])
    measured = shape + noise * rng.standard_normal(shape.shape)
    return Modes(frequency * (1 + spread * rng.standard_normal(5)), 0.02, measured, DOFS, covariance=covariance,
                 shape_variance=np.full(shape.shape, noise**2))


def compared(first, second, rng, **how):
    return compare_two_states(("May", (first, None)), ("June", (second, None)), rng=rng, **how)


def test_unchanged_frequencies_and_shapes_are_said_to_have_moved_once_in_twenty():
    rng = np.random.default_rng(1)
    moved, turned = [], []
    for _ in range(60):
        result = compared(modes(rng), modes(rng), rng)
        moved.append(result.moved)
        turned.append(result.turned)
    # 300 of each: 15 expected, standard deviation 3.8.
    assert 4 <= np.sum(moved) <= 28 and 4 <= np.sum(turned) <= 28


def test_a_change_beyond_the_interval_is_said_with_its_size():
    rng = np.random.default_rng(2)
    result = compared(modes(rng), modes(rng, factor=0.98), rng)
    assert result.moved.all() and result.change == pytest.approx(-0.02, abs=5e-3)
    assert result.interval == pytest.approx(1.96e-3 * 2**0.5, rel=0.03)
    assert "5 of 5 frequencies with an interval moved" in result.answer() and "test one state twice" in result.table()


def test_the_point_that_changed_is_named():
    rng = np.random.default_rng(3)
    first, second = modes(rng, noise=1e-3), modes(rng, noise=1e-3)
    shape = np.array(second.shape)
    shape[8] += 0.5  # point 4, +x
    result = compared(first, replace(second, shape=shape), rng)
    assert result.points[0].point == 4 and result.points[0].stands_out and not any(p.stands_out for p in result.points[1:])
    assert result.turned.all()


def test_without_intervals_nothing_is_said_to_have_moved():
    rng = np.random.default_rng(4)
    first, second = (replace(modes(rng, factor=f), covariance=None, shape_variance=None) for f in (1.0, 0.9))
    result = compared(first, second, rng)
    assert not result.moved.any() and not result.turned.any() and "no frequency has an interval" in result.answer()
    assert result.to_dict()["modes"][0]["half_width"] is None


def test_frac_of_equal_responses_is_that_of_noise_and_of_others_is_not():
    rng = np.random.default_rng(5)
    truth, lines = Modes([20.0, 40.0], 0.03, [[0.1, 0.05], [0.04, -0.1]], ["1:+x", "2:+x"]), np.linspace(5, 60, 200)
    clean = frequency_response.modal(truth, lines)
    changed = frequency_response.modal(replace(truth, frequency=np.array([21.0, 40.0])), lines)
    noise = [1e-7 * (rng.standard_normal(clean.values.shape) + 1j * rng.standard_normal(clean.values.shape)) for _ in range(3)]
    noisy = [replace(f, values=f.values + part, variance=np.full(f.values.shape, 2e-14))
             for f, part in zip((clean, clean, changed), noise, strict=True)]
    saved = [compare_two_states(("a", (None, noisy[0])), ("b", (None, other)), rng=rng) for other in noisy[1:]]
    assert (saved[0].frac > saved[0].frac_noise - 2e-3).all() and (saved[1].frac[0, 0] < saved[1].frac_noise[0, 0])


def test_machines_move_by_the_law_of_their_stiffness_and_say_what_differs():
    machine = read_machine(FILE)
    paths = [f"joints.foundation.stiffness.{way}" for way in ("rx", "ry", "rz")]
    softer = machine.with_values({path: 0.99 * machine.value(path) for path in paths})
    result = compare_two_states(("new", machine), ("old", softer), rng=np.random.default_rng(1))
    assert {number.path for number in result.numbers} == set(paths)
    # Slopes of the first state: to second order in 1 %.
    assert sum(number.predicted for number in result.numbers) == pytest.approx(result.change, abs=1e-4)
    assert not result.moved.any() and "taken as exact" in result.table()


def test_states_of_two_kinds_and_without_a_common_point_are_refused(tmp_path):
    rng = np.random.default_rng(1)
    with pytest.raises(ToolpointError, match="must be two of a kind"):
        compare_two_states(("a", read_machine(FILE)), ("b", (modes(rng), None)), rng=rng)
    (tmp_path / "test.h5").write_bytes(b"")
    with pytest.raises(ToolpointError, match="the command correlate puts a test beside a machine"):
        read_two_states(FILE, tmp_path / "test.h5")
    other = Modes([20.0], 0.02, [[1.0]], ["99:+x"])
    with pytest.raises(ToolpointError, match="both states must be seen at the same points"):
        compared(modes(rng), other, rng)


def test_the_command_compares_two_machine_files(tmp_path):
    text = FILE.read_text()
    (tmp_path / "worn.yaml").write_text(text.replace("rx: 902.78 GN", "rx: 857.641 GN"))
    done = CliRunner().invoke(cli, ["compare", str(FILE), str(tmp_path / "worn.yaml"), "-o", str(tmp_path / "page"), "--json"])
    assert done.exit_code == 0, done.output
    result = json.loads(done.output)
    assert result["numbers"][0]["path"] == "joints.foundation.stiffness.rx" and result["modes"][1]["change"] < -0.01
    assert "what moved" in (tmp_path / "page" / "index.html").read_text()
