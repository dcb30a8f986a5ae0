"""Shaker test from its records: responses with coherence and intervals, and what the records say of their excitation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.special

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.signals.checks import Reciprocity, free_of_masses, reciprocity
from toolpoint.signals.doubts import question
from toolpoint.signals.driving_doubts import DrivingPointCheck, driving_points
from toolpoint.signals.hammer import CIRCLE_PROBABILITY
from toolpoint.signals.record_set import RecordSet
from toolpoint.signals.setups import join_setups
from toolpoint.signals.shaker import count_blocks, shaker_test, split_channels
from toolpoint.signals.shaker_doubts import ShakerSettings, question_shaker
from toolpoint.signals.usable_band import UsableBand, usable_band
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Frf, Record

SHAKER_HEADER = ("set-up", "forces", "responses", "records", "blocks", "coherence")
_LOUD_SHARE = 0.3  # of the largest response: lines above it are peaks, whose scatter is told


@dataclass(frozen=True, eq=False)
class ShakerSetUp:
    """Responses of one set-up, how many records they are of, and how many independent blocks."""

    frf: Frf
    record_count: int
    blocks: float

    @property
    def coherence(self) -> float:
        """Median of the coherence over lines and responses; not a number where blocks are too few."""
        return float("nan") if self.frf.coherence is None else float(np.median(self.frf.coherence))


@dataclass(frozen=True, eq=False)
class ShakerStudy(NotebookText):
    """Responses of a shaker test with their band and checks.

    frf : all responses; set_ups : of each; settings : of the test; band : part of the lines to be believed; doubts : what may
    be wrong, first; notes : what was assumed and done.
    """

    frf: Frf
    set_ups: tuple[ShakerSetUp, ...]
    settings: ShakerSettings
    band: UsableBand
    driving: tuple[DrivingPointCheck, ...]
    pairs: tuple[Reciprocity, ...]
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]

    @property
    def status(self) -> str:
        """The answer in a sentence."""
        size = f"{len(self.frf.outputs)} x {len(self.frf.inputs)}"
        return (f"{size} responses ({self.frf.quantity}) from {self.settings.excitation} excitation, lines of "
                f"{self.settings.resolution:.4g} Hz, to be believed from {self.band.low:.4g} to {self.band.high:.4g} "
                f"Hz{self.scatter_words()}.")

    def radius(self) -> FloatArray | None:
        """Return the radius of the circle about every response in which the true one lies with 95 %; None where not known.

        For noise of any phase the squared error over the estimated variance is F-distributed with 2 and 2 (n - n_i) degrees of
        freedom, n the blocks of the set-up with fewest of them, n_i its forces.
        """
        freedom = min(2 * (part.blocks - len(part.frf.inputs)) for part in self.set_ups)
        if self.frf.variance is None or freedom <= 0:
            return None
        return np.sqrt(self.frf.variance * scipy.special.fdtri(2, freedom, CIRCLE_PROBABILITY))

    def scatter_words(self) -> str:
        """Return how far the responses scatter at their peaks (95 %), in words."""
        radius = self.radius()
        if radius is None:
            return "; their scatter is not known"
        size = np.abs(self.frf.values)
        inside = (self.frf.frequency >= self.band.low) & (self.frf.frequency <= self.band.high)
        loud = inside[:, None, None] & (size > _LOUD_SHARE * size[inside].max(axis=0))
        share = 100 * float(np.median(radius[loud] / size[loud]))
        return f"; they scatter by ±{share:.2g} % where they are large (95 %)"

    def rows(self) -> list[list[str]]:
        """Return a row for every set-up."""
        return [[str(k), " ".join(map(str, part.frf.inputs)), str(len(part.frf.outputs)), str(part.record_count),
                 f"{part.blocks:.0f}", f"{part.coherence:.3f}"] for k, part in enumerate(self.set_ups, 1)]

    def table(self) -> str:
        """Return the set-ups as text, and the status."""
        return text_table("Shaker test", SHAKER_HEADER, self.rows()) + "\n" + self.status

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: settings, set-ups, band, doubts, notes, checks."""
        return {"status": self.status, "doubts": list(self.doubts), "notes": list(self.notes),
                "excitation": self.settings.excitation, "line_spacing_hz": self.settings.resolution,
                "estimator": self.settings.estimator, "band_hz": [self.band.low, self.band.high],
                "set_ups": [{"forces": [str(dof) for dof in part.frf.inputs],
                             "outputs": [str(dof) for dof in part.frf.outputs], "records": part.record_count,
                             "blocks": part.blocks,
                             "coherence": None if np.isnan(part.coherence) else part.coherence}
                            for part in self.set_ups],
                "outputs": [str(dof) for dof in self.frf.outputs], "inputs": [str(dof) for dof in self.frf.inputs],
                "driving_points": [{"dof": str(check.dof), "passive_share": None if np.isnan(check.share) else check.share,
                                    "doubts": list(check.doubts)} for check in self.driving],
                "reciprocity": [{"first": str(pair.first), "second": str(pair.second), "agreement": pair.agreement,
                                 "ratio": pair.ratio} for pair in self.pairs]}


