r"""Masses of components, and a first joint stiffness from modal data in closed form: the start of the fit of the machine.

With joint coordinates q, mass matrix M of the rigid components in them and a stiffness matrix K of the joint, every mode obeys
:math:`K q_r = \omega_r^2 (M q_r)` (Ewins, Modal Testing, 2nd ed., section 2.3) on the joint's own lines. Each joint is linear
and free of the scale of the modes; see `stiffness_matrix`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, nonnegative, positive, symmetric
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification.joints import stiffness_matrix

_LINEAR_FRACTION = 0.5  # of a second moment of mass: above it a change enters unchanged


@dataclass(frozen=True, eq=False)
class ComponentMass(NotebookText):
    """`mass` (kg), `centre` (3,) of mass (m) and `inertia` (3, 3) about it (kg m^2), all in the machine frame.

    `mass_deviation` is the standard deviation of the mass as a share of it (the inertia goes with the mass),
    `inertia_deviation` that of each principal moment beside it, `centre_deviation` that of each coordinate of the centre, m.

    Examples
    --------
    A head of 400 kg, known to 5 %, with its mass 1.2 m above the origin:

    >>> head = ComponentMass(400.0, [0, 0, 1.2], np.diag([30.0, 30.0, 20.0]), mass_deviation=0.05)
    >>> head.mass * head.mass_deviation
    20.0
    """

    mass: float
    centre: ArrayLike
    inertia: ArrayLike
    mass_deviation: float = 0.0
    inertia_deviation: float = 0.0
    centre_deviation: float = 0.0

    def __post_init__(self) -> None:
        positive("ComponentMass.mass", self.mass)
        object.__setattr__(self, "centre", floats("ComponentMass.centre", self.centre, (3,)))
        inertia = symmetric("ComponentMass.inertia", floats("ComponentMass.inertia", self.inertia, (3, 3)))
        if np.linalg.eigvalsh(inertia)[0] < 0:
            fail("ComponentMass.inertia", "a negative principal moment", "must not be negative")
        object.__setattr__(self, "inertia", inertia)
        for name in ("mass_deviation", "inertia_deviation", "centre_deviation"):
            nonnegative(f"ComponentMass.{name}", np.asarray(getattr(self, name), float))

    @property
    def matrix(self) -> FloatArray:
        """Mass matrix (6, 6) for twists (v, w) about the origin of the machine."""
        x, y, z = np.asarray(self.centre)
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return np.block([[self.mass * np.eye(3), -self.mass * k], [self.mass * k, self.inertia - self.mass * k @ k]])

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of the arguments of `changed`: relative mass, centre x y z (m), three relative moments."""
        return np.array([self.mass_deviation, *[self.centre_deviation] * 3, *[self.inertia_deviation] * 3])

    def changed(self, by: FloatArray) -> ComponentMass:
        """Return the mass with its logarithm, its centre (m) and the logarithms of its principal moments changed.

        Moments stay those of a body: none larger than the sum of the two others. Where the change would break this, the second
        moment of mass along that axis, half the sum of all less the moment, tends to zero instead of below it.
        """
        factor = float(np.exp(by[0]))
        values, axes = np.linalg.eigh(np.asarray(self.inertia))
        moments = _physical_moments(values, values * np.exp(by[4:7]))
        inertia = axes @ np.diag(factor * moments) @ axes.T
        return ComponentMass(self.mass * factor, np.asarray(self.centre) + by[1:4], (inertia + inertia.T) / 2,
                             self.mass_deviation, self.inertia_deviation, self.centre_deviation)

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
        return f"ComponentMass({self.mass:g} kg at {np.array2string(np.asarray(self.centre), precision=3)} m)"


def _physical_moments(original: FloatArray, changed: FloatArray) -> FloatArray:
    """Return changed principal moments (3,) whose second moments of mass are not negative, where those before were not.

    A second moment above half of what it was stays as changed; below, it decays exponentially with the same slope.
    """
    second_original, second_changed = (np.maximum(part.sum() / 2 - part, floor) for part,
                                       floor in ((original, 0.0), (changed, -np.inf)))
    is_low = second_changed < _LINEAR_FRACTION * second_original
    if not is_low.any() and (second_changed >= 0).all():
        return changed
    ratio = np.where(second_original > 0, second_changed / np.where(second_original > 0, second_original, 1.0), -np.inf)
    decayed = second_original * _LINEAR_FRACTION * np.exp(np.minimum(ratio / _LINEAR_FRACTION - 1.0, 0.0))
    second_moments = np.where(is_low | (second_changed < 0), decayed, second_changed)
    return np.asarray(second_moments.sum() - second_moments)


