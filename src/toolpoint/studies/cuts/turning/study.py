"""Stability of a turning cut on a structure known in several directions: chart, unconditional limit, best cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt, doubts_among, grave_among
from toolpoint._notebook import NotebookText
from toolpoint._rounding import MIN_PRINTED_ERROR_RATIO, text_below
from toolpoint.cutting import StabilityChart, stability
from toolpoint.cutting.advice.best_speed import from_chart
from toolpoint.cutting.build import find_material
from toolpoint.cutting.cut.problem import TurningProblem
from toolpoint.cutting.force.materials import materials
from toolpoint.cutting.stability.methods.mode_coupling import ModeCoupling, mode_coupling
from toolpoint.studies.cuts.lobes_study import doubtful_limits
from toolpoint.studies.cuts.tip_doubts import withheld_words
from toolpoint.studies.cuts.tool_directions import driving_points, tool_directions
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.cuts.turning.direction import UnconditionalLimit, orient, unconditional_limit, unit_vector, width_range
from toolpoint.studies.cuts.turning.doubts import band_note, doubt_lines
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof

HEADER = ("", "rev/min", "width mm", "")
LATHE_SPEED_GRID = (300.0, 6000.0, 400)  # least and largest rev/min of a usual lathe, number of speeds of every chart
MAX_WIDTH_DOUBLINGS = 4  # of the largest width, until half of the speeds have a limit


@dataclass(frozen=True)
class TurningCut:
    """An orthogonal cut, SI.

    cutting : K_f along the thickness of the chip, Pa; tangential : K_t along the cutting speed, Pa; normal : direction in which
    the chip is thick, from the work into the tool (None: the first known direction of the dynamics); velocity : direction in
    which the work moves past the edge (None: y); process_damping : C, N/m, which needs cutting_speed (m/s, at every spindle
    speed) or diameter (m, the speed being pi D n); source : where the coefficients come from, empty where they are your own.

    Examples
    --------
    >>> TurningCut(cutting=2e9, tangential=1e9, normal=(1.0, 0.0, 0.0)).velocity is None  # then the work moves along y
    True
    """

    cutting: float
    tangential: float = 0.0
    normal: tuple[float, float, float] | None = None
    velocity: tuple[float, float, float] | None = None
    process_damping: float = 0.0
    cutting_speed: float | None = None
    diameter: float | None = None
    source: str = ""


def describe_turning(cutting: float | None = None, tangential: float | None = None, *, material: str | None = None,
                     **geometry: Any) -> TurningCut:
    """Return a turning cut of given coefficients (Pa), or of a material of the literature table.

    K_f of a material is its normal coefficient K_n, K_t its tangential one: the sets are of milling tests, where the thickness
    of the chip is measured along the normal too, and charts of such a cut carry a doubt. Coefficients that are given take the
    place of the table's; `geometry` are the further fields of `TurningCut`. Raises ToolpointError where neither is there, and
    for an unknown material or one whose source has no normal coefficient.

    >>> cut = describe_turning(material="al7075", normal=(1.0, 0.0, 0.0))
    >>> bool(cut.cutting < cut.tangential)
    True
    """
    if material is None:
        if cutting is None:
            raise ToolpointError("`kf`: missing; must be the coefficient along the thickness of the chip, or give a `material` "
                                 "of the literature table: " + ", ".join(materials()))
        return TurningCut(cutting, tangential or 0.0, **geometry)
    entry, number = find_material(material)
    if not entry.sets:
        if cutting is None:
            raise ToolpointError(f"`material`: the source for {entry.material} gives the tangential force only, and not "
                                 "the one along the thickness of the chip; give `kf` and, where it matters, `kt` instead")
        raise ToolpointError(f"`material`: the tangential coefficient of {entry.material} follows the thickness of the chip; "
                             "give `kt` beside `kf`, and leave the material out")
    table = entry.sets[number - 1]
    cut = TurningCut(table.kn if cutting is None else cutting, table.kt if tangential is None else tangential, **geometry)
    is_own = cutting is not None and tangential is not None
    return cut if is_own else replace(cut, source=f"{entry.material}, set {number} of {len(entry.sets)}, {entry.source}")


@dataclass(frozen=True, eq=False)
class TurningStudy(NotebookText):
    """Turning cut with its problem, chart and limits.

    limit : unconditional limit, None with process damping, where it depends on the speed; coupling : width of mode coupling
    alone, without regeneration, which no choice of speed avoids, None of a measured FRF or with process damping. The notes of
    the chart hold the assumptions.
    """

    cut: TurningCut
    problem: TurningProblem
    chart: StabilityChart
    limit: UnconditionalLimit | None
    coupling: ModeCoupling | None

    def noted(self, notes: Sequence[str]) -> TurningStudy:
        """Return the study with further notes before those of its chart."""
        return replace(self, chart=replace(self.chart, notes=tuple(dict.fromkeys([*notes, *self.chart.notes]))))

    def rows(self) -> list[list[str]]:
        """Return rows (what, rev/min, width in mm, remark) of the limits and the best cut, all as text; see `HEADER`."""
        chart, limit = self.chart, self.limit
        rows = []
        if limit is not None and self.withheld:
            rows.append(["stable at every speed", "", "-", "withheld (doubtful)"])
        elif limit is not None:
            finite = np.isfinite(limit.width)
            remark = (f"{_error_words(limit.width, limit.error)}chatter at {limit.frequency:.1f} Hz above" if finite
                      else "no negative real part")
            rows.append(["stable at every speed", "", f"below {text_below(1e3 * limit.width)}" if finite else "every width",
                         remark + ("" if self.problem.plane.is_modal else ", of the measured band")
                         + (" (doubtful)" if self.doubts else "")])
        if self.coupling is not None:
            coupling_width, is_finite = self.coupling.depth, np.isfinite(self.coupling.depth)
            width = f"above {text_below(1e3 * coupling_width)}" if is_finite else f"no width to {1e3 * chart.depth_max:.3g}"
            remark = f"at {self.coupling.frequency:.1f} Hz" if is_finite else "this force direction couples no modes"
            rows.append(["unstable by mode coupling at any speed", "", width, remark])
        lowest, highest = int(np.argmin(chart.limit)), int(np.argmax(np.minimum(chart.limit, chart.depth_max)))
        for name, index in (("lowest limit of the chart", lowest), ("highest limit of the chart", highest)):
            value, error = float(chart.limit[index]), float(chart.limit_error[index])
            rows.append([name, f"{chart.speeds[index]:.0f}",
                         text_below(1e3 * value) if np.isfinite(value) else f"above {1e3 * chart.depth_max:.3g}",
                         _error_words(value, error).rstrip(", ")])
        if self.withheld:
            return [*rows, ["best cut of the chart", "-", "-", withheld_words(self.withheld)]]
        best = from_chart(chart)
        return [*rows, ["best cut of the chart", f"{best.speed:.0f}", text_below(1e3 * best.depth), best.reason]]

    def table(self) -> str:
        """Return limits and best cut as text."""
        title = "Turning: stable widths" + (" (not to be used: see the doubts)" if self.withheld else "")
        return text_table(title, HEADER, self.rows())

    @property
    def doubts(self) -> list[Doubt]:
        """Doubts about the limits."""
        return doubts_among(self.chart.notes)

    @property
    def withheld(self) -> list[Doubt]:
        """The grave doubts for which no cut is recommended."""
        return grave_among(self.chart.notes)

    def to_dict(self) -> dict[str, object]:
        """Return the result as plain numbers and text; no best cut and no width for every speed where they are withheld."""
        best, points = from_chart(self.chart), self.chart.limit_points().tolist()
        unconditional = None if self.limit is None or self.withheld or not np.isfinite(self.limit.width) else {
            "width_m": self.limit.width, "width_error_m": self.limit.error, "chatter_frequency_hz": self.limit.frequency,
            "least_real_part_m_per_n": self.limit.real, "speed_rpm": self.limit.tips.tolist()}
        return {"speed_rpm": self.chart.speeds.tolist(), "unconditional": unconditional,
                "mode_coupling": self._coupling(), "method": self.chart.method,
                "stable_intervals_m": [self.chart.intervals(i).tolist() for i in range(self.chart.speeds.size)],
                "depth_max_m": self.chart.depth_max, "is_end_of_search": (~np.isfinite(self.chart.limit)).tolist(),
                "limit_error_m": [None if p < 0 else float(self.chart.error[p]) for p in points],
                "chatter_frequency_hz": [None if p < 0 else float(self.chart.frequency[p]) for p in points],
                "best_cut": None if self.withheld else {"speed_rpm": best.speed, "width_m": best.depth, "reason": best.reason,
                                                    "limit_error_m": self._error_at(best.speed)},
                "withheld": list(self.withheld),
                "doubts": list(self.doubts), "notes": list(self.chart.notes)}

    def _error_at(self, speed: float) -> float | None:
        """Return the stated error (m) of the limit at a charted speed, None where the search ended below a limit."""
        index = int(np.argmin(np.abs(self.chart.speeds - speed)))
        return float(self.chart.limit_error[index]) if np.isfinite(self.chart.limit[index]) else None

    def _coupling(self) -> dict[str, float] | None:
        """Return width and frequency of mode coupling as plain data, None where no width couples the modes."""
        if self.coupling is None or not np.isfinite(self.coupling.depth):
            return None
        return {"width_m": self.coupling.depth, "frequency_hz": self.coupling.frequency}


def chart_turning(dynamics: ToolDynamics, cut: TurningCut, speeds: FloatArray | None = None) -> TurningStudy:
    """Return the stability chart of a turning cut on these dynamics, wide enough to show limits.

    speeds : rev/min; where left out, 400 over the range of the machine's cut, or of a usual lathe. The largest width is doubled
    until half of the speeds have a limit, at most `MAX_WIDTH_DOUBLINGS` times.

    >>> from toolpoint.studies import TurningCut, modal_dynamics
    >>> from toolpoint.vibration import Modes
    >>> stiffness, ratio, cutting = 2e7, 0.03, 1.5e9
    >>> tip = Modes([150.0], ratio, [[2 * np.pi * 150.0 / np.sqrt(stiffness)]], ("tip:+x",))
    >>> result = chart_turning(modal_dynamics(tip), TurningCut(cutting), np.linspace(500, 5000, 40))
    >>> bool(np.isclose(result.limit.width, 2 * stiffness * ratio * (1 + ratio) / cutting, rtol=1e-3))
    True
    """
    problem, assumed = build_turning(dynamics, cut)
    described = None if dynamics.machine is None else dynamics.machine.description.cutting
    n = speeds if speeds is not None else np.linspace(*(described.speeds if described else LATHE_SPEED_GRID[:2]),
                                                      LATHE_SPEED_GRID[2])
    chart = stability.chart(problem, n, None, depth_max=width_range(problem))
    # Ten times the unconditional limit may lie below most lobes of a lightly damped structure.
    for _ in range(MAX_WIDTH_DOUBLINGS):
        if np.isfinite(chart.limit).mean() >= 0.5:
            break
        chart = stability.chart(problem, n, None, depth_max=2 * chart.depth_max)
    # Process damping falls with the speed: no width holds for all.
    limit = unconditional_limit(problem) if cut.process_damping == 0 else None
    modal = cut.process_damping == 0 and problem.plane.is_modal
    coupling = mode_coupling(problem, chart.depth_max) if modal else None
    if not problem.plane.is_modal:
        assumed = [*doubt_lines(problem.plane), *assumed, band_note(problem.plane)]
    # Notes on the milling plane do not hold for the direction of a turned chip.
    kept = [note for note in dynamics.notes if "response across is taken" not in note and "rigid along y" not in note]
    doubts = [*doubts_among(kept), *doubts_among(assumed)]
    plain_notes = [note for note in assumed if not isinstance(note, Doubt)]
    return TurningStudy(cut, problem, chart.noted(*dict.fromkeys([*doubts, *doubtful_limits(chart), *kept, *plain_notes])),
                        limit,
                        coupling)


def build_turning(dynamics: ToolDynamics, cut: TurningCut) -> tuple[TurningProblem, list[str]]:
    """Return the turning problem of a cut on these dynamics, and the assumptions as sentences."""
    labels, notes = _labels(dynamics)
    normal = unit_vector("`direction`", cut.normal or _axis(next(iter(labels))))
    force, notes = normal, list(notes)
    if cut.tangential:
        velocity = unit_vector("`cutting_direction`", cut.velocity or (0.0, 1.0, 0.0))
        if abs(float(velocity @ normal)) > 1e-6:
            raise ToolpointError(f"`cutting_direction`: {_vector(velocity)} is not normal to the chip's thickness along "
                                 f"{_vector(normal)}; must be (give another `cutting_direction`)")
        # Force over K_f: the thickness's own share is one.
        force = normal + cut.tangential / cut.cutting * velocity
        notes.append(f"K_t acts along {_vector(velocity)}, the way of the work past the edge")
    notes.append(f"the chip is thick along {_vector(normal)}")
    if cut.source:
        notes.append(Doubt("coefficients", f"K_f {cut.cutting / 1e6:.4g} and K_t {cut.tangential / 1e6:.4g} N/mm^2 come from "
                           f"milling tests of others ({cut.source}): rake, edge, wear and feed of your tool are not theirs",
                           "measure them on your own cut (calibrate), or give --kf"))
    plane = orient(dynamics.response, labels, normal, force=force)
    return TurningProblem(cut.cutting, plane, None, cut.process_damping, cut.cutting_speed, cut.diameter), notes


def _labels(dynamics: ToolDynamics) -> tuple[dict[str, str], list[str]]:
    """Return axis (x, y, z) to label of the known directions at the cutting point, and notes.

    Where the first label is not along x it is taken as x, and no other direction is looked for.
    """
    if Dof.parse(dynamics.x).direction[1:] != "x":
        return {"x": dynamics.x}, [f"{dynamics.x} is taken as x"]
    z = tool_directions(driving_points(dynamics.response), dynamics.x, "same").z
    ways = {"x": dynamics.x} | ({} if dynamics.y in (None, "same") else {"y": str(dynamics.y)})
    return ways | ({} if z is None else {"z": z}), []


def _error_words(width: float, error: float) -> str:
    """Return the error of a width, m, in mm with a comma behind it; nothing for an infinite width,
    or where it moves none of the printed digits."""
    return f"± {1e3 * error:.2g} mm, " if np.isfinite(width) and error >= MIN_PRINTED_ERROR_RATIO * width else ""


def _axis(name: str) -> tuple[float, float, float]:
    """Return the unit vector of an axis."""
    return (float(name == "x"), float(name == "y"), float(name == "z"))


def _vector(direction: Sequence[float] | FloatArray) -> str:
    """Return a direction as text: its axis with a sign, or three numbers."""
    parts = np.asarray(direction, float)
    for k, name in enumerate("xyz"):
        if abs(abs(parts[k]) - 1) < 1e-9:
            return ("-" if parts[k] < 0 else "") + name
    return "(" + ", ".join(f"{v:.4g}" for v in parts) + ")"
