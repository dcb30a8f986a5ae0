r"""Active damping: a proof-mass actuator with velocity feedback, its loop's stability margin, and its effect.

The actuator is a mass m on a spring and damper, :math:`\kappa = k + i \omega c`, with a force u between base and mass; u = -g
D v, v the velocity of the base, D the electronics: a high-pass against drift of the integrator, a low-pass of the amplifier,
a delay. The base feels the dynamic stiffness :math:`Z = -\omega^2 m (\kappa + i \omega g D) / (\kappa - \omega^2 m)`. The
loop is :math:`L = -\frac{\omega^2 m}{\kappa - \omega^2 m}\,i \omega g D\,G'_{pp}`, with G' the structure that carries the
passive actuator; all its parts are stable, so the loop is if and only if L does not circle -1 (Nyquist). Below its own
resonance the actuator's force turns its sign: so the gain is always bounded. Source: Preumont, Vibration Control of Active
Structures, ch. 7; Baur, Zaeh, CIRP Annals 61 (2012) on machine tools.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from toolpoint._check import ComplexArray, FloatArray, fail, nonnegative, positive
from toolpoint._notebook import NotebookText
from toolpoint.studies.finite_elements.attached import FittingPlace, damper_stiffness
from toolpoint.studies.finite_elements.machine_cut import least_depth
from toolpoint.vibration import Frf

# Largest step of arg(1 + L) between two lines, rad: a larger one could be a turn the other way round.
_MAX_LOOP_TURN = 1.0


@dataclass(frozen=True)
class ProofMassActuator:
    """An inertial actuator with its electronics.

    Parameters
    ----------
    mass : float
        Moving mass, kg.
    frequency, damping_ratio : float
        Of the mass on its own spring, base fixed; Hz. The frequency lies well below the first mode that is to be damped.
    delay : float
        Of controller and converters, s.
    bandwidth : float
        Corner of the amplifier's first-order low-pass, Hz.
    high_pass : float
        Corner of the first-order high-pass behind the integrator, Hz.
    """

    mass: float
    frequency: float = 8.0
    damping_ratio: float = 0.4
    delay: float = 0.2e-3
    bandwidth: float = 1000.0
    high_pass: float = 1.0

    def __post_init__(self) -> None:
        for name in ("mass", "frequency", "damping_ratio", "bandwidth"):
            positive(f"ProofMassActuator.{name}", getattr(self, name))
        for name in ("delay", "high_pass"):
            nonnegative(f"ProofMassActuator.{name}", np.array(getattr(self, name)))

    def passive(self, omega: FloatArray) -> ComplexArray:
        """Return the dynamic stiffness (n,) at its base without feedback, N/m; omega : (n,) rad/s."""
        return damper_stiffness(omega, self.mass, 2 * np.pi * self.frequency, ratio=self.damping_ratio)

    def active(self, omega: FloatArray) -> ComplexArray:
        """Return the dynamic stiffness (n,) that feedback adds for each N s/m of gain, (N/m)/(N s/m); omega : (n,) rad/s."""
        natural = 2 * np.pi * self.frequency
        spring = self.mass * (natural**2 + 2j * self.damping_ratio * natural * omega)
        return -(omega**2) * self.mass / (spring - omega**2 * self.mass) * 1j * omega * self.electronics(omega)

    def electronics(self, omega: FloatArray) -> ComplexArray:
        """Return D (n,), about 1 in the middle of its band; omega : (n,) rad/s."""
        w = 2 * np.pi * self.high_pass
        drift = 1.0 if w == 0 else 1j * omega / (1j * omega + w)
        return drift * np.exp(-1j * omega * self.delay) / (1 + 1j * omega / (2 * np.pi * self.bandwidth))


@dataclass(frozen=True, eq=False)
class LoopMargins(NotebookText):
    """Margins of a loop L.

    distance : least ``|1 + L|`` over the lines; gain : factor by which the gain may grow, infinite without a crossing; phase :
    phase margin, rad, to the nearest line. They say nothing where the loop is not stable.
    """

    is_stable: bool
    distance: float
    gain: float
    phase: float

    def __str__(self) -> str:
        if not self.is_stable:
            return "unstable"
        return (f"stable: gain margin {20 * np.log10(self.gain):.1f} dB, phase margin {np.degrees(self.phase):.0f} deg, "
                f"distance from -1 {self.distance:.2f}")


@dataclass(frozen=True, eq=False)
class ActiveDamper(NotebookText):
    """Actuator at a place with its gain (N s/m) and its effect.

    margins : of its loop; largest_gain : at which the loop becomes unstable, N s/m; response : tool against work with it;
    depths : least depths of milling without, with the passive actuator and with feedback, m; peaks : largest responses along
    x likewise, m/N; force : largest feedback force u per newton at the tool along x, N/N; stroke : largest motion of the mass
    against its base likewise, m/N; status : what bounds the gain.
    """

    actuator: ProofMassActuator
    gain: float
    margins: LoopMargins
    largest_gain: float
    response: Frf
    depths: tuple[float, float, float]
    peaks: tuple[float, float, float]
    force: float
    stroke: float
    status: str

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as plain data."""
        return {"mass_kg": self.actuator.mass, "own_frequency_hz": self.actuator.frequency, "gain_n_s_m": self.gain,
                "largest_gain_n_s_m": self.largest_gain, "stable": bool(self.margins.is_stable),
                "gain_margin_db": float(20 * np.log10(self.margins.gain)),
                "phase_margin_deg": float(np.degrees(self.margins.phase)),
                "distance_from_minus_one": self.margins.distance, "least_depths_m": list(self.depths),
                "peaks_m_n": list(self.peaks),
                "force_n_n": self.force, "stroke_m_n": self.stroke, "status": self.status}

    def __repr__(self) -> str:
        return f"ActiveDamper({self.actuator.mass:g} kg, gain {self.gain:.3g} N s/m, {self.margins})"


