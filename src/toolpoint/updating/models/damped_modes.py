r"""Damped modes of a model with their exact derivatives along parameters, for dampers that couple the undamped modes.

In the undamped modes :math:`\psi` (unit modal mass) the poles are those of
:math:`Q(s) = s^2 I + s C + \Omega^2 + i D` with positive imaginary part, from its state matrix. With all 2n right vectors
:math:`u_j` scaled to :math:`u_j^T (2 s_j I + C) u_j = 1`, and :math:`Q'` the derivative of Q along a parameter at fixed s:

.. math::
   s_k' = -u_k^T Q'(s_k) u_k, \qquad
   u_k' = -\sum_{j \ne k} u_j \frac{u_j^T Q'(s_k) u_k}{s_k - s_j} - \tfrac12 u_k\, u_k^T (2 s_k M' + C') u_k .

Every :math:`u^T A' u` comes from the low-rank factors of A'. Source: Adhikari, AIAA J. 37 (1999), written for the symmetric
state form; real modes with the diagonal of the modal damping matrix are the limit of small, even damping.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.linalg

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.updating.models.prediction import Prediction, ShapeSlopes
from toolpoint.updating.models.shape_turns import UndampedModes, Weighted
from toolpoint.vibration import Modes, SecondOrderSystem
from toolpoint.vibration.eigen import clusters

# Undamped modes that are all kept. The state matrix of more is too slow for a fit: the modes beyond move then as dampers push
# them at standstill, which leaves out the square of a frequency over theirs.
MAX_STATE_MODES = 160
# Condition of the products of repeated vectors beyond which they are no basis: a coordinate that is critically damped.
MAX_CLUSTER_CONDITION = 1e7
# Distance of two poles over their size up to which they are one: their vectors turn with a parameter in jumps.
REPEATED_POLE_TOLERANCE = 1e-9
SKEW_TOLERANCE = 1e-12  # symmetric part over a matrix up to which the matrix is skew


def has_damping(system: SecondOrderSystem, factors: Weighted) -> bool:
    """Whether a matrix of damping is not zero, or a parameter moves one: the first damper already makes shapes complex."""
    for name in ("damping", "structural_damping"):
        matrix = getattr(system, name)
        if name in factors:
            return True
        if matrix is not None and not is_skew(matrix):
            return True
    return False


def is_skew(matrix: FloatArray) -> bool:
    """Whether a damping matrix is zero or gyroscopic, (n, n): it takes no energy."""
    return bool(np.abs(matrix + matrix.T).max() <= SKEW_TOLERANCE * np.abs(matrix).max())


def predict_damped_modes(system: SecondOrderSystem, undamped: UndampedModes, keep: int) -> Prediction:
    """Return the `keep` oscillating modes of lowest natural frequency with their derivatives.

    Frequencies are :math:`|s| / 2 \\pi` and damping ratios :math:`-\\Re s / |s|`, as they are identified from responses.
    Shapes are complex; a lightly damped one is nearly real with unit modal mass. Where fewer modes oscillate, overdamped ones
    follow: real poles, of damping ratio 1.

    Raises ToolpointError for modes at 0 Hz or unstable ones.
    """
    damped = _DampedModes(system, undamped, keep)
    poles, size = damped.poles, np.abs(damped.poles)
    if (size <= 0).any() or (poles.real > 1e-6 * size).any():
        fail("model", f"{int(((size <= 0) | (poles.real > 1e-6 * size)).sum())} modes at 0 Hz or unstable",
             "must be held in all directions", remedy="raise the lower bounds of the stiffnesses, or ground the model")
    basis = system.output_map @ undamped.vectors @ damped.subspace
    modes = Modes(size / (2 * np.pi), -poles.real / size, basis @ damped.shapes, system.outputs, "unscaled")
    if not undamped.count:
        return Prediction(modes)
    changes = damped.pole_slopes
    along = np.real(poles.conj() * changes) / size
    ratio_slopes = -changes.real / size + poles.real * along / size**2
    return Prediction(modes, None, along / (2 * np.pi), ratio_slopes, ShapeSlopes(basis, damped.shape_slopes, damped.shapes))


class _DampedModes:
    """Poles (keep,), shapes (m, keep) in a subspace (n, m) of the undamped modes, and derivatives of both."""

    def __init__(self, system: SecondOrderSystem, undamped: UndampedModes, keep: int) -> None:
        self.undamped = undamped
        # The skew part of a damping matrix is gyroscopic: these are the modes at standstill, as the matrices' slopes are.
        modal = {name: undamped.vectors.T @ (matrix + matrix.T) @ undamped.vectors / 2
                 for name in ("damping", "structural_damping") if (matrix := getattr(system, name)) is not None}
        self.subspace = _subspace(undamped.squares, modal)
        size = self.subspace.shape[1]
        projected = {name: self.subspace.T @ matrix @ self.subspace for name, matrix in modal.items()}
        stiffness = self.subspace.T @ (undamped.squares[:, None] * self.subspace)
        if "structural_damping" in projected:
            stiffness = stiffness + 1j * projected["structural_damping"]
        self.damping = projected.get("damping", np.zeros((size, size)))
        all_poles, vectors = _scaled_pairs(self.damping, stiffness)
        self.every_pole, self.every_vector = all_poles, vectors
        self.places = _lowest(all_poles, keep)
        self.poles = all_poles[self.places]
        # Unit modal mass of a mode without damping, where u^T (2 s) u = 1 is u^T u = 1 / 2 s.
        self.lengths = np.sqrt(2 * self.poles)
        self.shapes = vectors[:, self.places] * self.lengths

    @cached_property
    def _forms(self) -> tuple[ComplexArray, ComplexArray]:
        """u_j^T Q'(s_k) u_k, (count, 2m, keep), and u_k^T (2 s_k M' + C') u_k, (count, keep)."""
        all_poles, kept, poles = self.every_vector, self.places, self.poles
        forms = np.zeros((self.undamped.count, all_poles.shape[1], kept.size), complex)
        growth = np.zeros((self.undamped.count, kept.size), complex)
        each = np.arange(kept.size)
        scales = {"stiffness": np.ones_like(poles), "damping": poles, "mass": poles**2, "structural_damping": 1j + 0 * poles}
        growth_scales = {"damping": np.ones_like(poles), "mass": 2 * poles}
        coordinates = self.undamped.vectors @ self.subspace
        for name, (factor, weights) in self.undamped.factors.items():
            sensed = factor.seen(coordinates) @ all_poles
            product = (sensed * weights[:, :, None]).swapaxes(1, 2) @ sensed[:, :, kept]
            forms[factor.used] += product * scales[name]
            if name in growth_scales:
                growth[factor.used] += product[:, kept, each] * growth_scales[name]
        return forms, growth

    @cached_property
    def pole_slopes(self) -> ComplexArray:
        """Derivatives of the poles, (count, keep)."""
        return -self._forms[0][:, self.places, np.arange(self.places.size)]

    @cached_property
    def shape_slopes(self) -> ComplexArray:
        """Derivatives of the shapes in the subspace, (m, keep, count)."""
        forms, growth = self._forms
        each = np.arange(self.places.size)
        distance = self.poles - self.every_pole[:, None]
        size = np.maximum(np.abs(self.poles), np.abs(self.every_pole[:, None]))
        distance[np.abs(distance) <= REPEATED_POLE_TOLERANCE * size] = np.inf
        parts = -forms / distance
        parts[:, self.places, each] = -growth / 2
        turned = np.einsum("mj,pjk->mkp", self.every_vector, parts)
        scale = (self.pole_slopes / (2 * self.poles)).T
        return np.asarray(self.lengths[:, None] * (turned + self.every_vector[:, self.places, None] * scale))


