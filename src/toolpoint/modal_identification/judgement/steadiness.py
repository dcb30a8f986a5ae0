r"""Steadiness: whether modes stay where they are when the band is cut a little or points are left out, and how they move.

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

# Shares of the band cut off below and above; half-power widths that a mode must keep from the ends of a cut band to be asked
# for; how far it may move, in half-power widths and in its own intervals, and how much its shape must look alike.
CUTS = ((0.125, 0.0), (0.0, 0.125), (0.08, 0.08))
MARGIN, FAR, INTERVALS, ALIKE = 3.0, 1.0, 3.0, 0.8
FEWEST_LINES, FEWEST_POINTS, GROUPS = 64, 5, 3


@dataclass(frozen=True, eq=False)
class Steadiness:
    """What parts of the data show of every mode.

    moved : (n_modes, 2), root mean square of the change of frequency (Hz) and damping ratio beyond that of noise; asked, seen :
    (n_modes,) parts that must show it, and that do.
    """

    moved: FloatArray
    asked: FloatArray
    seen: FloatArray

    @property
    def unsteady(self) -> BoolArray:
        """Modes that most of the parts do not show."""
        return np.asarray((self.asked > 0) & (2 * self.seen <= self.asked))


def is_crowded(modes: Modes) -> bool:
    """Return whether two modes lie within a half-power width: rare in a structure, usual where one drifts between points."""
    return bool(_crowds(modes))


def judge_steadiness(frf: Frf, modes: Modes, again: Callable[[Frf], Modes], *, bands: bool = True, points: bool = True
                     ) -> Steadiness | None:
    """Return how modes move and vanish in parts of the data, None where there are too few lines and points for any.

    again : identifies the modes of the responses that it is given; bands, points : which parts are tried.
    """
    kinds = [list(_cut_bands(frf) if bands else ()), list(_fewer_points(frf) if points else ())]
    if not any(kinds):
        return None
    moved, asked, seen = np.zeros((modes.count, 2)), np.zeros(modes.count), np.zeros(modes.count)
    for parts, samples in zip(kinds, (False, True), strict=True):
        square, more_asked, more_seen = _moves(frf, modes, again, parts, samples=samples)
        moved, asked, seen = moved + square, asked + more_asked, seen + more_seen
    return Steadiness(np.sqrt(moved), asked, seen)


def _moves(frf: Frf, modes: Modes, again: Callable[[Frf], Modes], parts: list[tuple[Frf, float]], *, samples: bool
           ) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean square (n_modes, 2) of the changes in parts of one kind beyond noise, the parts that must show a mode,
    and those that do; `samples` where the parts are samples of points."""
    total, asked, seen = np.zeros((modes.count, 2)), np.zeros(modes.count), np.zeros(modes.count)
    known = np.zeros((modes.count, 2))
    if modes.covariance is not None:
        known = np.maximum(np.diagonal(modes.covariance, axis1=1, axis2=2), 0.0)
    for part, lost in parts:
        low, high = float(part.frequency[0]), float(part.frequency[-1])
        margin = np.where(part.frequency.size < frf.frequency.size, MARGIN, 0.0) * np.abs(modes.damping_ratio) * modes.frequency
        within = (modes.frequency - low >= margin) & (high - modes.frequency >= margin)
        try:
            partner, change = _partners(modes, again(part))
        except ToolpointError:  # no mode at all in this part: none of them is seen
            partner, change = np.zeros(modes.count, bool), np.zeros((modes.count, 2))
        asked += within
        seen += within & partner
        weight = (1 - lost) / lost if samples else 1.0
        total += np.where((within & partner)[:, None], weight * (change**2 - lost / (1 - lost) * known), 0.0)
    square = np.maximum(total, 0.0) / np.maximum(seen, 1)[:, None]
    return _pooled(square, modes, seen) if samples else square, asked, seen


def _pooled(square: FloatArray, modes: Modes, seen: FloatArray) -> FloatArray:
    """Return variances that three groups of points tell, no less than half of what all modes share as parts of themselves.

    Of one mode three groups tell a variance with two degrees of freedom: by chance it is far too small in one of ten.
    """
    size = np.stack([modes.frequency, np.abs(modes.damping_ratio)], axis=1) ** 2
    shown = seen > 0
    if not shown.any():
        return square
    share = (square[shown] / np.maximum(size[shown], 1e-300)).mean(axis=0)
    return np.where(shown[:, None], np.maximum(square, (square + share * size) / 2), square)


