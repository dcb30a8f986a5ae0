r"""Frequency responses: by direct solution, by modal sum, and the truncation error of the sum."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail, floats, increasing, nonnegative, one_of
from toolpoint.vibration.dof import Dof, positions
from toolpoint.vibration.frf import QUANTITIES, Frf
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.system import SecondOrderSystem

Labels = Iterable["Dof | str | int"] | None
_MAX_CHUNK_NUMBERS = 4_000_000  # complex numbers of dynamic stiffness held at once, 64 MB


def direct(system: SecondOrderSystem, frequency: FloatArray, quantity: str = "receptance") -> Frf:
    r"""Return :math:`H = L (K + i D + i \omega C - \omega^2 M)^{-1} B`, exact for any damping.

    Parameters
    ----------
    system : SecondOrderSystem
        Any batch of poses.
    frequency : (n_f,) floats
        Hz, increasing.
    quantity : str
        ``receptance``, ``mobility`` or ``accelerance``.

    Raises
    ------
    ToolpointError
        Where the dynamic stiffness is singular (an undamped resonance exactly on a line, a rigid body at 0 Hz).
    """
    frequency = nonnegative("frequency", increasing("frequency", floats("frequency", np.atleast_1d(frequency))))
    one_of("quantity", quantity, QUANTITIES)
    outputs, inputs = len(system.outputs), len(system.inputs)
    values = np.empty((*system.poses, frequency.size, outputs, inputs), complex)
    per_line = max(1, int(np.prod(system.poses, dtype=int)) * system.size**2)
    step = max(1, _MAX_CHUNK_NUMBERS // per_line)
    for start in range(0, frequency.size, step):
        lines = slice(start, start + step)
        values[..., lines, :, :] = _solve_lines(system, 2 * np.pi * frequency[lines])
    return Frf(frequency, values, system.outputs, system.inputs, notes=system.notes).converted_to(quantity)


def _solve_lines(system: SecondOrderSystem, omega: FloatArray) -> ComplexArray:
    """Return L Z(w)^-1 B at angular frequencies (rad/s), lines before the matrix axes."""
    w = omega[:, None, None]

    def by_line(matrix: FloatArray) -> FloatArray:
        return matrix[..., None, :, :]

    z = by_line(system.stiffness) - w**2 * by_line(system.mass) + 0j
    if system.damping is not None:
        z += 1j * w * by_line(system.damping)
    if system.structural_damping is not None:
        z += 1j * by_line(system.structural_damping)
    forces = np.broadcast_to(by_line(system.input_map), (*z.shape[:-1], len(system.inputs)))
    try:
        return by_line(system.output_map) @ np.linalg.solve(z, forces)
    except np.linalg.LinAlgError:
        fail("frequency", f"a singular dynamic stiffness within {omega[0] / 6.2832:g} .. {omega[-1] / 6.2832:g} Hz",
             "must have no undamped resonance or rigid-body motion on a line", remedy="add damping or move the lines")


def modal(
    modes: Modes, frequency: FloatArray, outputs: Labels = None, *, inputs: Labels = None, quantity: str = "receptance"
) -> Frf:
    """Return the sum of the modes' responses (formulas: see `Modes`), with their residuals; batched over poses.

    Parameters
    ----------
    modes : Modes
        Any scaling that fixes a response.
    frequency : (n_f,) floats
        Hz, increasing.
    outputs, inputs : labels or indices, optional
        All of the modes' where left out.
    """
    frequency = nonnegative("frequency", increasing("frequency", floats("frequency", np.atleast_1d(frequency))))
    rows = list(range(len(modes.dofs))) if outputs is None else positions("outputs", outputs, modes.dofs)
    driven = modes.input_dofs or modes.dofs
    columns = list(range(len(driven))) if inputs is None else positions("inputs", inputs, driven)
    source = modes.shape if modes.participation is None else modes.participation
    left, right = modes.shape[..., rows, :], source[..., columns, :]
    omega = 2 * np.pi * frequency
    if frequency[0] == 0 and modes.is_rigid.any():
        fail("frequency", "a line at 0 Hz", "rigid-body modes have no response there", remedy="start above 0 Hz")
    values = _sum_modes(modes, left, right, omega)
    values = values + _residuals(modes, rows, columns, omega)
    result = Frf(frequency, values, tuple(modes.dofs[i] for i in rows), tuple(driven[i] for i in columns),
                 notes=modes.notes)
    return result.converted_to(quantity)


def _sum_modes(modes: Modes, left: ComplexArray, right: ComplexArray, omega: FloatArray) -> ComplexArray:
    """Return the sum of the modes over factors by line times residues, shape (..., n_f, n_outputs, n_inputs)."""
    outputs, inputs = left.shape[-2], right.shape[-2]

    def term(factors: ComplexArray, l: ComplexArray, r: ComplexArray) -> ComplexArray:
        # One matrix product over modes for all output-input pairs: (n_f, n_modes) @ (n_modes, n_o n_i).
        residues = np.swapaxes(l[..., :, None, :] * r[..., None, :, :], -1, -3)
        residues = np.swapaxes(residues, -1, -2).reshape(*residues.shape[:-3], residues.shape[-3], -1)
        return (factors @ residues).reshape(*factors.shape[:-1], outputs, inputs)

    if modes.scaling == "unit modal mass":
        return term(_real_factors(modes, omega), left, right)
    if modes.scaling == "unscaled" and modes.participation is None:
        fail("modes", "unscaled shapes without participation", "must carry a scale to give a response",
             remedy="identify with a driving point, or give `participation`")
    first, second = _pole_factors(modes, omega)
    return term(first, left, right) + term(second, left.conj(), right.conj())


def _real_factors(modes: Modes, omega: FloatArray) -> ComplexArray:
    """Return 1/(w_r^2 - w^2 + i loss) of real modes, shape (..., n_f, n_modes)."""
    w = modes.omega[..., None, :]
    zeta = modes.damping_ratio[..., None, :]
    line_omega = omega[:, None]
    loss = 2 * zeta * w * line_omega if modes.damping == "viscous" else 2 * zeta * w * w
    # 1 / (a + i b) written out: numpy's complex division is several times slower than two real ones.
    elastic_part = w * w - line_omega * line_omega
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse_square = 1.0 / (elastic_part * elastic_part + loss * loss)
    if not np.isfinite(inverse_square).all():
        fail("frequency", "a line exactly on an undamped resonance", "must lie beside it",
             remedy="add damping or move the lines")
    factors = np.empty(inverse_square.shape, complex)
    factors.real, factors.imag = elastic_part * inverse_square, -loss * inverse_square
    return factors


def _pole_factors(modes: Modes, omega: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return 1/(i w - s_r) and 1/(i w - s_r^*), shape (..., n_f, n_modes); a real pole has the first alone."""
    s, i_omega = modes.poles[..., None, :], 1j * omega[:, None]
    rigid = modes.is_rigid[..., None, :]
    # A real pole has no conjugate: counted as a pair it would answer twice.
    is_real_pole = (np.abs(s.imag) <= 1e-12 * np.abs(s)) & ~rigid
    with np.errstate(divide="ignore", invalid="ignore"):
        # A rigid mode has a double pole at zero, and unit modal mass in place of modal A: its whole response is -1/w^2.
        first = np.where(rigid, 1 / i_omega**2, 1 / (i_omega - s))
        second = np.where(rigid | is_real_pole, 0.0, 1 / (i_omega - s.conj()))
    return first, second


