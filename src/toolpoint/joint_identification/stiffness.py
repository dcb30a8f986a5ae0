r"""Joint stiffness from modal data when the masses of the components are known.

With joint coordinates q, mass matrix M(q) of the rigid components in them and a diagonal K, every mode obeys
:math:`K q_r = \omega_r^2 M q_r` (Ewins, Modal Testing, 2nd ed., section 2.3), line by line
:math:`k_j q_{jr} = \omega_r^2 (M q_r)_j`. Each line is linear in one k_j and free of the scale of the mode; the lines of all
modes are weighted by the variance of their misfit (effective variance: Orear, Am. J. Phys. 50 (1982) 912), less the bias
that noise in q_jr brings. A general joint has a full matrix over its free twists, see `stiffness_matrix`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from toolpoint._check import FloatArray, fail, floats, positive, symmetric
from toolpoint.joint_identification import stiffness_matrix
from toolpoint.joint_identification.estimate import JointEstimate, free_twists, joint_frame
from toolpoint.joint_identification.joint_fit import JointFit
from toolpoint.joint_identification.measured import Component, about
from toolpoint.joint_identification.relative_motion import RelativeMotion
from toolpoint.joint_identification.rigid_motion import RigidMotion
from toolpoint.vibration import Modes

# Of the single lines (n, k), and of the matrices of general joints, (k, f, f) each.
_Weights = tuple[FloatArray, list[FloatArray]]


@dataclass(frozen=True, eq=False)
class ComponentMass:
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
    def joined(cls, parts: Sequence[ComponentMass]) -> ComponentMass:
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
class _Equations:
    """What the stiffness is computed from, and how the joints' parameters follow from the twists."""

    omega: FloatArray
    tree: tuple[tuple[str, str], ...]
    names: tuple[str, ...]
    twists: FloatArray
    covariance: FloatArray
    whole: FloatArray
    matrices: FloatArray
    relatives: tuple[RelativeMotion, ...]
    fits: tuple[JointFit, ...]


def stiffnesses(
    modes: Modes, parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], *, relatives: Sequence[RelativeMotion],
    joints: Sequence[JointEstimate], fits: Sequence[JointFit], masses: Mapping[str, ComponentMass],
) -> list[JointEstimate]:
    """Return the joints with the stiffness of every freedom and its standard deviation.

    The deviation holds the noise of the shapes, also through the positions and directions of all joints, and that of the
    frequencies where their covariance is known; the masses count as exact.
    """
    _check(modes, parts, joints, masses)
    names = tuple(parts)
    data = _Equations(
        modes.omega, tuple((joint.parent, joint.child) for joint in joints), names,
        np.stack([motions[name].twist.T for name in names]), np.stack([motions[name].covariance for name in names]),
        np.stack([motions[name].whole for name in names]),
        np.stack([masses[name].matrix for name in names]), tuple(relatives), tuple(fits))
    value, weights = _value(data, data.twists, data.omega, None)
    covariance = _covariance(data, weights, modes)
    result = _with(joints, value, np.sqrt(np.diag(covariance)), _misfit(data, value, weights))
    return _with_matrices(data, result, value, weights, covariance)


def _check(modes: Modes, parts: Mapping[str, Component], joints: Sequence[JointEstimate],
           masses: Mapping[str, ComponentMass]) -> None:
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
            result.append(joint)
            continue
        k, spread = value[part], deviation[part]
        doubts = list(joint.doubts)
        for name, estimate, sd, miss in zip(joint.freedoms, k, spread, misfit[part], strict=True):
            if miss > 0:
                doubts.append(f"one stiffness {name} leaves {100 * miss:.2g} % of the moment or force unexplained: check the "
                              "masses; the joint's principal directions may lie off its frame")
            if not sd < 0.2 * abs(estimate):
                doubts.append(f"stiffness {name} is known within {200 * sd / max(abs(estimate), 1e-300):.0f} % only")
            if estimate <= 0:
                doubts.append(f"stiffness {name} comes out negative: check masses and frequencies")
        result.append(replace(joint, stiffness=k, stiffness_deviation=spread, doubts=tuple(doubts)))
    return result


