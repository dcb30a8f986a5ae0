r"""Steadiness: changes of modes when the band is cut a little or points are left out.

The covariance of a fit holds for a model that is right. Where the residual is not noise (a structure that is not linear, modes
outside the band) the poles depend on what is fitted: another band gives other modes, by far more than their intervals. Where
the structure drifts between points (a sensor that is moved), each point has its own poles, and several of them may be taken
for as many modes, without a trace in the residual. So the modes are identified again in bands cut at either end, and without a
third of the points; the mean square of what a mode moves by, less what fewer data explain, is added to its covariance, and a
mode that most of these do not show is the model's, not the structure's.

An efficient estimate from a part of the data differs from that of all by the difference of their variances (Hausman,
Econometrica 46 (1978) 1251): a part that loses the share s moves by s/(1 - s) of the variance under noise alone. Where points
differ by more than noise the same holds of their spread, so that (1 - s)/s times the mean square of the changes is the variance
of the mode (the jackknife with groups left out: Efron, The Jackknife, the Bootstrap and Other Resampling Plans, 1982, chapter
3). Changes with the band are errors of the model, no samples: their mean square is taken as it is. Both are added.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from toolpoint._check import BoolArray, FloatArray, ToolpointError
from toolpoint.vibration.correlation import mac
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

BAND_CUTS = ((0.125, 0.0), (0.0, 0.125), (0.08, 0.08))  # fractions of the band cut off below and above
BAND_END_MARGIN = 3.0  # half-power widths between a mode and the ends of a cut band that must show it
MAX_PARTNER_WIDTHS, MAX_PARTNER_INTERVALS = 1.0, 3.0  # change of a partner's frequency: half-power widths, 95 % intervals
MIN_PARTNER_MAC = 0.8
MIN_CUT_LINES, MIN_SPLIT_POINTS, POINT_GROUPS = 64, 5, 3  # lines of a band that is cut; points that are split; groups left out


@dataclass(frozen=True, eq=False)
class Steadiness:
    """Changes of every mode in parts of the data.

    moved : (n_modes, 2), root mean square of the change of frequency (Hz) and damping ratio beyond noise; n_expected,
    n_detected : (n_modes,) numbers of parts that must show a mode, and that do.
    """

    moved: FloatArray
    n_expected: FloatArray
    n_detected: FloatArray

    @property
    def unsteady(self) -> BoolArray:
        """Modes that most of the parts do not show."""
        return np.asarray((self.n_expected > 0) & (2 * self.n_detected <= self.n_expected))


def is_crowded(modes: Modes) -> bool:
    """Whether two modes lie within a half-power width: rare in a structure, usual where one drifts between points."""
    return bool(_find_crowds(modes))


def judge_steadiness(frf: Frf, modes: Modes, identify_part: Callable[[Frf], Modes], *, bands: bool = True, points: bool = True
                     ) -> Steadiness | None:
    """Return how modes move and vanish in parts of the data, None where there are too few lines and points for any.

    identify_part : identifies the modes of the responses that it is given; bands, points : which parts are tried.
    """
    parts_by_kind = [list(_cut_bands(frf) if bands else ()), list(_leave_out_points(frf) if points else ())]
    if not any(parts_by_kind):
        return None
    mean_square, n_expected, n_detected = np.zeros((modes.count, 2)), np.zeros(modes.count), np.zeros(modes.count)
    for parts, samples in zip(parts_by_kind, (False, True), strict=True):
        square, expected_of_kind, detected_of_kind = _mode_changes(frf, modes, identify_part, parts, samples=samples)
        mean_square, n_expected, n_detected = mean_square + square, n_expected + expected_of_kind, n_detected + detected_of_kind
    return Steadiness(np.sqrt(mean_square), n_expected, n_detected)


def _mode_changes(frf: Frf, modes: Modes, identify_part: Callable[[Frf], Modes], parts: list[tuple[Frf, float]], *,
                  samples: bool
           ) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean square (n_modes, 2) of the changes in parts of one kind beyond noise, and two counts of parts.

    The counts are those of parts that must show a mode, and of those that do; `samples` where the parts are samples of points.
    """
    total, n_expected, n_detected = np.zeros((modes.count, 2)), np.zeros(modes.count), np.zeros(modes.count)
    prior_variance = np.zeros((modes.count, 2))
    if modes.covariance is not None:
        prior_variance = np.maximum(np.diagonal(modes.covariance, axis1=1, axis2=2), 0.0)
    for part, left_out_fraction in parts:
        band_min, band_max = float(part.frequency[0]), float(part.frequency[-1])
        margin = np.where(part.frequency.size < frf.frequency.size, BAND_END_MARGIN,
                          0.0) * np.abs(modes.damping_ratio) * modes.frequency
        is_expected = (modes.frequency - band_min >= margin) & (band_max - modes.frequency >= margin)
        try:
            partner, change = _find_partners(modes, identify_part(part))
        except ToolpointError:  # no mode at all in this part: none of them is seen
            partner, change = np.zeros(modes.count, bool), np.zeros((modes.count, 2))
        n_expected += is_expected
        n_detected += is_expected & partner
        weight = (1 - left_out_fraction) / left_out_fraction if samples else 1.0
        total += np.where((is_expected & partner)[:, None],
                          weight * (change**2 - left_out_fraction / (1 - left_out_fraction) * prior_variance), 0.0)
    square = np.maximum(total, 0.0) / np.maximum(n_detected, 1)[:, None]
    return _pool_variances(square, modes, n_detected) if samples else square, n_expected, n_detected


