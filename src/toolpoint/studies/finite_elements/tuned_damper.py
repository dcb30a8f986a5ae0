r"""Tuned mass damper on a structure of known modes: Den Hartog's start, then the least peak, or the deepest stable cut.

A damper of mass m, stiffness k, damping c resists the motion of its base with :math:`Z = -\omega^2 m (k + i \omega c) / (k + i
\omega c - \omega^2 m)`; the response becomes :math:`G_{tt} - G_{tp} Z G_{pt} / (1 + Z G_{pp})`. Sources: Den Hartog, Mechanical
Vibrations, section 3.3; Sims, J. Sound Vib. 301 (2007) (tuned by the real part, for chatter).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from toolpoint._check import ComplexArray, FloatArray, fail, one_of, positive
from toolpoint.vibration import Dof, Modes, frequency_response

GOALS = ("peak", "depth")


@dataclass(frozen=True, eq=False)
class TunedDamper:
    """A damper and what it does.

    mass : kg; frequency : Hz of the damper alone on a fixed base; damping_ratio : of it; before, after : (n,) response at the
    tool on `lines` (Hz), m/N, without and with it; goal : ``peak`` or ``depth``; start : (frequency, damping ratio) after Den
    Hartog; status : whether the search ended well.
    """

    mass: float
    frequency: float
    damping_ratio: float
    lines: FloatArray
    before: ComplexArray
    after: ComplexArray
    goal: str
    start: tuple[float, float]
    status: str

    @property
    def stiffness(self) -> float:
        """N/m."""
        return self.mass * (2 * np.pi * self.frequency) ** 2

    @property
    def peak_ratio(self) -> float:
        """Largest response with the damper over that without."""
        return float(np.abs(self.after).max() / np.abs(self.before).max())

    @property
    def depth_ratio(self) -> float:
        """Least stable depth with the damper over that without: depths go with 1 / -min Re G (Tlusty)."""
        return float(min(self.before.real.min(), -1e-300) / min(self.after.real.min(), -1e-300))

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers as plain data."""
        return {"mass_kg": self.mass, "frequency_hz": self.frequency, "damping_ratio": self.damping_ratio,
                "stiffness_n_m": self.stiffness, "peak_ratio": self.peak_ratio, "depth_ratio": self.depth_ratio,
                "goal": self.goal, "start": list(self.start), "status": self.status}


def tune_damper(
    modes: Modes, tool: Dof | str, place: Dof | str, mass: float, *, lines: FloatArray, goal: str = "peak"
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
        ``peak`` or ``depth``.
    """
    one_of("goal", goal, GOALS)
    labels = list(dict.fromkeys((tool, place)))
    frf = frequency_response.modal(modes, lines, outputs=labels, inputs=labels).values
    g_tt, g_tp, g_pp = frf[:, 0, 0], frf[:, 0, -1], frf[:, -1, -1]
    start = _den_hartog(modes, tool, place, positive("mass", mass))
    omega = 2 * np.pi * np.asarray(lines)

    def response(values: FloatArray) -> ComplexArray:
        w, ratio = np.exp(values[0]), np.exp(values[1])
        spring = mass * (w**2 + 2j * ratio * w * omega)
        force = -(omega**2) * mass * spring / (spring - omega**2 * mass)
        return g_tt - g_tp**2 * force / (1 + force * g_pp)

    def cost(values: FloatArray) -> float:
        g = response(values)
        return float(np.log(np.abs(g).max() if goal == "peak" else max(-g.real.min(), 1e-300)))

    best = minimize(cost, np.log([2 * np.pi * start[0], start[1]]), method="Nelder-Mead",
                    options={"xatol": 1e-7, "fatol": 1e-10, "maxiter": 4000})
    status = "least found by a search from Den Hartog's tuning"
    if not best.success:
        status = f"search not ended ({best.message}): give more lines"
    return TunedDamper(mass, float(np.exp(best.x[0]) / (2 * np.pi)), float(np.exp(best.x[1])), np.asarray(lines), g_tt,
                       response(best.x), goal, start, status)


def _den_hartog(modes: Modes, tool: Dof | str, place: Dof | str, mass: float) -> tuple[float, float]:
    """Return f_r / (1 + mu) and sqrt(3 mu / (8 (1 + mu)^3)) for the mode that moves the tool most, mu = m phi_p^2."""
    if modes.scaling != "unit modal mass":
        fail("modes", f"scaling {modes.scaling!r}", "must be 'unit modal mass'")
    shape_t, shape_p = modes.shape_at([tool])[0].real, modes.shape_at([place])[0].real
    strong = np.abs(shape_t * shape_p) / np.maximum(modes.omega**2 * np.maximum(modes.damping_ratio, 1e-4), 1e-300)
    worst = int(np.argmax(strong))
    ratio = mass * float(shape_p[worst]) ** 2
    if ratio <= 0:
        fail("place", str(place), "must move in a mode that moves the tool", "put the damper where the shape is large")
    return float(modes.frequency[worst] / (1 + ratio)), float(np.sqrt(3 * ratio / (8 * (1 + ratio) ** 3)))
