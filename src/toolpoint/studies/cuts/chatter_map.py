"""Chatter limits over axis positions or poses and feed directions: serial or on workers, resumable.

Neighbouring poses are computed in short chains, each chart warm from the one before. The division into chains
depends on the places alone, so limits do not depend on workers or interruptions. A chain is finished, and
kept, as a whole; where it breaks, its poses run again one at a time, so that only the pose at fault is a failure.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats
from toolpoint._doubt import mark_notes, read_marked
from toolpoint.cutting import MillingProblem
from toolpoint.cutting.build import words
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.chain import ChartRow, chart_poses, limits_of
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.panels.method import PanelArnoldi
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.cuts.chatter_limits import ChatterMap
from toolpoint.studies.cuts.limit_spread import sample_limits
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.cuts.work_dynamics import problem_with_work
from toolpoint.studies.execute import Engine, Outcome, Progress, execute
from toolpoint.studies.machines.reduced_limits import question_reduction
from toolpoint.studies.machines.tool_point import (
    FEED_ANGLE,
    MAX_CHART_DEPTH,
    MAX_DEPTH_DOUBLINGS,
    STUDY_LINES,
    ToolPoint,
    batch_of,
    depth_limit,
    first_loss_depth,
    method_for,
    pose_problem,
    tool_point,
)
from toolpoint.studies.machines.tool_seat import question_tool_seat
from toolpoint.studies.remark_kinds import first_of_each_kind
from toolpoint.vibration import Modes

MAX_CHAIN_LENGTH, MIN_CHAIN_COUNT = 5, 8  # poses, lost together by an interruption; chains, for workers to share
Place = tuple[int, ...]


def chatter_map(
    machine: Machine, positions: Mapping[str, ArrayLike] | Sequence[Mapping[str, float]] | None = None,
    cut: CuttingDescription | None = None, *, speeds: ArrayLike | None = None, feed_angles: ArrayLike | None = None,
    method: StabilityMethod | None = None, work: ToolDynamics | None = None, engine: Engine | None = None,
    folder: str | Path | None = None, progress: Progress | None = None,
) -> ChatterMap:
    """Return the stable depths of a cut over axis positions or poses, and over feed directions.

    Parameters
    ----------
    machine : Machine
        Names its tool point, and the cut unless `cut` is given.
    positions : mapping of axis name to positions, or sequence of poses, optional
        m or rad. Of a mapping all combinations are taken, and axes left out stand at zero; of a sequence the poses in it,
        neighbours in the list near in space. The described poses where left out.
    cut : CuttingDescription, optional
    speeds : (n_speeds,) floats, optional
        rev/min; 60 over the range of the cut where left out.
    feed_angles : (n_directions,) floats
        rad from x towards y; the direction of the cut's feed where left out.
    method : stability method, optional
        Chosen to suit the cut where left out; `ZeroOrder` is quicker by far and says its usual error.
    work : ToolDynamics, optional
        Modes of a work that gives way too, x and y along those of the tool at every pose (`modal_dynamics`).
    engine, folder, progress
        See `execute.execute`; a point of the study is a chain of neighbouring poses, `progress` counts poses.

    Examples
    --------
    Runs in ``examples/map_chatter_limits.py``.
    """
    used = cut or machine.description.cutting
    if used is None:
        fail("cut", "none", "must be given, here or as 'cutting' in the machine file")
    words(used)  # faults of the cut are reported before any work
    if work is not None:
        _refuse_bodies(machine)
    places = _Places.of(machine, machine.description.poses or ({},) if positions is None else positions)
    n = floats("speeds", np.linspace(*used.speeds, 60) if speeds is None else np.atleast_1d(speeds))
    angles = floats("feed_angles", np.atleast_1d(FEED_ANGLE[used.feed] if feed_angles is None else feed_angles))
    function = _ChainLimits(machine, places.names, tuple(map(float, n)), tuple(map(float, angles)), used, method,
                             work)
    store = None if folder is None else Path(folder)
    result = _assemble_map(_run_chains(function, places, engine, store, progress), places, angles, n, used)
    of_work = () if work is None else (*work.notes, f"the work gives way too, by {work.what}, alike at every pose; it is taken "
                                       "to stand on a structure that the machine does not move")
    result = replace(result, notes=(*question_tool_seat(machine), *of_work, *result.notes))

    def limits(sample: Machine) -> FloatArray:
        sample_function = replace(function, machine=sample)
        sample_store = None if store is None else store / hashlib.sha256(sample_function.identity.encode()).hexdigest()[:16]
        return _assemble_map(_run_chains(sample_function, places, engine, sample_store, progress), places, angles, n,
                             used).limit

    def compliance(sample: Machine) -> FloatArray:
        study = tool_point(sample, [dict(zip(places.names, row, strict=True)) for row in places.rows.values()])
        return np.log(np.abs(study.frf.values.real).max(axis=(1, 2, 3)))

    if np.isnan(result.limit).all():
        return result
    return replace(result, spread=sample_limits(machine, limits, compliance, rng=np.random.default_rng(0)))


def _refuse_bodies(machine: Machine) -> None:
    """Refuse elastic bodies beside a work that gives way: what their reduction leaves out is judged on the machine alone."""
    elastic = [name for name, body in machine.description.bodies.items() if body.is_elastic]
    if elastic:
        fail("work", f"beside the elastic bodies {', '.join(elastic)}", "must be beside rigid bodies in a map",
             remedy="chart single poses by `toolpoint lobes MACHINE --work FILE`")


@dataclass(frozen=True, eq=False)
class _Places:
    """Places of a map: names of axes, a row of positions for each place, and the shape of the grid.

    axes : of a grid; poses : of a list.
    """

    names: tuple[str, ...]
    rows: dict[Place, tuple[float, ...]]
    shape: tuple[int, ...]
    axes: Mapping[str, FloatArray]
    poses: tuple[Mapping[str, float], ...]
    angles: tuple[str, ...]

    @classmethod
    def of(cls, machine: Machine, positions: Mapping[str, ArrayLike] | Sequence[Mapping[str, float]]) -> _Places:
        """Return the places after checking them against the machine's axes."""
        if not positions:
            fail("axes", "none", "must be at least one axis with its positions")
        angles = tuple(axis.name for axis in machine.chain.axes if axis.is_rotary)
        if isinstance(positions, Mapping):
            axes = {name: np.atleast_1d(floats(f"axes[{name!r}]", v)) for name, v in positions.items()}
            for name, values in axes.items():
                machine.chain.batch({name: values})
            shape = tuple(len(v) for v in axes.values())
            rows = {index: tuple(float(v[i]) for v, i in zip(axes.values(), index)) for index in _snake(shape)}
            return cls(tuple(axes), rows, shape, axes, (), angles)
        poses = tuple(dict(pose) for pose in positions)
        for pose in poses:
            machine.chain.batch(pose)
        batch = batch_of(machine, poses)
        listed: dict[Place, tuple[float, ...]] = {
            (i,): tuple(float(positions_of_axis[i]) for positions_of_axis in batch.values()) for i in range(len(poses))}
        return cls(tuple(batch), listed, (len(poses),), {}, poses, angles)


