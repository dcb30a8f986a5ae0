r"""Turning on a structure known in several directions: the oriented response, and the chip width stable at every speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its rooms load on first use
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats, positive
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import TurningProblem, plane_dynamics
from toolpoint.cutting.stability.hill.noise import line_variance
from toolpoint.vibration import Modes
from toolpoint.vibration.frf import Frf

REAL_PART_LINES = 4000  # even lines of the search for the least real part, beside 65 about every mode
WIDTH_RANGE_FACTOR = 10.0  # largest width of a chart over the unconditional limit
MAX_TURNING_WIDTH = 0.5  # m, largest width of any chart
_DIRECTION_TOLERANCE = 1e-9  # of the length: a smaller component of n or f counts as zero
_AXES = "xyz"


@dataclass(frozen=True)
class UnconditionalLimit:
    """Width below which the cut is stable at every spindle speed.

    width : m, infinite where the oriented response never has a negative real part; frequency : chatter frequency there, Hz;
    real : the least real part of the oriented response, m/N; error : of the width by the noise of measured lines (95 %) and by
    how far the lines lie apart, m, zero for modes; tips : spindle speeds (rev/min) at which it is reached, lobe 0
    first.
    """

    width: float
    frequency: float
    real: float
    tips: FloatArray
    error: float = 0.0


def unit_vector(name: str, direction: ArrayLike) -> FloatArray:
    """Return a direction (3,) at length 1; `name` is that of the argument in the error for a zero vector."""
    vector = floats(name, direction, (3,))
    length = float(np.linalg.norm(vector))
    if length <= 0:
        fail(name, "a vector of zero length", "must have a direction")
    return np.asarray(vector / length)


def orient(response: Modes | Frf, labels: Mapping[str, str], normal: ArrayLike, *, force: ArrayLike) -> PlaneDynamics:
    r"""Return the response of the chip thickness to the cutting force, :math:`n^T G f`, as the x of a PlaneDynamics.

    The result has two directions, as every PlaneDynamics: all entries but (x, x) are zero.

    Parameters
    ----------
    response : Modes or Frf of one pose
    labels : mapping of axis (x, y, z) to label
        The directions whose response is known.
    normal : (3,) floats
        n, the direction in which the chip is thick, from the work into the tool.
    force : (3,) floats
        f, force on the tool per width, chip thickness and K_f: n itself where only K_f acts.

    Raises ToolpointError where n or f has a part along an axis whose response is not known.
    """
    n, f = unit_vector("normal", normal), np.asarray(floats("force", force, (3,)))
    used = [k for k in range(3) if abs(n[k]) > _DIRECTION_TOLERANCE or abs(f[k]) > _DIRECTION_TOLERANCE * np.linalg.norm(f)]
    for k in used:
        if _AXES[k] not in labels:
            fail("direction", f"({n[0]:g}, {n[1]:g}, {n[2]:g}), force along ({f[0]:g}, {f[1]:g}, {f[2]:g})",
                 f"the response along {_AXES[k]} is not known", remedy=f"known are {', '.join(labels.values())}")
    known_labels = [labels[_AXES[k]] for k in used]
    x, y, z = [*(known_labels if len(known_labels) > 1 else known_labels * 2), None][:3]
    plane = plane_dynamics(response, x, y, z=z)
    left, right = n[used], f[used]
    if len(used) == 1:
        left, right = np.append(left, 0.0), np.append(right, 0.0)

    def along(matrix: Array) -> Array:
        out = np.zeros((*matrix.shape[:-2], 2, 2), matrix.dtype)
        out[..., 0, 0] = np.einsum("i,...ij,j->...", left, matrix, right)
        return out

    values = None if plane.values is None else along(plane.values)
    variance = None
    # Noise of the entries of G is taken as independent: variances add with the squares of n_i f_j.
    if plane.variance is not None:
        variance = np.zeros((*plane.variance.shape[:-2], 2, 2))
        variance[..., 0, 0] = np.einsum("i,...ij,j->...", left**2, plane.variance, right**2)
    draws = None if plane.draws is None else along(plane.draws)
    return replace(plane, residues=along(plane.residues), static=along(plane.static), values=values, variance=variance,
                   draws=draws)


def unconditional_limit(problem: TurningProblem, lobes: int = 12) -> UnconditionalLimit:
    r"""Return the width that is stable at every speed: :math:`b = -1/(2 K_f \min \mathrm{Re}\, G)`.

    There :math:`e^{-i\omega T} = 1 + 1/(K_f b G)`, which gives the speeds of the lobes' tips; lobes : number of tips.

    Source: Tlusty, Polacek, The stability of the machine tool against self-excited vibration, ASME Int. Research in
    Production Engineering (1963) 465; Altintas, Manufacturing Automation, 2nd ed., section 4.2.
    """
    if problem.process_damping > 0:
        fail("problem", "process damping", "its limit depends on the speed", remedy="read it from the chart")
    f, g = _least_real(problem.plane)
    if g.real >= 0:
        return UnconditionalLimit(float("inf"), f, float(g.real), np.zeros(0))
    width = -1 / (2 * problem.stiffness * g.real)
    lag = -np.angle(1 + 1 / (problem.stiffness * width * g)) % (2 * np.pi)
    return UnconditionalLimit(float(width), f, float(g.real), 60 * f / (np.arange(lobes) + lag / (2 * np.pi)),
                              float(width) * (real_part_error(problem.plane, f) + drawn_width_error(problem.plane, g.real)))


def drawn_width_error(plane: PlaneDynamics, real: float) -> float:
    """Return half the 95 % interval of the width over the width, by the draws of a response; zero without draws.

    real : the least real part of the response itself, m/N, below zero.
    """
    if plane.draws is None or plane.frequency is None:
        return 0.0
    real_of_draws = plane.draws[:, plane.frequency > 0, 0, 0].real.min(axis=1)
    # Draws whose real part is not negative have no limit: the bound makes their quotient large instead of turning its sign.
    lower, upper = np.quantile(real / np.minimum(real_of_draws, -1e-300), [0.025, 0.975], method="weibull")
    return float(min((upper - lower) / 2, 1.0))


def real_part_error(plane: PlaneDynamics, frequency: float) -> float:
    """Return the relative error of the least real part, of the line nearest to `frequency` (Hz); zero for modes.

    It is the noise of that line (95 %) plus the error of straight lines between the measured ones: an eighth of the second
    difference, as for a parabola through the line and its neighbours.
    """
    if plane.is_modal:
        return 0.0
    f, values = plane.lines
    k = int(np.argmin(np.abs(f - frequency)))
    real = values[:, 0, 0].real
    # Draws hold their noise.
    noise = 0.0 if plane.draws is not None else NORMAL_QUANTILE_95 * float(np.sqrt(line_variance(plane)[k, 0, 0] / 2))
    bend = float(real[k - 1] + real[k + 1] - 2 * real[k]) / 8 if 0 < k < f.size - 1 else 0.0
    return float((noise + abs(bend)) / max(abs(float(real[k])), 1e-300))


def _least_real(plane: PlaneDynamics) -> tuple[float, complex]:
    """Return frequency (Hz) and value (m/N) of the oriented response where its real part is least."""
    def value(f: float) -> complex:
        return complex(plane.response(np.array([f]))[0, 0, 0])

    if plane.frequency is not None:  # linear between lines: the least is at a line
        f = plane.frequency[plane.frequency > 0]
        best = float(f[int(np.argmin(plane.response(f)[:, 0, 0].real))])
        return best, value(best)
    centre, half = np.abs(plane.poles) / (2 * np.pi), np.maximum(-plane.poles.real / (2 * np.pi), 1e-12)
    f = np.unique(np.concatenate([(centre[:, None] + half[:, None] * np.linspace(-8, 8, 65)).ravel(),
                                  np.linspace(0.2 * centre.min(), 3 * centre.max(), REAL_PART_LINES)]))
    f = f[f > 0]
    k = int(np.argmin(plane.response(f)[:, 0, 0].real))
    # The least line brackets the least value; a minimiser alone may end at the minimum of another mode.
    ends = float(f[max(k - 1, 0)]), float(f[min(k + 1, f.size - 1)])
    minimum = scipy.optimize.minimize_scalar(lambda x: value(x).real, bounds=ends, method="bounded",
                                             options={"xatol": 1e-10 * ends[1]})
    best = float(minimum.x) if value(float(minimum.x)).real <= value(float(f[k])).real else float(f[k])
    return best, value(best)


def width_range(problem: TurningProblem) -> float:
    """Return the largest width of a chart, m: ten times the unconditional limit, at most `MAX_TURNING_WIDTH`.

    Where no real part is negative, the response at the lowest frequency stands in its place.
    """
    least_real = _least_real(problem.plane)[1].real
    size = -least_real if least_real < 0 else float(np.abs(problem.plane.response(np.array([problem.plane.span[0]]))[0, 0, 0]))
    return float(min(MAX_TURNING_WIDTH, WIDTH_RANGE_FACTOR / (2 * problem.stiffness * positive("response", size))))
