"""Doubts about a gauge test by its responses: noise, signs and labels, power that no passive spindle gives off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import ComplexArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.signals.doubts import question
from toolpoint.signals.passivity import active_matrix_share
from toolpoint.studies.cuts.coupling.line_smoothing import noise_over_stated, scatter_variance
from toolpoint.substructuring.shaft import ShaftDescription
from toolpoint.vibration import Frf

MAX_NOISE_UNDERSTATEMENT = 1.5  # scatter of neighbouring lines over the stated noise
MIN_ACTIVE_LINE_FRACTION = 0.02  # of the lines, at which some set of forces takes power out
LOW_LINE_FRACTION = 0.2  # of the lines, the lowest: stations are compared there
MIN_STATION_COMPLIANCE_RATIO = 0.8  # outer over inner station: below, they may be exchanged


def with_noise(frf: Frf, noise: float | None) -> Frf:
    """Return responses with a variance: the stated one, else `noise` as a share of each response.

    The scatter of neighbouring lines is taken where it is larger: the sensor's own noise is no share of a response.
    """
    if frf.variance is not None or frf.frequency.size < 2:
        return frf
    scatter = scatter_variance(frf.values)
    if noise is not None:
        return replace(frf, variance=np.maximum((noise * np.abs(frf.values)) ** 2, scatter))
    share = 100 * float(np.median(np.sqrt(scatter) / np.maximum(np.abs(frf.values), 1e-300)))
    note = f"the noise is not stated: taken from the scatter of neighbouring lines (median {share:.2g} % of a response)"
    return replace(frf, variance=scatter).noted(note)


def question_gauge(frf: Frf, gauge: ShaftDescription) -> list[Doubt]:
    """Return doubts of measured responses among a gauge's stations (with variance, before they are used)."""
    doubts = list(question(frf))
    if frf.variance is not None and (ratio := noise_over_stated(frf.values, frf.variance)) > MAX_NOISE_UNDERSTATEMENT:
        doubts.append(Doubt("noise", f"neighbouring lines scatter by {ratio:.2g} times the stated noise", "state what was "
                            "measured (tap, frf), or lines are too far apart for the damping", figure=ratio))
    for plane in "xy":
        rows, columns, names = _driving_stations(frf, gauge, plane)
        if len(names) < 2 or frf.variance is None:
            continue
        block = frf.selected([frf.outputs[k] for k in rows], [frf.inputs[k] for k in columns])
        doubts += [*_question_passivity(block, plane), *_question_order(frf, block.values, [gauge.stations[n] for n in names],
                                                                        names)]
    return doubts


def _driving_stations(frf: Frf, gauge: ShaftDescription, plane: str) -> tuple[IndexArray, IndexArray, list[str]]:
    """Return rows and columns of the stations that are measured and struck along a plane, and their names."""
    stations = [(i, frf.inputs.index(d), str(d.point)) for i, d in enumerate(frf.outputs)
                if d in frf.inputs and d.direction == f"+{plane}" and str(d.point) in gauge.stations]
    return np.array([i for i, _, _ in stations], int), np.array([j for _, j, _ in stations], int), [name for _, _,
                                                                                                    name in stations]


def _question_passivity(frf: Frf, plane: str) -> list[Doubt]:
    """Doubt responses by which some set of forces would take power out of the spindle."""
    share = active_matrix_share(frf)
    if share < MIN_ACTIVE_LINE_FRACTION:
        return []
    return [Doubt(f"responses along {plane}", f"at {100 * share:.2g} % of the lines the spindle would give off power, which no "
                  "passive one does", "check quantity, signs, labels and calibration of every response", figure=share,
                  grave=True)]


def _question_order(frf: Frf, values: ComplexArray, places: list[float], names: list[str]) -> list[Doubt]:
    """Doubt a station farther out that moves less at low frequency than one farther in."""
    outer_station, inner_station = int(np.argmax(places)), int(np.argmin(places))
    lowest = slice(0, max(3, int(LOW_LINE_FRACTION * frf.frequency.size)))
    size = np.abs(values[lowest])
    ratio = float(np.median(size[:, outer_station, outer_station] / np.maximum(size[:, inner_station, inner_station], 1e-300)))
    if ratio > MIN_STATION_COMPLIANCE_RATIO:
        return []
    return [Doubt(f"stations {names[outer_station]} and {names[inner_station]}",
                  f"{names[outer_station]}, farther out, moves {ratio:.2g} times as "
                  f"much as {names[inner_station]}: they may be exchanged", "check which is which", figure=1 - ratio)]