def study_shaker_records(records: RecordSet | Sequence[Record], settings: ShakerSettings, *,
                         masses: Mapping[str, float] | None = None) -> ShakerStudy:
    """Return the responses of a shaker test from its records: one or several forces, sensors that stay or are moved.

    Parameters
    ----------
    records : RecordSet (of `io.read_records`) or sequence of Record
        Records with the same channels are averaged together; those with others are set-ups that are joined.
    settings : ShakerSettings
    masses : mapping of Dof to kg, optional
        What sensors add to the structure; taken off at driving points (`signals.checks.free_of_masses`).

    Raises
    ------
    ToolpointError
        For records without force or responses, shorter than a block, and set-ups that do not make one set of responses.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import ShakerSettings
    >>> from toolpoint.studies import study_shaker_records
    >>> from toolpoint.vibration import Record
    >>> force = np.random.default_rng(1).standard_normal(16384)
    >>> record = Record(np.column_stack([force, 0.5 * force]), 1024.0, ["1:+z", "1:+z"], ["force", "acceleration"])
    >>> study_shaker_records([record], ShakerSettings(4.0)).frf.quantity
    'accelerance'
    """
    record_set = records if isinstance(records, RecordSet) else RecordSet(tuple(records), tuple(
        record.name or f"record {k}" for k, record in enumerate(records, 1)))
    groups: dict[Any, list[Record]] = {}
    for record in record_set.records:
        split_channels(record)
        groups.setdefault((record.channels, record.quantities), []).append(record)
    set_ups, doubts = [], list(record_set.doubts)
    for group in groups.values():
        frf = shaker_test(group, settings.resolution, excitation=settings.excitation, estimator=settings.estimator,
                          band=settings.band, settle=settings.settle)
        blocks = count_blocks(group, settings.resolution, settings.excitation, settle=settings.settle)
        set_ups.append(ShakerSetUp(frf, len(group), blocks))
        doubts += question_shaker(group, frf, settings)
    joined = free_of_masses(_join([part.frf for part in set_ups]), masses or {})
    notes = dict.fromkeys([*record_set.notes, *joined.notes])
    frf = replace(joined, notes=())
    return ShakerStudy(frf, tuple(set_ups), settings, usable_band(frf), tuple(driving_points(frf)), tuple(reciprocity(frf)),
                       tuple(dict.fromkeys([*doubts, *question(frf)])), tuple(notes))


def _join(parts: Sequence[Frf]) -> Frf:
    if len(parts) == 1:
        return parts[0]
    try:
        return join_setups(parts)
    except ToolpointError as error:
        listed = "; ".join(f"forces {', '.join(map(str, frf.inputs))}: sensors {', '.join(map(str, frf.outputs))}"
                           for frf in parts)
        raise ToolpointError(f"the set-ups do not make one set of responses ({error}); {listed}; give the files of each set of "
                             "sensors apart") from None
