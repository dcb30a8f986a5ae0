r"""Tuned mass damper on a structure of known modes: Den Hartog's start, then the least peak, or the deepest stable cut.

A damper of mass m, stiffness k, damping c resists the motion of its base with :math:`Z = -\omega^2 m (k + i \omega c) / (k + i
\omega c - \omega^2 m)`; the response becomes :math:`G_{tt} - G_{tp} Z G_{pt} / (1 + Z G_{pp})`. Sources: Den Hartog, Mechanical
Vibrations, section 3.3; Sims, J. Sound Vib. 301 (2007) (tuned by the real part, for chatter).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from toolpoint._check import ComplexArray, FloatArray, fail, one_of, positive
from toolpoint._doubt import Doubt, status_of
from toolpoint.studies.finite_elements.attached import damper_stiffness, fitting_place
from toolpoint.studies.finite_elements.machine_cut import PLANE, least_depth
from toolpoint.vibration import Dof, Frf, Modes, frequency_response

# What is made best: the least peak, the deepest cut in one direction, the deepest milling at any speed.
GOALS = ("peak", "depth", "lobes")


@dataclass(frozen=True, eq=False)
class TunedDamper:
    """Tuned damper and its effect.

    mass : kg; frequency : Hz of the damper alone on a fixed base; damping_ratio : of it; without_damper, with_damper : (n,)
    response at the tool on `lines` (Hz), m/N, along x for the goal ``lobes``; goal : ``peak``, ``depth`` or ``lobes``; start :
    frequency (Hz) and damping ratio after Den Hartog, where the search begins; status : whether the search ended well; depths :
    least depths of milling without and with it, m, and response : of tool against work with it, for the goal ``lobes`` only.
    """

    mass: float
    frequency: float
    damping_ratio: float
    lines: FloatArray
    without_damper: ComplexArray
    with_damper: ComplexArray
    goal: str
    start: tuple[float, float]
    status: str
    depths: tuple[float, float] | None = None
    response: Frf | None = None

    @property
    def stiffness(self) -> float:
        """Stiffness of its spring, N/m."""
        return self.mass * (2 * np.pi * self.frequency) ** 2

    @property
    def peak_ratio(self) -> float:
        """Largest response with the damper over that without."""
        return float(np.abs(self.with_damper).max() / np.abs(self.without_damper).max())

    @property
    def depth_ratio(self) -> float:
        """Least stable depth with the damper over that without: 1 / -min Re G (Tlusty), or that of milling."""
        if self.depths is not None:
            return self.depths[1] / self.depths[0]
        return float(min(self.without_damper.real.min(), -1e-300) / min(self.with_damper.real.min(), -1e-300))

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as plain data."""
        return {"mass_kg": self.mass, "frequency_hz": self.frequency, "damping_ratio": self.damping_ratio,
                "stiffness_n_m": self.stiffness, "peak_ratio": self.peak_ratio, "depth_ratio": self.depth_ratio,
                "goal": self.goal, "start": list(self.start), "status": self.status}


def tune_damper(
    modes: Modes, tool: Dof | str, place: Dof | str, *, mass: float, lines: FloatArray, goal: str = "peak"
) -> TunedDamper:
    """Return the damper of a mass that leaves the least peak (or the largest least depth) at the tool.

    Parameters
    ----------
    modes : Modes
        Unit modal mass, with damping, that hold both labels.
    tool, place : labels
        Where the response matters, and where (and along what) the damper moves.
    mass : float
        kg.
    lines : (n,) floats
        Hz, over which the response is judged; they should lie close beside the peaks.
    goal : str
        ``peak`` or ``depth`` (of a cut in one direction: 1 / -min Re G); for lobes of milling see `tune_damper_for_cut`.

    Examples
    --------
    >>> modes = Modes([80.0], [0.02], [[0.1]], ["tool:+x"])
    >>> damper = tune_damper(modes, "tool:+x", "tool:+x", mass=2.0, lines=np.linspace(50, 110, 300))
    >>> round(damper.start[0], 2), damper.peak_ratio < 0.3
    (78.43, True)
    """
    one_of("goal", goal, GOALS[:2])
    # A damper at the tool itself has one label: first and last row are then the same.
    labels = list(dict.fromkeys((tool, place)))
    frf = frequency_response.modal(modes, lines, outputs=labels, inputs=labels).values
    g_tt, g_tp, g_pp = frf[:, 0, 0], frf[:, 0, -1], frf[:, -1, -1]
    start = _den_hartog(modes, tool, place, positive("mass", mass))
    omega = 2 * np.pi * np.asarray(lines)

    def response(values: FloatArray) -> ComplexArray:
        force = damper_stiffness(omega, mass, float(np.exp(values[0])), ratio=float(np.exp(values[1])))
        return g_tt - g_tp**2 * force / (1 + force * g_pp)

    def cost(values: FloatArray) -> float:
        g = response(values)
        # Logarithms, so that the search's tolerance is a relative one.
        return float(np.log(np.abs(g).max() if goal == "peak" else max(-g.real.min(), 1e-300)))

    x, status = _search(cost, [start])
    return TunedDamper(mass, float(np.exp(x[0]) / (2 * np.pi)), float(np.exp(x[1])), np.asarray(lines), g_tt, response(x), goal,
                       start, status)