def _with_matrices(data: _Equations, joints: Sequence[JointEstimate], value: FloatArray, weights: _Weights,
                   covariance: FloatArray
                   ) -> list[JointEstimate]:
    """Return the joints, general ones with their matrix where the data decide it."""
    lines, result = _lines(data, data.twists, data.omega), list(joints)
    at = lines.q.shape[1]
    for j, (block, weight) in zip(_general(data), _blocks(data, lines, weights), strict=True):
        entries = stiffness_matrix.symmetric_entries(block.q.shape[1])
        part = slice(at, at + entries.shape[2])
        at, joint, why = part.stop, joints[j], stiffness_matrix.fault(block)
        if why:
            result[j] = replace(joint, doubts=(*joint.doubts, why))
            continue
        matrix, spread = entries @ value[part], covariance[part, part]
        doubts = stiffness_matrix.doubts(block, matrix, weight, covariance=spread)
        result[j] = replace(joint, stiffness_matrix=matrix, stiffness_matrix_deviation=entries @ np.sqrt(np.diag(spread)),
                            doubts=(*joint.doubts, *doubts))
    return result


def _bases(data: _Equations, thetas: Sequence[FloatArray]) -> list[FloatArray]:
    result = []
    for motion, fit, theta in zip(data.relatives, data.fits, thetas, strict=True):
        frame, names = joint_frame(fit.kind, fit.chart.place(theta)[1])
        if fit.kind == "general":
            # Of the span at theta the twists nearest to those that were found: a basis of its own would turn within it.
            place = about(motion.centre, motion.size)
            here, there = (np.linalg.qr(place @ fit.chart.basis(t))[0] for t in (fit.theta, theta))
            result.append(there @ (there.T @ here))
        else:
            result.append(free_twists(motion, replace(fit, theta=theta), frame, names=names))
    return result


def _jacobians(data: _Equations, bases: Sequence[FloatArray]) -> FloatArray:
    """Return the maps (n_components, 6, n) from all joint coordinates to the twist of every component."""
    total = sum(base.shape[1] for base in bases)
    starts = np.cumsum([0, *(base.shape[1] for base in bases)])
    index = {child: i for i, (_, child) in enumerate(data.tree)}
    above = {child: parent for parent, child in data.tree}
    result = np.zeros((len(data.names), 6, total))
    for c, name in enumerate(data.names):
        at = name
        while at in index:
            i = index[at]
            result[c, :, starts[i]:starts[i + 1]] = bases[i]
            at = above[at]
    return result


def _general(data: _Equations) -> list[int]:
    return [j for j, fit in enumerate(data.fits) if fit.kind == "general"]


def _lines(data: _Equations, twists: FloatArray, omega: FloatArray) -> stiffness_matrix.Lines:
    """Return the coordinates of all joints, the forces on them and their noise, for these twists."""
    jacobians = _jacobians(data, _bases(data, [_theta(data, twists, j) for j in range(len(data.fits))]))
    q, spread = _coordinates(data, jacobians, twists)
    mass = np.einsum("cia,cij,cjb->ab", jacobians, data.matrices, jacobians)
    square = omega**2
    return stiffness_matrix.Lines(q, square[:, None] * (q @ mass), spread, slice(0, q.shape[1]), mass, square)


def _blocks(data: _Equations, lines: stiffness_matrix.Lines, weights: _Weights) -> list[
        tuple[stiffness_matrix.Lines, FloatArray]]:
    """Return the lines of every general joint and their weights."""
    ends = np.cumsum([0, *(fit.chart.freedoms for fit in data.fits)])
    parts = [slice(int(ends[j]), int(ends[j + 1])) for j in _general(data)]
    blocks = [replace(lines, q=lines.q[:, p], force=lines.force[:, p], own=p, mass=lines.mass[p]) for p in parts]
    return list(zip(blocks, weights[1], strict=True))


def _value(data: _Equations, twists: FloatArray, omega: FloatArray, weights: _Weights | None) -> tuple[FloatArray, _Weights]:
    """Return (stiffnesses (n,) followed by the upper triangles of matrices, weights), weights found where none are given."""
    lines = _lines(data, twists, omega)
    k, weight = _diagonal(lines, None if weights is None else weights[0])
    given: list[FloatArray] = [np.zeros(0)] * len(_general(data)) if weights is None else weights[1]
    values, matrices = [k], []
    for block, stiffness in _blocks(data, lines, (weight, given)):
        if weights is None:
            matrix, new = stiffness_matrix.identify_matrix(block)
        else:
            matrix, new = stiffness_matrix.solve(block, stiffness), stiffness
        values.append(matrix[np.triu_indices(len(matrix))])
        matrices.append(new)
    return np.concatenate(values), (weight, matrices)


