r"""Joints that change while the machine moves: what the machine file leaves of the measured courses, explained joint by joint.

For mode k in window w, :math:`r_{kw} = \ln f_{kw} - \ln \hat f_k(p_w)` is what the machine at that pose does not predict. Its
mean over the windows is an error of the file, not of the motion, and is taken off. A joint j whose stiffness goes with the
value x by the factor :math:`e^{c x}` leaves :math:`S_{kj}(p_w)\,c\,x_w`, with
:math:`S_{kj} = \phi_k^T K_j \phi_k / (2 \omega_k^2)`. Each joint is weighed alone, with a share of its prediction left open.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.machine import Machine
from toolpoint.studies.drift.hypotheses import DriftModel, model_drift
from toolpoint.studies.moving.mode_tracks import ModeTrack
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.correlation import assign_modes

CHANGE_DEVIATION = 0.3  # before the record, of the logarithm of a joint's factor over half of the range
OPEN_SHARE = 0.1  # of a predicted change, that the machine file may have wrong
FILE_DEVIATION = 5e-4  # relative, by which a file may miss the course of a frequency besides its mean
MAX_JOINT_MISFIT = 2.5  # chi-squared over degrees of freedom, beyond which a joint alone does not explain the courses
UNCHANGED_WEIGHT = 0.5  # before the record, of no joint changing at all
MIN_MODEL_MAC_OF_TRACK = 0.5  # of a mode and the machine's


@dataclass(frozen=True)
class JointChange:
    """A joint that could change on the way: its probability, its factor of stiffness from the first to the last value with its
    95 % interval (as a factor), and the misfit that it leaves (chi-squared over its degrees of freedom)."""

    joint: str
    probability: float
    factor: float
    interval: tuple[float, float]
    misfit: float

    @property
    def fits(self) -> bool:
        """Whether this joint alone explains the courses."""
        return self.misfit <= MAX_JOINT_MISFIT


@dataclass(frozen=True, eq=False)
class PredictedTracks:
    """Machine beside the tracks: frequency (n_tracks, n_windows), not a number where a mode has no partner, and sensitivity of
    ln f to ln of each joint's stiffness (n_joints, n_tracks, n_windows)."""

    joints: tuple[str, ...]
    frequency: FloatArray
    sensitivity: FloatArray


def predict_tracks(machine: Machine, tracks: Sequence[ModeTrack], poses: Sequence[Mapping[str, float]], *,
                   dofs: Sequence[Dof]) -> PredictedTracks:
    """Return what a machine predicts for tracks at the poses of the windows."""
    highest = max(float(track.frequency.max()) for track in tracks)
    models = [model_drift(machine, dofs, pose, highest=highest) for pose in poses]
    joints = tuple(hypothesis.part for hypothesis in models[0].hypotheses
                   if hypothesis.part.startswith("joint ") and not hypothesis.direction)
    frequency = np.full((len(tracks), len(poses)), np.nan)
    sensitivity = np.zeros((len(joints), len(tracks), len(poses)))
    for w, model in enumerate(models):
        slopes = {each.part: each.slope for each in model.hypotheses if not each.direction and each.slope is not None}
        for k, partner in _pair(tracks, w, model):
            frequency[k, w] = model.nominal.frequency[partner]
            square = float(model.nominal.omega[partner]) ** 2
            sensitivity[:, k, w] = [slopes[joint][partner, partner] / (2 * square) for joint in joints]
    return PredictedTracks(joints, frequency, sensitivity)


def _pair(tracks: Sequence[ModeTrack], window: int, model: DriftModel) -> list[tuple[int, int]]:
    """Return the tracks that are seen in a window, each with its own mode of the machine."""
    present = [(k, int(np.flatnonzero(track.windows == window)[0])) for k, track in enumerate(tracks)
               if (track.windows == window).any()]
    if not present:
        return []
    measured = Modes(np.array([tracks[k].frequency[place] for k, place in present]), np.zeros(len(present)),
                     np.column_stack([tracks[k].shapes[:, place] for k, place in present]), model.nominal.dofs, "unscaled")
    rows, columns, values = assign_modes(measured, model.nominal)
    return [(present[row][0], int(column)) for row, column, value in zip(rows, columns, values, strict=True)
            if value >= MIN_MODEL_MAC_OF_TRACK]