def widen(modes: Modes, steadiness: Steadiness) -> Modes:
    """Return the modes with the covariance of frequency and damping widened by what they move by; unknown ones stay so."""
    if modes.covariance is None:
        return modes
    known = np.diagonal(modes.covariance, axis1=1, axis2=2).min(axis=1) >= 0
    more = np.where(known[:, None], steadiness.moved, 0.0)[:, :, None] ** 2 * np.eye(2)
    return replace(modes, covariance=modes.covariance + more)


def steadiness_remarks(modes: Modes, steadiness: Steadiness, before: Modes) -> list[str]:
    """Return remarks on the modes that cut bands do not show, and on by how much intervals were widened."""
    lines = []
    gone = np.flatnonzero(steadiness.unsteady)
    if gone.size:
        names = ", ".join(f"{i + 1} ({modes.frequency[i]:.5g} Hz)" for i in gone[:8]) + (" and more" if gone.size > 8 else "")
        lines.append(f"modes {names} vanish, or move by more than their width, when the band is cut by an eighth or a third "
                     "of the points is left out: they may be the model's and not the structure's (a sensor that is moved "
                     "shifts the modes of each point: several poles then stand for one mode); identify a narrower band, or "
                     "hold the mass of the sensor the same at all points")
    groups = _crowds(modes)
    if groups:
        names = "; ".join(", ".join(str(i + 1) for i in group) for group in groups)
        lines.append(f"modes {names} lie within half-power widths of each other: a structure that drifts between points shows "
                     "one mode as several; count them as several only where a second reference or symmetry speaks for it")
    wider = np.flatnonzero(modes.frequency_interval > 2 * before.frequency_interval)
    if wider.size:
        lines.append(f"the intervals of {wider.size} of {modes.count} modes are more than doubled, as they move so much with "
                     "the band or the points: the model is not the structure's")
    return lines


def _crowds(modes: Modes) -> list[list[int]]:
    """Return the groups of modes of which each lies within a half-power width of the next."""
    groups: list[list[int]] = []
    width = np.abs(modes.damping_ratio) * modes.frequency
    order = np.argsort(modes.frequency).tolist()
    for before, after in pairwise(order):
        if modes.frequency[after] - modes.frequency[before] < width[after] + width[before]:
            if groups and groups[-1][-1] == before:
                groups[-1].append(after)
            else:
                groups.append([before, after])
    return groups


def _cut_bands(frf: Frf) -> Iterator[tuple[Frf, float]]:
    """Yield the responses in bands cut at their ends, with the share of the lines that is lost; none of a few lines."""
    if frf.frequency.size < FEWEST_LINES:
        return
    low, high = float(frf.frequency[0]), float(frf.frequency[-1])
    for below, above in CUTS:
        part = frf.between(low + below * (high - low), high - above * (high - low))
        yield part, 1 - part.frequency.size / frf.frequency.size


def _fewer_points(frf: Frf) -> Iterator[tuple[Frf, float]]:
    """Yield the responses without every third point, with the share of the outputs that is lost; none of a few points."""
    names = list(dict.fromkeys(dof.point for dof in frf.outputs))
    if len(names) < FEWEST_POINTS:
        return
    for k in range(GROUPS):
        left_out = set(names[k::GROUPS])
        kept = [i for i, dof in enumerate(frf.outputs) if dof.point not in left_out]
        yield frf.selected(kept, list(range(len(frf.inputs)))), 1 - len(kept) / len(frf.outputs)


def _partners(modes: Modes, others: Modes) -> tuple[BoolArray, FloatArray]:
    """Return which modes have a partner among others, and by how much (Hz, ratio) it differs."""
    away = np.abs(others.frequency[None] - modes.frequency[:, None])
    width = np.maximum(np.abs(modes.damping_ratio) * modes.frequency, _finite(modes))
    shape = modes.shape_at(others.dofs) if others.dofs != modes.dofs else modes.shape
    possible = (away <= FAR * width[:, None]) & (mac(shape, others.shape) >= ALIKE)
    best = np.where(possible, away, np.inf).argmin(axis=1)
    change = np.stack([others.frequency[best] - modes.frequency, others.damping_ratio[best] - modes.damping_ratio], axis=1)
    return np.asarray(possible.any(axis=1)), np.asarray(change)


def _finite(modes: Modes) -> FloatArray:
    """Return the frequency that some intervals span; zero where they are not known."""
    if modes.covariance is None:
        return np.zeros(modes.count)
    return np.nan_to_num(INTERVALS * modes.frequency_interval, nan=0.0, posinf=0.0)
