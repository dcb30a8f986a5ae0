"""Metrics of screenings: numbers of every variant by name, or any function of a machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from toolpoint._check import fail, one_of
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.cuts.chatter_map import chatter_map
from toolpoint.studies.machines.stiffness_map import stiffness_rows
from toolpoint.studies.machines.tool_point import STUDY_LINES, batch_of, tool_point

Pose = Mapping[str, float]


class Metric(Protocol):
    """Answers of a machine by name; `unit` of each, `lower_is_better`, and `loads`: for which loads they hold."""

    def __call__(self, machine: Machine) -> Mapping[str, float]:
        """Return the answers."""
        ...


@dataclass(frozen=True)
class NamedMetrics:
    """Metrics by name at poses, each the worst of all poses.

    names : ``frequency 1``, ``frequency 2`` ... (Hz), ``static stiffness`` and ``dynamic stiffness`` (N/m, softest direction),
    ``response peak`` (m/N, of any direction), ``depth limit`` (m, lowest over the speeds of the machine's cut).

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}))
    >>> {name: round(value, 3) for name, value in NamedMetrics(("frequency 1",))(machine).items()}
    {'frequency 1': 50.329}
    """

    names: tuple[str, ...] = ("frequency 1",)
    poses: tuple[Pose, ...] = ({},)

    def __post_init__(self) -> None:
        for name in self.names:
            one_of("metric", name.rsplit(" ", 1)[0] if name.startswith("frequency ") else name, METRICS)
            if name.startswith("frequency ") and not name.rsplit(" ", 1)[1].isdigit():
                fail("metric", repr(name), "must end in the number of a mode", remedy="frequency 1")

    @property
    def identity(self) -> str:
        """Key of these metrics among others."""
        return repr((self.names, self.poses))

    def __call__(self, machine: Machine) -> dict[str, float]:
        """Return every metric of a machine."""
        # All named frequencies come from one solution.
        modes = max((int(name.rsplit(" ", 1)[1]) for name in self.names if name.startswith("frequency ")), default=0)
        result: dict[str, float] = {}
        if modes:
            frequency = natural_frequencies(machine, batch_of(machine, self.poses), modes).min(axis=0)
            result |= {f"frequency {i + 1}": float(f) for i, f in enumerate(frequency)}
        for name in self.names:
            if not name.startswith("frequency "):
                result[name] = METRICS[name](machine, self.poses)
        return {name: result[name] for name in self.names}


def _static(machine: Machine, poses: tuple[Pose, ...]) -> float:
    # Column 3 is the softest direction, see `stiffness_rows`.
    return float(stiffness_rows(tool_point(machine, list(poses), STUDY_LINES), "static")[:, 3].min())


def _dynamic(machine: Machine, poses: tuple[Pose, ...]) -> float:
    return float(stiffness_rows(tool_point(machine, list(poses), STUDY_LINES), "dynamic")[:, 3].min())


def _peak(machine: Machine, poses: tuple[Pose, ...]) -> float:
    # The least dynamic stiffness is one over the largest response of any direction.
    return 1 / _dynamic(machine, poses)


def _depth(machine: Machine, poses: tuple[Pose, ...]) -> float:
    """Return the least depth limit over the poses, m; the least depth looked at where no stability is lost.

    A pose that could not be charted is no stable one: the variant fails with its reason.
    """
    chart = chatter_map(machine, list(poses))
    if np.isnan(chart.limit).any():
        reason = next(iter(chart.failures.values()), "the chart has no limit")
        fail("poses",
             f"no depth limit at {int(np.isnan(chart.limit).any(axis=(-1, -2)).sum())} of {chart.limit.shape[0]} ({reason})",
             "must be charted everywhere", remedy="see that pose with `toolpoint lobes --pose`")
    return float(np.minimum(chart.limit, chart.depth_max[..., None, None]).min())


METRICS: dict[str, Callable[[Machine, tuple[Pose, ...]], float]] = {
    "frequency": lambda machine, poses: float(natural_frequencies(machine, batch_of(machine, poses), 1).min()),
    "static stiffness": _static, "dynamic stiffness": _dynamic, "response peak": _peak, "depth limit": _depth}
# Unit of a person beside the factor from the SI unit of the numbers.
UNITS = {"frequency": ("Hz", 1.0), "static stiffness": ("N/µm", 1e-6), "dynamic stiffness": ("N/µm", 1e-6),
         "response peak": ("µm/N", 1e6), "depth limit": ("mm", 1e3), "position error": ("µm", 1e6),
         "rotation error": ("µrad", 1e6)}
ROUNDING_SHARE = 1e-9  # of a metric: a smaller effect is rounding
LOWER_IS_BETTER = ("response peak", "position error", "rotation error")


def share_text(value: float) -> str:
    """Return a share in per cent with its sign; what is rounding is none.

    >>> share_text(0.1402), share_text(-3e-15)
    ('+14 %', '0 %')
    """
    return "0 %" if abs(value) < ROUNDING_SHARE else f"{100 * value:+.3g} %"


def shown_unit(name: str) -> tuple[str, float]:
    """Return the unit in which a metric is shown, and the factor to it; no unit and 1 where it is a function's own."""
    return next((unit for start, unit in UNITS.items() if name.startswith(start)), ("", 1.0))


def shown_name(name: str) -> str:
    """Return the name of a metric with the unit in which it is shown."""
    unit, _ = shown_unit(name)
    return f"{name}, {unit}" if unit else name


def is_lower_better(name: str) -> bool:
    """Whether a smaller value of a metric is the better one."""
    return name.startswith(LOWER_IS_BETTER)


__all__ = ["METRICS", "Metric", "NamedMetrics", "is_lower_better", "shown_name", "shown_unit"]
