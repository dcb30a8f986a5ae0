"""Modes of measured responses, with the responses questioned first: signs, delays, scales, labels."""

from __future__ import annotations

from dataclasses import replace

from toolpoint.modal_identification import Identification, identify
from toolpoint.signals.doubts import question
from toolpoint.vibration import Frf


def identify_modes(frf: Frf, method: str = "refined", band: tuple[float, float] | None = None) -> Identification:
    """Return the identification of `modal_identification.identify`, its `doubts` those of `signals.doubts.question`.

    band : (low, high), Hz; the whole axis where left out. The doubts are looked for within it.
    """
    result = identify(frf, method, band)
    return replace(result, doubts=question(frf if band is None else frf.between(*band)))
