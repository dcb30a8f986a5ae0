r"""Modes of a system with all its damping: real where damping couples no modes, complex where it does.

Unequal loss factors or dampers of single joints couple the undamped modes. Leaving this coupling out has moved stability
limits by 24 %, so a real-mode solution is returned only where it is exact. Four cases:

- damping that is diagonal in the undamped modes: real modes, unit modal mass;
- structural damping alone: eigenvectors of :math:`K + i D`, exact at all positive frequencies;
- viscous damping alone: poles and modal A of the state matrix, exact;
- both: the poles of :math:`s^2 M + s C + K + i D` with positive imaginary part. Their residues are those of the response at
  positive frequencies, so the sum of conjugate pairs is exact at the resonances and an equivalent between them; the response
  itself goes along on some lines (`Modes.direct`).

A structure with both kinds whose joints are overdamped has no such pairs. There structural damping is replaced by viscous
damping of equal loss at each resonance (`damping.equivalent_viscous`) before the state matrix is solved.

Source: Ewins, Modal Testing, 2nd ed., sections 2.5 to 2.8.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.vibration import damping, eigen, frequency_response
from toolpoint.vibration.gyroscopic import is_gyroscopic
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.system import SecondOrderSystem

MAX_REAL_MODE_COUPLING = 1e-6  # largest modal damping off the diagonal over that on it: below, real modes are exact
MAX_PAIR_DAMPING = 0.7  # damping ratio up to which a pole of both kinds of damping is one of a conjugate pair
SPACED_LINE_COUNT, MAX_DIRECT_LINES = 100, 300  # lines of `Modes.direct`: spaced by ratio over the band, in all
BEYOND_RATIO, BEYOND_LINE_COUNT = 20.0, 24  # lines above that band: up to this many times its end, so many
MAX_MODE_FREQUENCY = 1e4  # Hz: dampers of light parts have real poles far beyond any resonance

MIXED_NOTE = "structural damping beside viscous damping: exact at each resonance, replaced by an equivalent between them"


def solve_as_damped(system: SecondOrderSystem) -> Modes:
    """Return the modes of a system with its whole damping; one batch axis of poses at most.

    Raises ToolpointError where modes do not exist (see `eigen.solve_damped`).
    """
    structural, viscous = _is_present(system.structural_damping), _is_present(system.damping)
    if is_gyroscopic(system):
        return eigen.solve_damped(damping.equivalent_viscous(system) if structural else system)
    if not (structural or viscous):
        return eigen.solve_undamped(system)
    if structural and viscous:
        mixed = _solve_mixed(system)
        return replace(mixed, direct=frequency_response.direct(system, _resonance_lines(mixed)))
    if not is_coupled(system):
        real = eigen.solve_undamped(system)
        if not (real.damping_ratio >= 1).any():
            return real
    damped = eigen.solve_damped(system)
    return damped if structural else drop_fast_modes(damped)


def upper_poles(modes: Modes) -> ComplexArray:
    r"""Return the upper poles, rad/s: :math:`i \omega \sqrt{1 + 2 i \zeta}` where damping is structural alone."""
    if modes.damping == "structural" and modes.scaling == "unit modal mass":
        return np.asarray(1j * modes.omega * np.sqrt(1 + 2j * modes.damping_ratio))
    ratio = modes.damping_ratio
    return np.asarray(modes.omega * (-ratio + 1j * np.sqrt(np.maximum(1 - ratio**2, 0.0))))


def is_coupled(system: SecondOrderSystem) -> bool:
    """Whether damping of any kind couples the undamped modes, at any pose."""
    _, vectors = eigen.mass_normalised(system.mass, system.stiffness)
    for matrix in (system.damping, system.structural_damping):
        if matrix is None:
            continue
        modal = np.swapaxes(vectors, -1, -2) @ matrix @ vectors
        diagonal = np.diagonal(modal, axis1=-2, axis2=-1)
        off_diagonal = np.abs(modal - diagonal[..., None] * np.eye(modal.shape[-1])).max(initial=0.0)
        if off_diagonal > MAX_REAL_MODE_COUPLING * max(float(np.abs(diagonal).max(initial=0.0)), 1e-300):
            return True
    return False


def drop_fast_modes(modes: Modes) -> Modes:
    """Return the modes up to the last below `MAX_MODE_FREQUENCY` at any pose."""
    is_slow = (modes.frequency < MAX_MODE_FREQUENCY).any(axis=tuple(range(modes.frequency.ndim - 1)))
    return modes.selected(list(range(int(np.flatnonzero(is_slow).max(initial=0)) + 1)))


def _resonance_lines(modes: Modes) -> FloatArray:
    """Return lines (Hz) at the resonances of all poles, a half width beside them, and spaced by ratio between and beyond them.

    Harmonics of a cut lie far above the highest resonance: held at a last line near it, what the modes lack was 3 % of the
    response at the second harmonic.
    """
    is_elastic = modes.frequency > 0
    frequency, ratio = modes.frequency[is_elastic], np.minimum(modes.damping_ratio[is_elastic], 0.5)
    flanks = [frequency * (1 + side * ratio) for side in (-1.0, 0.0, 1.0)]
    highest = 2 * frequency.max()
    lines = np.sort(np.concatenate([np.geomspace(0.02 * frequency.min(), highest, SPACED_LINE_COUNT), *flanks]))
    if lines.size > MAX_DIRECT_LINES:
        lines = np.quantile(lines, np.linspace(0, 1, MAX_DIRECT_LINES))
    return np.unique(np.concatenate([lines, np.geomspace(highest, BEYOND_RATIO * highest, BEYOND_LINE_COUNT)]))


def _is_present(matrix: FloatArray | None) -> bool:
    """Whether a matrix is given and not zero."""
    return matrix is not None and bool(np.any(matrix))


def _solve_mixed(system: SecondOrderSystem) -> Modes:
    """Return modes of viscous and structural damping together; every pose is solved in the same way."""
    if not is_coupled(system):
        modes = eigen.solve_undamped(damping.equivalent_viscous(system))
        if not (modes.damping_ratio >= 1).any():
            return replace(modes, notes=(*modes.notes, MIXED_NOTE))
    systems = [system] if not system.poses else [system.at_pose(i) for i in range(system.poses[0])]
    modes_by_pose = [_mixed_pairs(system_of_pose) for system_of_pose in systems]
    solved_poses = [part for part in modes_by_pose if part is not None]
    if len(solved_poses) < len(systems):
        # A damper so strong that its pole is real: no pairs to take, so the equivalent serves all poses alike.
        modes = drop_fast_modes(eigen.solve_damped(damping.equivalent_viscous(system)))
        return replace(modes, damping="structural")
    return eigen.stack_poses(solved_poses) if system.poses else solved_poses[0]


def _mixed_pairs(system: SecondOrderSystem) -> Modes | None:
    """Return the n upper poles of :math:`s^2 M + s C + K + i D` with :math:`\\phi^T (2 s M + C) \\phi = 1`; None where some are
    no pairs."""
    poles, vectors, rigid = eigen.viscous_pencil(system, hysteretic=True)
    omega = np.abs(poles)
    is_elastic = omega > 0
    ratio = np.ones(poles.size)
    ratio[is_elastic] = -poles.real[is_elastic] / omega[is_elastic]
    if poles.size + rigid.shape[1] != system.size or (ratio > MAX_PAIR_DAMPING).any():
        return None
    shape: ComplexArray = np.concatenate([rigid + 0j, vectors], axis=1)
    rigid_zeros = np.zeros(rigid.shape[1])
    return Modes(np.concatenate([rigid_zeros, omega / (2 * np.pi)]), np.concatenate([rigid_zeros, ratio]),
                 system.output_map @ shape,
                 system.outputs, "modal A", "structural", **eigen.participation_of(system, shape),
                 notes=(*system.notes, MIXED_NOTE))
