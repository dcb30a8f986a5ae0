"""Operational modal analysis of records, with the scale of the modes by an added mass, a blow, or a machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine, assemble
from toolpoint.modal_identification import OperationalIdentification, Subspace, identify_operational
from toolpoint.modal_identification.operational.mass_scaling import scale_by_added_mass, scale_by_driving_point, scale_by_model
from toolpoint.signals.record_set import RecordSet
from toolpoint.vibration import Frf, Modes, Record, eigen

NO_SCALE = ("the modes have no scale: frequencies, damping and shapes hold, receptances cannot be formed; give an added mass, "
            "one blow at a measured point, or the machine")


@dataclass(frozen=True, eq=False)
class OperationalStudy(NotebookText):
    """Modes of a machine at work, with their scale where one was asked for.

    Parameters
    ----------
    identification : OperationalIdentification
    modes : Modes
        Of unit modal mass where a scale was found, else as identified.
    scale : str
        What gave the scale, empty where nothing did.
    doubts : tuple of Doubt
        Of the records, the modes, and the scale.
    notes : tuple of str

    >>> import numpy as np
    >>> from toolpoint.modal_identification import OperationalIdentification
    >>> none = np.zeros(0)
    >>> modes = Modes([8.5], 0.005, np.ones((1, 1)), ["spindle:+x"], scaling="unscaled")
    >>> result = OperationalIdentification(modes, (), none, np.ones(1), np.ones(1, bool), (), (), "ssi-cov", 600.0)
    >>> OperationalStudy(result, modes, "", (), ()).table().splitlines()[0]
    '1 mode: 8.5 Hz (0.5 %).'
    """

    identification: OperationalIdentification
    modes: Modes
    scale: str
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]

    @property
    def status(self) -> str:
        """Summary in words."""
        return f"{self.identification.status}\n- {self._scale_words}"

    def table(self) -> str:
        """Return modes and harmonics as text, doubts first, then the answer in words and the scale."""
        result = self.identification
        body = result.table().split("\n")[len(mark_notes(result.doubts)):]
        return "\n".join([*mark_notes(self.doubts), *result.answer, self._scale_words, *body])

    @property
    def _scale_words(self) -> str:
        return f"scale by {self.scale}: unit modal mass" if self.scale else NO_SCALE

    def to_dict(self) -> dict[str, Any]:
        """Return modes, harmonics, scale and doubts as plain data."""
        return self.identification.to_dict() | {
            "doubts": list(self.doubts), "notes": list(self.notes), "scale": self.scale, "scaling": self.modes.scaling,
            "scaled_frequency_hz": self.modes.frequency.tolist()}

    def __repr__(self) -> str:
        return f"OperationalStudy({self.identification!r}, scale: {self.scale or 'none'})"


def study_operational(records: RecordSet | Record | Sequence[Record], method: str | Subspace = "ssi-cov", *,
                      references: Sequence[str] | None = None, band: tuple[float, float] | None = None,
                      keep_harmonics: bool = False, loaded: RecordSet | Sequence[Record] | None = None,
                      masses: Mapping[str, float] | None = None, blow: Frf | None = None, machine: Machine | None = None
                      ) -> OperationalStudy:
    """Return the modes of records of a machine at work, scaled where a mass, a blow or a machine is given.

    Parameters
    ----------
    records, method, references, band, keep_harmonics
        See `modal_identification.identify_operational`.
    loaded, masses : records of the same channels with known masses added, and these: degree of freedom to kg, optional
        Give both or none.
    blow : Frf, optional
        One driving-point response at a measured degree of freedom.
    machine : Machine, optional
        At the pose of the records; its points have the names of the channels.

    Raises
    ------
    ToolpointError
        For more than one source of the scale, masses without records or the reverse, and what the identification refuses.

    Examples
    --------
    Runs in ``examples/scale_modes_of_a_machine_at_work.py``.
    """
    sources = [name for name, is_given in (("loaded", loaded is not None or masses), ("blow", blow is not None),
                                        ("machine", machine is not None)) if is_given]
    if len(sources) > 1:
        raise ToolpointError(f"`{sources[0]}` and `{sources[1]}`: must be one source of the scale alone")
    if (loaded is None) != (not masses):
        raise ToolpointError("`loaded` and `masses`: one without the other; the records with the masses, and what these weigh, "
                             "belong together")
    identification = identify_operational(_records_of(records), method, references=references, band=band,
                                          keep_harmonics=keep_harmonics)
    modes, scale, doubts = identification.modes, "", list(identification.doubts)
    if loaded is not None and masses:
        loaded_result = identify_operational(_records_of(loaded), method, references=references, band=band,
                                      keep_harmonics=keep_harmonics)
        modes, of_scale = scale_by_added_mass(identification.modes, loaded_result.modes, masses)
        doubts += [*(doubt.within("records with the masses") for doubt in loaded_result.doubts), *of_scale]
        scale = "added masses at " + ", ".join(f"{dof} ({mass:.4g} kg)" for dof, mass in masses.items())
    elif blow is not None:
        modes, scale = scale_by_driving_point(identification.modes, blow), f"the driving point {blow.inputs[0]}"
    elif machine is not None:
        model = eigen.solve_undamped(assemble(machine, outputs=identification.modes.dofs))
        modes, scale = scale_by_model(identification.modes, model), f"the machine {machine.name}"
    notes = [*(records.notes if isinstance(records, RecordSet) else ()), *identification.notes]
    if scale and modes.count < identification.modes.count:
        left_out = [f"{f:.4g}" for f in identification.modes.frequency if f not in modes.frequency]
        notes.append(f"without scale, and not among the saved modes: {', '.join(left_out)} Hz")
    return OperationalStudy(identification, modes, scale, tuple(doubts), tuple(notes))


def _records_of(records: RecordSet | Record | Sequence[Record]) -> list[Record]:
    if isinstance(records, RecordSet):
        return list(records.records)
    return [records] if isinstance(records, Record) else list(records)
