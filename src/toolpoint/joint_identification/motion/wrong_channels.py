"""One channel of a rigid component whose sign or gain is wrong: named from the rigid motion alone, three points are enough.

The displacements of a rigid component obey linear conditions in every mode. A channel with a wrong factor breaks them in all
modes by its own values times one pattern: the factor that takes most of the misfit of all modes off is least squares in one
number, in closed form (the derivative of the residual by a row's factor is its value through the residual projector).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.motion.measured import Component, Point, about
from toolpoint.vibration import Dof

# Misfit of a rigid motion over that with one channel corrected from which the channel is named: a component that bends, or
# noise, loses a tenth to a half by one factor.
MIN_MISFIT_RATIO = 6.0
RIVAL_MISFIT_RATIO = 2.0  # misfit over the least, up to which another channel explains it as well
TURNED_FACTORS = (-1.3, -0.75)  # factors that a turned sensor has, its gain a little wrong besides
MIN_CHANNEL_DEVIATION = 0.05  # of a factor from one: gains of sensors agree within a few per cent, not better
MIN_POINTS_OF_GAIN = 4  # of a component, to tell a point with another gain from the others
MIN_FREE_ROWS = 4  # free rows of all modes together beyond the motions and one factor, to tell a fault from chance


def question_channels(parts: Mapping[str, Component], dofs: Sequence[Dof]) -> list[Doubt]:
    """Return a doubt on every component whose misfit one wrong channel or point explains.

    dofs : of the shapes that they are part of.
    """
    return [fault.doubt(dofs) for part in parts.values() if (fault := _fault_of(part)) is not None]


def faulty_points(parts: Mapping[str, Component]) -> dict[str, Point]:
    """Return the point, by component, whose channel or channels explain the misfit of the component by one wrong factor."""
    faults = {name: _fault_of(part) for name, part in parts.items()}
    return {name: point for name, fault in faults.items() if fault is not None and (point := fault.point) is not None}


@dataclass(frozen=True, eq=False)
class _Fault:
    """One wrong factor of a component's channels: `rows` that it is on, further rows that explain the misfit as well, the
    factor by which the values must be multiplied, and the misfit over that with it."""

    part: Component
    rows: IndexArray
    rivals: tuple[int, ...]
    factor: float
    ratio: float

    @property
    def point(self) -> Point | None:
        """The point of all channels that may be wrong; None where they belong to several."""
        owners = set(self.part.owner[[*self.rows.tolist(), *self.rivals]].tolist())
        return self.part.points[owners.pop()] if len(owners) == 1 else None

    def doubt(self, dofs: Sequence[Dof]) -> Doubt:
        """Return the doubt on the channel, or on the point all of whose channels have one wrong gain."""
        if len(self.rows) > 1:
            return _doubt_of_point(self)
        labels = tuple(str(dof) for dof in dofs if dof.point in self.part.points and not dof.is_rotation)
        return _doubt_of(self.part.name, labels, int(self.rows[0]), list(self.rivals), factor=self.factor, ratio=self.ratio)


def _fault_of(part: Component) -> _Fault | None:
    """Return the one wrong channel or point of a component; None where no single factor explains its misfit."""
    misfit, factors = _misfits(part)
    best = int(np.argmin(misfit[:-1]))
    fault = _fault_of_point(part, best_channel_misfit=float(misfit[best]))
    free = (len(part.rows) - 6) * part.values.shape[1] - 1
    is_explained = misfit[-1] >= MIN_MISFIT_RATIO * misfit[best] and abs(factors[best] - 1) >= MIN_CHANNEL_DEVIATION
    if fault is not None or free < MIN_FREE_ROWS or not is_explained:
        return fault
    rivals = tuple(i for i in np.flatnonzero(misfit[:-1] < RIVAL_MISFIT_RATIO * misfit[best]).tolist() if i != best)
    return _Fault(part, np.array([best]), rivals, float(factors[best]), float(misfit[-1] / max(misfit[best], 1e-300)))


def _fault_of_point(part: Component, *, best_channel_misfit: float) -> _Fault | None:
    """Return the point all of whose channels have one wrong gain; None where a single channel explains more."""
    if not _have_gains(part):
        return None
    misfit, factors = _misfits_of_points(part)
    total, misfit = float(misfit[-1]), misfit[:-1]
    best = int(np.argmin(misfit))
    factor = float(factors[best])
    rivals = np.delete(misfit, best)
    if (total < MIN_MISFIT_RATIO * misfit[best] or abs(factor - 1) < MIN_CHANNEL_DEVIATION or best_channel_misfit < misfit[best]
            or rivals.min() < RIVAL_MISFIT_RATIO * misfit[best]):
        return None
    return _Fault(part, np.flatnonzero(part.owner == best), (), factor, float(total / max(misfit[best], 1e-300)))


def _doubt_of_point(fault: _Fault) -> Doubt:
    """Return the doubt on a point with another gain."""
    part, factor = fault.part, fault.factor
    cause = "struck from the other side, or the sensor turned" if factor < 0 else "another gain, unit or calibration"
    return Doubt(f"point {fault.point}", f"with all its channels multiplied by {factor:.3g}, {part.name} moves as one body "
                 f"{fault.ratio:.2g} times better: {cause} while it was measured", "look at its records and correct them",
                 figure=factor)


def channel_misfit_ratio(part: Component) -> float:
    """Return the misfit of a component over that with the factor of one channel, or of all of one point, fitted."""
    misfits = [_misfits(part)[0], *([_misfits_of_points(part)[0]] if _have_gains(part) else [])]
    return max(float(misfit[-1] / max(misfit[:-1].min(), 1e-300)) for misfit in misfits)


def _have_gains(part: Component) -> bool:
    """Whether points can be told to have another gain: enough of them, each with several channels."""
    return len(part.points) >= MIN_POINTS_OF_GAIN and int(np.bincount(part.owner, minlength=len(part.points)).min()) >= 2


def _misfits_of_points(part: Component) -> tuple[FloatArray, FloatArray]:
    """Return the misfit with one factor on each point's rows fitted (n_points + 1,), the last as measured, and the factors."""
    groups = [part.owner == k for k in range(len(part.points))]
    slope, power, total = np.zeros(len(groups)), np.zeros(len(groups)), 0.0
    for value, projector in _weighted_modes(part):
        residual = projector @ value
        total += float(residual @ residual)
        for k, group in enumerate(groups):
            spread = projector @ (value * group)
            slope[k] += float(residual @ spread)
            power[k] += float(spread @ spread)
    change = slope / np.maximum(power, 1e-300)
    # Never quite zero: of exact data the ratio to the misfit as measured would be infinite.
    return np.append(np.maximum(total - slope * change, 1e-12 * total), total), 1 - change


