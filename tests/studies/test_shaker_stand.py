"""A shaker hung and standing on what it shakes: beside an assembly of all masses and springs, and by laws."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError, io
from toolpoint.app.main import main
from toolpoint.studies import describe_shaker, stand_shaker
from toolpoint.substructuring.shaker import CoilDrive, ElectrodynamicShaker

MACHINE = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical.yaml"
LINES = np.linspace(5.0, 120.0, 47)
MASS = np.diag([80.0, 200.0])
STIFFNESS = np.array([[4e6, -4e6], [-4e6, 1.4e7]])
DAMPING = 2e-4 * STIFFNESS
SHAKER = ElectrodynamicShaker(20.0, 0.4, 5e3, suspension_damping=8.0, stinger=2e6, stand=3e6, stand_damping=400.0)
COIL = CoilDrive(12.0, 1.5, 2e-3)


def receptances(frequency):
    omega = 2 * np.pi * frequency[:, None, None]
    return np.linalg.inv(STIFFNESS + 1j * omega * DAMPING - omega**2 * MASS)


def assembled(frequency, shaker, stands):
    """Motions (n_f, 4) of driving point, stand, armature and body per coil force: all masses and springs in one matrix."""
    omega = 2 * np.pi * frequency
    mass = np.zeros((4, 4))
    mass[:2, :2] = MASS
    mass[2, 2], mass[3, 3] = shaker.armature_mass, shaker.body_mass
    spring, damper = np.zeros((4, 4)), np.zeros((4, 4))
    spring[:2, :2], damper[:2, :2] = STIFFNESS, DAMPING
    links = [(2, 0, shaker.stinger, 0.0), (2, 3, shaker.suspension, shaker.suspension_damping)]
    links += [(3, 1, shaker.stand, shaker.stand_damping)] if stands else []
    for i, j, k, c in links:
        sign = np.zeros(4)
        sign[i], sign[j] = 1.0, -1.0
        spring += k * np.outer(sign, sign)
        damper += c * np.outer(sign, sign)
    dynamic = spring + 1j * omega[:, None, None] * damper - omega[:, None, None] ** 2 * mass
    return np.linalg.solve(dynamic, np.array([0, 0, 1.0, -1.0]))


@pytest.mark.parametrize("stands", [True, False])
def test_forces_are_those_of_the_whole_assembly(stands):
    motion = assembled(LINES, SHAKER, stands)
    force = SHAKER.forces(receptances(LINES), LINES, stands=stands)
    assert force[:, 0] == pytest.approx(SHAKER.stinger * (motion[:, 2] - motion[:, 0]), rel=1e-9)
    omega = 2 * np.pi * LINES
    stand = (SHAKER.stand + 1j * omega * SHAKER.stand_damping) * (motion[:, 3] - motion[:, 1]) * stands
    assert force[:, 1] == pytest.approx(stand, rel=1e-9, abs=1e-12)
    relative = SHAKER.coil_motion(receptances(LINES), LINES, stands=stands)
    assert relative == pytest.approx(motion[:, 2] - motion[:, 3], rel=1e-8)


@pytest.mark.parametrize("stands", [True, False])
def test_forces_per_volt_obey_the_coil(stands):
    motion = assembled(LINES, SHAKER, stands)
    omega = 2 * np.pi * LINES
    force = SHAKER.voltage_forces(COIL, receptances(LINES), LINES, stands=stands)[:, 0]
    current = force / (SHAKER.stinger * (motion[:, 2] - motion[:, 0])) / COIL.force_constant
    volts = (COIL.resistance + 1j * omega * COIL.inductance) * current \
        + COIL.force_constant**2 * 1j * omega * current * (motion[:, 2] - motion[:, 3])
    assert volts == pytest.approx(np.ones(LINES.size), rel=1e-8)


def test_a_shaker_without_masses_measures_the_relative_response():
    light = ElectrodynamicShaker(1e-12, 1e-12, 1e3)
    force = light.forces(receptances(LINES), LINES, stands=True)
    assert force[:, 1] / force[:, 0] == pytest.approx(-np.ones(LINES.size), rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.floats(1.0, 100.0), st.floats(0.1, 2.0), st.floats(1e2, 1e5))
def test_on_a_point_that_does_not_move_the_response_is_true(body, armature, suspension):
    """The stand is of another body, which shares no motion with the driving point."""
    structure = receptances(LINES)
    structure[:, 1, :] = structure[:, :, 1] = 0.0
    force = ElectrodynamicShaker(body, armature, suspension).forces(structure, LINES, stands=True)
    apparent = structure[:, 0, 0] + structure[:, 0, 1] * force[:, 1] / force[:, 0]
    assert apparent == pytest.approx(structure[:, 0, 0], rel=1e-12)


@pytest.fixture(scope="module")
def result():
    machine = io.read_machine(MACHINE)
    shaker, coil = describe_shaker({"body": 20.0, "armature": 0.4, "suspension": 5e3, "suspension_damping": 5.0, "coil": 10.0,
                                    "resistance": 2.0})
    return stand_shaker(machine, shaker, "tool:+z", stand="table", outputs=["tool:+z", "table:+z"], frequency=LINES, coil=coil)


def test_a_heavy_exciter_on_the_table_alters_the_result(result):
    """As the thesis on a vertical machining centre says in words; hung, the responses are the machine's own."""
    from toolpoint.studies import study_responses_of_machine

    true = study_responses_of_machine(io.read_machine(MACHINE), None, ["tool:+z", "table:+z"], inputs=["tool:+z"],
                                      frequency=LINES).frfs[0]
    assert result.hung.values == pytest.approx(true.values, rel=1e-9)
    assert np.nanmax(result.change) > 0.05 and any("hang it from outside" in doubt for doubt in result.doubts)
    assert result.force.shape == (LINES.size, 2)
    assert result.to_dict()["outputs"] == ["tool:+z", "table:+z"]