def first_stiffness(
    omega: FloatArray, jacobians: FloatArray, masses: FloatArray, *, sizes: Sequence[int], twists: FloatArray,
    covariance: FloatArray,
) -> list[FloatArray]:
    """Return a stiffness matrix (f, f) for every joint: full where the modes decide it, else its diagonal; always positive.

    Parameters
    ----------
    omega : (k,) rad/s; jacobians : (c, 6, n); masses : (c, 6, 6)
    sizes : freedoms of every joint, n in all
    twists : (c, k, 6), measured motions of the components; covariance : (c, k, 6, 6)
    """
    mass = np.einsum("cia,cij,cjb->ab", jacobians, masses, jacobians)
    weight = np.linalg.inv(covariance)
    normal = np.einsum("cia,ckij,cjb->kab", jacobians, weight, jacobians, optimize=True)
    right = np.einsum("cia,ckij,ckj->ka", jacobians, weight, twists, optimize=True)
    # Coordinates that a mode does not determine (a lightly weighed joint) must not stop the others.
    coordinate_covariance = np.linalg.pinv(normal, rcond=1e-13, hermitian=True)
    q = np.einsum("kab,kb->ka", coordinate_covariance, right)
    lines = stiffness_matrix.Lines(q, omega[:, None] ** 2 * (q @ mass), coordinate_covariance, slice(0, q.shape[1]), mass,
                                   omega**2)
    result, start = [], 0
    for size in sizes:
        joint_rows = slice(start, start + size)
        start = joint_rows.stop
        block = stiffness_matrix.Lines(q[:, joint_rows], lines.force[:, joint_rows], coordinate_covariance, joint_rows,
                                       mass[joint_rows], omega**2)
        result.append(_positive_matrix(block, _diagonal(lines, joint_rows)))
    return result


def _diagonal(lines: stiffness_matrix.Lines, part: slice) -> FloatArray:
    """Return the stiffness of every line alone, without the bias of noise in q."""
    noise = np.einsum("kjj->kj", lines.spread)
    cross = lines.square[:, None] * np.einsum("ja,kaj->kj", lines.mass, lines.spread)
    # Errors in variables: the mean of q^2 holds the noise of q, that of q f its covariance with M q. Both are subtracted,
    # else k is too low. The weights hold k, so they follow it for some rounds.
    weight, k = 1 / np.maximum(noise, 1e-300), np.zeros(lines.q.shape[1])
    for _ in range(4):
        k = (weight * (lines.q * lines.force - cross)).sum(axis=0) / (weight * (lines.q**2 - noise)).sum(axis=0)
        miss = lines.square[:, None, None] * lines.mass[None] - k[:, None] * np.eye(len(k))
        weight = 1 / np.maximum(np.einsum("kja,kab,kjb->kj", miss, lines.spread, miss, optimize=True), 1e-300)
    typical = np.abs(lines.square.mean() * np.diag(lines.mass))
    # Noise can make it negative: a fit needs a positive start.
    return np.where(k[part] > 1e-6 * typical[part], k[part], 0.1 * typical[part])


def _positive_matrix(block: stiffness_matrix.Lines, diagonal: FloatArray) -> FloatArray:
    """Return the full matrix of a joint where the modes determine it and it is positive, else its diagonal."""
    if len(diagonal) < 2 or stiffness_matrix.count_moved_directions(block) < len(diagonal):
        return np.diag(diagonal)
    matrix = np.diag(diagonal)
    try:
        for _ in range(4):
            matrix = stiffness_matrix.solve(block, block.weights(matrix))
    except np.linalg.LinAlgError:
        return np.diag(diagonal)
    # By the diagonal, since N/m and N m/rad do not compare: what is left are pure numbers, 1 where directions are not
    # coupled.
    scale = np.sqrt(diagonal)
    values = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
    return matrix if values[0] > 1e-3 and values[-1] < 1e3 else np.diag(diagonal)
