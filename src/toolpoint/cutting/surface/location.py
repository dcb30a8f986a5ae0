r"""Surface location error from the frequency response: stable forced vibration is tooth-periodic."""

from __future__ import annotations

import warnings

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, ToolpointWarning, fail, one_of, positive
from toolpoint.cutting.cut.arc import gauss
from toolpoint.cutting.cut.coefficients import force_direction
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem, check_speeds
from toolpoint.cutting.cut.tool import Engagement

WALL_ANGLE_TOLERANCE = 1e-6  # rad
STATIC_LINE_COUNT = 5  # lines of a measured FRF whose median stands for the response below it


def static_force_series(problem: MillingProblem, depth: float, harmonics: int) -> ComplexArray:
    r"""Return Fourier coefficients c_k, k = -H..H, of the static force over a tooth pitch, N, shape (2H + 1, 3).

    :math:`F(t) = -w \sum_j g_j [k(\phi_j) f_z \sin\phi_j + k_e(\phi_j)] = \sum_k c_k e^{i k \omega_T t}`, time zero at
    tooth 0's entry; helical tools are averaged over their height.
    """
    tool, arc, material = problem.tool, problem.engagement, problem.coefficients
    pitch = 2 * np.pi / tool.teeth
    x, w, _ = gauss(40 + int(np.ceil(0.6 * harmonics * arc.arc * tool.teeth)))
    phi = arc.entry + arc.arc * (1 + x) / 2
    k = force_direction(material, phi) * (problem.feed_per_tooth * np.sin(phi))[:, None]
    s, c = np.sin(phi), np.cos(phi)
    k = k + np.stack([material.edge_t * c + material.edge_n * s, -material.edge_t * s + material.edge_n * c], axis=-1)
    axial = -(material.ka * problem.feed_per_tooth * np.sin(phi) + material.edge_a)  # the tool is pulled along its axis
    k = np.concatenate([k, axial[:, None]], axis=1)
    order = np.arange(-harmonics, harmonics + 1)
    wave = np.exp(-1j * order[:, None] * tool.teeth * (phi - arc.entry)) * (w * arc.arc / 2 / pitch)
    series = -depth * wave @ k
    if tool.has_helix:
        half = np.tan(tool.helix[0]) / tool.diameter * depth * tool.teeth * order
        series = series * (np.exp(-1j * half) * np.sinc(half / np.pi))[:, None]
    return series


def wall_side(engagement: Engagement) -> str | None:
    """Return the side of the cut that leaves a wall: ``exit`` (down-milling, slot), ``entry`` (up-milling), None (neither)."""
    if engagement.exit > np.pi - WALL_ANGLE_TOLERANCE:
        return "exit"
    return "entry" if engagement.entry < WALL_ANGLE_TOLERANCE else None


def location_error(problem: MillingProblem, speeds: FloatArray, depth: float, *, side: str = "exit",
                   harmonics: int = 0) -> FloatArray:
    r"""Return the surface location error at each speed, m: positive where the tool leaves material (undercut).

    :math:`y(t_s) = \sum_k G(i k \omega_T) c_k e^{i k \omega_T t_s}`, t_s when a tooth is at phi = pi (``exit``,
    down-milling) or phi = 0 (``entry``, up-milling); at the tool's tip.

    Parameters
    ----------
    problem : MillingProblem
        Regular tool; `feed_per_tooth` above zero.
    speeds : (n,) floats
        rev/min; speeds at which the cut is stable (not checked here).
    depth : float
        m.
    side : str
        ``exit`` or ``entry``: the side on which the finished surface is.
    harmonics : int
        Tooth harmonics kept; chosen by the highest mode where 0.

    A measured FRF is taken as zero above its band; below it, and for the static deflection, as the real part of its lowest
    lines, with a ToolpointWarning.

    Source: Schmitz, Ziegert, Precision Engineering 23 (1999) 51; Mann, Young, Schmitz, Dilley, JMSE 127 (2005) 652.
    """
    one_of("side", side, ("exit", "entry"))
    depth = positive("depth", depth, 1.0)
    if not problem.tool.is_regular or problem.tool.corner_radius > 0:
        fail("problem", "unequal pitch or helix, or a rounded edge", "must be a regular cylindrical tool",
             remedy="take the surface of a simulation")
    if problem.feed_per_tooth <= 0:
        fail("MillingProblem.feed_per_tooth", "0", "must be above zero", remedy="problem.changed(feed_per_tooth=...)")
    tool, arc = problem.tool, problem.engagement
    if not problem.plane.is_modal and problem.plane.span[0] > 0:
        warnings.warn(f"surface location error: the response below {problem.plane.span[0]:g} Hz, static deflection included, "
                      "is taken as the real part at the lowest measured lines", ToolpointWarning, stacklevel=2)
    out = []
    for speed in check_speeds(speeds):
        plane = problem.plane_at(float(speed))
        tooth = float(tool.teeth * speed / 60)
        order_max = harmonics or int(np.ceil(60 * plane.span[1] / tooth)) + 200
        c = static_force_series(problem, depth, order_max)
        order = np.arange(-order_max, order_max + 1)
        g = _response(plane, np.abs(order) * tooth)
        g = np.where((order < 0)[:, None, None], g.conj(), g)
        turn = (np.pi if side == "exit" else 0.0) - arc.entry
        y = np.einsum("kab,kb,k->a", g, c[:, :plane.size], np.exp(1j * order * tool.teeth * turn)).real
        # The finished wall is at the tooth's own direction n = (0, cos): outward motion there cuts too deep.
        out.append(-y[1] * (-1.0 if side == "exit" else 1.0))
    return np.array(out)


def _response(plane: PlaneDynamics, frequency: FloatArray) -> ComplexArray:
    """Return G; below the first line of a measured FRF the real part of its lowest lines."""
    g = plane.response(frequency)
    if plane.is_modal:
        return g
    below = np.median(plane.lines[1][:STATIC_LINE_COUNT].real, axis=0)
    return np.where((frequency < plane.span[0])[:, None, None], below, g)
