r"""Exact derivatives of eigenvalues, shapes and frequency responses to parameters that enter M, C and K.

All eigenproblems here are symmetric pencils :math:`(B - \lambda A) z = 0`, :math:`z^T A z = 1`: undamped (A = M, B = K),
structural (B = K + i D) and viscous (the symmetric state pencil), so one derivation serves all three.
Sources: Fox, Kapoor, AIAA J. 6 (1968); repeated roots: Dailey, AIAA J. 27 (1989), for parameters that enter affinely.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.eigen import clusters, mass_normalised, orthogonalise, viscous_pencil
from toolpoint.vibration.system import SecondOrderSystem

EQUAL_ROOT_TOLERANCE = 1e-9  # relative distance of eigenvalues that are differentiated as one repeated root


@dataclass(frozen=True, eq=False)
class MatrixDerivatives(NotebookText):
    """Derivatives of a system's matrices to named parameters.

    Parameters
    ----------
    names : sequence of str
        The parameters, n_p of them.
    mass, damping, stiffness, structural_damping : (..., n_p, n, n) floats, optional
        Derivatives per unit of each parameter; zero where left out.
    """

    names: tuple[str, ...]
    mass: FloatArray | None = None
    damping: FloatArray | None = None
    stiffness: FloatArray | None = None
    structural_damping: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        for name in ("mass", "damping", "stiffness", "structural_damping"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, floats(f"MatrixDerivatives.{name}", value, (len(self.names), None, None)))

    def term(self, name: str) -> FloatArray | float:
        """Return one matrix derivative, or 0.0 where it is left out."""
        value = getattr(self, name)
        return 0.0 if value is None else value

    def __repr__(self) -> str:
        kinds = [n for n in ("mass", "damping", "stiffness", "structural_damping") if getattr(self, n) is not None]
        return f"MatrixDerivatives({len(self.names)} parameters in {', '.join(kinds) or 'nothing'})"


@dataclass(frozen=True, eq=False)
class ModeDerivatives:
    """Derivatives of modes to parameters; index order (parameter, [Dof,] mode).

    Parameters
    ----------
    names : sequence of str
        The parameters.
    dofs : sequence of Dof
        Rows of the shapes.
    eigenvalue : (n_p, n_modes)
        d lambda/dp: lambda = w^2 undamped, w^2 (1 + i eta) structural, s viscous.
    frequency, damping_ratio : (n_p, n_modes) floats
        Hz and 1 per unit of the parameter; not a number for a zero-frequency mode that the parameter moves.
    shape : (n_p, n_dofs, n_modes)
        Derivative of `basis`.
    basis : (n_p, n_dofs, n_modes)
        The shapes that are differentiated: within a group of repeated roots only those that the parameter splits into
        have a derivative, so they depend on the parameter; elsewhere they are the modes' own.
    undetermined : (n_p, n_modes) bools
        Modes whose root stays repeated to first order: their shape derivative is not unique (its part inside the group
        is left at the normalisation's minimum).
    """

    names: tuple[str, ...]
    dofs: tuple[Dof, ...]
    eigenvalue: Array
    frequency: FloatArray
    damping_ratio: FloatArray
    shape: Array
    basis: Array
    undetermined: np.ndarray


def frequencies(system: SecondOrderSystem, derivatives: MatrixDerivatives, modes: int | None = None) -> FloatArray:
    r"""Return df/dp of the undamped modes, Hz per unit, shape (..., n_p, n_modes); batched over poses.

    :math:`d\omega_r^2/dp = \phi_r^T (K' - \omega_r^2 M') \phi_r`; for repeated roots the eigenvalues of that form on the
    group, in ascending order.
    """
    squares, vectors = mass_normalised(system.mass, system.stiffness)
    keep = system.size if modes is None else modes
    slopes = eigenvalue_slopes(squares[..., :keep], vectors[..., :keep], derivatives)
    omega = np.sqrt(np.maximum(squares[..., None, :keep], 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        # df = d(w^2) / (4 pi w): a rigid mode that a parameter does not touch has slope zero, one that it holds has none
        # that is finite.
        return np.where(slopes == 0, 0.0, slopes / (4 * np.pi * omega))


def eigenvalue_slopes(squares: FloatArray, vectors: FloatArray, derivatives: MatrixDerivatives) -> FloatArray:
    """Return d(w^2)/dp, shape (..., n_p, n_modes), for mass-normalised vectors; repeated roots in ascending order."""
    slopes = np.zeros((*squares.shape[:-1], len(derivatives.names), squares.shape[-1]))
    if derivatives.stiffness is not None:
        slopes = slopes + _quadratic(derivatives.stiffness, vectors)
    if derivatives.mass is not None:
        slopes = slopes - squares[..., None, :] * _quadratic(derivatives.mass, vectors)
    # The plain form holds for single roots; only where two are equal is their group asked, as that goes pose by pose.
    gaps = np.diff(squares, axis=-1)
    if (gaps <= EQUAL_ROOT_TOLERANCE * np.maximum(np.abs(squares[..., 1:]), 1e-300)).any():
        slopes = _split_repeated(squares, vectors, derivatives, slopes)
    return slopes


def _quadratic(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return z^T A_p z of every parameter's matrix and mode, shape (..., n_p, n_modes)."""
    if matrices.ndim == 3:
        # The derivatives do not depend on the pose: one product of all outer squares with all flattened matrices.
        n, m = vectors.shape[-2:]
        products = (vectors[..., :, None, :] * vectors[..., None, :, :]).reshape(*vectors.shape[:-2], n * n, m)
        return matrices.reshape(-1, n * n) @ products
    return ((matrices @ vectors[..., None, :, :]) * vectors[..., None, :, :]).sum(axis=-2)


def _split_repeated(
    squares: FloatArray, vectors: FloatArray, derivatives: MatrixDerivatives, slopes: FloatArray
) -> FloatArray:
    """Return the slopes with those of repeated roots from the eigenvalues of their own form, ascending."""
    result = slopes.copy()
    for pose in np.ndindex(squares.shape[:-1]):
        for group in clusters(squares[pose], EQUAL_ROOT_TOLERANCE):
            if len(group) == 1:
                continue
            z = vectors[pose][:, group]
            for p in range(len(derivatives.names)):
                # Vectors of a repeated root are any basis of their plane; the slopes are those of the basis that the
                # parameter parts it into.
                form = z.T @ _slope_form(derivatives, p, pose, squares[pose][group[0]]) @ z
                result[(*pose, p, group)] = np.linalg.eigvalsh((form + form.T) / 2)
    return result


def _slope_form(derivatives: MatrixDerivatives, p: int, pose: tuple[int, ...], square: float) -> FloatArray:
    """Return K' - w^2 M' of parameter p at one pose."""
    def pick(value: FloatArray | None) -> FloatArray | float:
        if value is None:
            return 0.0
        return value[p] if value.ndim == 3 else value[(*pose, p)]

    return np.asarray(pick(derivatives.stiffness) - square * np.asarray(pick(derivatives.mass)))


def modes(system: SecondOrderSystem, derivatives: MatrixDerivatives, damping: str = "undamped") -> ModeDerivatives:
    """Return the derivatives of all modes of one pose; `damping` is ``undamped``, ``structural`` or ``viscous``.

    Mode order and scaling are those of `eigen.solve_undamped` and `eigen.solve_damped` (structural, viscous).
    Viscous systems with rigid-body modes that no damping touches are refused: their pole is defective.
    """
    if system.poses:
        fail("modes", f"{system.poses} poses", "must be one pose", remedy="use system.at_pose(i)")
    if damping == "viscous":
        return _viscous(system, derivatives)
    if damping not in ("undamped", "structural"):
        fail("damping", repr(damping), "must be undamped, structural or viscous")
    values, vectors = _symmetric_pencil(system, structural=damping == "structural")
    slopes, shapes, bases, unknown = [], [], [], []
    for p in range(len(derivatives.names)):
        da = _derivative_matrix(derivatives.mass, p, system.size)
        db = _derivative_matrix(derivatives.stiffness, p, system.size)
        if damping == "structural":
            db = db + 1j * _derivative_matrix(derivatives.structural_damping, p, system.size)
        slope, derivative, basis, undetermined = _pencil_derivative(values, vectors, da, db)
        slopes.append(slope)
        shapes.append(system.output_map @ derivative)
        bases.append(system.output_map @ basis)
        unknown.append(undetermined)
    slope = np.stack(slopes)
    frequency, ratio = _from_squares(values, slope)
    return ModeDerivatives(derivatives.names, system.outputs, slope, frequency, ratio, np.stack(shapes), np.stack(bases),
                           np.stack(unknown))


def _symmetric_pencil(system: SecondOrderSystem, structural: bool) -> tuple[Array, Array]:
    """Return eigenvalues and vectors of the undamped pencil, or of K + i D and M."""
    if not structural:
        values, vectors = mass_normalised(system.mass, system.stiffness)
        largest = float(np.abs(values).max())
        return np.where(np.abs(values) < 1e-12 * largest, 0.0, values), vectors
    loss = np.zeros_like(system.stiffness) if system.structural_damping is None else system.structural_damping
    stiffness = system.stiffness + 1j * loss
    squares, shapes = np.linalg.eig(np.linalg.solve(system.mass, stiffness))
    order = np.argsort(squares.real)
    squares, shapes = squares[order], shapes[:, order]
    return squares, orthogonalise(shapes, squares, lambda x, y: x.T @ system.mass @ y)


def _derivative_matrix(matrices: FloatArray | None, p: int, n: int) -> FloatArray:
    """Return the derivative of one matrix to parameter p; zero where it is left out."""
    return np.zeros((n, n)) if matrices is None else matrices[p]


def _pencil_derivative(values: Array, vectors: Array, da: Array, db: Array) -> tuple[Array, Array, Array, np.ndarray]:
    """Return slopes, vector derivatives, the differentiable basis, and which modes stay undetermined."""
    n = values.size
    kind = complex if np.iscomplexobj(vectors) or np.iscomplexobj(db) else float
    slopes, basis = np.zeros(n, kind), vectors.astype(kind)
    undetermined = np.zeros(n, bool)
    groups = clusters(values, EQUAL_ROOT_TOLERANCE)
    # A repeated root has derivatives in the basis that diagonalises its slopes (Dailey), so each group is rotated first.
    for group in groups:
        z = vectors[:, group]
        form = z.T @ (db - values[group[0]] * da) @ z
        slope, rotation = _diagonalise((form + form.T) / 2)
        slopes[group], basis[:, group] = slope, z @ rotation
    derivative = np.zeros((vectors.shape[0], n), kind)
    for group in groups:
        others = np.setdiff1d(np.arange(n), group)
        for i in group:
            force = (db - values[i] * da) @ basis[:, i]
            from_others = basis[:, others] @ ((basis[:, others].T @ force) / (values[i] - values[others]))
            from_group, is_undetermined = _derivative_in_group(group, i, values, slopes, basis, da, db, from_others)
            derivative[:, i], undetermined[i] = from_others + from_group, is_undetermined
    return slopes, derivative, basis, undetermined


def _derivative_in_group(group: list[int], i: int, values: Array, slopes: Array, basis: Array, da: Array, db: Array,
            from_others: Array) -> tuple[Array, bool]:
    """Return the part of a vector's derivative inside its own group of repeated roots."""
    shape = basis[:, i]
    # From z^T A z = 1: the vector's own part of its derivative is half of what the product gains.
    result = -0.5 * (shape @ da @ shape) * shape
    is_undetermined = False
    slope_scale = max(float(np.abs(slopes[group]).max()), 1e-300)
    for j in group:
        if j == i:
            continue
        gap = slopes[i] - slopes[j]
        mass_coupling = basis[:, j] @ da @ shape
        # Roots that stay equal leave their vectors free: only the part that keeps them orthogonal in A is taken.
        if abs(gap) <= 1e-7 * slope_scale:
            is_undetermined = True
            result = result - 0.5 * mass_coupling * basis[:, j]
            continue
        force = (db - values[i] * da).T @ basis[:, j]
        result = result + ((force @ from_others - slopes[i] * mass_coupling) / gap) * basis[:, j]
    return result, is_undetermined


def _diagonalise(form: Array) -> tuple[Array, Array]:
    """Return eigenvalues of a symmetric form and vectors with z^T z = 1: the basis in which repeated roots have derivatives."""
    if form.shape == (1, 1):
        return form[0], np.ones((1, 1), form.dtype)
    if not np.iscomplexobj(form):
        return np.linalg.eigh(form)
    values, rotation = np.linalg.eig(form)
    return values, orthogonalise(rotation, values, lambda x, y: x.T @ y)


def _from_squares(values: Array, slope: Array) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of frequency (Hz) and damping ratio from those of w^2 (1 + i eta)."""
    real, loss = np.real(values), np.imag(values)
    with np.errstate(divide="ignore", invalid="ignore"):
        frequency = np.where(real > 0, np.real(slope) / (4 * np.pi * np.sqrt(np.abs(real))),
                             np.where(np.abs(slope) == 0, 0.0, np.nan))
        ratio = np.where(real > 0, (np.imag(slope) * real - loss * np.real(slope)) / (2 * real**2), 0.0)
    return frequency, ratio


def _viscous(system: SecondOrderSystem, derivatives: MatrixDerivatives) -> ModeDerivatives:
    """Return the derivatives of viscous modes from the symmetric state pencil [[C, M], [M, 0]], [[-K, 0], [0, M]]."""
    poles, vectors, rigid = viscous_pencil(system)
    if rigid.shape[1]:
        fail("system", f"{rigid.shape[1]} rigid-body modes", "viscous derivatives need every pole to be simple",
             remedy="ground the machine, or use damping='undamped'")
    n = system.size
    pairs = poles.imag > 0
    all_poles = np.concatenate([poles, poles[pairs].conj()])
    all_vectors = np.concatenate([vectors, vectors[:, pairs].conj()], axis=1)
    states = np.concatenate([all_vectors, all_poles * all_vectors])
    zero = np.zeros((n, n))
    slopes, shapes, bases, unknown = [], [], [], []
    for p in range(len(derivatives.names)):
        dm, dc, dk = (_derivative_matrix(getattr(derivatives, name), p, n) for name in ("mass", "damping", "stiffness"))
        da, db = np.block([[dc, dm], [dm, zero]]), np.block([[-dk, zero], [zero, dm]])
        slope, derivative, basis, undetermined = _pencil_derivative(all_poles, states, da, db)
        keep = slice(0, poles.size)
        slopes.append(slope[keep])
        shapes.append(system.output_map @ derivative[:n, keep])
        bases.append(system.output_map @ basis[:n, keep])
        unknown.append(undetermined[keep])
    slope = np.stack(slopes)
    size = np.abs(poles)
    # d|s| = Re(conj(s) ds) / |s|; the damping ratio is -Re(s)/|s|.
    change = np.real(poles.conj() * slope) / size
    ratio = -(slope.real - poles.real * change / size) / size
    return ModeDerivatives(derivatives.names, system.outputs, slope, change / (2 * np.pi), ratio, np.stack(shapes),
                           np.stack(bases), np.stack(unknown))


def frequency_response(
    system: SecondOrderSystem, derivatives: MatrixDerivatives, frequency: FloatArray
) -> ComplexArray:
    r"""Return the derivatives of the receptance, :math:`H' = -L Z^{-1} Z' Z^{-1} B`, shape (..., n_p, n_f, n_o, n_i).

    Z is the dynamic stiffness. Two solutions with Z per line serve all parameters.
    """
    omega = 2 * np.pi * floats("frequency", np.atleast_1d(frequency))
    result = np.empty((*system.poses, len(derivatives.names), omega.size, len(system.outputs), len(system.inputs)), complex)
    transposed_matrices: dict[str, Any] = {
        name: None if (value := getattr(system, name)) is None else np.swapaxes(value, -1, -2)
        for name in ("mass", "stiffness", "damping", "structural_damping")}
    # Of L Z^-1 the transposed equation is solved: as many right sides as outputs, not as coordinates.
    transposed = replace(system, **transposed_matrices)
    for line, w in enumerate(omega):
        right = np.linalg.solve(system.dynamic_stiffness(w), system.input_map + 0j)
        left = np.linalg.solve(transposed.dynamic_stiffness(w), np.swapaxes(system.output_map, -1, -2) + 0j)
        change = (derivatives.term("stiffness") + 1j * derivatives.term("structural_damping")
                  + 1j * w * derivatives.term("damping") - w**2 * derivatives.term("mass"))
        change = np.broadcast_to(change, (*np.shape(change)[:-3], len(derivatives.names), system.size, system.size))
        result[..., :, line, :, :] = -np.swapaxes(left, -1, -2)[..., None, :, :] @ change @ right[..., None, :, :]
    return result
