"""State space of a machine by command: its responses are the machine's, its names the file's."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from toolpoint import io
from toolpoint.app.main import main
from toolpoint.io.binary import hdf5
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.studies import state_space_of_machine
from toolpoint.vibration import StateSpace, frequency_response

MACHINE = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical.yaml"
POSE, LABELS = {"X": 0.1, "Y": -0.05, "Z": 0.02}, ["tool:+x", "tool-table:+y"]
LINES = np.array([5.0, 21.0, 33.3, 80.0])


def response(a, b, c, d):
    """C (i w I - A)^-1 B + D at the lines."""
    return np.array([c @ np.linalg.solve(2j * np.pi * f * np.eye(len(a)) - a, b) + d for f in LINES])


@pytest.mark.parametrize("ending", [".mat", ".npz", ".h5"])
def test_the_file_answers_as_the_machine(tmp_path, ending, capsys):
    path = tmp_path / f"machine{ending}"
    main(["frf", str(MACHINE), "--pose", "X=100mm,Y=-50mm,Z=20mm", *(w for label in LABELS for w in ("--at", label)), "--lines",
          "5:80:4", "--state-space", str(path), "-o", str(tmp_path / "page")])
    assert "State space written" in capsys.readouterr().out
    if ending == ".h5":
        noun = hdf5.read(path, StateSpace)
        a, b, c, d, names = noun.a, noun.b, noun.c, noun.d, list(noun.inputs)
    else:
        data = np.load(path, allow_pickle=False) if ending == ".npz" else loadmat(path, simplify_cells=True)
        a, b, c, d, names = *(data[key] for key in "ABCD"), list(data["inputs"])
    machine = io.read_machine(MACHINE)
    exact = frequency_response.direct(assemble(machine, POSE, LABELS), LINES).values
    assert response(a, b, c, d) == pytest.approx(exact, rel=1e-9)
    assert names == LABELS and a.shape == (12, 12)


def test_structural_losses_become_viscous_ones_and_that_is_said():
    head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    joint = JointDescription("ground", "head", stiffness={"x": 1e6}, loss_factor=0.04)
    machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, points={"tip": PointDescription("head")}))
    system, notes = state_space_of_machine(machine, outputs=["tip:+x"])
    assert any("viscous damping of equal loss" in note for note in notes)
    # At resonance, 100 rad/s, both lose as much: H = 1/(i eta k).
    resonant = system.c @ np.linalg.solve(100j * np.eye(2) - system.a, system.b)
    assert resonant[0, 0] == pytest.approx(1 / (0.04j * 1e6), rel=1e-9)


def test_the_machining_centre_with_feed_drives_has_the_36_states_of_its_18_freedoms():
    machine = io.read_machine(MACHINE.with_name("three_axis_vertical_drives.yaml"))
    system, _ = state_space_of_machine(machine)
    assert system.size == 36 and len(system.states) == 36 and system.states[0] == "foundation.rx"


def test_several_poses_and_other_endings_are_refused(tmp_path, capsys):
    for words, options in (("at one pose", ["--pose", "X=0", "--pose", "X=100mm"]), ("is written to", [])):
        path = tmp_path / ("machine.npz" if options else "machine.csv")
        with pytest.raises(SystemExit):
            main(["frf", str(MACHINE), *options, "--state-space", str(path), "-o", str(tmp_path / "page")])
        assert words in capsys.readouterr().err
