"""Responses of the blows so far as the page draws them: size and coherence over the lines to be believed, thinned."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpoint.plot.figures.thinning import extreme_samples
from toolpoint.studies.measured.hammer_study import HammerStudy
from toolpoint.vibration import Dof, Frf

MAX_DRAWN_LINES = 600  # lines of a response that are sent to the page


def response_beside(study: HammerStudy, outputs: tuple[Dof, ...], earlier: Frf | None) -> dict[str, Any]:
    """Return plain data of the response that moves most among some outputs, beside that of the responses of before.

    study : with a person's decisions; outputs : those that the blow in question contributes to; earlier : of the last run.
    """
    frf, band = study.frf, study.band
    inside = np.flatnonzero((frf.frequency >= band.low) & (frf.frequency <= band.high))
    places = [frf.outputs.index(output) for output in outputs if output in frf.outputs] or [0]
    output = max(places, key=lambda place: float(np.abs(frf.values[inside, place, 0]).max()))
    size = np.abs(frf.values[inside, output, 0])
    drawn = inside[extreme_samples(size, MAX_DRAWN_LINES)]
    data = {"frequency_hz": frf.frequency[drawn], "size": np.abs(frf.values[drawn, output, 0]), "status": study.status,
            "quantity": frf.quantity, "output": str(frf.outputs[output]), "input": str(frf.inputs[0]), "earlier": None}
    is_alike = earlier is not None and np.array_equal(earlier.frequency, frf.frequency)
    if earlier is not None and is_alike and frf.outputs[output] in earlier.outputs and frf.inputs[0] in earlier.inputs:
        last_run = earlier.values[:, earlier.outputs.index(frf.outputs[output]), earlier.inputs.index(frf.inputs[0])]
        largest = float(np.abs(last_run[inside]).max())
        data |= {"earlier": np.abs(last_run[drawn]), "change": float(np.abs(
            frf.values[inside, output, 0] - last_run[inside]).max() / largest)}
    return data


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