def tune_damper_for_cut(modes: Modes, place: Dof | str, mass: float, *, lines: FloatArray, factors: FloatArray) -> TunedDamper:
    """Return the damper of a mass with which the least stable depth of milling at any speed is the largest.

    Parameters
    ----------
    modes : Modes
        Unit modal mass, with damping, of the tool against the work and of the place.
    place : label
        Where, and along what, the damper moves.
    mass : float
        kg.
    lines : (n,) floats
        Hz.
    factors : (2, 2) floats
        Mean directional matrix of the cut, see `machine_cut.mean_factors`.
    """
    fitting = fitting_place(modes, place, lines)
    first = [_den_hartog(modes, tool, place, positive("mass", mass)) for tool in PLANE]

    def response(values: FloatArray) -> ComplexArray:
        return fitting.with_device(damper_stiffness(fitting.omega, mass, float(np.exp(values[0])),
                                                    ratio=float(np.exp(values[1]))))

    def cost(values: FloatArray) -> float:
        return -float(np.log(least_depth(response(values), factors, fitting.lines)[0]))

    # A cut is often limited by another mode than that of the peak: the search starts at every mode.
    starts = [*first, *((float(f), first[0][1]) for f in modes.frequency if f < fitting.lines[-1])]
    x, status = _search(cost, starts)
    depths = tuple(least_depth(values, factors, fitting.lines)[0] for values in (fitting.cut, response(x)))
    frequency, ratio = float(np.exp(x[0]) / (2 * np.pi)), float(np.exp(x[1]))
    return TunedDamper(mass, frequency, ratio, fitting.lines, fitting.cut[:, 0, 0], response(x)[:, 0, 0], "lobes", first[0],
                       status,
                       (depths[0], depths[1]), fitting.frf(response(x)))


def _search(cost: Callable[[FloatArray], float], starts: Sequence[tuple[float, float]]) -> tuple[FloatArray, str]:
    """Return logarithms of angular frequency (rad/s) and damping ratio of least cost, (2,), and a status.

    starts : frequency (Hz) and damping ratio of each. The status is a doubt where the best search did not end.
    """
    # Logarithms of both: neither can become negative, and both steps are relative.
    runs = [minimize(cost, np.log([2 * np.pi * f, max(ratio, 1e-3)]), method="Nelder-Mead",
                     options={"xatol": 1e-7, "fatol": 1e-10, "maxiter": 4000}) for f, ratio in starts]
    best = min(runs, key=lambda run: float(run.fun))
    if not best.success:
        return best.x, status_of([Doubt("search", f"not ended ({best.message})", "give more lines")], "")
    starts_text = "" if len(runs) == 1 else f", the best of {len(runs)} starts"
    return best.x, f"least found by a search from Den Hartog's tuning{starts_text}"


def _den_hartog(modes: Modes, tool: Dof | str, place: Dof | str, mass: float) -> tuple[float, float]:
    """Return f_r / (1 + mu), Hz, and sqrt(3 mu / (8 (1 + mu))) of the dominant mode r, mu = m phi_p^2.

    Dominant is the mode in which a force at the damper's place moves the tool most at resonance. Den Hartog's ratio
    sqrt(3 mu / (8 (1 + mu)^3)) is c / (2 m omega_r), of the structure's frequency; over the damper's own it is 1 + mu times
    as large.
    """
    if modes.scaling != "unit modal mass":
        fail("modes", f"scaling {modes.scaling!r}", "must be 'unit modal mass'")
    shape_t, shape_p = modes.shape_at([tool])[0].real, modes.shape_at([place])[0].real
    # The mode that a force at the damper's place moves the tool in most, at its resonance.
    peaks = np.abs(shape_t * shape_p) / np.maximum(modes.omega**2 * np.maximum(modes.damping_ratio, 1e-4), 1e-300)
    mode = int(np.argmax(peaks))
    ratio = mass * float(shape_p[mode]) ** 2
    if ratio <= 0:
        fail("place", str(place), "must move in a mode that moves the tool", remedy="put the damper where the shape is large")
    return float(modes.frequency[mode] / (1 + ratio)), float(np.sqrt(3 * ratio / (8 * (1 + ratio))))
