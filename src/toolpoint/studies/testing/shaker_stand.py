"""Responses of a machine as a shaker measures them: hung from outside, and standing on the machine, beside the true ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import ComplexArray, FloatArray, fail, increasing
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.studies.machines.machine_responses import study_responses_of_machine
from toolpoint.studies.text_table import text_table
from toolpoint.substructuring.shaker import CoilDrive, ElectrodynamicShaker
from toolpoint.vibration import Dof, Frf

STAND_HEADER = ("response", "true peak nm/N", "at Hz", "standing peak nm/N", "at Hz", "largest change", "at Hz")
TOLERABLE_CHANGE = 0.05  # of a response: a test that changes it more is doubted
MIN_SHOWN_SHARE = 0.01  # of a response's peak: changes of what is smaller are not looked for
DROP_OUT_RATIO = 0.1  # of the median force: below it the force drops out, and noise takes its place


@dataclass(frozen=True, eq=False)
class ShakerStand(NotebookText):
    """Responses to a shaker's force at one point.

    hung, standing : responses by the force cell; hung ones are the machine's own. force : (n_f, 2) N per volt of the coil, hung
    and standing, at the driving point; None without a coil.
    """

    name: str
    driven: Dof
    stand: Dof
    shaker: ElectrodynamicShaker
    hung: Frf
    standing: Frf
    force: ComplexArray | None = None

    @property
    def change(self) -> FloatArray:
        """Change of each response by standing on the machine, (n_f, n_outputs), over the true one; NaN where that is small."""
        true = self.hung.values[:, :, 0]
        true_size = np.abs(true)
        has_size = true_size > MIN_SHOWN_SHARE * true_size.max(axis=0)
        return np.where(has_size, np.abs(self.standing.values[:, :, 0] - true) / np.where(has_size, true_size, 1.0), np.nan)

    @property
    def status(self) -> str:
        """The answer in a sentence."""
        change = self.change
        place = np.unravel_index(int(np.nanargmax(change)), change.shape)
        return (f"Standing at {self.stand} the shaker changes the response of {self.hung.outputs[place[1]]} by up to "
                f"{100 * change[place]:.3g} % (at {self.hung.frequency[place[0]]:.4g} Hz); hung from outside by nothing.")

    @property
    def doubts(self) -> list[Doubt]:
        """Doubts of a test with the shaker on the machine, and of forces that drop out."""
        doubts = []
        largest = float(np.nanmax(self.change))
        if largest > TOLERABLE_CHANGE:
            doubts.append(Doubt(f"shaker at {self.stand}", "its stand puts the reaction into the machine: responses change by "
                                f"up to {100 * largest:.3g} %", "hang it from outside the machine", figure=largest))
        if self.force is not None:
            size = np.abs(self.force[:, 0])
            lowest = int(size.argmin())
            if size[lowest] < DROP_OUT_RATIO * np.median(size):
                share = 100 * size[lowest] / np.median(size)
                doubts.append(Doubt(f"force at {self.driven}", f"it drops to {share:.2g} % of its median at "
                                    f"{self.hung.frequency[lowest]:.4g} Hz", "noise takes its place there: drive the coil by a "
                                    "current, or shape the signal"))
        return doubts

    def rows(self) -> list[list[str]]:
        """Return a row for every response, see `STAND_HEADER`."""
        rows, change, lines = [], self.change, self.hung.frequency
        for i, output in enumerate(self.hung.outputs):
            true, standing = (1e9 * np.abs(frf.values[:, i, 0]) for frf in (self.hung, self.standing))
            first, second, third = int(true.argmax()), int(standing.argmax()), int(np.nanargmax(change[:, i]))
            rows.append([str(output), f"{true[first]:.4g}", f"{lines[first]:.4g}", f"{standing[second]:.4g}",
                         f"{lines[second]:.4g}", f"{100 * change[third, i]:.3g} %", f"{lines[third]:.4g}"])
        return rows

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions of the shaker's model."""
        return ("The shaker pushes along one line; the moment of its reaction about its feet is left out.",
                "The force cell is at the machine, behind the stinger: what is fixed to the armature is not in the response.")

    def table(self) -> str:
        """Return doubts, the responses and the status as text."""
        responses = text_table(f"Shaker at {self.driven}", STAND_HEADER, self.rows())
        return "\n".join([*mark_notes(self.doubts), responses, self.status])

    def to_dict(self) -> dict[str, Any]:
        """Return lines (Hz) and receptances (m/N), hung and standing, as plain data."""
        def parts(values: ComplexArray) -> dict[str, Any]:
            return {"real": values.real.tolist(), "imaginary": values.imag.tolist()}
        return {"status": self.status, "doubts": list(self.doubts), "notes": list(self.notes),
                "frequency_hz": self.hung.frequency.tolist(), "outputs": [str(dof) for dof in self.hung.outputs],
                "hung_m_per_n": parts(self.hung.values[:, :, 0]), "standing_m_per_n": parts(self.standing.values[:, :, 0]),
                "force_n_per_v": None if self.force is None else parts(self.force)}


