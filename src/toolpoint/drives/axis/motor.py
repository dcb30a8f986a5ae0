"""Permanent-magnet synchronous motor in dq, a motor with an ideal torque loop, and the inverter that feeds them."""

from __future__ import annotations

from dataclasses import dataclass

from toolpoint._check import count, one_of, positive


@dataclass(frozen=True)
class SynchronousMotor:
    r"""Permanent-magnet synchronous motor in rotor coordinates, amplitude-invariant dq.

    .. math:: L_d \dot i_d = u_d - R i_d + p \omega L_q i_q, \quad
              L_q \dot i_q = u_q - R i_q - p \omega (L_d i_d + \psi), \quad
              T = \tfrac32 p (\psi i_q + (L_d - L_q) i_d i_q)

    A linear motor is the same with forces, velocities and p/tau_p (pi over the pole pitch) in the place of p.
    Source: Krishnan, Permanent Magnet Synchronous and Brushless DC Motor Drives, ch. 3.

    Parameters
    ----------
    pole_pairs, resistance, inductance_d, inductance_q, flux
        p (1; rad/m for a linear motor), R (ohm of a phase), L_d, L_q (H), psi (V s).

    The rotor's inertia and damping belong to the `Mechanics` that it drives.

    Examples
    --------
    >>> SynchronousMotor(pole_pairs=4, resistance=0.5, inductance_d=5e-3, inductance_q=5e-3, flux=0.2).torque_constant
    1.2000000000000002
    """

    pole_pairs: float
    resistance: float
    inductance_d: float
    inductance_q: float
    flux: float

    def __post_init__(self) -> None:
        for name in ("pole_pairs", "resistance", "inductance_d", "inductance_q", "flux"):
            positive(f"SynchronousMotor.{name}", getattr(self, name))

    @property
    def torque_constant(self) -> float:
        """Torque per q current (peak of a phase), 3/2 p psi, N m/A."""
        # 3/2 by the transformation to d and q that keeps amplitudes: power of two phases stands for that of three.
        return 1.5 * self.pole_pairs * self.flux


@dataclass(frozen=True)
class TorqueMotor:
    """Motor whose torque follows the command at once (N m, or N of a linear motor): no electrical states.

    Examples
    --------
    >>> TorqueMotor().torque_constant
    1.0
    """

    torque_constant: float = 1.0

    def __post_init__(self) -> None:
        positive("TorqueMotor.torque_constant", self.torque_constant)


@dataclass(frozen=True)
class Inverter:
    """Inverter of a motor: voltage limit and the model of switching.

    Parameters
    ----------
    voltage : float
        Largest amplitude of a phase voltage, V (u_dc/sqrt(3) in the linear range of space-vector modulation).
    kind : str
        ``averaged``: the commanded dq voltage, constant over each step; ``six-pulse``: two-level legs switched by
        comparison with a symmetric triangle, exact in volt-seconds over each simulation step.
    carrier : int
        Carrier periods for each current sample (six-pulse only).

    Examples
    --------
    >>> Inverter(voltage=300.0, kind="six-pulse").carrier
    1
    """

    voltage: float = 320.0
    kind: str = "averaged"
    carrier: int = 1

    def __post_init__(self) -> None:
        positive("Inverter.voltage", self.voltage)
        one_of("Inverter.kind", self.kind, ("averaged", "six-pulse"))
        count("Inverter.carrier", self.carrier)