def open_loop(place: FittingPlace, actuator: ProofMassActuator) -> ComplexArray:
    """Return the loop L (n_f,) for each N s/m of gain on the lines of a place."""
    passive = actuator.passive(place.omega)
    return actuator.active(place.omega) * place.itself / (1 + passive * place.itself)


def loop_lines(lines: FloatArray, actuator: ProofMassActuator) -> FloatArray:
    """Return the lines (Hz) with 4000 more, from far below the actuator's frequency to far above its bandwidth."""
    frequency_min, frequency_max = 0.01 * min(actuator.frequency, float(lines[0])), 40 * max(actuator.bandwidth,
                                                                                             float(lines[-1]))
    # The lines of the cut are among them, so that its response can be taken out again.
    return np.unique(np.concatenate([np.geomspace(frequency_min, frequency_max, 4000), lines]))


def loop_margins(loop: ComplexArray) -> LoopMargins:
    """Return the margins of a loop (n,) on increasing lines, at both ends of which it is small.

    Raises ToolpointError where lines are too far apart to count how the loop turns about -1, or its ends are not small.
    """
    ends = np.abs(loop[[0, -1]]).max()
    if ends > 0.5:
        fail("loop", f"{ends:.2g} at an end of its lines", "must be below 0.5 there", remedy="take lines further down and up")
    # Turns are counted by small steps between lines; the ends, where L is small, belong to a closed curve.
    turn = np.angle((1 + loop)[1:] / (1 + loop)[:-1])
    if np.abs(turn).max() > _MAX_LOOP_TURN:
        fail("loop", f"1 + L turns by {np.abs(turn).max():.2g} rad between two lines", f"must be below {_MAX_LOOP_TURN:g}",
             remedy="take more lines about the loop's poles, or a smaller gain")
    start, end = np.angle(1 + loop[0]), np.angle(1 + loop[-1])
    turns = (float(turn.sum()) + start - end) / (2 * np.pi)
    # Crossings of the negative real axis, by straight lines between lines, and of the unit circle.
    crossing = np.flatnonzero((loop.imag[1:] * loop.imag[:-1] < 0) & (loop.real[1:] < 0))
    axis_values = [float(loop.real[k] - loop.imag[k] * (loop.real[k + 1] - loop.real[k]) / (loop.imag[k + 1] - loop.imag[k]))
                   for k in crossing]
    gain = min([1 / -value for value in axis_values if -1 < value < 0], default=np.inf)
    size = np.abs(loop)
    unit = np.flatnonzero((size[1:] - 1) * (size[:-1] - 1) < 0)
    phase = min([float(np.abs(np.angle(-loop[k + (size[k + 1] > size[k])]))) for k in unit], default=np.pi)
    return LoopMargins(abs(turns) < 0.5, float(np.abs(1 + loop).min()), gain, phase)


