"""Bending of components as a fraction of the deflection that a fit attributes to the joints beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.joint_identification.joints.joint_fit import Criterion
from toolpoint.joint_identification.motion.measured import Component
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion

MIN_UNEVENNESS = 3.0  # residual of a mode over the least of all modes, from which it is no noise where that is not known
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
    bent = {name: _bent(motion, parts[name], count, criterion) for name, motion in motions.items()}
    if not any(values.any() for values in bent.values()):
        return None
    joints, largest, deflection = dict[str, float](), np.zeros(count), np.zeros(count)
    for pair in relatives:
        relative = _by_mode(parts[pair.child].rows @ pair.twist, count)
        bending = np.maximum(bent[pair.child], bent.get(pair.parent, 0.0))
        deflection, largest = np.maximum(deflection, relative), np.maximum(largest, bending)
        share = np.minimum(bending / np.maximum(relative, 1e-300), 1.0)
        # A stiffness is told by the modes whose frequency it moves most: by (deflection / frequency) squared.
        weight = ((relative / frequency) ** 2)[list(kept)] ** 2
        joints[pair.child] = float(np.sqrt((weight * share[list(kept)] ** 2).sum() / max(float(weight.sum()), 1e-300)))
    lowered = np.minimum(largest / np.maximum(deflection, 1e-300), 1.0)[list(kept)]
    return BendingShare(joints, np.asarray(lowered))


def _bent(motion: RigidMotion, part: Component, count: int, criterion: Criterion) -> FloatArray:
    """Return the rms displacement (k,) by which a component bends in every mode, 0 where it is no more than noise."""
    floor = max(criterion.floor, 1e-3)
    bends = motion.bends(criterion.significance / max(motion.residual.size, 1), floor)
    if part.variance is not None:
        uneven = motion.excess > MIN_EXCESS
    else:
        uneven = motion.residual > MIN_UNEVENNESS * motion.residual.min()
    share = np.where(bends, motion.bending, 0.0)
    # A residual of the rigid motion beyond noise is bending of another shape than a beam's.
    share = np.where(uneven & (motion.residual > floor), np.maximum(share, motion.residual), share)
    return _by_mode(part.values * share, count)


def _by_mode(values: FloatArray, count: int) -> FloatArray:
    """Return the rms over rows of every mode, real and imaginary columns together."""
    power = (values**2).mean(axis=0)
    return np.asarray(np.sqrt(power.reshape(-1, count).sum(axis=0)))