def _misfits(part: Component) -> tuple[FloatArray, FloatArray]:
    """Return the misfit with each row's factor fitted (n_rows + 1,), the last as measured, and the factors (n_rows,)."""
    slope, power, total = np.zeros(len(part.rows)), np.zeros(len(part.rows)), 0.0
    for value, projector in _weighted_modes(part):
        residual = projector @ value
        total += float(residual @ residual)
        slope += value * residual
        power += value**2 * np.diag(projector)
    change = slope / np.maximum(power, 1e-300)
    return np.append(np.maximum(total - slope * change, 1e-12 * total), total), 1 - change


def _weighted_modes(part: Component) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the weighted values (n_rows,) of every mode, and the projector (n_rows, n_rows) beside rigid motions."""
    weights = np.ones_like(part.values) if part.variance is None else 1 / np.sqrt(part.variance)
    if part.variance is None:
        weights = weights / np.where(part.motion > 0, part.motion, 1.0)  # loud modes are no better known
    local = part.rows @ about(part.centre, part.size)
    for i in range(part.values.shape[1]):
        q = np.linalg.qr(local * weights[:, i, None])[0]
        yield part.values[:, i] * weights[:, i], np.eye(len(local)) - q @ q.T


def _doubt_of(name: str, labels: tuple[str, ...], best: int, rivals: list[int], *, factor: float, ratio: float) -> Doubt:
    """Return the doubt on a channel; factor : by which its values must be multiplied."""
    others = f", or {' or '.join(labels[i] for i in rivals[:3])} as well" if rivals else ""
    is_turned = TURNED_FACTORS[0] < factor < TURNED_FACTORS[1]
    change = "turned round" if is_turned else f"multiplied by {factor:.3g}"
    cause = "its calibration is wrong, or it is another channel"
    if is_turned:
        cause = "the sensor points the other way than labelled"
    return Doubt(f"channel {labels[best]}", f"{change}, {name} moves as one body {ratio:.2g} times better{others}: {cause}",
                 "check mounting, label and calibration, and correct the records", figure=factor)
