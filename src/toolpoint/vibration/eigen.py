r"""Natural frequencies and shapes of a SecondOrderSystem: undamped, viscous and structurally damped, any batch.

All solutions are those of a symmetric pencil, so left and right vectors are the same and are scaled by one product:
:math:`\phi^T M \phi = 1` (unit modal mass) or :math:`\phi^T (2 s M + C) \phi = 1` (modal A). Vectors of repeated roots
are made orthogonal in that product. Source: Ewins, Modal Testing, 2nd ed., section 2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from toolpoint._check import ComplexArray, FloatArray, ToolpointError, count, fail
from toolpoint.vibration.gyroscopic import RIGID_TOLERANCE, gyroscopic_modes, is_gyroscopic
from toolpoint.vibration.modes import Modes, remark_overdamped
from toolpoint.vibration.system import SecondOrderSystem

REPEATED_TOLERANCE = 1e-7  # relative distance of eigenvalues that count as one repeated root
_SINGLE_MATRIX_SIZE = 30  # coordinates from which the matrices of a batch are reduced one by one, in place


def solve_undamped(system: SecondOrderSystem, modes: int | None = None) -> Modes:
    """Return the real modes of M and K, mass-normalised, lowest first; batched over poses.

    Viscous damping enters as the diagonal of the modal damping matrix (exact for proportional damping), structural
    damping likewise when there is no viscous one; `notes` says so where terms beside the diagonal were left out.

    Parameters
    ----------
    system : SecondOrderSystem
        Needs a positive definite mass and a symmetric stiffness.
    modes : int, optional
        How many of the lowest modes to return; all where left out.
    """
    squares, vectors = mass_normalised(system.mass, system.stiffness)
    keep = system.size if modes is None else min(count("modes", modes), system.size)
    squares, vectors = squares[..., :keep], vectors[..., :keep]
    omega = natural_omega(squares, system.mass, system.stiffness)
    ratio, kind, notes = _diagonal_damping(system, vectors, omega)
    return Modes(omega / (2 * np.pi), ratio, system.output_map @ vectors, system.outputs, "unit modal mass", kind,
                 **participation_of(system, vectors), notes=(*system.notes, *notes, *remark_overdamped(ratio)))


def mass_normalised(mass: FloatArray, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return eigenvalues w^2 and vectors with phi^T M phi = 1 of K phi = w^2 M phi, ascending, batched."""
    scaled, inverse = _scale_by_mass(mass, stiffness)
    squares, vectors = np.linalg.eigh(scaled)
    return squares, np.swapaxes(inverse, -1, -2) @ vectors


def natural_squares(mass: FloatArray, stiffness: FloatArray) -> FloatArray:
    """Return the eigenvalues w^2 of K phi = w^2 M phi, ascending, batched, in a third of the time of vectors."""
    # Small matrices in one batched call, where calls cost most; large ones by LAPACK's reduction, which forms no inverse.
    if stiffness.shape[-1] < _SINGLE_MATRIX_SIZE:
        return np.linalg.eigvalsh(_scale_by_mass(mass, stiffness)[0])
    lower_factors, stiffnesses = np.broadcast_arrays(_cholesky(mass), stiffness)
    reduced = np.empty(stiffnesses.shape)
    for pose in np.ndindex(stiffnesses.shape[:-2]):
        # By columns the lower triangle is the upper one of the transposed: no copy.
        reduced[pose] = scipy.linalg.lapack.dsygst(stiffnesses[pose].T, lower_factors[pose].T, lower=0)[0]
    return np.linalg.eigvalsh(reduced, UPLO="U")


def _cholesky(mass: FloatArray) -> FloatArray:
    """Return L of M = L L^T; a mass matrix that is not positive definite is refused."""
    try:
        return np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:
        fail("mass", "a mass matrix that is not positive definite", "every coordinate needs inertia",
             remedy="condense massless coordinates or give them a small mass")