def _subspace(squares: FloatArray, modal: dict[str, FloatArray]) -> FloatArray:
    """Return orthonormal coordinates to keep, (n, m): the lowest modes, and how dampers push the others at standstill."""
    count = squares.size
    if count <= MAX_STATE_MODES:
        return np.eye(count)
    lowest_count = MAX_STATE_MODES // 2
    columns = []
    for matrix in modal.values():
        values, vectors = np.linalg.eigh(matrix)
        strong = np.abs(values) > 1e-10 * np.abs(values).max(initial=0.0)
        columns.append(vectors[lowest_count:, strong] / squares[lowest_count:, None])
    pushed, sizes, _ = np.linalg.svd(np.concatenate(columns, axis=1), full_matrices=False)
    pushed = pushed[:, sizes > 1e-10 * sizes.max(initial=0.0)]
    result = np.zeros((count, lowest_count + pushed.shape[1]))
    result[:lowest_count, :lowest_count] = np.eye(lowest_count)
    result[lowest_count:, lowest_count:] = pushed
    return result


def _scaled_pairs(damping: FloatArray, stiffness: FloatArray | ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return all 2m poles of s^2 + s C + K and their vectors (m, 2m), scaled to u_j^T (s_i + s_j + C) u_i = delta_ij."""
    size = len(damping)
    companion = np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -damping]])
    poles, states = np.linalg.eig(companion)
    poles, states = poles.astype(complex), states.astype(complex)
    order = np.argsort(np.abs(poles), kind="stable")
    poles, states = poles[order], states[:, order]
    for cluster in clusters(poles):
        part = states[:, cluster]
        if len(cluster) > 1:
            part = _aligned(part, size)
        gram = part[:size].T @ damping @ part[:size] + part[:size].T @ part[size:] + part[size:].T @ part[:size]
        if len(cluster) > 1 and np.linalg.cond(gram) < MAX_CLUSTER_CONDITION:
            states[:, cluster] = part @ np.linalg.inv(scipy.linalg.sqrtm((gram + gram.T) / 2))
        else:
            states[:, cluster] = part / np.sqrt(np.diagonal(gram) + 1e-300)
    return poles, states[:size]


def _aligned(states: ComplexArray, size: int) -> ComplexArray:
    """Return vectors of a repeated pole, each along one undamped mode as far as they can be.

    The solver returns any basis of them, another one for every rounding; undamped modes are the same for the same matrices.
    """
    _, _, order = scipy.linalg.qr(states[:size].T, pivoting=True, mode="economic")
    rows = np.sort(order[:states.shape[1]])
    if np.linalg.cond(states[rows]) > MAX_CLUSTER_CONDITION:
        return states
    return states @ np.linalg.inv(states[rows])


def _lowest(poles: ComplexArray, keep: int) -> np.ndarray:
    """Return the places of the lowest upper poles; real ones follow only where there are too few others. `poles` by size."""
    oscillating = np.flatnonzero(poles.imag > 1e-9 * np.abs(poles))
    overdamped = np.flatnonzero(np.abs(poles.imag) <= 1e-9 * np.abs(poles))
    return np.concatenate([oscillating, overdamped])[:keep]
