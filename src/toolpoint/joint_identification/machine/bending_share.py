"""Bending of components as a fraction of the deflection that a fit attributes to the joints beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from toolpoint._check import BoolArray, FloatArray
from toolpoint.joint_identification.joints.joint_fit import Criterion
from toolpoint.joint_identification.motion.measured import Component
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion

MIN_UNEVENNESS = 3.0  # residual of a mode over the least of all modes, from which it is no noise where that is not known
MAX_COMMON_EXCESS = 4.0  # mean square over stated noise of a mode's residual at all components, that is noise of the mode
MIN_COMMON_PVALUE = 1e-3  # of an F-test, from which a component's residual is that of the others
MIN_EXCESS = 2.0  # mean square of a residual over its known noise, from which it is no noise


@dataclass(frozen=True, eq=False)
class BendingShare:
    """Bending that a fit attributes to joints.

    joints : standard deviation of the logarithm of the stiffnesses of every child's joint; lowered (k,) : fraction by which
    bending lowers the square of the frequency of every mode of the fit.
    """

    joints: Mapping[str, float]
    lowered: FloatArray


def bending_share(parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], relatives: Sequence[RelativeMotion], *,
                  frequency: FloatArray, kept: Sequence[int], criterion: Criterion) -> BendingShare | None:
    """Return the fraction of bending components in the deflection of the joints beside them; None where none bends.

    A component that bends is a spring in line with its joints: it takes its bending over the joint's own deflection. That may
    be little beside the motion of the component, which its other joints carry along.

    Parameters
    ----------
    frequency : (n_modes,) floats
        Of the measured modes, Hz.
    kept : sequence of int
        The modes of the fit.
    """
    count = frequency.size
    noisy = noisy_modes(parts, motions, count)
    bent = {name: _bent(motions, name, parts[name], noisy=noisy[name], criterion=criterion) for name in motions}
    loud = {name: noisy[name] & (motion.excess.reshape(-1, count).mean(axis=0) > MIN_EXCESS)
            for name, motion in motions.items()}
    no_mode = np.zeros(count, bool)
    if not any(values.any() for values in bent.values()):
        return None
    joints, largest, deflection = dict[str, float](), np.zeros(count), np.zeros(count)
    for pair in relatives:
        relative = _by_mode(parts[pair.child].rows @ pair.twist, count)
        bending = np.maximum(bent[pair.child], bent.get(pair.parent, 0.0))
        deflection, largest = np.maximum(deflection, relative), np.maximum(largest, bending)
        share = np.minimum(bending / np.maximum(relative, 1e-300), 1.0)
        share = _shared_with_loud(share, loud[pair.child] | loud.get(pair.parent, no_mode))
        # A stiffness is told by the modes whose frequency it moves most: by (deflection / frequency) squared.
        weight = ((relative / frequency) ** 2)[list(kept)] ** 2
        joints[pair.child] = float(np.sqrt((weight * share[list(kept)] ** 2).sum() / max(float(weight.sum()), 1e-300)))
    lowered = np.minimum(largest / np.maximum(deflection, 1e-300), 1.0)[list(kept)]
    return BendingShare(joints, np.asarray(lowered))


def _shared_with_loud(share: FloatArray, loud: BoolArray) -> FloatArray:
    """Return the shares (n_modes,) of a joint's deflection with that of loud modes taken from the others.

    A component and its joint are springs in line: the same force deflects both, so the share is alike in the modes that load
    them, and one mode whose noise hides it does not make it nothing.
    """
    if not loud.any() or loud.all():
        return share
    return np.where(loud, np.maximum(share, np.sqrt((share[~loud] ** 2).mean())), share)


def noisy_modes(parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], count: int) -> dict[str, BoolArray]:
    """Return, of every component, the modes (n_modes,) whose residual is noise by its phase.

    What bends moves in phase with its component, but for the loss of its material. An error of a point's response, such as
    that of the force of its blows, which is common to its directions, turns the phase as often as it changes the size. So the
    part of all residuals in quadrature measures the noise of a mode, whatever was stated, and a part in phase that an F-test
    does not tell from it is no bending. Real shapes have no quadrature and tell nothing.
    """
    powers = {name: _phase_powers(parts[name], motion, count) for name, motion in motions.items()
              if parts[name].values.shape[1] == 2 * count and parts[name].variance is not None}
    # A point's error is one number for its directions: a third of the rows are independent.
    freedom = {name: max(motions[name].freedom / 3, 1.0) for name in powers}
    total = sum(freedom.values())
    noise = sum((freedom[name] * power[1] for name, power in powers.items()), np.zeros(count)) / max(total, 1.0)
    chance = {name: stats.f.sf(power[0] / np.maximum(noise, 1e-300), freedom[name], total) for name, power in powers.items()}
    significance = MIN_COMMON_PVALUE / max(count, 1)  # each mode is asked
    return {name: np.asarray(chance[name] >= significance) if name in chance else np.zeros(count, bool) for name in motions}


def _phase_powers(part: Component, motion: RigidMotion, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the mean squares (n_modes,) of the residual over its variance, in phase with the motion and in quadrature."""
    moved, shape = part.rows @ motion.twist, part.values
    residual = (shape - moved)[:, :count] + 1j * (shape - moved)[:, count:]
    complex_motion = moved[:, :count] + 1j * moved[:, count:]
    turned = residual * np.exp(-0.5j * np.angle((complex_motion**2).sum(axis=0)))
    if part.variance is not None:
        turned = turned / np.sqrt(0.5 * (part.variance[:, :count] + part.variance[:, count:]))
    in_phase, quadrature = (turned.real**2).sum(axis=0), (turned.imag**2).sum(axis=0)
    return np.asarray(in_phase / motion.freedom), np.asarray(quadrature / motion.freedom)