def _pool_variances(square: FloatArray, modes: Modes, n_detected: FloatArray) -> FloatArray:
    """Pool the jackknife variances: each is at least half of the mean relative variance of all modes.

    Three groups give two degrees of freedom only: by chance one variance in ten is far too small.
    """
    scale = np.stack([modes.frequency, np.abs(modes.damping_ratio)], axis=1) ** 2
    is_detected = n_detected > 0
    if not is_detected.any():
        return square
    mean_relative = (square[is_detected] / np.maximum(scale[is_detected], 1e-300)).mean(axis=0)
    return np.where(is_detected[:, None], np.maximum(square, (square + mean_relative * scale) / 2), square)


def inflate_covariance(modes: Modes, steadiness: Steadiness) -> Modes:
    """Return the modes with their mean square changes added to the covariance of frequency and damping, where it is known."""
    if modes.covariance is None:
        return modes
    has_variance = np.diagonal(modes.covariance, axis1=1, axis2=2).min(axis=1) >= 0
    added = np.where(has_variance[:, None], steadiness.moved, 0.0)[:, :, None] ** 2 * np.eye(2)
    return replace(modes, covariance=modes.covariance + added)


def steadiness_remarks(modes: Modes, steadiness: Steadiness, original: Modes) -> list[str]:
    """Return remarks on modes that parts of the data do not show, on crowds, and on widened intervals."""
    lines = []
    vanished = np.flatnonzero(steadiness.unsteady)
    if vanished.size:
        names = ", ".join(f"{i + 1} ({modes.frequency[i]:.5g} Hz)" for i in vanished[:8]) + (" and more" if vanished.size > 8
                                                                                             else "")
        which = (f"mode {names} vanishes, or moves by more than its width," if vanished.size == 1 else
                 f"modes {names} vanish, or move by more than their width,")
        lines.append(f"{which} when the band is cut by an eighth or a third of the points is left out: "
                     f"{'it' if vanished.size == 1 else 'they'} may be the model's and not the structure's (a sensor that is "
                     "moved shifts the modes of each point: several poles then stand for one mode); identify a narrower band, "
                     "or hold the mass of the sensor the same at all points")
    groups = _find_crowds(modes)
    if groups:
        names = "; ".join(", ".join(str(i + 1) for i in group) for group in groups)
        lines.append(f"modes {names} lie within half-power widths of each other: a structure that drifts between points shows "
                     "one mode as several; count them as several only where a second reference or symmetry speaks for it")
    widened = np.flatnonzero(modes.frequency_interval > 2 * original.frequency_interval)
    if widened.size:
        lines.append(f"the intervals of {widened.size} of {modes.count} modes are more than doubled, as they move so much with "
                     "the band or the points: the model is not the structure's")
    return lines


def _find_crowds(modes: Modes) -> list[list[int]]:
    """Return the groups of modes of which each lies within a half-power width of the next."""
    groups: list[list[int]] = []
    width = np.abs(modes.damping_ratio) * modes.frequency
    order = np.argsort(modes.frequency).tolist()
    for lower, upper in pairwise(order):
        if modes.frequency[upper] - modes.frequency[lower] < width[upper] + width[lower]:
            if groups and groups[-1][-1] == lower:
                groups[-1].append(upper)
            else:
                groups.append([lower, upper])
    return groups


def _cut_bands(frf: Frf) -> Iterator[tuple[Frf, float]]:
    """Yield the responses in bands cut at their ends, with the share of the lines that is lost; none of a few lines."""
    if frf.frequency.size < MIN_CUT_LINES:
        return
    band_min, band_max = float(frf.frequency[0]), float(frf.frequency[-1])
    for cut_below, cut_above in BAND_CUTS:
        part = frf.between(band_min + cut_below * (band_max - band_min), band_max - cut_above * (band_max - band_min))
        yield part, 1 - part.frequency.size / frf.frequency.size


def _leave_out_points(frf: Frf) -> Iterator[tuple[Frf, float]]:
    """Yield the responses without every third point, with the share of the outputs that is lost; none of a few points."""
    names = list(dict.fromkeys(dof.point for dof in frf.outputs))
    if len(names) < MIN_SPLIT_POINTS:
        return
    for k in range(POINT_GROUPS):
        left_out = set(names[k::POINT_GROUPS])
        outputs = [i for i, dof in enumerate(frf.outputs) if dof.point not in left_out]
        yield frf.selected(outputs, list(range(len(frf.inputs)))), 1 - len(outputs) / len(frf.outputs)


def _find_partners(modes: Modes, others: Modes) -> tuple[BoolArray, FloatArray]:
    """Return whether each mode has a partner among others, and the change (Hz, ratio) to it."""
    distance = np.abs(others.frequency[None] - modes.frequency[:, None])
    width = np.maximum(np.abs(modes.damping_ratio) * modes.frequency, _interval_reach(modes))
    shape = modes.shape_at(others.dofs) if others.dofs != modes.dofs else modes.shape
    possible = (distance <= MAX_PARTNER_WIDTHS * width[:, None]) & (mac(shape, others.shape) >= MIN_PARTNER_MAC)
    partner = np.where(possible, distance, np.inf).argmin(axis=1)
    change = np.stack([others.frequency[partner] - modes.frequency, others.damping_ratio[partner] - modes.damping_ratio],
                      axis=1)
    return np.asarray(possible.any(axis=1)), np.asarray(change)


def _interval_reach(modes: Modes) -> FloatArray:
    """Return `MAX_PARTNER_INTERVALS` half widths (95 %) of every frequency, Hz; zero where they are not known."""
    if modes.covariance is None:
        return np.zeros(modes.count)
    return np.nan_to_num(MAX_PARTNER_INTERVALS * modes.frequency_interval, nan=0.0, posinf=0.0)