@dataclass(frozen=True)
class _ChainLimits:
    """Limits in all feed directions at the poses of a chain, each chart warm from the one before; a row a pose."""

    machine: Machine
    names: tuple[str, ...]
    speeds: tuple[float, ...]
    feed_angles: tuple[float, ...]
    cut: CuttingDescription
    method: StabilityMethod | None
    work: ToolDynamics | None = None

    @property
    def identity(self) -> str:
        """Key of this study among others on the same places."""
        parts = (self.machine.description, self.speeds, self.feed_angles, self.cut, str(self.method))
        if self.work is None or not isinstance(self.work.response, Modes):
            return repr(parts)
        modes = self.work.response
        return repr((*parts, self.work.x, self.work.y, *(
            value.tolist() for value in (modes.frequency, modes.damping_ratio, modes.shape))))

    def problem(self, study: ToolPoint) -> MillingProblem:
        """Return the milling problem at the pose of a study, with the work where it gives way too."""
        problem = pose_problem(study, self.cut, 0)
        return problem if self.work is None else problem_with_work(problem, self.work)

    def __call__(self, chain: Sequence[Sequence[float]]) -> dict[str, Any]:
        # Where joints have dampers the number of poles may differ from pose to pose: one at a time.
        studies = [tool_point(self.machine, [dict(zip(self.names, position, strict=True))], STUDY_LINES) for position in chain]
        problems = [self.problem(study) for study in studies]
        dynamics = problems[0].dynamics if self.work is not None else studies[0].modes
        method = method_for(dynamics if isinstance(dynamics, Modes) else studies[0].modes, self.method)
        first_only = isinstance(method, PanelArnoldi) and method.first_only
        end = self.cut.depth_end[0]
        # One depth for the whole chain, wide enough for its stiffest pose.
        depth = min(max((first_loss_depth if first_only else depth_limit)(problem) for problem in problems), end)
        rows: tuple[ChartRow, ...] = ()
        for _ in range(1 if first_only else MAX_DEPTH_DOUBLINGS + 1):
            rows = chart_poses(problems[0], [problem.dynamics for problem in problems], np.array(self.speeds),
                               feed_angles=self.feed_angles, method=method, depth_max=depth)
            if depth >= min(MAX_CHART_DEPTH, end) or not any(_is_unlimited(chart) for row in rows for chart in row):
                break
            # the softest mode is too slow for these teeth: stiffer ones limit, and deeper
            depth = min(2 * depth, MAX_CHART_DEPTH, end)
        rows, remarks = self._with_reduction(chain, problems, rows)
        empty = np.full(len(self.speeds), np.nan)
        return {"limit": limits_of(rows, len(self.speeds)),
                "frequency": np.array([[empty if isinstance(c, str) else _chatter_frequency(c) for c in row] for row in rows]),
                "error": np.array([[empty if isinstance(c, str) else c.limit_error for c in row] for row in rows]),
                "depth_max": np.full(len(chain), depth),
                "notes": np.array([_notes(row, said) for row, said in zip(rows, remarks, strict=True)]),
                "reasons": np.array([[c if isinstance(c, str) else "" for c in row] for row in rows])}


    def _with_reduction(self, chain: Sequence[Sequence[float]], problems: Sequence[MillingProblem], rows: Sequence[ChartRow]
                        ) -> tuple[tuple[ChartRow, ...], list[list[str]]]:
        """Return the charts with the reduction of elastic bodies in their errors, and for every pose what is to be said."""
        widened, remarks = list[ChartRow](), list[list[str]]()
        for position, problem, row in zip(chain, problems, rows, strict=True):
            pose, cells, said = dict(zip(self.names, position, strict=True)), list[StabilityChart | str](), list[str]()
            for angle, cell in zip(self.feed_angles, row, strict=True):
                reduced = None if isinstance(cell, str) else question_reduction(
                    self.machine, pose, problem.at_feed_angle(angle), chart=cell)
                cells.append(cell if reduced is None or isinstance(cell, str) else reduced.widen(cell))
                said += [] if reduced is None else reduced.notes
            widened.append(tuple(cells))
            remarks.append(said)
        return tuple(widened), remarks