def tune_gain(place: FittingPlace, actuator: ProofMassActuator, *, factors: FloatArray, least_distance: float = 0.5,
              most_force: float = 2.0) -> ActiveDamper:
    """Return the actuator with the gain that allows the deepest cut while its loop keeps a distance from -1.

    Parameters
    ----------
    place : FittingPlace
        Lines from well below the actuator's own frequency, close enough about the modes.
    actuator : ProofMassActuator
    factors : (2, 2) floats
        Mean directional matrix of the cut, see `machine_cut.mean_factors`.
    least_distance : float
        Least ``|1 + L|``; 0.5 keeps 6 dB of gain and 29 degrees of phase.
    most_force : float
        Largest feedback force for a force at the tool along x, N/N, at any line: rated force over the force of the cut.
    """
    positive("least_distance", least_distance)
    positive("most_force", most_force)
    loop = open_loop(place, actuator)
    passive, active = actuator.passive(place.omega), actuator.active(place.omega)
    largest = _largest_gain(loop)
    bounds = {"that its distance from -1 sets": _largest_gain_by_distance(loop, largest, least_distance),
              "of the actuator's force": _largest_gain_by_force(place, actuator, largest, most_force)}
    allowed = min(bounds.values())

    def depth(gain: float) -> float:
        return least_depth(place.with_device(passive + gain * active), factors, place.lines)[0]

    # A bounded search never returns its ends, which are candidates too.
    best = minimize_scalar(lambda g: -depth(g), bounds=(0.0, allowed), method="bounded", options={"xatol": 1e-5 * allowed})
    gain = max((0.0, float(best.x), allowed), key=depth)
    values = place.with_device(passive + gain * active)
    status = (f"the gain is at the bound {min(bounds, key=lambda name: bounds[name])}" if gain > 0.999 * allowed
              else "no gain helps this cut: feedback is left off" if gain == 0 else "least depth is the largest at this gain")
    depths = least_depth(place.cut, factors, place.lines)[0], depth(0.0), depth(gain)
    peaks = tuple(float(np.abs(v[:, 0, 0]).max()) for v in (place.cut, place.with_device(passive), values))
    force, stroke = _efforts(place, actuator, gain)
    return ActiveDamper(actuator, gain, loop_margins(gain * loop), largest, place.frf(values), depths,
                        (peaks[0], peaks[1], peaks[2]), force, stroke, status)


def _largest_gain(loop: ComplexArray) -> float:
    """Return the gain (N s/m) at which a loop of unit gain (n,) reaches -1: by its farthest crossing of the negative axis."""
    crossing = np.flatnonzero((loop.imag[1:] * loop.imag[:-1] < 0) & (loop.real[1:] < 0))
    values = [float(loop.real[k] - loop.imag[k] * (loop.real[k + 1] - loop.real[k]) / (loop.imag[k + 1] - loop.imag[k]))
              for k in crossing]
    if not values:
        fail("loop", "no crossing of the negative real axis", "must have one: every actuator turns its force's sign somewhere",
             remedy="take lines from well below its own frequency")
    return 1 / max(-value for value in values)


def _largest_gain_by_distance(loop: ComplexArray, largest: float, distance: float) -> float:
    """Return the least gain (N s/m) at which the loop comes within `distance` of -1, at most `largest`."""
    def gap(gain: float) -> float:
        return float(np.abs(1 + gain * loop).min()) - distance

    if distance >= 1:
        fail("least_distance", f"{distance:g}", "must be below 1, which is that of no gain")
    gain_below = 0.0
    for gain in np.linspace(0, largest, 400)[1:]:
        if gap(gain) < 0:
            return float(brentq(gap, gain_below, gain, xtol=1e-6 * largest))
        gain_below = float(gain)
    return gain_below


def _largest_gain_by_force(place: FittingPlace, actuator: ProofMassActuator, largest: float, force_max: float) -> float:
    """Return the least gain (N s/m) at which the feedback force for a newton at the tool reaches its bound (N/N)."""
    def excess(gain: float) -> float:
        return _efforts(place, actuator, gain)[0] - force_max

    gain_below = 0.0
    for gain in np.linspace(0, largest, 60)[1:]:
        if excess(gain) > 0:
            return float(brentq(excess, gain_below, gain, xtol=1e-6 * largest))
        gain_below = float(gain)
    return gain_below


def _efforts(place: FittingPlace, actuator: ProofMassActuator, gain: float) -> tuple[float, float]:
    """Return the largest feedback force (N/N) and stroke of the mass (m/N) per newton at the tool along x, over the lines."""
    total = actuator.passive(place.omega) + gain * actuator.active(place.omega)
    motion = place.from_cut[:, 0] / (1 + total * place.itself)
    force = gain * np.abs(1j * place.omega * actuator.electronics(place.omega) * motion)
    # The base pushes the mass with Z x = -m w^2 x_a, so x_a - x = -Z x / (m w^2) - x.
    stroke = np.abs(total * motion / (actuator.mass * place.omega**2) + motion)
    return float(force.max()), float(stroke.max())
