"""Uncertainty of stability limits from the machine's identified numbers: samples of the whole machine.


Limits are not smooth where lobes change places, so machines are drawn from the covariance; the logarithm of the limit gets
Student's interval from them. In a chart of one machine, drawn limits are the chart's own times a ratio of single-frequency
limits (`stability.drawn_response`), so that many machines can be drawn; maps, and machines whose bodies spin, chart few
machines anew. Which joint it comes from follows from the greatest compliance of the tool, which is smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # its rooms load on first use

from toolpoint._check import FloatArray
from toolpoint.cutting import MillingProblem, StabilityChart, stability
from toolpoint.cutting.stability.automatic import default_method
from toolpoint.cutting.stability.drawn_response import ratios_of
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.cuts.work_dynamics import with_work
from toolpoint.studies.execute import Progress
from toolpoint.studies.machines.machine_uncertainty import MACHINE_DRAW_COUNT, MachineUncertainty, machine_uncertainty

LIMIT_SAMPLE_COUNT = 8  # machines drawn from the covariance that are charted


@dataclass(frozen=True, eq=False)
class LimitSpread:
    """Standard deviations of the natural logarithm of limits, not a number where there is none.

    lowest : of the least limit; samples : number of machines drawn; part : the joint that brings most of it.
    """

    deviation: FloatArray
    lowest: float
    samples: int
    part: str

    @property
    def factor(self) -> float:
        """Half widths of 95 % intervals over standard deviations (Student)."""
        # Student's, not 1.96: the standard deviation is itself that of these few samples.
        return float(scipy.special.stdtrit(self.samples - 1, 0.975))

    def ends(self, limit: FloatArray, error: FloatArray | float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Return both ends of the 95 % intervals of limits, m; error : stated of each besides the spread, m."""
        half_width = self.factor * self.deviation
        return np.maximum(limit * np.exp(-half_width) - error, 0.0), limit * np.exp(half_width) + error

    def rows(self, limit: FloatArray, error: FloatArray | float = 0.0) -> list[list[float] | None]:
        """Return both ends of every interval as plain numbers, None where there is no limit; error as in `ends`."""
        lower, upper = self.ends(limit, error)
        return [[float(a), float(b)] if np.isfinite(a) and np.isfinite(b) else None for a, b in zip(lower, upper, strict=True)]

    def lowest_ends(self, limit: float, error: float = 0.0) -> tuple[float, float]:
        """Return both ends of the 95 % interval of the least limit, m; error : what is stated of it besides, m."""
        half_width = self.factor * self.lowest
        return max(limit * float(np.exp(-half_width)) - error, 0.0), limit * float(np.exp(half_width)) + error

    def words(self, limit: float, error: float = 0.0) -> str:
        """Return the interval of the least limit in words; error : what is stated of it besides, m."""
        lower, upper = self.lowest_ends(limit, error)
        besides = " and its own stated error" if error > 0 else ""
        return (f"95 % interval of the least limit from the machine's identified numbers{besides}: {1e3 * lower:.4g} .. "
                f"{1e3 * upper:.4g} mm ({self.samples} samples), mostly of {self.part}")


def sample_limits(machine: Machine, limits: Callable[[Machine], FloatArray], part_of: Callable[[Machine], FloatArray],
                  *, rng: np.random.Generator, samples: int = LIMIT_SAMPLE_COUNT, progress: Progress | None = None
                  ) -> LimitSpread | None:
    """Return the spread of limits (last axis: speeds) of a machine, None where its file holds no identified numbers.

    Parameters
    ----------
    limits : function of a machine, m
    part_of : function of a machine
        A smooth answer that the limits depend on; the joint that brings most of its variance is named.
    """
    uncertainty = machine_uncertainty(machine)
    if uncertainty is None:
        return None
    drawn = []
    for k, sample in enumerate(uncertainty.samples(samples, rng)):
        drawn.append(limits(sample))
        if progress is not None:
            progress(k + 1, samples)
    return _spread_of(np.array(drawn), uncertainty, part_of)


def _spread_of(drawn: FloatArray, uncertainty: MachineUncertainty, part_of: Callable[[Machine], FloatArray]) -> LimitSpread:
    """Return the spread of drawn limits (n_draws, ..., n_speeds), m."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(np.where(np.isfinite(drawn), drawn, np.nan))
        lowest = np.log(np.nanmin(drawn.reshape(len(drawn), -1), axis=1))
        lowest[~np.isfinite(lowest)] = np.nan  # a sample without a limit: then the least limit has no deviation
        deviation = logs.std(axis=0, ddof=1)
    spread = uncertainty.spread(part_of)
    worst_index = int(np.argmax(spread.deviation))
    return LimitSpread(deviation, float(lowest.std(ddof=1)), len(drawn), spread.main_part(worst_index))


def spread_of_limits(dynamics: ToolDynamics, values: Mapping[str, Any], chart: StabilityChart, *,
                     method: StabilityMethod | None = None, progress: Progress | None = None) -> LimitSpread | None:
    """Return the spread of a chart's limits, None for dynamics that are not of an identified machine.

    values : of the cut by flat keys, as the chart was made with.
    """
    machine = dynamics.machine
    if machine is None:
        return None
    tool, work = dynamics.parts or (dynamics, None)
    across = "rigid" if tool.y is None else "same" if tool.y == "same" else None

    def problem_of(sample: Machine) -> MillingProblem:
        drawn = machine_dynamics(sample, dynamics.pose, across)
        return build_problem(drawn if work is None else with_work(drawn, work), values)[0]

    def limits(sample: Machine) -> FloatArray:
        return stability.chart(problem_of(sample), chart.speeds, method, depth_max=chart.depth_max).limit

    def compliance(sample: Machine) -> FloatArray:
        plane = problem_of(sample).plane
        frequency_min, frequency_max = plane.span
        return np.log(np.abs(np.real(plane.response(np.linspace(0.5 * frequency_min, 2 * frequency_max,
                                                                400)))).max(keepdims=True).ravel())

    uncertainty = machine_uncertainty(machine)
    if uncertainty is None or dynamics.at_speed is not None:
        return sample_limits(machine, limits, compliance, rng=np.random.default_rng(0), progress=progress)
    drawn = []
    for k, sample in enumerate(uncertainty.samples(MACHINE_DRAW_COUNT, np.random.default_rng(0))):
        drawn.append(problem_of(sample))
        if progress is not None:
            progress(k + 1, MACHINE_DRAW_COUNT)
    problem = problem_of(machine)
    ratios = ratios_of(problem, drawn, chart, method=default_method(problem) if method is None else method)
    return _spread_of(np.minimum(chart.limit, chart.depth_max) * ratios, uncertainty, compliance)