def _scale_by_mass(mass: FloatArray, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return L^-1 K L^-T and L^-1 of M = L L^T."""
    inverse = np.linalg.inv(_cholesky(mass))
    scaled = inverse @ stiffness @ np.swapaxes(inverse, -1, -2)
    # The products round differently above and below the diagonal, and `eigh` reads one triangle alone.
    return (scaled + np.swapaxes(scaled, -1, -2)) / 2, inverse


def natural_omega(squares: FloatArray, mass: FloatArray, stiffness: FloatArray) -> FloatArray:
    """Return natural angular frequencies (rad/s) of eigenvalues w^2 (..., n): zero for rigid-body modes.

    Raises ToolpointError for an eigenvalue that is truly negative: the configuration is statically unstable.
    """
    # Rounding leaves rigid modes at about 1e-16 of the largest eigenvalue of either sign; a truly negative one is an
    # unstable (buckled, or upside-down) configuration and must not be hidden.
    scale = np.abs(stiffness).max(axis=(-1, -2)) / np.abs(mass).max(axis=(-1, -2))
    # Of a system with rigid modes alone all squares are rounding: the matrices themselves then give the scale.
    largest = np.maximum(np.abs(squares).max(axis=-1), scale)
    rigid_limit = RIGID_TOLERANCE * 1e-3 * largest[..., None]
    if (squares < -1e3 * rigid_limit).any():
        fail("stiffness", f"eigenvalue {squares.min():g} rad^2/s^2", "must not be negative for modes",
             remedy="the configuration is statically unstable: look at preload, gravity and free directions")
    return np.sqrt(np.where(np.abs(squares) <= rigid_limit, 0.0, np.maximum(squares, 0.0)))


def _diagonal_damping(
    system: SecondOrderSystem, vectors: FloatArray, omega: FloatArray
) -> tuple[FloatArray, str, tuple[str, ...]]:
    """Return damping ratios from the diagonal of the modal damping matrix, its kind, and a note where it couples modes."""
    viscous, structural = system.damping, system.structural_damping
    if viscous is not None and structural is not None and np.any(structural) and np.any(viscous):
        fail("solve_undamped", "viscous and structural damping together", "modes carry one kind of damping",
             remedy="convert one with damping.equivalent_viscous(system)")
    matrix = structural if structural is not None and np.any(structural) else viscous
    if matrix is None:
        return np.zeros_like(omega), "viscous", ()
    modal = np.swapaxes(vectors, -1, -2) @ matrix @ vectors
    diagonal = np.diagonal(modal, axis1=-2, axis2=-1)
    exponent = 2 if matrix is structural else 1
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(omega > 0, diagonal / (2 * omega**exponent), 0.0)
    off_diagonal = np.abs(modal - diagonal[..., None] * np.eye(modal.shape[-1])).max() if modal.size else 0.0
    coupled = off_diagonal > 1e-6 * max(float(np.abs(diagonal).max(initial=0.0)), 1e-300)
    note = ("modal damping: coupling of modes by damping is left out; use solve_damped or a direct solution",)
    return ratio, "structural" if matrix is structural else "viscous", note if coupled else ()


def participation_of(system: SecondOrderSystem, vectors: FloatArray | ComplexArray) -> dict[str, Any]:
    """Return the fields `participation` and `input_dofs` of modes, empty where inputs and outputs are the same."""
    is_symmetric = system.inputs == system.outputs and np.array_equal(
        system.input_map, np.swapaxes(system.output_map, -1, -2))
    if is_symmetric:
        return {}
    return {"participation": np.swapaxes(system.input_map, -1, -2) @ vectors, "input_dofs": system.inputs}


def solve_damped(system: SecondOrderSystem, modes: int | None = None) -> Modes:
    """Return the complex modes of a damped system, batched over poses.

    Viscous damping: modal A scaling; pairs of real poles appear as two modes with damping ratio 1 (overdamped), a
    simple real pole at zero as frequency 0 with damping ratio 1. Structural damping: unit modal mass with complex
    shapes, K + i D as it stands. Rigid-body modes that no damping touches come first, with unit modal mass.

    A damping matrix that is not symmetric (gyroscopic) gives modes with a participation of their own, see `gyroscopic`.

    Raises ToolpointError for viscous and structural damping together, or a defective pencil (critical damping of a coordinate),
    for which modes do not exist.
    """
    structural = system.structural_damping is not None and bool(np.any(system.structural_damping))
    viscous = system.damping is not None and bool(np.any(system.damping))
    if structural and viscous:
        fail("solve_damped", "viscous and structural damping together", "must be one kind",
             remedy="use frequency_response.direct, or damping.equivalent_viscous(system)")
    keep = None if modes is None else count("modes", modes)
    solve = _solve_structural if structural else gyroscopic_modes if is_gyroscopic(system) else _solve_viscous
    if not system.poses:
        return solve(system, keep)
    singles = [solve(system.at_pose(i), keep) for i in range(system.poses[0])] if len(system.poses) == 1 else None
    if singles is None:
        fail("solve_damped", f"pose axes {system.poses}", "must be one axis of poses", remedy="reshape the poses first")
    return stack_poses(singles)


def stack_poses(parts: list[Modes]) -> Modes:
    """Return modes of single poses as one batch.

    Raises ToolpointError where their number differs.
    """
    if len({part.count for part in parts}) > 1:
        raise ToolpointError("solve_damped: the number of poles differs from pose to pose (overdamped modes in some); "
                             "solve these poses one by one, or ask for a smaller number of modes")
    first = parts[0]
    stack = (lambda name: np.stack([getattr(part, name) for part in parts]))
    participation: dict[str, Any] = {} if first.participation is None else {"participation": stack("participation"),
                                                   "input_dofs": first.input_dofs}
    return Modes(stack("frequency"), stack("damping_ratio"), stack("shape"), first.dofs, first.scaling, first.damping,
                 **participation, notes=first.notes)


def _solve_structural(system: SecondOrderSystem, keep: int | None) -> Modes:
    """Return the eigenvectors of K + i D and M, with unit modal mass in the bilinear product phi^T M phi."""
    assert system.structural_damping is not None
    stiffness = system.stiffness + 1j * system.structural_damping
    # K + i D is symmetric and not Hermitian: no symmetric solver applies, and vectors are orthogonal without conjugation.
    squares, vectors = np.linalg.eig(np.linalg.solve(system.mass, stiffness))
    order = np.argsort(squares.real)[:keep]
    squares, vectors = squares[order], vectors[:, order]
    largest = float(np.abs(squares).max())
    squares = np.where(np.abs(squares) <= RIGID_TOLERANCE * largest, 0.0, squares)
    if (squares.real < 0).any():
        fail("stiffness", f"eigenvalue {squares.real.min():g}", "must have a positive real part")
    vectors = orthogonalise(vectors, squares, lambda x, y: x.T @ system.mass @ y)
    omega = np.sqrt(squares.real)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(omega > 0, squares.imag / (2 * squares.real), 0.0)
    return Modes(omega / (2 * np.pi), ratio, system.output_map @ vectors, system.outputs, "unit modal mass", "structural",
                 **participation_of(system, vectors), notes=(*system.notes, *remark_overdamped(ratio)))


def _solve_viscous(system: SecondOrderSystem, keep: int | None) -> Modes:
    """Return upper and real poles in modal A scaling behind the rigid-body modes."""
    poles, vectors, rigid = viscous_pencil(system)
    omega, ratio = np.abs(poles), np.zeros(poles.size)
    is_moving = omega > 0
    ratio[is_moving] = -poles.real[is_moving] / omega[is_moving]
    # A pole at zero does not oscillate: ratio 1 keeps it among the real ones.
    ratio[~is_moving] = 1.0
    shape = np.concatenate([rigid + 0j, vectors], axis=1)
    frequency = np.concatenate([np.zeros(rigid.shape[1]), omega / (2 * np.pi)])[:keep]
    ratio = np.concatenate([np.zeros(rigid.shape[1]), ratio])[:keep]
    shape = shape[:, :keep]
    return Modes(frequency, ratio, system.output_map @ shape, system.outputs, "modal A", "viscous",
                 **participation_of(system, shape), notes=system.notes)


def viscous_pencil(system: SecondOrderSystem, *, hysteretic: bool = False
                   ) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Return upper and real poles, their vectors with phi^T (2 s M + C) phi = 1, and the undamped rigid-body modes.

    hysteretic : take K + i D, whose upper poles alone are those of the response at positive frequencies.

    The rigid-body modes (null space of K and C, unit modal mass) are removed before the eigenvalue problem: their
    double pole at zero is defective, and no modal A exists for it.
    """
    mass, stiffness = system.mass, system.stiffness
    damping = np.zeros_like(mass) if system.damping is None else system.damping
    if np.abs(damping - damping.T).max() > 1e-8 * max(float(np.abs(damping).max()), 1e-300):
        fail("damping", "an unsymmetric matrix", "complex modes need a symmetric one",
             remedy="gyroscopic systems: use frequency_response.direct or state_space.physical")
    rigid, basis = _split_rigid(mass, damping, stiffness)
    if hysteretic and system.structural_damping is not None:
        stiffness = stiffness + 1j * system.structural_damping
    m, c, k = (basis.T @ matrix @ basis for matrix in (mass, damping, stiffness))
    n = m.shape[0]
    companion = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]])
    poles, states = np.linalg.eig(companion)
    largest = float(np.abs(poles).max(initial=0.0))
    poles = np.where(np.abs(poles) <= RIGID_TOLERANCE * largest, 0.0, poles)
    # Rounding gives real poles a tiny imaginary part of either sign, which would make two modes of one or lose it.
    poles = np.where(np.abs(poles.imag) <= 1e-12 * np.abs(poles), poles.real + 0j, poles)
    is_upper = poles.imag >= 0
    poles, vectors = poles[is_upper], states[:n, is_upper]
    # By size, then the slower of two real poles first: `eig` gives no order that lasts from pose to pose.
    order = np.lexsort((-poles.real, np.abs(poles)))
    poles, vectors = poles[order], vectors[:, order]

    def product(group: ComplexArray, s: ComplexArray) -> ComplexArray:
        return group.T @ c @ group + (s[:, None] + s[None, :]) * (group.T @ m @ group)

    vectors = _scale_to_modal_a(vectors, poles, product)
    return poles, basis @ vectors, rigid


