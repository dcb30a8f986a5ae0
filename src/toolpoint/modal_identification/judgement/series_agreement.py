r"""Series of a test, one for each struck Dof, against each other: a record with another sign, gain, point or spot is named.

A residue is :math:`\psi_p L_s`, so the responses to two struck Dofs differ in every mode by one ratio, the same at all points.
The ratio of each mode is that of the majority of points (least sum of distances). A point that departs from it in all modes by
one real factor was struck from the other side, or measured with another gain or unit in one of the series; one that no factor
explains was measured or struck elsewhere. What both series share (a wrong sensor at one point) leaves the ratio as it is.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.residues import residues
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.unit_factor import scale_words

MIN_SERIES_POINTS = 6
MIN_SERIES_MISFIT, MIN_SERIES_MISFIT_RATIO = 0.05, 8.0  # share of a point's residues; over the median of all points
MAX_FACTOR_MISFIT = 0.15  # of the misfit, that a factor may leave
MAX_DISSENTING_POINTS, MAX_DISSENTING_FRACTION = 2, 0.05  # more, and more of all, are no slip of single records
MIN_LOUD_SHARE = 0.05  # of the largest power of a mode at a point, from which that point tells whether the mode is one
_DERIVATIVES = {"receptance": 0, "mobility": 1, "accelerance": 2}


def question_series(frf: Frf, modes: Modes) -> tuple[Doubt, ...]:
    """Return the doubts about points whose responses to two struck Dofs do not fit those of all other points.

    modes : of these responses, with false ones that such a point makes.
    """
    points = list(dict.fromkeys(dof.point for dof in frf.outputs))
    if len(frf.inputs) < 2 or len(points) < MIN_SERIES_POINTS or modes.count == 0:
        return ()
    has_lower = bool(frf.frequency[0] > 0 or frf.decay != 0)
    poles = _distinct_poles(modes)
    # Residues as heights of peaks: what is loud at a point decides there.
    heights = np.abs(poles) ** _DERIVATIVES[frf.quantity] / np.maximum(np.abs(poles.real), 1e-300)
    values = residues(frf, poles, has_lower).values * heights
    rows = [[k for k, dof in enumerate(frf.outputs) if dof.point == point] for point in points]
    reference = int(np.argmax((np.abs(values) ** 2).sum(axis=(0, 2))))
    doubts: list[Doubt] = []
    for series in range(len(frf.inputs)):
        if series == reference:
            continue
        expected, measured = _paired_peaks(values[:, reference], values[:, series], rows)
        misfit, factor, remaining = _misfits(expected, measured, rows)
        dissents = np.flatnonzero(misfit > max(MIN_SERIES_MISFIT, MIN_SERIES_MISFIT_RATIO * float(np.median(misfit))))
        if dissents.size > _max_dissents(len(points)):
            continue
        doubts += [_doubt_of(points[k], str(frf.inputs[series]), str(frf.inputs[reference]), factor=float(factor[k]),
                             is_explained=bool(remaining[k] < MAX_FACTOR_MISFIT * misfit[k])) for k in dissents.tolist()]
    return tuple(doubts)


def _distinct_poles(modes: Modes) -> ComplexArray:
    """Return one pole for modes that overlap: the one that moves the responses most."""
    size = np.abs(modes.shape).max(axis=0) / np.maximum(modes.damping_ratio * modes.frequency, 1e-12)
    if modes.participation is not None:
        size = size * np.abs(modes.participation).max(axis=0)
    chosen: list[int] = []
    for k in range(modes.count):
        if chosen and modes.frequency[k] - modes.frequency[chosen[-1]] < float(
                (modes.damping_ratio * modes.frequency)[[k, chosen[-1]]].sum()):
            chosen[-1] = max(chosen[-1], k, key=lambda mode: float(size[mode]))
        else:
            chosen.append(k)
    return np.asarray(modes.poles[chosen], complex)


def _paired_peaks(first: ComplexArray, second: ComplexArray, rows: list[list[int]]) -> tuple[ComplexArray, ComplexArray]:
    """Return the peaks (n_outputs, n_modes) of the second series as the first lets expect them, and as measured.

    Modes in which many points disagree are left out: two close modes in one have no common ratio.
    """
    expected, measured = np.zeros_like(first), np.zeros_like(second)
    for mode in range(first.shape[1]):
        a, b = first[:, mode], second[:, mode]
        power = np.array([float((np.abs(a[part]) ** 2).sum()) for part in rows])
        ratios = np.array([np.vdot(a[part], b[part]) for part in rows]) / np.maximum(power, 1e-300)
        distance = [sum(float(np.linalg.norm(b[part] - c * a[part])) for part in rows) for c in ratios]
        a = ratios[int(np.argmin(distance))] * a
        size = np.array([float((np.abs(a[part]) ** 2 + np.abs(b[part]) ** 2).sum()) for part in rows])
        shares = np.array([float((np.abs(b[part] - a[part]) ** 2).sum()) for part in rows]) / np.maximum(size, 1e-300)
        is_loud = size > MIN_LOUD_SHARE * size.max()
        if (shares[is_loud] > MIN_SERIES_MISFIT).sum() <= _max_dissents(len(rows)):
            expected[:, mode], measured[:, mode] = a, b
    return expected, measured


def _max_dissents(count: int) -> float:
    """Return how many of the points slips of single records may touch: a body of close modes holds more."""
    return max(MAX_DISSENTING_POINTS, MAX_DISSENTING_FRACTION * count)


def _misfits(expected: ComplexArray, measured: ComplexArray, rows: list[list[int]]
             ) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return for every point the misfit share, the best real factor on what is expected, and the share that it leaves."""
    misfit, factor, remaining = (np.empty(len(rows)) for _ in range(3))
    for k, part in enumerate(rows):
        a, b = expected[part], measured[part]
        power = max(float((np.abs(a) ** 2).sum() + (np.abs(b) ** 2).sum()), 1e-300)
        factor[k] = np.vdot(a, b).real / max(float((np.abs(a) ** 2).sum()), 1e-300)
        misfit[k] = float((np.abs(b - a) ** 2).sum()) / power
        remaining[k] = float((np.abs(b - factor[k] * a) ** 2).sum()) / power
    return misfit, factor, remaining


def _doubt_of(point: int | str, series: str, reference: str, *, factor: float, is_explained: bool) -> Doubt:
    """Return the doubt about the record of a point: reversed, of another gain, or of another place."""
    what = f"point {point} struck at {series} and at {reference}"
    if not is_explained:
        return Doubt(what, "its responses to the two do not belong together as those of the other points do, by no factor: "
                     "one of the two was measured at another point or struck at another spot", "look at the two records, or "
                     "measure them again")
    if -1.3 < factor < -0.75:
        return Doubt(what, "its responses to the two have opposite signs beside those of all other points: in one of the two "
                     "it was struck from the other side, or the sensor was turned",
                     "look at the two records, and turn the one that is wrong", figure=factor)
    words = scale_words(factor) if factor else ""
    return Doubt(what, f"its responses to the first are {factor:.3g} times what those to the second and all other points let "
                 f"expect{words}: gain, unit or calibration differ between the two records",
                 "look at the two records, correct the one that is wrong", figure=factor)
