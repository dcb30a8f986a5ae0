"""Responses of a machine with its drives on, off, shorted and braked, beside the machine file's own drive springs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import ComplexArray, ToolpointError, fail, increasing
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint._rounding import number_text
from toolpoint.drives.axis.plant import Attachment, Structure
from toolpoint.drives.build import build_servo
from toolpoint.drives.controller.drive_states import DRIVE_STATES, DriveState, respond_to_forces
from toolpoint.drives.controller.loops import compute_loops
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.description import DriveDescription
from toolpoint.machine import Machine
from toolpoint.machine.assembly.system import assemble
from toolpoint.studies.machines.machine_responses import study_responses_of_machine
from toolpoint.studies.servos.drive_structure import free_machine, question_damping
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof, Frf, eigen, state_space

STATE_HEADER = ("drives", "response", "at the lowest line nm/N", "greatest nm/N", "at Hz")
SPRINGS = "springs of the machine file"
_HELD_LEVEL = 3.0  # times the response with braked motors at the lowest line: above, drives that are on hold little


@dataclass(frozen=True, eq=False)
class DrivenResponses(NotebookText):
    """Receptances of a machine at one pose for every state of its drives.

    frfs : name of the state (``on``, ``off``, ``shorted``, ``braked``, and `SPRINGS`) to responses on the same lines; doubts :
    what may be wrong, first; notes : what was assumed.
    """

    name: str
    frfs: Mapping[str, Frf]
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]

    @property
    def status(self) -> str:
        """The answer in a sentence: where drives that are on change most what braked ones leave."""
        on, braked = self.frfs["on"], self.frfs["braked"]
        peaks = [np.abs(np.einsum("fii->fi", frf.values)).max(axis=0) for frf in (on, braked)]
        i = int(np.abs(np.log(peaks[0] / peaks[1])).argmax())
        line = on.frequency[int(np.abs(on.values[:, i, i]).argmax())]
        sizes = [number_text(1e9 * float(peak[i]), digits=3) for peak in peaks]
        return (f"With its drives on, {on.outputs[i]} yields by {sizes[0]} nm/N at the most (at {line:.4g} Hz), with motors "
                f"braked by {sizes[1]} nm/N.")

    def rows(self) -> list[list[str]]:
        """Return a row for every state and driving response, see `STATE_HEADER`."""
        rows = []
        for name, frf in self.frfs.items():
            for i, output in enumerate(frf.outputs):
                size = 1e9 * np.abs(frf.values[:, i, frf.inputs.index(output)])
                peak = int(size.argmax())
                rows.append([name, str(output), number_text(float(size[0]), digits=4),
                             number_text(float(size[peak]), digits=4), f"{frf.frequency[peak]:.4g}"])
        return rows

    def table(self) -> str:
        """Return the responses as text, and the status."""
        return text_table(f"Drives of {self.name}", STATE_HEADER, self.rows()) + "\n" + self.status

    def to_dict(self) -> dict[str, Any]:
        """Return lines (Hz) and receptances (m/N) of every state as plain data."""
        on = self.frfs["on"]
        return {"status": self.status, "doubts": list(self.doubts), "notes": list(self.notes),
                "frequency_hz": on.frequency.tolist(), "dofs": [str(dof) for dof in on.outputs],
                "states": {name: {"real_m_per_n": frf.values.real.tolist(), "imaginary_m_per_n": frf.values.imag.tolist()}
                           for name, frf in self.frfs.items()},
                "greatest": [dict(zip(STATE_HEADER, row, strict=True)) for row in self.rows()]}


def study_driven_responses(machine: Machine, drives: DriveDescription, pose: Mapping[str, float] | None = None, *,
                           dofs: Sequence[Dof | str] | None = None, frequency: ArrayLike | None = None) -> DrivenResponses:
    """Return the receptances of a machine at a pose with its drives on, off, shorted and braked.

    Parameters
    ----------
    machine, pose
        The structure; directions that the drives carry are freed of the file's own springs.
    drives : DriveDescription
        Axes whose `ends` stand on the machine.
    dofs : labels, optional
        Where forces act and motions are seen; the tool against the table along x, y and z where left out.
    frequency : (n_f,) floats, optional
        Hz, above 0; those of the machine's own responses where left out.

    Raises
    ------
    ToolpointError
        For drives that do not end on the machine, and lines at 0 Hz: a drive that is off is free there.

    See `drives.controller.drive_states` for the equations.

    Examples
    --------
    >>> from importlib.resources import files
    >>> from toolpoint import studies
    >>> from toolpoint.io import read_drives, read_machine
    >>> folder = files("toolpoint.app") / "machines"
    >>> machine = read_machine(folder / "three_axis_vertical_drives.yaml")
    >>> drives = read_drives(folder / "three_axis_vertical_servo_on_structure.yaml")
    >>> result = studies.study_driven_responses(machine, drives, dofs=["tool:+x"], frequency=[5.0, 80.0])
    >>> list(result.frfs)
    ['on', 'off', 'braked', 'springs of the machine file']
    """
    if frequency is not None and not np.min(frequency) > 0:
        fail("frequency", f"{np.min(frequency):g} Hz", "must be above 0: a drive that is off is free there")
    labels = _labels(machine, dofs)
    lines = None if frequency is None else increasing("frequency", np.atleast_1d(np.asarray(frequency, float)))
    springs = study_responses_of_machine(machine, [dict(pose or {})], labels, inputs=labels, frequency=lines).frfs[0]
    structure, structure_losses = build_structure(machine, drives, pose, labels=labels)
    servo = build_servo(drives, structure, warn=False)
    size, first = servo.plant.a.shape[0], servo.plant.a.shape[0] - structure.system.size
    forces, outputs, losses = np.zeros((size, len(labels))), np.zeros((len(labels), size)), np.zeros((size, size), complex)
    forces[first:] = np.column_stack([structure.column(label) for label in labels])
    outputs[:, first:] = np.vstack([structure.row(label) for label in labels])
    losses[first:, first:] = structure_losses
    frfs: dict[str, Frf] = {}
    for state in _states(servo):
        response = respond_to_forces(servo, forces, outputs, frequency=springs.frequency, state=state, losses=losses)
        frfs[state] = _frf(response, springs)
    frfs[SPRINGS] = springs
    return DrivenResponses(machine.name, frfs, (*question_damping(drives, machine), *_doubts(servo, frfs)), _NOTES)


def build_structure(machine: Machine, drives: DriveDescription, pose: Mapping[str, float] | None, *, labels: Sequence[str]
               ) -> tuple[Structure, ComplexArray]:
    """Return the freed machine in its modal coordinates, and its structural damping as an addition to their equations."""
    free, ends, tools = free_machine(drives, machine)
    driven = list(dict.fromkeys([*ends.values(), *labels]))
    system = assemble(free, pose, list(dict.fromkeys([*driven, *tools.values()])), inputs=driven)
    states = state_space.modal_coordinates(replace(system, structural_damping=None), "displacement and velocity")
    losses = np.zeros((states.size, states.size), complex)
    if system.structural_damping is not None:
        _, vectors = eigen.mass_normalised(system.mass, system.stiffness)
        losses[1::2, 0::2] = -1j * (vectors.T @ system.structural_damping @ vectors)
    return Structure(states, {key: Attachment(dof, dof, "d" + dof) for key, dof in ends.items()}, dict(tools)), losses


_NOTES = ("Responses are linear at rest: dry friction of guides, screws and seals is not in them, and holds a table that small "
          "forces push. What sampling mirrors about half a loop's rate is left out.",
          "Off: no current flows. Shorted: windings of synchronous motors are shorted, and brake. Braked: motors cannot turn.")


def _labels(machine: Machine, dofs: Sequence[Dof | str] | None) -> list[str]:
    if dofs is not None:
        return [str(Dof.parse(str(dof))) for dof in dofs]
    if machine.description.tool is None:
        fail("dofs", "none, and the machine names no tool", "must be point:direction labels",
             remedy="add 'tool: NAME' to the machine file, or name them")
    point = machine.description.tool
    point += "" if machine.description.table is None else f"-{machine.description.table}"
    return [f"{point}:{way}" for way in ("+x", "+y", "+z")]


def _states(servo: Servo) -> list[DriveState]:
    """Return the states that differ: torque motors have no windings to short."""
    has_windings = any(name.endswith(".i_q") for name in servo.plant.states)
    return [state for state in DRIVE_STATES if state != "shorted" or has_windings]


def _frf(values: np.ndarray, like: Frf) -> Frf:
    return Frf(like.frequency, values, like.outputs, like.inputs, "receptance")


def _doubts(servo: Servo, frfs: Mapping[str, Frf]) -> list[Doubt]:
    """Return doubts about loops that are not stable, and drives that hold less than their brakes."""
    words = {"nut": "as it carries: in its play, or once its preload is lost, it holds less",
             "coupling": "at rest: under torque a progressive one is stiffer"}
    doubts = [Doubt(f"{play.name} of {axis.name}", f"taken with its stiffness {words[play.name]}",
                    "toolpoint drive steps through it in time")
              for axis in servo.plant.axes for play in axis.mechanics.contacts]
    try:
        loops = compute_loops(servo)
    except ToolpointError as error:
        return [*doubts, Doubt("loops", str(error), "mend the drive file", grave=True)]
    if not loops.stable:
        doubts.append(Doubt("loops", "not stable: no response with the drives on exists",
                            "lower the gains: toolpoint drive says which", grave=True))
    size = [np.abs(frfs[state].values[0]).max() for state in ("on", "braked")]
    if size[0] > _HELD_LEVEL * size[1]:
        doubts.append(Doubt("drives that are on", f"yield {size[0] / size[1]:.3g} times as much as braked ones at "
                            f"{frfs['on'].frequency[0]:.4g} Hz: their loops hold little there",
                            "higher position and velocity gains", figure=float(size[0] / size[1])))
    return doubts
