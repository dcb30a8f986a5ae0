r"""Joint stiffness from modal data when the masses of the components are known.

With joint coordinates q, mass matrix M(q) of the rigid components in them and a diagonal K, every mode obeys
:math:`K q_r = \omega_r^2 M q_r` (Ewins, Modal Testing, 2nd ed., section 2.3), line by line
:math:`k_j q_{jr} = \omega_r^2 (M q_r)_j`. Each line is linear in one k_j and free of the scale of the mode; the lines of all
modes are weighted by the variance of their misfit (effective variance: Orear, Am. J. Phys. 50 (1982) 912), less the bias
that noise in q_jr brings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from toolpoint._check import FloatArray, fail, floats, positive, symmetric
from toolpoint.joint_identification.estimate import JointEstimate, free_twists, joint_frame
from toolpoint.joint_identification.joint_fit import Fit
from toolpoint.joint_identification.measured import Component, about
from toolpoint.joint_identification.relative_motion import RelativeMotion
from toolpoint.joint_identification.rigid_motion import RigidMotion
from toolpoint.vibration import Modes


@dataclass(frozen=True, eq=False)
class MassProperties:
    """`mass` (kg), `centre` (3,) of mass (m) and `inertia` (3, 3) about it (kg m^2), all in the machine frame."""

    mass: float
    centre: ArrayLike
    inertia: ArrayLike

    def __post_init__(self) -> None:
        positive("MassProperties.mass", self.mass)
        object.__setattr__(self, "centre", floats("MassProperties.centre", self.centre, (3,)))
        inertia = symmetric("MassProperties.inertia", floats("MassProperties.inertia", self.inertia, (3, 3)))
        if np.linalg.eigvalsh(inertia)[0] < 0:
            fail("MassProperties.inertia", "a negative principal moment", "must not be negative")
        object.__setattr__(self, "inertia", inertia)

    @property
    def matrix(self) -> FloatArray:
        """Mass matrix (6, 6) for twists (v, w) about the origin of the machine."""
        x, y, z = np.asarray(self.centre)
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return np.block([[self.mass * np.eye(3), -self.mass * k], [self.mass * k, self.inertia - self.mass * k @ k]])

    @classmethod
    def joined(cls, parts: Sequence[MassProperties]) -> MassProperties:
        """Return the mass properties of several bodies that ride rigidly together."""
        mass = float(sum(part.mass for part in parts))
        centre = np.sum([part.mass * np.asarray(part.centre) for part in parts], axis=0) / mass
        inertia = np.zeros((3, 3))
        for part in parts:
            d = np.asarray(part.centre) - centre
            inertia += np.asarray(part.inertia) + part.mass * (d @ d * np.eye(3) - np.outer(d, d))
        return cls(mass, centre, inertia)

    def __repr__(self) -> str:
        return f"MassProperties({self.mass:g} kg at {np.array2string(np.asarray(self.centre), precision=3)} m)"


@dataclass(frozen=True, eq=False)
class _Data:
    """What the stiffness is computed from, and how the joints' parameters follow from the twists."""

    omega: FloatArray
    tree: tuple[tuple[str, str], ...]
    names: tuple[str, ...]
    twists: FloatArray
    covariance: FloatArray
    whole: FloatArray
    matrices: FloatArray
    relatives: tuple[RelativeMotion, ...]
    fits: tuple[Fit, ...]


def stiffnesses(
    modes: Modes, parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], relatives: Sequence[RelativeMotion],
    joints: Sequence[JointEstimate], fits: Sequence[Fit], masses: Mapping[str, MassProperties],
) -> list[JointEstimate]:
    """Return the joints with the stiffness of every freedom and its standard deviation.

    The deviation holds the noise of the shapes, also through the positions and directions of all joints, and that of the
    frequencies where their covariance is known; the masses count as exact.
    """
    _check(modes, parts, joints, masses)
    names = tuple(parts)
    data = _Data(
        modes.omega, tuple((joint.parent, joint.child) for joint in joints), names,
        np.stack([motions[name].twist.T for name in names]), np.stack([motions[name].covariance for name in names]),
        np.stack([motions[name].whole for name in names]),
        np.stack([masses[name].matrix for name in names]), tuple(relatives), tuple(fits))
    value, weights = _value(data, data.twists, data.omega, None)
    deviation = _deviation(data, value, weights, modes)
    return _with(joints, value, deviation, _misfit(data, value, weights))