def _diagonal(lines: stiffness_matrix.Lines, weights: FloatArray | None) -> tuple[FloatArray, FloatArray]:
    """Return (stiffness (n,), weights (n, k)), each line on its own; the weights are found where none are given."""
    n, noise = lines.q.shape[1], np.einsum("kjj->kj", lines.spread)
    cross = lines.square[:, None] * np.einsum("ja,kaj->kj", lines.mass, lines.spread)
    weight = 1 / np.maximum(noise.T, 1e-300) if weights is None else weights
    for _ in range(4 if weights is None else 1):
        top = (weight.T * (lines.q * lines.force - cross)).sum(axis=0)
        k = top / (weight.T * (lines.q**2 - noise)).sum(axis=0)
        if weights is None:
            miss = lines.square[:, None, None] * lines.mass[None] - k[:, None] * np.eye(n)
            weight = 1 / np.maximum(np.einsum("kja,kab,kjb->jk", miss, lines.spread, miss), 1e-300)
    return k, weight


def _misfit(data: _Equations, value: FloatArray, weights: _Weights) -> FloatArray:
    """Return for every freedom the share of omega^2 M q that k q leaves; 0 where noise explains it or it is below 5 %."""
    lines, weight = _lines(data, data.twists, data.omega), weights[0]
    chi2 = (weight.T * (lines.force - value[:lines.q.shape[1]] * lines.q) ** 2).sum(axis=0)
    share = np.sqrt(chi2 / (weight.T * lines.force**2).sum(axis=0))
    chance = stats.chi2.sf(chi2, max(len(data.omega) - 1, 1))
    return np.where((share > 0.05) & (chance < 1e-6), share, 0.0)


def _theta(data: _Equations, twists: FloatArray, joint: int) -> FloatArray:
    """Return the parameters of a joint for changed twists, to first order."""
    parent, child = data.tree[joint]
    fit, motion = data.fits[joint], data.relatives[joint]
    change = (twists - data.twists)
    relative = change[data.names.index(child)] - (change[data.names.index(parent)] if parent in data.names else 0)
    local = np.linalg.solve(about(motion.centre, motion.size), relative.T).T
    return fit.theta + np.einsum("pkj,kj->p", fit.gain, local)


def _coordinates(data: _Equations, jacobians: FloatArray, twists: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the joint coordinates (k, n) of every mode and their covariance (k, n, n)."""
    weight = np.linalg.inv(data.covariance)
    normal = np.einsum("cia,ckij,cjb->kab", jacobians, weight, jacobians)
    right = np.einsum("cia,ckij,ckj->ka", jacobians, weight, twists)
    spread = np.linalg.inv(normal)
    return np.einsum("kab,kb->ka", spread, right), spread


def _covariance(data: _Equations, weights: _Weights, modes: Modes) -> FloatArray:
    # Differences at the same weights: with them free, matrices would be a nonlinear search for every step.
    value = _value(data, data.twists, data.omega, weights)[0]
    slope = np.zeros((len(value), *data.twists.shape))
    roots = np.linalg.cholesky(data.covariance)
    for c, k, j in np.ndindex(data.twists.shape):
        step = np.zeros(data.twists.shape)
        step[c, k] = 0.1 * roots[c, k, :, j]
        slope[:, c, k, j] = (_value(data, data.twists + step, data.omega, weights)[0] - value) / 0.1
    # Steps are standard deviations of one column; their covariance between columns in that measure.
    back = np.linalg.inv(roots)
    between = np.einsum("ckia,ckalb,cljb->ckilj", back, data.whole, back)
    result = np.einsum("ncki,ckilj,mclj->nm", slope, between, slope, optimize=True)
    if modes.covariance is not None:
        for k in range(modes.count):
            shift = np.zeros(modes.count)
            shift[k] = 2 * np.pi * np.sqrt(modes.covariance[k, 0, 0])
            change = _value(data, data.twists, data.omega + shift, weights)[0] - value
            result += np.outer(change, change)
    return np.asarray(result)
