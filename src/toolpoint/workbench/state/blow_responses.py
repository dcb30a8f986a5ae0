"""Responses of the blows so far as the page draws them: size and coherence over the lines to be believed, thinned."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpoint.plot.figures.thinning import extreme_samples
from toolpoint.studies.measured.hammer_study import HammerStudy

MAX_DRAWN_LINES = 600  # lines of a response that are sent to the page


def drawn_responses(study: HammerStudy) -> dict[str, Any]:
    """Return plain data: the study's own words, hits and doubts, and its first response between the ends of its band."""
    frf, band = study.frf, study.band
    inside = np.flatnonzero((frf.frequency >= band.low) & (frf.frequency <= band.high))
    size = np.abs(frf.values[inside, 0, 0])
    drawn = inside[extreme_samples(size, MAX_DRAWN_LINES)] if inside.size else inside
    coherence = None if frf.coherence is None else np.asarray(frf.coherence)[drawn, 0, 0]
    data = study.to_dict()
    return {"study": {**{key: data[key] for key in ("status", "doubts", "notes", "hits", "band_hz")},
                      "frequency_hz": frf.frequency[drawn], "size": np.abs(frf.values[drawn, 0, 0]), "coherence": coherence,
                      "quantity": frf.quantity, "output": str(frf.outputs[0]), "input": str(frf.inputs[0])}}
