r"""Surface location error from the frequency response: stable forced vibration is tooth-periodic."""

from __future__ import annotations

import warnings

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, ToolpointWarning, fail, one_of, positive
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem, check_speeds
from toolpoint.cutting.cut.tool import Engagement

WALL_ANGLE_TOLERANCE = 1e-6  # rad
MIN_COMPLIANCE_SHARE = 1e-5  # of the static compliance: stiffer modes ask for no further harmonics
STATIC_LINE_COUNT = 5  # lines of a measured FRF whose median stands for the response below it


def static_force_series(problem: MillingProblem, depth: float, harmonics: int) -> ComplexArray:
    r"""Return Fourier coefficients c_k, k = -H..H, of the static force over a tooth pitch, N, shape (2H + 1, 3).

    :math:`F(t) = -w \sum_j g_j [k(\phi_j) f_z \sin\phi_j + k_e(\phi_j)] = \sum_k c_k e^{i k \omega_T t}`, time zero at
    tooth 0's entry; helical tools are averaged over their height. The bracket is a sum of :math:`a_m e^{i m \phi}`, m = -2..2,
    so every coefficient is an integral in closed form, however many there are.
    """
    tool, arc = problem.tool, problem.engagement
    order = np.arange(-harmonics, harmonics + 1)
    m = np.arange(-2, 3)
    turn = m[None, :] - order[:, None] * tool.teeth
    wave = np.exp(1j * m * arc.entry + 1j * turn * arc.arc / 2) * np.sinc(turn * arc.arc / (2 * np.pi)) * arc.arc
    series = -depth * tool.teeth / (2 * np.pi) * wave @ _force_waves(problem)
    if tool.has_helix:
        half = np.tan(tool.helix[0]) / tool.diameter * depth * tool.teeth * order
        series = series * (np.exp(-1j * half) * np.sinc(half / np.pi))[:, None]
    return series


def _force_waves(problem: MillingProblem) -> ComplexArray:
    """Return the force of a tooth per depth as a_m, m = -2..2, over x, y and the axis, N/m."""
    material, feed = problem.coefficients, problem.feed_per_tooth
    one = np.array([0, 0, 1, 0, 0], complex)
    sine, cosine = np.array([0, 0.5j, 0, -0.5j, 0]), np.array([0, 0.5, 0, 0.5, 0])
    sine_squared = np.array([-0.25, 0, 0.5, 0, -0.25])
    sine_cosine = np.array([0.25j, 0, 0, 0, -0.25j])
    along = feed * (material.kt * sine_cosine + material.kn * sine_squared) + material.edge_t * cosine + material.edge_n * sine
    across = feed * (material.kn * sine_cosine - material.kt * sine_squared) - material.edge_t * sine + material.edge_n * cosine
    axial = -(material.ka * feed * sine + material.edge_a * one)  # the tool is pulled along its axis
    return np.stack([along, across, axial], axis=1)


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
        Tooth harmonics kept; chosen by the highest mode that holds a share of the compliance where 0.

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
        order_max = harmonics or int(np.ceil(60 * _highest_frequency(plane) / tooth)) + 200
        c = static_force_series(problem, depth, order_max)
        order = np.arange(-order_max, order_max + 1)
        g = response_with_static(plane, np.abs(order) * tooth)
        g = np.where((order < 0)[:, None, None], g.conj(), g)
        turn = (np.pi if side == "exit" else 0.0) - arc.entry
        y = np.einsum("kab,kb,k->a", g, c[:, :plane.size], np.exp(1j * order * tool.teeth * turn)).real
        # The finished wall is at the tooth's own direction n = (0, cos): outward motion there cuts too deep.
        out.append(-y[1] * (-1.0 if side == "exit" else 1.0))
    return np.array(out)


def _highest_frequency(plane: PlaneDynamics) -> float:
    """Return the highest frequency whose modes hold a share of the static compliance, Hz.

    Joints that are all but locked put modes at MHz into a machine file. They follow a force at once, and harmonics up there
    would be hundreds of thousands.
    """
    if not plane.is_modal:
        return plane.span[1]
    order = np.argsort(np.abs(plane.poles))
    compliance = (np.linalg.norm(plane.residues, axis=(1, 2)) / np.abs(plane.poles))[order]
    tail = np.cumsum(compliance[::-1])[::-1]
    last = int(np.flatnonzero(tail >= MIN_COMPLIANCE_SHARE * tail[0]).max())
    return float(np.abs(plane.poles[order[last]]) / (2 * np.pi))


def response_with_static(plane: PlaneDynamics, frequency: FloatArray) -> ComplexArray:
    """Return G (n, d, d); below the first line of a measured FRF the real part of its lowest lines."""
    g = plane.response(frequency)
    if plane.is_modal:
        return g
    below = np.median(plane.lines[1][:STATIC_LINE_COUNT].real, axis=0)
    return np.where((frequency < plane.span[0])[:, None, None], below, g)
