r"""Electrodynamic shaker against a structure: forces that it puts into the structure, hung from outside or standing on it.

The coil pushes the armature (mass m) with F_e and the body (mass M) with -F_e; a suspension (k, c) joins both. The armature
pushes the structure through a stinger at its driving point d, the body stands on the structure at s:

.. math:: Z [a, b]^T = [1, -1]^T F_e - [F_d, F_s]^T, \qquad [a, b]^T = (H + S) [F_d, F_s]^T,

with Z the dynamic stiffness of both masses on their suspension, H the structure's receptances at d and s, and S the
compliances of stinger and stand. A hung shaker has :math:`F_s = 0`. The response that a test measures is that to the force cell
at d, :math:`\tilde H_{id} = H_{id} + H_{is} F_s/F_d`: exact for a hung shaker, of something else for one that stands on what it
shakes.

Source: Ewins, Modal Testing, 2nd ed., section 3.3 (attachment of exciters); coil equations of a moving-coil exciter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, floats, nonnegative, positive, scalar


@dataclass(frozen=True)
class CoilDrive:
    """Coil of a shaker that is driven by a voltage: force constant (N/A), resistance (ohm), inductance (H).

    Examples
    --------
    >>> CoilDrive(10.0, 2.0).inductance
    0.0
    """

    force_constant: float
    resistance: float
    inductance: float = 0.0

    def __post_init__(self) -> None:
        for name in ("force_constant", "resistance"):
            positive(f"CoilDrive.{name}", getattr(self, name))
        nonnegative("CoilDrive.inductance", np.array([scalar("CoilDrive.inductance", self.inductance)]))


@dataclass(frozen=True)
class ElectrodynamicShaker:
    """Masses (kg) and stiffnesses (N/m) of a shaker; infinite stiffness is rigid.

    body_mass, armature_mass; suspension, suspension_damping : between both, N/m, N s/m; stinger : armature to structure; stand,
    stand_damping : body to what it stands on.

    Examples
    --------
    A shaker without masses puts back into the structure what it pushes with:

    >>> light = ElectrodynamicShaker(body_mass=1e-9, armature_mass=1e-9, suspension=1e3)
    >>> structure = np.full((1, 2, 2), 1e-6, complex)
    >>> forces = light.forces(structure, np.array([10.0]), stands=True)[0]
    >>> bool(abs(forces[1] / forces[0] + 1) < 1e-6)
    True
    """

    body_mass: float
    armature_mass: float
    suspension: float
    suspension_damping: float = 0.0
    stinger: float = np.inf
    stand: float = np.inf
    stand_damping: float = 0.0

    def __post_init__(self) -> None:
        for name in ("body_mass", "armature_mass"):
            positive(f"ElectrodynamicShaker.{name}", getattr(self, name))
        for name in ("suspension", "suspension_damping", "stand_damping"):
            nonnegative(f"ElectrodynamicShaker.{name}", np.array([scalar(f"ElectrodynamicShaker.{name}", getattr(self, name))]))
        for name in ("stinger", "stand"):
            if not getattr(self, name) > 0:
                positive(f"ElectrodynamicShaker.{name}", getattr(self, name))

    def forces(self, structure: ComplexArray, frequency: FloatArray, *, stands: bool) -> ComplexArray:
        """Return the forces on the structure at driving point and stand per coil force, (n_f, 2).

        structure : (n_f, 2, 2) receptances between driving point and stand, along the shaker's axis, m/N; frequency : Hz, above
        0; stands : whether the body stands on the structure; hung, its second force is 0.
        """
        omega = 2 * np.pi * _lines(frequency)
        both = self._dynamic_stiffness(omega)
        coil = np.broadcast_to(np.array([1.0, -1.0], complex), (omega.size, 2))
        if stands:
            compliance = structure + self._attachments(omega)
            return np.asarray(np.linalg.solve(both @ compliance + np.eye(2), coil[..., None])[..., 0])
        # Unknown are the force at the driving point and the motion of the body: Z [(h + 1/k_st) F_d, b] + [F_d, 0] = [1, -1].
        point = structure[:, 0, 0] + 1 / self.stinger
        matrix = np.stack([both[:, :, 0] * point[:, None] + np.array([1.0, 0.0]), both[:, :, 1]], axis=-1)
        driven = np.linalg.solve(matrix, coil[..., None])[..., 0]
        return np.stack([driven[:, 0], np.zeros(omega.size)], axis=1)

    def coil_motion(self, structure: ComplexArray, frequency: FloatArray, *, stands: bool) -> ComplexArray:
        """Return the motion of the armature against the body per coil force, (n_f,) m/N; arguments as in `forces`."""
        force = self.forces(structure, frequency, stands=stands)
        omega = 2 * np.pi * _lines(frequency)
        if stands:
            motion = np.einsum("fij,fj->fi", structure + self._attachments(omega), force)
            return np.asarray(motion[:, 0] - motion[:, 1])
        armature = (structure[:, 0, 0] + 1 / self.stinger) * force[:, 0]
        body = (-1 + self._suspension(omega) * armature) / (self._suspension(omega) - omega**2 * self.body_mass)
        return np.asarray(armature - body)

    def voltage_forces(self, coil: CoilDrive, structure: ComplexArray, frequency: FloatArray, *, stands: bool) -> ComplexArray:
        r"""Return the forces per volt, (n_f, 2) N/V.

        The coil is that of :math:`U = (R + j\omega L) I + Bl\, j\omega (a - b)`, :math:`F_e = Bl\, I`; others as in `forces`.
        """
        omega = 2 * np.pi * _lines(frequency)
        motion = self.coil_motion(structure, frequency, stands=stands)
        impedance = coil.resistance + 1j * omega * coil.inductance + coil.force_constant**2 * 1j * omega * motion
        return np.asarray(self.forces(structure, frequency, stands=stands) * (coil.force_constant / impedance)[:, None])

    def _suspension(self, omega: FloatArray) -> ComplexArray:
        return np.asarray(self.suspension + 1j * omega * self.suspension_damping)

    def _dynamic_stiffness(self, omega: FloatArray) -> ComplexArray:
        spring = self._suspension(omega)
        rows = [[spring - omega**2 * self.armature_mass, -spring], [-spring, spring - omega**2 * self.body_mass]]
        return np.moveaxis(np.array(rows), 2, 0)

    def _attachments(self, omega: FloatArray) -> ComplexArray:
        result = np.zeros((omega.size, 2, 2), complex)
        result[:, 0, 0] = 1 / self.stinger
        result[:, 1, 1] = 0.0 if np.isinf(self.stand) else 1 / (self.stand + 1j * omega * self.stand_damping)
        return result


def _lines(frequency: FloatArray) -> FloatArray:
    """Return frequencies (n_f,), Hz, all above zero: at rest a hung shaker holds nothing."""
    lines = floats("frequency", np.atleast_1d(frequency))
    positive("frequency", float(lines.min()))
    return lines
