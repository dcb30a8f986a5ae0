"""Modes of measured responses, with the responses questioned first: signs, delays, scales, labels."""

from __future__ import annotations

from dataclasses import replace

from toolpoint.modal_identification import Identification, PoleChoice, identify
from toolpoint.signals.doubts import question
from toolpoint.signals.usable_band import usable_band
from toolpoint.vibration import Frf


def identify_modes(frf: Frf, method: str = "refined", band: tuple[float, float] | None = None, *,
                   choice: PoleChoice | None = None) -> Identification:
    """Return the identification of `modal_identification.identify`, its `doubts` those of `signals.doubts.question`.

    band : (low, high), Hz; where left out, the lines that can be believed (`signals.usable_band`), and the advice says which
    lines were left out and why. The doubts are looked for within it.
    choice : poles added and modes removed by hand, see `modal_identification.identify`.
    """
    if band is not None:
        result = identify(frf, method, band, choice=choice)
        return replace(result, doubts=question(frf.between(*band)))
    usable = usable_band(frf)
    inside = frf.between(*usable.ends)
    result = identify(inside, method, choice=choice)
    words = [f"{note} (`band` for another choice)" for note in usable.notes]
    return replace(result, doubts=question(inside), advice=(*result.advice, *words))
