"""An axis that shakes itself, standing and moving: modes that differ, and the damping of its joint."""

from __future__ import annotations

import json

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.app.main import main
from toolpoint.machine import assemble, build
from toolpoint.machine import description as d
from toolpoint.signals import DrivenAxisTest
from toolpoint.studies import study_driven_axis
from toolpoint.vibration import Frf, eigen

LINES = np.arange(5.0, 60.0, 0.1)  # Hz
DOFS = ["table:+y", "column:+y"]


def machine(drive: float = 6e6):
    inertia = d.InertiaDescription(1.0, 1.0, 1.0)
    bodies = {"column": d.BodyDescription(800.0, inertia=inertia), "table": d.BodyDescription(200.0, inertia=inertia)}
    joints = {"foot": d.JointDescription("ground", "column", stiffness={"y": 2e7}),
              "drive_y": d.JointDescription("column", "table", stiffness={"y": drive})}
    return build(d.MachineDescription("axis", bodies, joints, points={name: d.PointDescription(name) for name in bodies}))


def axis_test(loss: float, *, drive: float = 6e6, noise: float = 0.01, seed: int = 0) -> DrivenAxisTest:
    """Return the response of the machine with this loss factor of its drive and 0.02 of its foot, with noise."""
    modes = eigen.solve_undamped(assemble(machine(drive), outputs=DOFS, inputs=DOFS[:1]))
    energy = np.array([drive * (modes.shape[0, k] - modes.shape[1, k])**2 for k in range(2)]) / modes.omega**2
    ratio = (energy * loss + (1 - energy) * 0.02) / 2
    w = 2 * np.pi * LINES[:, None]
    gain = 1j * w / (modes.omega**2 - w**2 + 2j * ratio * modes.omega * w)
    values = np.einsum("fk,ok,k->fo", gain, modes.shape, modes.shape[0])
    rng, size = np.random.default_rng(seed), noise * np.abs(values).max()
    noisy = values + size * (rng.standard_normal(values.shape) + 1j * rng.standard_normal(values.shape)) / np.sqrt(2)
    frf = Frf(LINES, noisy[:, :, None], DOFS, DOFS[:1], "mobility", variance=np.full((*values.shape, 1), size**2))
    return DrivenAxisTest(frf, np.ones(LINES.size), noisy)


def test_the_change_of_the_joints_damping_is_found():
    study = study_driven_axis({"standing": axis_test(0.02), "moving": axis_test(0.08, seed=1)}, machine=machine(),
                              joint="drive_y")
    assert study.damping.change == pytest.approx(0.06, abs=0.01) and study.damping.half_width < 0.02
    assert study.damping.at_most[1] >= 0.08 * 0.95 and study.damping.misfit_probability > 0.001
    assert "; moving: damping of " in study.status
    assert "if it alone changes" in study.table() and study.to_dict()["pairs"] == [[0, 0], [1, 1]]


def test_two_tests_of_one_state_do_not_differ():
    study = study_driven_axis({"first": axis_test(0.04), "second": axis_test(0.04, seed=5)})
    assert "none of 2 differs" in study.status and study.damping is None


@pytest.mark.slow
def test_the_command_reads_columns_and_writes_its_page(tmp_path, capsys):
    """A mass of 50 kg on 42 Hz, driven by the current of its motor (40 N/A) and read as a table of a controller."""
    rng, rate, count = np.random.default_rng(0), 500.0, 40_000
    noise = rng.standard_normal(count)
    time, w = np.arange(1000) / rate, 2 * np.pi * 42.0
    velocity = np.convolve(noise, np.exp(-0.03 * w * time) * np.cos(w * time) / 50.0 / rate)[:count] * 40.0
    velocity += 0.02 * velocity.std() * rng.standard_normal(count)
    rows = np.column_stack([np.arange(count) / rate, 3.0 * noise, noise, velocity])
    np.savetxt(tmp_path / "axis.csv", rows, delimiter=",", comments="", fmt="%.9g",
               header="time [s],v set [-],current [A],velocity table:+y [m/s]")
    main(["axis-test", str(tmp_path / "axis.csv"), "--set-point", "v set", "--force", "2", "--newtons", "40",
          "--at", "table:+y", "--band", "20:80", "-o", str(tmp_path / "page"), "--json"])
    state = json.loads(capsys.readouterr().out)["states"][0]
    nearest = min(range(len(state["frequency_hz"])), key=lambda k: abs(state["frequency_hz"][k] - 42.0))
    assert state["frequency_hz"][nearest] == pytest.approx(42.0, rel=2e-3)
    assert state["damping_ratio"][nearest] == pytest.approx(0.03, rel=0.1)
    assert "An axis shakes itself" in (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["axis-test", str(tmp_path / "axis.csv"), "--set-point", "v sett", "--force", "2"])
    assert "did you mean v set" in capsys.readouterr().err.replace("'", "").replace("`", "")


def test_what_cannot_be_is_refused():
    with pytest.raises(ToolpointError, match="must be one of foot, drive_y"):
        study_driven_axis({"standing": axis_test(0.02)}, machine=machine(), joint="drive_x")
    with pytest.raises(ToolpointError, match="one or two"):
        study_driven_axis({})