def test_a_soft_stand_is_as_good_as_a_rope(result):
    """The body on springs far below the band: no reaction reaches the table."""
    soft = ElectrodynamicShaker(20.0, 0.4, 5e3, suspension_damping=5.0, stand=2e3)
    on_springs = stand_shaker(io.read_machine(MACHINE), soft, "tool:+z", stand="table", frequency=LINES[10:])
    assert np.nanmax(on_springs.change) < 0.1 * np.nanmax(result.change)


@pytest.mark.parametrize(("driven", "stand", "words"), [
    ("tool:+z", "tool", "another point"), ("tool:+z", "bench", "no 'bench'"), ("tool:+rz", "table", "along x, y or z")])
def test_what_cannot_be_is_refused(driven, stand, words):
    with pytest.raises(ToolpointError, match=words):
        stand_shaker(io.read_machine(MACHINE), SHAKER, driven, stand=stand, frequency=LINES)


def test_by_command(tmp_path, capsys):
    text = "stands=table,body=20kg,armature=400 g,suspension=5N/mm,coil=10,resistance=2"
    arguments = ["frf", str(MACHINE), "--shaker", text, "--at", "tool:+z", "--lines", "10:100:31"]
    main([*arguments, "--save", str(tmp_path / "s.h5"), "--json", "-o", str(tmp_path)])
    found = json.loads(capsys.readouterr().out)
    saved = io.read_frf(tmp_path / "s.h5")
    assert saved.values[:, 0, 0].real == pytest.approx(np.array(found["standing_m_per_n"]["real"])[:, 0])
    assert "Force per volt" in (tmp_path / "index.html").read_text()


@pytest.mark.parametrize(("text", "words"), [("body=20kg,armature=1kg,suspension=1N/mm", "stands: missing"),
                                             ("stands=table,body=20kg", "armature: missing"),
                                             ("stands=table,body=20kg,armature=1kg,suspension=1N/mm,coil=3", "belong together"),
                                             ("stands=table,weight=3kg", "must be one of")])
def test_mistyped_shakers_are_refused(text, words, capsys):
    with pytest.raises(SystemExit):
        main(["frf", str(MACHINE), "--shaker", text, "--at", "tool:+z"])
    assert words in capsys.readouterr().err