def describe_shaker(numbers: Mapping[str, float]) -> tuple[ElectrodynamicShaker, CoilDrive | None]:
    """Return shaker and coil of numbers by name, SI: body, armature, suspension, and what `ElectrodynamicShaker` takes; with
    coil (N/A), resistance (ohm) and inductance (H) the coil too.

    Examples
    --------
    >>> shaker, coil = describe_shaker({"body": 20.0, "armature": 0.4, "suspension": 5e3})
    >>> shaker.body_mass, coil
    (20.0, None)
    """
    values = dict(numbers)
    electric = [values.pop(name, 0.0) for name in ("coil", "resistance", "inductance")]
    shaker = ElectrodynamicShaker(values.pop("body"), values.pop("armature"), **values)
    return shaker, CoilDrive(*electric) if electric[0] else None


def stand_shaker(machine: Machine, shaker: ElectrodynamicShaker, driven: Dof | str, *, stand: str,
                 outputs: Sequence[Dof | str] | None = None, pose: Mapping[str, float] | None = None,
                 frequency: ArrayLike | None = None, coil: CoilDrive | None = None) -> ShakerStand:
    """Return the responses that a test with a shaker measures, hung from outside and standing on a point of the machine.

    Parameters
    ----------
    machine, pose
    shaker : ElectrodynamicShaker
    driven : label
        Where and in which direction it pushes, ``tip:+z``.
    stand : str
        The point that its body stands on; the reaction acts there in the same direction.
    outputs : labels, optional
        Where motions are seen; at the driving point where left out.
    frequency : (n_f,) floats, optional
        Hz, above 0; those of the machine's own responses where left out.
    coil : CoilDrive, optional
        Of a shaker that is driven by a voltage: the force per volt follows.

    Examples
    --------
    >>> from importlib.resources import files
    >>> from toolpoint.io import read_machine
    >>> from toolpoint.substructuring.shaker import ElectrodynamicShaker
    >>> machine = read_machine(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml")
    >>> shaker = ElectrodynamicShaker(body_mass=20.0, armature_mass=0.4, suspension=5e3)
    >>> result = stand_shaker(machine, shaker, "tool:+z", stand="table", frequency=[20.0, 60.0])
    >>> print(result.stand)
    table:+z
    """
    force = Dof.parse(str(driven))
    if force.direction[1:] not in ("x", "y", "z"):
        fail("driven", str(driven), "must be a point with a direction along x, y or z")
    place = Dof(stand, force.direction)
    if place == force:
        fail("stand", stand, "must be another point than the one it pushes")
    dofs = [Dof.parse(str(dof)) for dof in (outputs or [force])]
    lines = None if frequency is None else increasing("frequency", np.atleast_1d(np.asarray(frequency, float)))
    labels = list(dict.fromkeys([*map(str, dofs), str(force), str(place)]))
    frf = study_responses_of_machine(machine, [dict(pose or {})], labels, inputs=[str(force), str(place)],
                                     frequency=lines).frfs[0]
    if frf.frequency[0] <= 0:
        fail("frequency", f"{frf.frequency[0]:g} Hz", "must be above 0: at rest a shaker gives no force")
    rows = [labels.index(str(dof)) for dof in (force, place)]
    structure = frf.values[:, rows, :]
    forces = shaker.forces(structure, frf.frequency, stands=True)
    places = [labels.index(str(dof)) for dof in dofs]
    own_values = frf.values[:, places, :1]
    disturbed = own_values + frf.values[:, places, 1:] * (forces[:, 1] / forces[:, 0])[:, None, None]
    hung, standing = (Frf(frf.frequency, values, tuple(dofs), (force,), "receptance") for values in (own_values, disturbed))
    volts = None if coil is None else np.stack([shaker.voltage_forces(coil, structure, frf.frequency, stands=stands)[:, 0]
                                                for stands in (False, True)], axis=1)
    return ShakerStand(machine.name, force, place, shaker, hung, standing, volts)