def _residuals(modes: Modes, rows: list[int], columns: list[int], omega: FloatArray) -> ComplexArray | float:
    """Return the upper residual less the lower one over w^2."""
    total: ComplexArray | float = 0.0
    entries = np.ix_(rows, columns)
    if modes.upper_residual is not None:
        total = total + modes.upper_residual[entries]
    if modes.lower_residual is not None:
        if omega[0] == 0:
            fail("frequency", "a line at 0 Hz", "the lower residual is infinite there", remedy="start above 0 Hz")
        total = total - modes.lower_residual[entries] / omega[:, None, None] ** 2
    return total


@dataclass(frozen=True)
class Truncation:
    """Truncation error of a modal sum over a part of the modes.

    Parameters
    ----------
    static : (n_outputs, n_inputs) floats
        Static receptance of the modes left out, m/N.
    error : float
        Largest error of the plain sum over the band, relative to the largest response in it.
    corrected_error : float
        The same when the static residual is added to the sum.
    frequency : float
        Lowest natural frequency left out, Hz (infinite if none).
    """

    static: FloatArray
    error: float
    corrected_error: float
    frequency: float

    def __str__(self) -> str:
        return (f"modes above {self.frequency:.4g} Hz left out: largest error {100 * self.error:.3g} % of the largest "
                f"response, {100 * self.corrected_error:.3g} % with the static residual")