def _is_unlimited(chart: StabilityChart | str) -> bool:
    """Whether a chart shows no limit at any speed."""
    return not isinstance(chart, str) and not np.isfinite(chart.limit).any()


def _notes(row: ChartRow, remarks: Sequence[str]) -> str:
    """Return remarks and the notes of the charts of one pose, a line each; doubts are marked."""
    of_charts = (note for chart in row if not isinstance(chart, str) for note in chart.notes)
    return "\n".join(dict.fromkeys(mark_notes([*remarks, *of_charts])))


def _chatter_frequency(chart: StabilityChart) -> FloatArray:
    """Return the chatter frequency at the limit of every speed, not a number where there is no limit."""
    points = chart.limit_points()
    values = np.full(points.size, np.nan)
    values[points >= 0] = chart.frequency[points[points >= 0]]
    return values


def _run_chains(function: _ChainLimits, places: _Places, engine: Engine | None, folder: Path | None,
                progress: Progress | None) -> list[Outcome]:
    """Return the outcome of every pose, in the order of the places' shape."""
    order = list(places.rows)
    # Long chains start warm more often, several keep all processes busy.
    length = min(MAX_CHAIN_LENGTH, -(-len(order) // MIN_CHAIN_COUNT))
    chains = [order[i:i + length] for i in range(0, len(order), length)]

    def run(parts: Sequence[Sequence[Place]], store: Path | None, offset: int) -> dict[Place, Outcome]:
        total = sum(map(len, parts))
        report = (lambda completed, part_total: progress(offset + total * completed // part_total,
                                                         len(order))) if progress else None
        points = [[list(places.rows[place]) for place in part] for part in parts]
        outcomes = execute(function, points, engine, folder=store, progress=report).outcomes
        return {place: _pose_outcome(outcome, row) for part, outcome in zip(parts, outcomes) for row, place in enumerate(part)}

    outcomes = run(chains, folder, 0)
    # One failed pose takes its chain with it: the poses of such chains are run again one by one.
    broken = [[place] for part in chains if len(part) > 1 and outcomes[part[0]].values is None for place in part]
    if broken:
        outcomes |= run(broken, folder and folder / "alone", len(order) - len(broken))
    return [outcomes[place] for place in itertools.product(*map(range, places.shape))]


def _snake(shape: tuple[int, ...]) -> list[Place]:
    """Return the indices of a grid in an order in which each is a neighbour of the one before."""
    if not shape:
        return [()]
    tails = _snake(shape[1:])
    return [(i, *tail) for i in range(shape[0]) for tail in (tails[::-1] if i % 2 else tails)]


def _pose_outcome(outcome: Outcome, row: int) -> Outcome:
    """Return the outcome of one pose of a chain."""
    return outcome if outcome.values is None else Outcome({name: value[row] for name, value in outcome.values.items()})


def _assemble_map(outcomes: Sequence[Outcome], places: _Places, angles: FloatArray, speeds: FloatArray, cut: CuttingDescription
                  ) -> ChatterMap:
    undefined = np.full((angles.size, speeds.size), np.nan)
    limit, frequency, error = list[Array](), list[Array](), list[Array]()
    depth, failures = list[float](), dict[Place, str]()
    notes: dict[str, None] = {}
    for number, outcome in enumerate(outcomes):
        place = tuple(int(k) for k in np.unravel_index(number, places.shape))
        values = outcome.values
        limit.append(undefined if values is None else values["limit"])
        frequency.append(undefined if values is None else values["frequency"])
        error.append(undefined if values is None else values["error"])
        depth.append(np.nan if values is None else float(values["depth_max"]))
        reasons = [outcome.failure] * angles.size if values is None else map(str, values["reasons"])
        failures |= {(*place, way): reason for way, reason in enumerate(reasons) if reason}
        notes |= {} if values is None else dict.fromkeys(read_marked(str(values["notes"]).split("\n")))
    full = (*places.shape, angles.size, speeds.size)
    return ChatterMap(places.axes, angles, speeds, np.array(limit).reshape(full), np.array(frequency).reshape(full),
                      np.array(depth).reshape(places.shape), cut, failures, first_of_each_kind(notes), places.poses,
                      places.angles, error=np.array(error).reshape(full))