def _bent(motions: Mapping[str, RigidMotion], name: str, part: Component, *, noisy: BoolArray, criterion: Criterion
          ) -> FloatArray:
    """Return the rms displacement (k,) by which a component bends in every mode, 0 where it is no more than noise."""
    count = noisy.size
    motion = motions[name]
    floor = max(criterion.floor, 1e-3)
    bends = motion.bends(criterion.significance / max(motion.residual.size, 1), floor)
    if part.variance is not None:
        uneven = (motion.excess > MIN_EXCESS) & ~_is_common(motions, name)
    else:
        uneven = motion.residual > MIN_UNEVENNESS * motion.residual.min()
    share = np.where(bends, motion.bending, 0.0)
    # A residual of the rigid motion beyond noise is bending of another shape than a beam's.
    uneven &= ~np.tile(noisy, motion.residual.size // count)
    share = np.where(uneven & (motion.residual > floor), np.maximum(share, motion.residual), share)
    return _by_mode(part.values * share, count)


def _is_common(motions: Mapping[str, RigidMotion], name: str) -> BoolArray:
    """Whether the residual of each column is one that the other components show alike: noise of that mode, stated too small."""
    others = [motion for other, motion in motions.items() if other != name]
    freedom = sum(motion.freedom for motion in others)
    if not freedom:
        return np.zeros(motions[name].excess.size, bool)
    pooled = np.sum([motion.freedom * motion.excess for motion in others], axis=0) / freedom
    noise = np.maximum(pooled, 1.0)
    chance = stats.f.sf(motions[name].excess / noise, motions[name].freedom, freedom)
    return np.asarray((noise < MAX_COMMON_EXCESS) & (chance >= MIN_COMMON_PVALUE))


def _by_mode(values: FloatArray, count: int) -> FloatArray:
    """Return the rms over rows of every mode, real and imaginary columns together."""
    power = (values**2).mean(axis=0)
    return np.asarray(np.sqrt(power.reshape(-1, count).sum(axis=0)))
