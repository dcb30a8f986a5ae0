"""Updates say which channels of their test are doubtful: what only the machine tells, and what power tells."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.io import read_machine
from toolpoint.machine import assemble, build
from toolpoint.machine.description import PointDescription, parameters
from toolpoint.signals.doubts import question
from toolpoint.studies.measured.channel_doubts import question_unit
from toolpoint.studies.measured.measured_update import Measurement, update_machine
from toolpoint.vibration import Dof, Frf, Modes, eigen, frequency_response

LINES = np.linspace(2.0, 320.0, 400)


@pytest.fixture(scope="module")
def truth():
    """A machine with twelve points on its bodies, its stiffnesses some per cent beside those of the file."""
    machine = read_machine("src/toolpoint/app/machines/three_axis_vertical_drives.yaml")
    rng, bodies = np.random.default_rng(2), list(machine.description.bodies)
    more = {f"p{i}": PointDescription(bodies[i % len(bodies)], tuple(rng.uniform(-0.4, 0.4, 3))) for i in range(12)}
    machine = build(replace(machine.description, points={**machine.description.points, **more}))
    names = [path for path in parameters(machine.description) if ".stiffness." in path]
    return machine, machine.with_values({name: machine.value(name) * float(np.exp(0.05 * rng.normal())) for name in names})


DOFS = [f"p{i}:{way}" for i in range(12) for way in ("+x", "+y", "+z")]


@pytest.mark.slow
@pytest.mark.parametrize("row", [None, 7])
def test_a_sensor_turned_round_is_named_by_an_update_to_modes(truth, row):
    machine, true = truth
    modes = eigen.solve_undamped(assemble(true, None, DOFS), 8)
    shape = modes.shape.copy()
    if row is not None:
        shape[row] *= -1
    measured = Modes(modes.frequency, 0.02, shape, modes.dofs)
    doubts = update_machine(machine, [Measurement(measured)]).doubts
    assert doubts == () if row is None else any(DOFS[row] in line and "other way" in line for line in doubts)


@pytest.mark.slow
@pytest.mark.parametrize("column", [None, 5])
def test_a_sensor_turned_round_is_named_by_an_update_to_responses(truth, column):
    machine, true = truth
    frf = frequency_response.direct(assemble(true, None, DOFS[:18], inputs=["p5:+x"]), LINES)
    values = frf.values.copy()
    if column is not None:
        values[:, column] *= -1
    result = update_machine(machine, [Measurement(frf=replace(frf, values=values))])
    if column is None:
        assert result.doubts == ()
    else:
        assert any(DOFS[column] in line and ("sign" in line or "other way" in line) for line in result.doubts)
        assert result.table().startswith("doubt: ") and result.to_dict()["doubts"]


@pytest.mark.parametrize(("delay", "sign", "word"), [(0.0, 1, ""), (0.0, -1, "sign"), (2e-4, 1, "delay"), (-2e-4, 1, "delay")])
@pytest.mark.default_cases(2)
def test_a_real_driving_point_with_a_turned_or_late_channel_is_named(measured, delay, sign, word):
    """The five-point tap test of a tool and holder: the driving point as it was measured, turned, and late."""
    files = [np.loadtxt(measured / "tool_holder_frf" / f"Point_{i}_Channel_1_CH1.txt") for i in range(1, 6)]
    lines = files[0][20:, 0]
    values = np.stack([data[20:, 1] + 1j * data[20:, 2] for data in files], axis=1)[:, None]
    values[:, :, 0] *= sign
    values = values * np.exp(-2j * np.pi * lines * delay)[:, None, None]
    frf = Frf(lines, values, [Dof(1, "+z")], [Dof(i, "+z") for i in range(1, 6)], "receptance")
    doubts = question(frf)
    if not word:
        assert doubts == ()
    else:
        assert "1:+z" in doubts[0] and word in doubts[0]
        if delay:
            assert float(doubts[0].split("delay of about ")[1].split()[0]) == pytest.approx(1e3 * delay, abs=0.05)


@pytest.mark.parametrize(("factor", "words"), [(1000.0, "mm instead of m"), (1e-3, "m instead of mm"), (1.0, ""), (3.0, "")])
def test_responses_in_another_unit_are_named_with_it(truth, factor, words):
    """The machine before its update is some stiffnesses away: a thousand is a unit, three may be a machine."""
    machine, true = truth
    measured, predicted = (frequency_response.direct(assemble(m, None, DOFS[:6], inputs=["p1:+x"]), LINES)
                           for m in (true, machine))
    doubts = question_unit(replace(measured, values=factor * measured.values).converted_to("accelerance"), predicted)
    assert len(doubts) == bool(words) and all(words in doubt for doubt in doubts)
