r"""Calibration of a hammer by blows on a free mass: :math:`F = m a`, so the accelerance must be :math:`1/m` on every line.

A block that hangs on strings, or lies on foam, moves as a rigid body above its suspension and below its own elastic modes. The
hammer's reading is F / c there, and the response :math:`c / m`, with c the factor by which the reading is too small. What is
not flat tells more: a droop towards 0 Hz is an AC coupling, a slope upwards a mass that rocks, as it was not struck through its
centre.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.signals.record_set import RecordSet
from toolpoint.studies.measured.hammer_study import study_hammer_records

FLAT_TOLERANCE = 0.05  # of the level, within which a line is as that of a mass
MAX_SPREAD_OF_MASS = 0.03  # standard deviation of the lines over their level, beyond which the block is no rigid free mass
MIN_FLAT_LINES = 10


@dataclass(frozen=True)
class MassCalibration(NotebookText):
    """Factor of a hammer.

    factor : true force over the reading; half_width : 95 % of it; band : lowest and highest line (Hz) at which the response is
    that of the mass within 5 %; spread : of the lines there; used, hits : blows; sensitivity : as it should be written, empty
    where none was stated.

    >>> found = MassCalibration(1.04, 0.01, (50.0, 800.0), 0.004, used=5, hits=6, sensitivity="2.25 mV/N", doubts=())
    >>> found.factor - found.half_width > 1  # the hammer reads too little
    True
    """

    factor: float
    half_width: float
    band: tuple[float, float]
    spread: float
    used: int
    hits: int
    sensitivity: str
    doubts: tuple[Doubt, ...]

    @property
    def status(self) -> str:
        """The answer in a sentence."""
        turn = "; its sign is turned against the accelerometer's" if self.factor < 0 else ""
        stated = f": write {self.sensitivity}" if self.sensitivity else ""
        return (f"The true force is {abs(self.factor):.4f} ± {self.half_width:.4f} times the reading{turn}{stated} "
                f"({self.used} of {self.hits} blows; a free mass from {self.band[0]:.4g} to {self.band[1]:.4g} Hz).")

    def table(self) -> str:
        """Return the answer, doubts first."""
        return "\n".join([*mark_notes(self.doubts), self.status])

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**vars(self), "status": self.status, "doubts": list(self.doubts), "band": list(self.band)}


def calibrate_on_mass(records: RecordSet, mass: float, *, duration: float | None = None, sensitivity: str = ""
                      ) -> MassCalibration:
    """Return the factor of a hammer from blows on a free mass with an accelerometer on its far side.

    Parameters
    ----------
    records : RecordSet
        One force, one acceleration, along one line through the centre of the mass.
    mass : float
        Of the block with its accelerometer, kg.
    duration : float, optional
        Length of a block, s.
    sensitivity : str
        As stated for the records, ``2.25 mV/N``: the result says how to write it.

    Raises
    ------
    ToolpointError
        Where the response is nowhere that of a mass, or no blow is good.

    Examples
    --------
    Runs in ``examples/calibrate_a_hammer_on_a_mass.py``.
    """
    positive("mass", mass)
    study = study_hammer_records(records, duration=duration, final=1.0)
    if study.frf.quantity != "accelerance" or len(study.frf.outputs) != 1:
        fail("records", f"{len(study.frf.outputs)} responses ({study.frf.quantity})", "must be one acceleration")
    inside = (study.frf.frequency >= study.band.low) & (study.frf.frequency <= study.band.high)
    frequency, ratio = study.frf.frequency[inside], mass * study.frf.values[inside, 0, 0].real
    level = float(np.median(ratio))
    flat = _flat_stretch(np.abs(ratio / level - 1) < FLAT_TOLERANCE)
    if flat.size < MIN_FLAT_LINES:
        fail("records", f"the response is 1/m within {100 * FLAT_TOLERANCE:g} % on {flat.size} lines",
             f"must be on {MIN_FLAT_LINES}", remedy="hang a compact block freely and strike through its centre")
    factor, spread = float(np.median(ratio[flat])), float(np.std(ratio[flat] / level))
    radius = study.tests[0].radius()
    # Blows agree better with each other than the block with a mass: both are in the interval.
    of_blows = 0.0 if radius is None else float(np.median(np.asarray(radius)[inside][flat, 0, 0])) * mass / abs(factor)
    half_width = abs(factor) * float(np.hypot(NORMAL_QUANTILE_95 * spread / np.sqrt(MIN_FLAT_LINES), of_blows))
    band = float(frequency[flat[0]]), float(frequency[flat[-1]])
    return MassCalibration(factor, half_width, band, spread, study.used, len(study.verdicts),
                           _restate(sensitivity, factor), tuple(_doubts(band, spread, factor, study.band.high)))


def _flat_stretch(is_flat: FloatArray) -> FloatArray:
    """Return the places of the longest stretch of flat lines."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], is_flat, [False]]).astype(int)))
    stretches = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    first, last = max(stretches, key=lambda pair: pair[1] - pair[0], default=(0, 0))
    return np.arange(first, last)


def _restate(sensitivity: str, factor: float) -> str:
    """Return a sensitivity by which the force would read true."""
    match = re.match(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*)", sensitivity)
    return f"{float(match[1]) / factor:.4g} {match[2].strip()}" if match else ""


def _doubts(band: tuple[float, float], spread: float, factor: float, highest: float) -> list[Doubt]:
    doubts = []
    if spread > MAX_SPREAD_OF_MASS:
        doubts.append(Doubt("mass", f"its response scatters by {100 * spread:.2g} % from line to line where it should be flat",
                            "strike through the centre, hang the block softer, glue the accelerometer", figure=spread))
    if band[0] > 20.0:
        doubts.append(Doubt("low lines", f"the response is that of a mass only above {band[0]:.3g} Hz: the input is AC "
                            "coupled, or the suspension is stiff", f"trust no response below {band[0]:.3g} Hz from this input"))
    if band[1] < 0.5 * highest:
        doubts.append(Doubt("high lines", f"the response leaves that of a mass above {band[1]:.4g} Hz: the block bends, or "
                            "rocks", "take a more compact block"))
    # A sensitivity that is off by more is one in another unit (g for m/s^2, 9.8) or of another channel, not one that
    # drifted.
    if not 0.2 < abs(factor) < 5:
        doubts.append(Doubt("factor", f"{factor:.3g} is no error of a calibration", "check the unit of the sensitivities "
                            "(mV/g and mV/(m/s^2), mV/N and V/N) and the mass"))
    return doubts
