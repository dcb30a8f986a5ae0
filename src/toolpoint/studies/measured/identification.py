"""Modes of measured responses with doubts about these responses: signs, delays, scales, labels."""

from __future__ import annotations

from dataclasses import replace

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.modal_identification import Identification, PoleChoice, identify, significance
from toolpoint.modal_identification.judgement.relative_motion import common_directions
from toolpoint.modal_identification.judgement.series_agreement import question_series
from toolpoint.signals.doubts import question
from toolpoint.signals.usable_band import usable_band
from toolpoint.vibration import Frf, Modes


def identify_modes(frf: Frf, method: str = "refined", band: tuple[float, float] | None = None, *,
                   choice: PoleChoice | None = None, sensor_mass: float | None = None,
                   between: tuple[str | int, str | int] | None = None) -> Identification:
    """Return the identification of `modal_identification.identify`, its `doubts` followed by those of `question`.

    band : (low, high), Hz; where left out, the lines that can be believed (`signals.usable_band`), and the advice says which
    lines were left out and why. The doubts are looked for within it.
    choice : poles added and modes removed by hand; sensor_mass : kg, of a sensor that was moved between set-ups; see
    `modal_identification.identify`.
    between : points of tool and table, optional: which modes move them against each other is told (`significance`).

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.vibration import frequency_response
    >>> true_modes = Modes([80.0], [0.02], [[0.1]], ["tool:+x"])
    >>> identify_modes(frequency_response.modal(true_modes, np.linspace(60, 100, 60))).modes.frequency.round(3).tolist()
    [80.0]
    """
    if between is not None:  # A wrong name is told before the long fit.
        common_directions(frf.outputs, *between)
    result = _questioned(frf, method, band, choice=choice, sensor_mass=sensor_mass)
    return result if between is None else replace(result, tool_motion=significance(result.modes, *between))


def _questioned(frf: Frf, method: str, band: tuple[float, float] | None, *, choice: PoleChoice | None,
                sensor_mass: float | None) -> Identification:
    """Return the identification within a band, or within the lines that can be believed, with the doubts of the responses."""
    if band is not None:
        result = identify(frf, method, band, choice=choice, sensor_mass=sensor_mass)
        return replace(result, doubts=(*question_series(result.frf, result.modes), *result.doubts,
                                       *question(frf.between(*band))))
    usable = usable_band(frf)
    inside = frf.between(*usable.ends)
    result = identify(inside, method, choice=choice, sensor_mass=sensor_mass)
    words = [f"{note} (`band` for another choice)" for note in usable.notes]
    return replace(result, doubts=(*question_series(result.frf, result.modes), *result.doubts, *question(inside)),
                   advice=(*result.advice, *words))


def modes_of_test(modes: Modes | None, frf: Frf | None, *, band: tuple[float, float] | None = None
                  ) -> tuple[Modes, tuple[Doubt, ...]]:
    """Return saved modes as they are, or those identified from responses with the doubts of their channels.

    band : (low, high), Hz; all lines where left out: what a tester of joints leaves out, he says himself.

    Raises ToolpointError unless there is one of both.

    Examples
    --------
    >>> modes, doubts = modes_of_test(Modes([80.0], [0.02], [[0.1]], ["tool:+x"]), None)
    >>> modes.count, doubts
    (1, ())
    """
    if modes is not None and frf is None:
        return modes, ()
    if frf is None or modes is not None:
        raise ToolpointError("modes, frf: none or both given; must be saved modes alone, or responses alone")
    result = identify_modes(frf, band=band or (float(frf.frequency[0]), float(frf.frequency[-1])))
    return result.modes, result.doubts