def weigh_joints(tracks: Sequence[ModeTrack], predicted: PredictedTracks, values: FloatArray
                 ) -> tuple[list[JointChange], float]:
    """Return the joints that could change, the likeliest first, and the probability that none does."""
    rows, deviations, columns = _residuals(tracks, predicted, values)
    if rows.size < 3:
        return [], 1.0
    evidence, changes = [-0.5 * float((rows**2 / deviations**2).sum()) - float(np.log(deviations).sum())], []
    for column in columns:
        spread = deviations
        # The open share goes with the change that is found: two rounds settle it.
        for _ in range(3):
            information = float((column**2 / spread**2).sum()) + 1 / CHANGE_DEVIATION**2
            change = float((column * rows / spread**2).sum()) / information
            spread = np.sqrt(deviations**2 + (OPEN_SHARE * column * change) ** 2)
        left = rows - column * change
        squares = float((left**2 / spread**2).sum())
        evidence.append(-0.5 * squares - float(np.log(spread).sum()) - 0.5 * (change / CHANGE_DEVIATION) ** 2
                        - 0.5 * float(np.log(information * CHANGE_DEVIATION**2)))
        changes.append((change, NORMAL_QUANTILE_95 / np.sqrt(information), squares / max(rows.size - 1, 1)))
    weights = np.array([UNCHANGED_WEIGHT, *([(1 - UNCHANGED_WEIGHT) / max(len(columns), 1)] * len(columns))])
    logs = np.array(evidence) + np.log(weights)
    shares = np.exp(logs - logs.max())
    shares = shares / shares.sum()
    # The factor from end to end: the value runs over two half ranges.
    result = [JointChange(joint, float(share), float(np.exp(2 * c)),
                          (float(np.exp(2 * (c - half_width))), float(np.exp(2 * (c + half_width)))), misfit)
              for joint, share, (c, half_width, misfit) in zip(predicted.joints, shares[1:], changes, strict=True)]
    return sorted(result, key=lambda each: -each.probability), float(shares[0])


def _residuals(tracks: Sequence[ModeTrack], predicted: PredictedTracks, values: FloatArray
               ) -> tuple[FloatArray, FloatArray, list[FloatArray]]:
    """Return what the machine does not predict, its deviations, and what each joint would leave, less the means by mode."""
    half_range = max(float(np.ptp(values)) / 2, 1e-300)
    scaled = (values - (values.min() + values.max()) / 2) / half_range
    rows, deviations = list[FloatArray](), list[FloatArray]()
    columns: list[list[FloatArray]] = [[] for _ in predicted.joints]
    for k, track in enumerate(tracks):
        windows = track.windows.astype(int)
        is_paired = np.isfinite(predicted.frequency[k, windows])
        if is_paired.sum() < 3:
            continue
        windows = windows[is_paired]
        deviation = np.hypot(track.deviations[is_paired, 0] / track.frequency[is_paired], FILE_DEVIATION)
        residual = np.log(track.frequency[is_paired] / predicted.frequency[k, windows])
        weight = 1 / deviation**2 / (1 / deviation**2).sum()
        rows.append(residual - weight @ residual)
        deviations.append(deviation)
        for j, column in enumerate(columns):
            effect = predicted.sensitivity[j, k, windows] * scaled[windows]
            column.append(effect - weight @ effect)
    if not rows:
        return np.zeros(0), np.zeros(0), []
    return np.concatenate(rows), np.concatenate(deviations), [np.concatenate(column) for column in columns]
