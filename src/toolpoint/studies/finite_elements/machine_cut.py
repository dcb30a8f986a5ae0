r"""Depth limits of a machine: the response of the tool against the work in the plane, its lobes and the least depth of all.

At any speed the least depth of the single-frequency solution is :math:`w = 1 / (2 \max \mathrm{Re} \Lambda)` over all
frequencies and both eigenvalues :math:`\Lambda` of :math:`-\bar A G(i\omega)` (Altintas, Budak, CIRP Annals 44 (1995)): quick
enough to be the goal of a search.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint._notebook import NotebookText
from toolpoint.cutting import MillingProblem, StabilityChart, ZeroOrder, stability
from toolpoint.cutting.cut.interpolation import interpolate
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.machines.tool_point import depth_limit, milling_problem
from toolpoint.vibration import Dof, Frf, Modes, frequency_response

POINT = "tool-work"
# Plane of the cut: motion of the tool against the work along x and y.
PLANE = (Dof(POINT, "+x"), Dof(POINT, "+y"))
# Chosen: a face mill in steel, heavy enough that the machine's own modes decide.
EXAMPLE_FACE_MILL = CuttingDescription.of(
    diameter=0.08, teeth=5, immersion=0.6, tangential=2.0e9, normal=0.8e9, speeds=(150.0, 1500.0),
    source="chosen: 80 mm face mill, five teeth, in steel")
# Spindle speeds of a chart; frequency lines of a response.
_CHARTED_SPEEDS, _RESPONSE_LINES = 250, 2500
_CUBIC_REACH, _PEAK_POINTS = 3, 33  # lines beside a peak's highest that its cubics rest on; points between its neighbours
_RIVAL_SHARE = 0.9  # of the highest line, from which another peak is looked at between its lines


@dataclass(frozen=True, eq=False)
class CutLimit(NotebookText):
    """Limits of a cut on a machine: least `depth` at any speed (m), its chatter frequency (Hz), and the chart over speeds."""

    depth: float
    frequency: float
    chart: StabilityChart

    @property
    def best(self) -> tuple[float, float]:
        """The largest limit of the chart and its speed, m and rev/min; the chart's largest depth where there is none."""
        limit = np.minimum(self.chart.limit, self.chart.depth_max)
        k = int(np.argmax(limit))
        return float(limit[k]), float(self.chart.speeds[k])

    @property
    def mean(self) -> float:
        """Mean of the limit over the charted speeds, m; a limit above the chart's largest depth counts as that."""
        return float(np.minimum(self.chart.limit, self.chart.depth_max).mean())

    def __repr__(self) -> str:
        return f"CutLimit(least {1e3 * self.depth:.3g} mm, chatter at {self.frequency:.4g} Hz, mean {1e3 * self.mean:.3g} mm)"


def response_lines(frequency: FloatArray, cut: CuttingDescription) -> FloatArray:
    """Return lines (n,), Hz, for lobes: from 0.3 times the first mode to a tooth passing frequency above the last.

    frequency : (n_modes,) Hz, increasing. A constant ratio between lines resolves modes with a damping of 1 % or more.
    """
    tooth = cut.tool.teeth * cut.speeds[1] / 60
    frequency_max = float(frequency[-1]) + max(1.05 * tooth, 0.5 * float(frequency[-1]))
    return np.geomspace(0.3 * float(frequency[0]), frequency_max, _RESPONSE_LINES)


def plane_response(modes: Modes, lines: FloatArray) -> Frf:
    """Return the receptance of the tool against the work in x and y, (n_f, 2, 2)."""
    return frequency_response.modal(modes, lines, outputs=PLANE, inputs=PLANE)


def cut_limit(response: Frf, cut: CuttingDescription, *, depth: float | None = None) -> CutLimit:
    """Return the limits of a cut on the response of `plane_response`, changed or not.

    depth : largest depth of the chart, m; from the response where left out. Options are compared on the same one.
    """
    problem = face_problem(response, cut)
    lowest, frequency = least_depth(response.values, mean_factors(problem), np.asarray(response.frequency))
    speeds = np.linspace(*cut.speeds, _CHARTED_SPEEDS)
    chart = stability.chart(problem, speeds, ZeroOrder(), depth_max=depth or depth_limit(problem))
    return CutLimit(lowest, frequency, chart)


def face_problem(response: Frf, cut: CuttingDescription) -> MillingProblem:
    """Return the milling problem of a cut on the response of `plane_response`."""
    return milling_problem(cut, response, str(PLANE[0]), y=str(PLANE[1]))


def mean_factors(problem: MillingProblem) -> FloatArray:
    """Return the mean directional matrix in the plane, Pa, (2, 2); raises ToolpointError for a cut with axial force."""
    if problem.mean_matrix.shape != (2, 2):
        fail("cut", "axial force", "must be in the plane here", remedy="leave the axial coefficient out")
    return problem.mean_matrix


def least_depth(values: ComplexArray, factors: FloatArray, lines: FloatArray) -> tuple[float, float]:
    """Return the least depth at any speed (m, infinite where none limits) and its chatter frequency (Hz).

    values : (n_f, 2, 2) receptance; factors : see `mean_factors`; lines : (n_f,) Hz. Between the lines the response is the
    cubic that charts take, so that no chart lies below.
    """
    largest_real = _largest_real(values, factors)
    highest = int(np.argmax(largest_real))
    if largest_real[highest] <= 0:
        return float("inf"), float("nan")
    peaks = [(float(largest_real[highest]), float(lines[highest]))]  # at an end of the lines, the line itself
    middle = largest_real[1:-1]
    rising = (middle >= largest_real[:-2]) & (middle >= largest_real[2:]) & (middle > _RIVAL_SHARE * largest_real[highest])
    # Two peaks of a tuned damper are alike: the one whose line is lower may be the higher one between its lines.
    for k in (np.flatnonzero(rising) + 1).tolist():
        window = slice(max(k - _CUBIC_REACH, 0), k + _CUBIC_REACH + 1)
        between = np.linspace(lines[k - 1], lines[k + 1], _PEAK_POINTS)
        peaks.append(_top_of_parabola(_largest_real(interpolate(lines[window], values[window], between), factors), between))
    peak, place = max(peaks)
    return 1 / (2 * peak), place


def _largest_real(values: ComplexArray, factors: FloatArray) -> FloatArray:
    """Return the largest real part (n,) of the eigenvalues of the oriented response."""
    m = -(factors @ values)
    half = (m[:, 0, 0] + m[:, 1, 1]) / 2
    # Eigenvalues of a 2 by 2 matrix in closed form: a search calls this thousands of times.
    root = np.sqrt(half**2 - (m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0]))
    return np.asarray(np.maximum((half + root).real, (half - root).real))


def _top_of_parabola(values: FloatArray, places: FloatArray) -> tuple[float, float]:
    """Return the largest value and its place by the parabola through the largest of even values and its neighbours."""
    k = int(np.argmax(values))
    if not 0 < k < values.size - 1:
        return float(values[k]), float(places[k])
    left, middle, right = (float(value) for value in values[k - 1:k + 2])
    curvature = left - 2 * middle + right
    shift = 0.0 if curvature >= 0 else 0.5 * (left - right) / curvature
    return middle - 0.25 * (left - right) * shift, float(places[k]) + shift * float(places[1] - places[0])