def _split_rigid(mass: FloatArray, damping: FloatArray, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rigid-body modes (n, r) that neither K nor C holds, and a basis (n, n - r) orthogonal to them in M."""
    # Each by its own size: N/m stand above N s/m by many powers of ten, and the smaller matrix would count as rounding.
    stiffness_scale = float(np.abs(stiffness).max()) or 1.0
    stacked = np.concatenate([stiffness / stiffness_scale, damping / (float(np.abs(damping).max()) or 1.0)])
    rigid = scipy.linalg.null_space(stacked, rcond=RIGID_TOLERANCE)
    if rigid.shape[1] == 0:
        return rigid, np.eye(mass.shape[0])
    # The null space is orthonormal in the plain product: its Cholesky factor makes it so in that of the mass.
    gram = np.linalg.cholesky(rigid.T @ mass @ rigid)
    rigid = np.linalg.solve(gram, rigid.T).T
    return rigid, scipy.linalg.null_space(rigid.T @ mass)


def _scale_to_modal_a(vectors: ComplexArray, poles: ComplexArray, product: Callable[..., ComplexArray]) -> ComplexArray:
    """Return vectors with the product phi^T (2 s M + C) phi of each cluster of equal poles the identity."""
    result = vectors.astype(complex)
    for cluster in clusters(poles):
        group, s = vectors[:, cluster], poles[cluster]
        result[:, cluster] = group @ _inverse_root(product(group, s))
    return result


def orthogonalise(vectors: ComplexArray, values: ComplexArray, product: Callable[..., ComplexArray]) -> ComplexArray:
    """Return vectors scaled so that the bilinear product of each cluster of equal values is the identity."""
    result = vectors.astype(complex)
    for cluster in clusters(values):
        group = vectors[:, cluster]
        result[:, cluster] = group @ _inverse_root(product(group, group))
    return result


def clusters(values: ComplexArray | FloatArray, tolerance: float = REPEATED_TOLERANCE) -> list[list[int]]:
    """Return groups of indices whose values agree within `tolerance` of their size; values sorted by magnitude."""
    groups: list[list[int]] = []
    for i, value in enumerate(values):
        # Sorted by size, poles of one cluster stand a few places apart at most: conjugates and equal moduli come between.
        for group in reversed(groups[-4:]):
            if abs(value - values[group[0]]) <= tolerance * max(abs(value), abs(values[group[0]])):
                group.append(i)
                break
        else:
            groups.append([i])
    return groups


def _inverse_root(gram: ComplexArray) -> ComplexArray:
    """Return the inverse square root of a symmetric complex Gram matrix; a singular one is a defective root."""
    if gram.shape == (1, 1):
        root = np.sqrt(gram + 0j)
    else:
        # The symmetric root: any other would turn the vectors of a repeated pole by an arbitrary rotation.
        root = np.asarray(scipy.linalg.sqrtm((gram + gram.T) / 2))
    # The product of vectors of a defective root is zero; 1e7 is where half of the digits of a vector are gone.
    if abs(np.linalg.det(root)) == 0 or np.linalg.cond(root) > 1e7:
        fail("solve_damped", "a defective root (critical damping of a coordinate)", "its modes do not exist",
             remedy="change the damping a little, or use frequency_response.direct")
    return np.linalg.inv(root)