def _check(modes: Modes, parts: Mapping[str, Component], joints: Sequence[JointEstimate],
           masses: Mapping[str, MassProperties]) -> None:
    missing = [name for name in parts if name not in masses]
    if missing:
        fail("masses", f"none for {missing}", "must be given for every component")
    if np.iscomplexobj(modes.shape):
        fail("modes", "complex shapes", "must be real for a stiffness", "use modal_identification.real_modes first")
    if all(joint.parent != "ground" for joint in joints):
        fail("chain", "without ground", "must start at ground for a stiffness", "start the chain with 'ground'")


def _with(joints: Sequence[JointEstimate], value: FloatArray, deviation: FloatArray, misfit: FloatArray
          ) -> list[JointEstimate]:
    result, at = [], 0
    for joint in joints:
        part = slice(at, at + joint.screws.shape[1])
        at = part.stop
        if joint.kind == "general":
            text = ("stiffness not determined: the freedoms of a general joint are no directions of a frame, and a full matrix "
                    "is not identified; those of the other joints do not need it")
            result.append(replace(joint, doubts=(*joint.doubts, text)))
            continue
        k, spread = value[part], deviation[part]
        doubts = list(joint.doubts)
        for name, one, sd, miss in zip(joint.freedoms, k, spread, misfit[part], strict=True):
            if miss > 0:
                doubts.append(f"one stiffness {name} leaves {100 * miss:.2g} % of the moment or force unexplained: check the "
                              "masses; the joint's principal directions may lie off its frame")
            if not sd < 0.2 * abs(one):
                doubts.append(f"stiffness {name} is known within {200 * sd / max(abs(one), 1e-300):.0f} % only")
            if one <= 0:
                doubts.append(f"stiffness {name} comes out negative: check masses and frequencies")
        result.append(replace(joint, stiffness=k, stiffness_deviation=spread, doubts=tuple(doubts)))
    return result


def _bases(data: _Data, thetas: Sequence[FloatArray]) -> list[FloatArray]:
    result = []
    for motion, fit, theta in zip(data.relatives, data.fits, thetas, strict=True):
        moved = replace(fit, theta=theta)
        frame, names = joint_frame(fit.kind, fit.chart.place(theta)[1])
        result.append(free_twists(motion, moved, frame, names))
    return result


def _jacobians(data: _Data, bases: Sequence[FloatArray]) -> FloatArray:
    """Return the maps (n_components, 6, n) from all joint coordinates to the twist of every component."""
    total = sum(base.shape[1] for base in bases)
    starts = np.cumsum([0, *(base.shape[1] for base in bases)])
    own = {child: i for i, (_, child) in enumerate(data.tree)}
    above = {child: parent for parent, child in data.tree}
    result = np.zeros((len(data.names), 6, total))
    for c, name in enumerate(data.names):
        at = name
        while at in own:
            i = own[at]
            result[c, :, starts[i]:starts[i + 1]] = bases[i]
            at = above[at]
    return result


