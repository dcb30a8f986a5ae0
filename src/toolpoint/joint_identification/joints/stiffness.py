r"""Masses of components, and a first joint stiffness from modal data in closed form: where the fit of the machine starts.

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

_LINEAR_SHARE = 0.5  # of a second moment of mass: down to it a change enters as it is


@dataclass(frozen=True, eq=False)
class ComponentMass(NotebookText):
    """`mass` (kg), `centre` (3,) of mass (m) and `inertia` (3, 3) about it (kg m^2), all in the machine frame.

    `mass_deviation` is the standard deviation of the mass as a share of it (the inertia goes with the mass),
    `inertia_deviation` that of each principal moment beside it, `centre_deviation` that of each coordinate of the centre, m.
    """

    mass: float
    centre: ArrayLike
    inertia: ArrayLike
    mass_deviation: float = 0.0
    inertia_deviation: float = 0.0
    centre_deviation: float = 0.0

    def __post_init__(self) -> None:
        positive("MassProperties.mass", self.mass)
        object.__setattr__(self, "centre", floats("MassProperties.centre", self.centre, (3,)))
        inertia = symmetric("MassProperties.inertia", floats("MassProperties.inertia", self.inertia, (3, 3)))
        if np.linalg.eigvalsh(inertia)[0] < 0:
            fail("MassProperties.inertia", "a negative principal moment", "must not be negative")
        object.__setattr__(self, "inertia", inertia)
        for name in ("mass_deviation", "inertia_deviation", "centre_deviation"):
            nonnegative(f"MassProperties.{name}", np.asarray(getattr(self, name), float))

    @property
    def matrix(self) -> FloatArray:
        """Mass matrix (6, 6) for twists (v, w) about the origin of the machine."""
        x, y, z = np.asarray(self.centre)
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return np.block([[self.mass * np.eye(3), -self.mass * k], [self.mass * k, self.inertia - self.mass * k @ k]])

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of what `changed` takes: relative mass, centre x y z (m), three relative moments."""
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
        return f"MassProperties({self.mass:g} kg at {np.array2string(np.asarray(self.centre), precision=3)} m)"


def _physical_moments(before: FloatArray, changed: FloatArray) -> FloatArray:
    """Return changed principal moments (3,) whose second moments of mass are not negative, where those before were not.

    A second moment above half of what it was stays as changed; below, it decays exponentially with the same slope.
    """
    first, second = (np.maximum(part.sum() / 2 - part, floor) for part, floor in ((before, 0.0), (changed, -np.inf)))
    low = second < _LINEAR_SHARE * first
    if not low.any() and (second >= 0).all():
        return changed
    share = np.where(first > 0, second / np.where(first > 0, first, 1.0), -np.inf)
    decayed = first * _LINEAR_SHARE * np.exp(np.minimum(share / _LINEAR_SHARE - 1.0, 0.0))
    held = np.where(low | (second < 0), decayed, second)
    return np.asarray(held.sum() - held)


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
    # Coordinates that a mode does not tell (a lightly weighed joint) must not stop the others.
    spread = np.linalg.pinv(normal, rcond=1e-13, hermitian=True)
    q = np.einsum("kab,kb->ka", spread, right)
    lines = stiffness_matrix.Lines(q, omega[:, None] ** 2 * (q @ mass), spread, slice(0, q.shape[1]), mass, omega**2)
    result, at = [], 0
    for size in sizes:
        part = slice(at, at + size)
        at = part.stop
        block = stiffness_matrix.Lines(q[:, part], lines.force[:, part], spread, part, mass[part], omega**2)
        result.append(_positive_matrix(block, _diagonal(lines, part)))
    return result


def _diagonal(lines: stiffness_matrix.Lines, part: slice) -> FloatArray:
    """Return the stiffness of every line alone, with the bias that noise in q brings taken off."""
    noise = np.einsum("kjj->kj", lines.spread)
    cross = lines.square[:, None] * np.einsum("ja,kaj->kj", lines.mass, lines.spread)
    weight, k = 1 / np.maximum(noise, 1e-300), np.zeros(lines.q.shape[1])
    for _ in range(4):
        k = (weight * (lines.q * lines.force - cross)).sum(axis=0) / (weight * (lines.q**2 - noise)).sum(axis=0)
        miss = lines.square[:, None, None] * lines.mass[None] - k[:, None] * np.eye(len(k))
        weight = 1 / np.maximum(np.einsum("kja,kab,kjb->kj", miss, lines.spread, miss, optimize=True), 1e-300)
    typical = np.abs(lines.square.mean() * np.diag(lines.mass))
    return np.where(k[part] > 1e-6 * typical[part], k[part], 0.1 * typical[part])


def _positive_matrix(block: stiffness_matrix.Lines, diagonal: FloatArray) -> FloatArray:
    if len(diagonal) < 2 or stiffness_matrix.seen_ways(block) < len(diagonal):
        return np.diag(diagonal)
    matrix = np.diag(diagonal)
    try:
        for _ in range(4):
            matrix = stiffness_matrix.solve(block, block.weights(matrix))
    except np.linalg.LinAlgError:
        return np.diag(diagonal)
    scale = np.sqrt(diagonal)
    values = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
    return matrix if values[0] > 1e-3 and values[-1] < 1e3 else np.diag(diagonal)