def truncation(system: SecondOrderSystem, modes: Modes, frequency: FloatArray) -> Truncation:
    """Return the exact truncation error of the lowest `modes` of an (undamped) system over a band (one pose).

    All modes of the system are computed; `modes` must be its lowest ones. The errors are those of the modes left out,
    evaluated line by line without damping, related to the largest response of the modes kept, with their damping.
    """
    from toolpoint.vibration.eigen import solve_undamped

    if system.poses:
        fail("truncation", f"{system.poses} poses", "must be one pose", remedy="use at_pose(i)")
    # Without damping a left-out mode is largest in the band below it: the error stated is the upper one.
    all_modes = solve_undamped(replace(system, damping=None, structural_damping=None))
    omitted = all_modes.selected(range(modes.count, all_modes.count))
    kept_response = modal(modes, frequency).values
    if omitted.count == 0:
        return Truncation(np.zeros(kept_response.shape[-2:]), 0.0, 0.0, float("inf"))
    output_shape = omitted.shape
    input_shape = omitted.shape if omitted.participation is None else omitted.participation
    static = (output_shape / omitted.omega**2) @ input_shape.T
    omitted_response = _sum_modes(omitted, output_shape, input_shape, 2 * np.pi * floats("frequency", np.atleast_1d(frequency)))
    scale = float(np.abs(kept_response).max())
    return Truncation(static, float(np.abs(omitted_response).max()) / scale,
                      float(np.abs(omitted_response - static).max()) / scale,
                      float(omitted.frequency[0]))


def condense_above(modes: Modes, frequency: float, reason: str = "elastic bodies are reduced for no more") -> Modes:
    """Return the modes with those above a frequency (Hz) as their static receptance alone, in the upper residual (one pose).

    reason : why, for the note.
    """
    kept = np.flatnonzero(modes.frequency <= frequency)
    omitted = np.flatnonzero(modes.frequency > frequency)
    if not kept.size or not omitted.size:
        return modes
    omitted_modes = replace(modes.selected(omitted), lower_residual=None, upper_residual=None)
    # At 0 Hz, where damping plays no part.
    static = modal(omitted_modes, np.zeros(1), outputs=modes.dofs, inputs=modes.input_dofs or modes.dofs).values[0]
    upper_residual = 0.0 if modes.upper_residual is None else modes.upper_residual
    note = f"{omitted.size} modes above {frequency:.4g} Hz count by their static part: {reason}"
    return replace(modes.selected(kept), lower_residual=modes.lower_residual, upper_residual=static + upper_residual,
                   notes=(*modes.notes, note))


def with_static_residual(modes: Modes, system: SecondOrderSystem) -> Modes:
    """Return the modes with the static receptance of those left out as upper residual: L K^-1 B - sum phi phi^T/w^2.

    Needs a system without rigid-body modes (one pose); the mode-acceleration correction of Craig, Kurdila, section 11.4.
    """
    if system.poses:
        fail("with_static_residual", f"{system.poses} poses", "must be one pose", remedy="use at_pose(i)")
    if modes.scaling != "unit modal mass" or modes.is_rigid.any():
        fail("modes", repr(modes), "must have unit modal mass and no rigid-body mode")
    static = system.output_map @ np.linalg.solve(system.stiffness, system.input_map)
    input_shape = modes.shape if modes.participation is None else modes.participation
    return replace(modes, upper_residual=(static - (modes.shape / modes.omega**2) @ input_shape.T).astype(complex))