def _value(data: _Data, twists: FloatArray, omega: FloatArray, weights: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    """Return (stiffness (n,), weights (n, k)) for these twists; the weights are found where none are given."""
    thetas = [_theta(data, twists, j) for j in range(len(data.fits))]
    jacobians = _jacobians(data, _bases(data, thetas))
    q, spread = _coordinates(data, jacobians, twists)
    mass = np.einsum("cia,cij,cjb->ab", jacobians, data.matrices, jacobians)
    force = omega[:, None] ** 2 * (q @ mass)
    n = q.shape[1]
    noise = np.einsum("kjj->kj", spread)
    cross = omega[:, None] ** 2 * np.einsum("ja,kaj->kj", mass, spread)
    wanted = weights is None
    weight = 1 / np.maximum(noise.T, 1e-300) if weights is None else weights
    for _ in range(4 if wanted else 1):
        top = (weight.T * (q * force - cross)).sum(axis=0)
        k = top / (weight.T * (q * q - noise)).sum(axis=0)
        if wanted:
            miss = omega[:, None, None] ** 2 * mass[None] - k[:, None] * np.eye(n)
            weight = 1 / np.maximum(np.einsum("kja,kab,kjb->jk", miss, spread, miss), 1e-300)
    return k, weight


def _misfit(data: _Data, k: FloatArray, weights: FloatArray) -> FloatArray:
    """Return for every freedom the share of omega^2 M q that k q leaves; 0 where noise explains it or it is below 5 %."""
    jacobians = _jacobians(data, _bases(data, [fit.theta for fit in data.fits]))
    q, _ = _coordinates(data, jacobians, data.twists)
    mass = np.einsum("cia,cij,cjb->ab", jacobians, data.matrices, jacobians)
    force = data.omega[:, None] ** 2 * (q @ mass)
    chi2 = (weights.T * (force - k * q) ** 2).sum(axis=0)
    share = np.sqrt(chi2 / (weights.T * force**2).sum(axis=0))
    chance = stats.chi2.sf(chi2, max(len(data.omega) - 1, 1))
    return np.where((share > 0.05) & (chance < 1e-6), share, 0.0)


def _theta(data: _Data, twists: FloatArray, joint: int) -> FloatArray:
    """Return the parameters of a joint for changed twists, to first order."""
    parent, child = data.tree[joint]
    fit, motion = data.fits[joint], data.relatives[joint]
    change = (twists - data.twists)
    relative = change[data.names.index(child)] - (change[data.names.index(parent)] if parent in data.names else 0)
    local = np.linalg.solve(about(motion.centre, motion.size), relative.T).T
    return fit.theta + np.einsum("pkj,kj->p", fit.gain, local)


def _coordinates(data: _Data, jacobians: FloatArray, twists: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the joint coordinates (k, n) of every mode and their covariance (k, n, n)."""
    weight = np.linalg.inv(data.covariance)
    normal = np.einsum("cia,ckij,cjb->kab", jacobians, weight, jacobians)
    right = np.einsum("cia,ckij,ckj->ka", jacobians, weight, twists)
    spread = np.linalg.inv(normal)
    return np.einsum("kab,kb->ka", spread, right), spread


def _deviation(data: _Data, value: FloatArray, weights: FloatArray, modes: Modes) -> FloatArray:
    slope = np.zeros((len(value), *data.twists.shape))
    roots = np.linalg.cholesky(data.covariance)
    for c, k, j in np.ndindex(data.twists.shape):
        step = np.zeros(data.twists.shape)
        step[c, k] = 0.1 * roots[c, k, :, j]
        slope[:, c, k, j] = (_value(data, data.twists + step, data.omega, weights)[0] - value) / 0.1
    # Steps are standard deviations of one column; their covariance between columns in that measure.
    back = np.linalg.inv(roots)
    between = np.einsum("ckia,ckalb,cljb->ckilj", back, data.whole, back)
    variance = np.einsum("ncki,ckilj,nclj->n", slope, between, slope, optimize=True)
    if modes.covariance is not None:
        for k in range(modes.count):
            shift = np.zeros(modes.count)
            shift[k] = 2 * np.pi * np.sqrt(modes.covariance[k, 0, 0])
            variance += (_value(data, data.twists, data.omega + shift, weights)[0] - value) ** 2
    return np.sqrt(variance)
