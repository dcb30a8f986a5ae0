"""Remarks on an identification: what is doubtful, and what to try next."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.judgement.resonances import Resonance, group_similar
from toolpoint.modal_identification.judgement.resonances import resonance_remarks as doubtful_remark
from toolpoint.vibration.correlation import mac
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

MIN_PARTICIPATION = 0.02  # of a mode's largest: below, a reference hardly measures the mode
DRIFT_BAND_FRACTION = 0.02  # of the range of lines: where integrated accelerations drift
MIN_DRIFT_POWER = 0.5  # of all power of the responses, in the drift band
MIN_GOOD_FIT = 0.9  # explained fraction of a response's energy
MAX_DAMPING_UNCERTAINTY = 0.2  # half width of the 95 % interval over the damping ratio
MIN_SMOOTH_LINES = 4.0  # that share their residual, from which it is not noise
MIN_EXACT_FIT = 1 - 1e-10  # explained fraction of the energy: above, the residual is rounding


def remarks(frf: Frf, modes: Modes, quality: FloatArray, *, mode_quality: FloatArray, excess: float,
            spread: float, groups: tuple[Resonance, ...]) -> tuple[str, ...]:
    """Return the remarks on an identification, most important first."""
    return (*_drift_remarks(frf, modes), *_fit_remarks(frf, quality, mode_quality, modes, excess),
            *_shared_remarks(spread, quality), *doubtful_remark(groups, modes), *_mode_remarks(frf, modes),
            *_pair_remarks(modes), *_reference_remarks(frf, modes), *_scale_remarks(frf, modes))


def _drift_remarks(frf: Frf, modes: Modes) -> list[str]:
    drift_limit = DRIFT_BAND_FRACTION * float(frf.frequency[-1])
    in_drift_band = frf.frequency < drift_limit
    power = (np.abs(frf.values) ** 2).reshape(frf.frequency.size, -1)
    share = float(np.median(power[in_drift_band].sum(axis=0) / np.maximum(power.sum(axis=0), np.finfo(float).tiny)))
    if share < MIN_DRIFT_POWER or (modes.frequency < drift_limit).any():
        return []
    return [f"the lines below {drift_limit:.3g} Hz hold {100 * share:.4g} % of the power of the responses and no mode: "
            "integrated accelerations drift there and hide all else; begin the band above them "
            f"(--band {drift_limit:.3g}:{frf.frequency[-1]:.5g})"]


def _fit_remarks(frf: Frf, quality: FloatArray, mode_quality: FloatArray, modes: Modes, excess: float) -> list[Doubt]:
    doubts: list[Doubt] = []
    poor = np.argwhere(quality < MIN_GOOD_FIT)
    if poor.size:
        row, column = poor[int(np.argmin(quality[tuple(poor.T)]))]
        doubts.append(Doubt("fit", f"{len(poor)} of {quality.size} responses fit below {100 * MIN_GOOD_FIT:g} %, the worst "
                           f"{frf.outputs[row]} / {frf.inputs[column]} with {100 * quality[row, column]:.3g} %", "look at it "
                           "for noise, a wrong channel or a wrong direction", figure=float(quality[row, column])))
    for i in np.flatnonzero(mode_quality < MIN_GOOD_FIT):
        doubts.append(Doubt(_name(int(i) + 1, modes.frequency[i]), f"the responses around it fit only to "
                                                             f"{100 * mode_quality[i]:.3g} %: "
                           "a closely spaced pair may be unresolved, or the structure is not linear there", "add a "
                           "reference or raise the order; strike less hard", figure=float(mode_quality[i])))
    if excess > 2:
        doubts.append(Doubt("residual", f"{excess:.3g} times the stated variance: modes are missing, or the set-ups differ",
                           "the intervals are widened to what is seen", figure=excess))
    return doubts


def is_smooth(spread: float, quality: FloatArray) -> bool:
    """Whether the residual is a misfit of the model rather than noise."""
    return bool(spread >= MIN_SMOOTH_LINES and quality.min() <= MIN_EXACT_FIT)


def _shared_remarks(spread: float, quality: FloatArray) -> list[str]:
    if not is_smooth(spread, quality):
        return []
    return [f"the residual is smooth over about {spread:.0f} lines: the model misses something (a mode, a structure that "
            "is not linear) or the data are smoothed; the intervals are widened for it"]


def _name(number: int, frequency: float) -> str:
    return f"mode {number} at {frequency:.4g} Hz"


def _mode_remarks(frf: Frf, modes: Modes) -> list[Doubt]:
    doubts: list[Doubt] = []
    step = float(np.median(np.diff(frf.frequency)))
    for i, (f, zeta) in enumerate(zip(modes.frequency, modes.damping_ratio, strict=True), start=1):
        width = abs(zeta) * f
        if min(f - frf.frequency[0], frf.frequency[-1] - f) < 2 * width:
            doubts.append(Doubt(_name(i, f), "lies at the edge of the band", f"widen it by {5 * width:.2g} Hz"))
        if 2 * width < 3 * step:
            doubts.append(Doubt(_name(i, f), f"its half-power width of {2 * width:.2g} Hz holds fewer than three lines",
                               "measure longer for a finer line spacing", figure=2 * width / step))
        if zeta <= 0:
            doubts.append(Doubt(_name(i, f), "has no positive damping", "check the decay of the window", figure=float(zeta)))
        if modes.covariance is not None and np.diagonal(modes.covariance[i - 1]).min() < 0:
            doubts.append(Doubt(_name(i, f), "its certainty cannot be told, as the fit holds nearly equal modes that "
                               "cancel each other", "the responses may disagree on their poles (a sensor moved between them)"))
        elif modes.covariance is not None and modes.damping_interval[i - 1] > MAX_DAMPING_UNCERTAINTY * abs(zeta):
            uncertainty = float(modes.damping_interval[i - 1] / abs(zeta))
            doubts.append(Doubt(_name(i, f), f"damping known only to ±{100 * uncertainty:.0f} % of its value",
                                "average more hits or "
                               "choose a reference that moves more", figure=uncertainty))
    return doubts


def _pair_remarks(modes: Modes) -> list[str]:
    correlation = mac(modes.shape) if modes.count > 1 else np.eye(1)
    return [f"modes {i + 1} and {j + 1} at {modes.frequency[i]:.4g} and {modes.frequency[j]:.4g} Hz overlap and look alike "
            f"(MAC {correlation[i, j]:.2f}): more points or a further reference must part them"
            for run in group_similar(modes) for i, j in pairwise(run)]


def _reference_remarks(frf: Frf, modes: Modes) -> list[str]:
    if len(frf.inputs) < 2 or modes.participation is None:
        return []
    lines = []
    share = np.abs(modes.participation)
    share = share / share.max(axis=0)
    for i, dof in enumerate(frf.inputs):
        unseen = np.flatnonzero(share[i] < MIN_PARTICIPATION) + 1
        if unseen.size:
            lines.append(f"reference {dof} hardly sees mode{'s' * (unseen.size > 1)} {', '.join(map(str, unseen))}")
    return lines


def _scale_remarks(frf: Frf, modes: Modes) -> list[str]:
    points = driving_points(frf.outputs, frf.inputs)
    if modes.scaling != "unscaled":
        return []
    if not points:
        return ["no driving point among the responses: shapes are not mass-normalised (measure one input at its point)"]
    return ["the driving points do not give every mode a scale: shapes are not mass-normalised (use another point)"]
