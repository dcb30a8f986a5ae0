"""Run along one side of a milled path: its steps, its error, and blocks of steps that are kept on disk."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import FloatArray, fail, frozen, positive
from toolpoint._threads import on_one_thread
from toolpoint.studies.accuracy.cut_course import CutCourse, WorkBlock
from toolpoint.studies.accuracy.cutting_table import CuttingTable
from toolpoint.studies.accuracy.joint_servos import JointServo
from toolpoint.studies.accuracy.moving_structure import MovingStructure, ToolStance
from toolpoint.studies.accuracy.run_store import RunStore
from toolpoint.studies.accuracy.side_course import SideCourse, between_nodes
from toolpoint.studies.accuracy.tool_paths import PathSide
from toolpoint.studies.machines.branch_words import branch_lines
from toolpoint.vibration.simulation.varying import (
    CutArrays,
    NodeArrays,
    RunArrays,
    StepNodes,
    VaryingSystem,
    step_nodes,
)
from toolpoint.vibration.simulation.varying_periods import SteppedCourse, WholePeriod, advance_periods

Progress = Callable[[int, int], None]
_SIDE_BLOCK_STEPS = 100_000  # steps of a block
_MAX_KEPT_SAMPLES = 200_000  # of a side: with five times as many the means change by 1e-9
_FEED_CHANGE_TOLERANCE = 2e-3  # of the largest feed, within a revolution: below, its steps are taken at once


@dataclass(frozen=True)
class MillingSetup:
    """Conditions of milling a path, and of its computation.

    speed : rev/min; depth : m; loads : ``cutting``, with ``gravity`` its changing sag, with ``path`` the inertia of the
    nominal motion; gravity : m/s^2, the machine's where left out; regenerative : whether the vibration feeds back on the chip
    (linear: chips do not vanish); spacing : m between nodes of the structure; steps : in a tooth period; window : s of the
    middle of every side that is run, whole sides where left out; with_force : False leaves the cut's force out; halved :
    whether runs at two and four times step and spacing state the error; chip : ``path`` or ``constant``, as the cut says where
    left out (`chip`); work : the block that is milled, whose pixels decide what the cutter meets; the cut's own arc where left
    out; servos : of axes whose motors yield, all hold their set points where left out.

    Examples
    --------
    >>> setup = MillingSetup(speed=6000.0, depth=2e-3, loads=("cutting", "gravity"), window=0.5)
    >>> setup.steps, setup.spacing
    (100, 0.002)
    """

    speed: float
    depth: float
    loads: tuple[str, ...] = ("cutting",)
    regenerative: bool = False
    spacing: float = 2e-3
    steps: int = 100
    window: float | None = None
    with_force: bool = True
    halved: bool = True
    with_energy: bool = False
    with_base: bool = False
    gravity: tuple[float, float, float] | None = None
    stance: ToolStance = field(default_factory=ToolStance)
    work: WorkBlock | None = None
    chip: str = ""
    servos: Mapping[str, JointServo] | None = None


@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """Work of all loads, energy lost, gain of energy, and work done by the moving structure, J; size : sum of |work| of the
    steps.

    At a node the three balance to round-off; between two, where transition, loss and energy are each blended, by the square of
    the nodes' distance: that is the whole gap.
    """

    work: float
    dissipated: float
    gained: float
    by_structure: float
    size: float

    @property
    def gap(self) -> float:
        """Energy that does not balance, over the sum of the sizes of the work."""
        return abs(self.work - self.dissipated - self.gained) / max(self.size, 1e-300)


@dataclass(frozen=True, eq=False)
class SideAccuracy:
    """Error along a side.

    span : when the run begins and ends, s; time : (n,) s; length : (n,) m; relative : (n, 6) elastic motion of the tip (m, rad)
    in machine axes; base : (n, 6) reaction of the base about the machine's origin, empty where it was not asked for; halving :
    relative error that step and spacing leave in the means, from runs at two and four times each (`refinement`); not a number
    where they were not run; path : where the lengths are.
    """

    name: str
    span: tuple[float, float]
    time: FloatArray
    length: FloatArray
    relative: FloatArray
    base: FloatArray
    halving: float
    energy: EnergyBalance | None
    notes: tuple[str, ...] = ()
    path: PathSide | None = None

    @property
    def duration(self) -> float:
        """Duration of the run, s."""
        return self.span[1] - self.span[0]

    @property
    def mean_deflection(self) -> FloatArray:
        """Mean over the time of the run, (6,), m and rad."""
        return time_shares(self.time, *self.span) @ self.relative

    @property
    def error(self) -> FloatArray:
        """Unbiased error (21), (n, 6)."""
        return self.relative - self.mean_deflection

    @property
    def position_radius(self) -> FloatArray:
        """Radius of the position sphere (23), m, (n,)."""
        return np.linalg.norm(self.error[:, :3], axis=1)

    @property
    def rotation_radius(self) -> FloatArray:
        """Radius of the rotation sphere (25), rad, (n,)."""
        return np.linalg.norm(self.error[:, 3:], axis=1)

    @property
    def position_error(self) -> float:
        """Mean radius of the position sphere (26), m."""
        return float(time_shares(self.time, *self.span) @ self.position_radius)

    @property
    def rotation_error(self) -> float:
        """Mean radius of the rotation sphere (27), rad."""
        return float(time_shares(self.time, *self.span) @ self.rotation_radius)

    def spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Return frequencies (Hz) and amplitudes (n_f, 6) of the unbiased error."""
        rate = 1 / float(self.time[1] - self.time[0])
        window = np.hanning(len(self.time))
        # Divided by the window's sum, so that a steady sine shows its own amplitude.
        amplitude = 2 * np.abs(np.fft.rfft(self.error * window[:, None], axis=0)) / window.sum()
        return np.arange(len(amplitude)) * rate / len(self.time), amplitude


def time_shares(time: FloatArray, begin: float, end: float) -> FloatArray:
    """Return the weight of every sample in a mean over time, (n,): the trapezoidal rule between two ends.

    A plain mean of samples at the ends of steps is half a step late, and counts a last step beyond the end whole: on a side of
    10 000 steps that is 0.01 %, of first order, and may hide in what half the step changes.
    """
    edges = np.clip(time, begin, end)
    shares = np.zeros(len(time))
    shares[0] += edges[0] - begin
    shares[-1] += end - edges[-1]
    step, part = np.diff(time), np.diff(edges)
    next_share = part**2 / (2 * step)
    shares[:-1] += part - next_share
    shares[1:] += next_share
    return shares / (end - begin)


@dataclass
class _SideSteps:
    """Steps of a side, block by block: kept rows of the tool's motion (`out`) and of the base's load (`base`)."""

    structure: MovingStructure
    system: VaryingSystem
    setup: MillingSetup
    cut: CutCourse
    nodes: NodeArrays
    carried: RunArrays
    begin: float
    steps: int
    keep: int
    out: FloatArray
    base: FloatArray
    kept: int = 0
    period_maps: dict[tuple[int, int], WholePeriod] = field(default_factory=dict)

    def base_rows(self, first_row: int) -> FloatArray:
        """Return the rows of the base kept since `first_row`; none where the base is not requested."""
        return self.base[first_row:self.kept if self.setup.with_base else first_row]

    def take(self, out: FloatArray, base: FloatArray) -> None:
        """Take the rows of a block that was finished before."""
        first_row, self.kept = self.kept, self.kept + len(out)
        self.out[first_row:self.kept] = out
        self.base_rows(first_row)[:] = base

    def advance(self, first_step: int) -> None:
        """Advance the block that begins at step `first_step`, by whole periods unless single steps are needed."""
        from toolpoint.vibration.simulation.varying_kernel import advance

        setup, dt = self.setup, self.cut.step
        stepwise = setup.regenerative or setup.with_energy or setup.with_base
        count = min(_SIDE_BLOCK_STEPS, self.steps - first_step)
        course = SideCourse(self.structure, self.system, self.cut.tables[0], self.begin + first_step * dt, dt, count)
        if not stepwise and len(self.cut.tables) == 1 and _is_even(course.motion_in_periods(), course.table):
            # Of whole periods few steps are looked at: only these are computed.
            self._take_periods(course, course.table, first_step)
            return
        motion = course.motion(np.arange(count))
        for start, stop, table in self.cut.parts(motion[:, 0]):
            part, first = replace(course, table=table).of(motion[start:stop]), first_step + start
            if not stepwise and _is_even(motion[start:stop], table):
                self._take_periods(part, table, first)
            else:
                self.kept += advance(self.nodes, self._cut_arrays(table), part, self.carried, self.keep, first,
                                     self.out[self.kept:], self.base[self.kept:] if setup.with_base else self.base)

    def _take_periods(self, course: SteppedCourse, table: CuttingTable, first: int) -> None:
        self.kept += advance_periods(self.nodes, self._cut_arrays(table), course, motion=self.carried, keep=self.keep,
                                     first=first, out=self.out[self.kept:], maps=self.period_maps)

    def _cut_arrays(self, table: CuttingTable) -> CutArrays:
        return CutArrays(table.table, table.regeneration, self.setup.depth if self.setup.regenerative else 0.0)


@on_one_thread
def run_side(structure: MovingStructure, system: VaryingSystem, setup: MillingSetup, *, cut: CutCourse,
             progress: Progress | None = None, store: RunStore | None = None) -> SideAccuracy:
    """Step along a side, begun in the periodic state that the cut and the loads at its start would have in the end.

    store : where finished blocks of steps are kept and taken from.
    """
    law, dt = structure.side.law, cut.step
    begin, end = _span(law.duration, setup.window, dt * cut.per_tooth)
    nodes = step_nodes(system, dt, with_energy=setup.with_energy)
    steps = int(np.ceil((end - begin) / dt - 1e-6))
    keep = _keep_interval(steps, len(cut.at(0.0).table[0]))
    first = law.sample(np.array([begin]))
    state, delayed = _periodic_state(structure, system, nodes, cut.at(float(first[0, 0])), motion=first[0])
    totals = np.zeros(4 if setup.with_energy else 0)
    energy = _energy(system, state, float(first[0, 0]))
    # Read-only as mass and stiffness are, with loads and without: else the kernel is compiled once for each.
    at_nodes = NodeArrays(nodes.transition, nodes.deflection, nodes.reading, nodes.moving, nodes.dissipation,
                          frozen(nodes.load_map), system.mass, system.stiffness)
    rows = -(-steps // keep)
    run = _SideSteps(structure, system, setup, cut, at_nodes, RunArrays(state, delayed, totals), begin, steps, keep,
                     np.empty((rows, 6)), np.empty((rows if setup.with_base else 0, 9)))
    for first_step in range(0, steps, _SIDE_BLOCK_STEPS):
        first_row = run.kept
        stored = store.load(first_step, run.carried) if store else None
        if stored is not None:
            run.take(*stored)
        else:
            run.advance(first_step)
            if store:
                store.save(first_step, run.carried, out=run.out[first_row:run.kept], base=run.base_rows(first_row))
        if progress:
            progress(min(first_step + _SIDE_BLOCK_STEPS, steps), steps)
    kept, out, base = run.kept, run.out, run.base
    # The model is linear: motion of 100 mm means that the regenerative vibration grows.
    if not np.isfinite(out[:kept]).all() or np.abs(out[:kept, :3]).max(initial=0.0) > 0.1:
        fail("depth", f"{1e3 * setup.depth:g} mm at {setup.speed:g} rev/min", "the vibration grows without bound",
             remedy="the cut chatters: take it below the stable depth (toolpoint lobes)")
    # A kept row is the state at the end of its step.
    time = begin + (np.arange(kept) * keep + 1) * dt
    travelled = law.sample(time)
    after = _energy(system, state, float(law.sample(np.array([begin + steps * dt]))[0, 0]))
    return SideAccuracy(structure.side.name, (begin, end), time, travelled[:, 0], out[:kept],
                        _base_history(structure, base[:kept], travelled), float("nan"), _balance(totals, after - energy),
                        _notes(structure))


def _keep_interval(steps: int, per_turn: int) -> int:
    """Return the interval of kept steps: prime to the steps of a revolution, so that all its phases are kept alike."""
    keep = max(1, -(-steps // _MAX_KEPT_SAMPLES))
    while math.gcd(keep, per_turn) > 1:
        keep += 1
    return keep


def _balance(totals: FloatArray, change: float) -> EnergyBalance | None:
    if not totals.size:
        return None
    work, dissipated, moved, gained = (float(total) for total in totals)
    return EnergyBalance(work, dissipated, gained, change - gained, moved)


def _is_even(motion: FloatArray, table: CuttingTable) -> bool:
    """Return whether the feed hardly changes within a revolution, whose steps may then be taken at once."""
    if table.is_constant:
        return True
    change = np.abs(motion[:, 2]).max() * table.step * table.table.shape[1]
    return bool(change * table.per_tooth * table.step <= _FEED_CHANGE_TOLERANCE * table.largest_feed)


def _span(duration: float, window: float | None, tooth: float) -> tuple[float, float]:
    """Return begin and end of the run; a window holds whole tooth periods."""
    if window is None:
        return 0.0, duration
    size = max(np.floor(min(positive("window", window), duration) / tooth + 1e-9), 1.0) * tooth
    return (duration - size) / 2, (duration + size) / 2


def places_of(side: PathSide, setup: MillingSetup, tooth: float) -> tuple[float, float] | None:
    """Return the part of a side that a window needs, m."""
    if setup.window is None:
        return None
    ends = side.law.sample(np.array(_span(side.law.duration, setup.window, tooth)))[:, 0]
    return float(ends[0]), float(ends[1])


def _periodic_state(structure: MovingStructure, system: VaryingSystem, nodes: StepNodes, cut: CuttingTable, *,
                    motion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the state at the start of a revolution that repeats after it, and the tip's way over its last tooth period."""
    share = float(cut.feed_shares(motion[1:2])[0])
    force = cut.table[0] + share * (cut.table[-1] - cut.table[0])
    loads = np.concatenate([force, np.broadcast_to(structure.load_factors(motion[None])[0], (len(force),
                                                                                             nodes.deflection.shape[1] - 3))],
                           axis=1)
    node, part = (v[0] for v in between_nodes(system.length, motion[:1]))

    def blend(values: FloatArray) -> FloatArray:
        return values[node] + part * (values[node + 1] - values[node])

    phi, static = blend(nodes.transition).T, np.zeros((len(nodes.transition[0]), loads.shape[1]))
    static[:system.size] = blend(nodes.deflection).T

    def revolve(state: FloatArray) -> FloatArray:
        states = [state]
        for row in loads:
            # Exact for a load held over the step: the state decays about the static deflection.
            states.append(static @ row + phi @ (states[-1] - static @ row))
        return np.array(states)

    end = revolve(np.zeros(len(phi)))[-1]
    # A revolution from x ends in Phi^n x plus the end of one from rest; the periodic x comes back to itself.
    state = np.linalg.solve(np.eye(len(phi)) - np.linalg.matrix_power(phi, len(force)), end)
    way = revolve(state)[-cut.per_tooth - 1:-1, :system.size] @ blend(nodes.load_map)[:3].T
    return state, way


def _energy(system: VaryingSystem, state: FloatArray, length: float) -> float:
    u, v = state[:system.size], state[system.size:]
    return float(v @ system.blended("mass", length) @ v + u @ system.blended("stiffness", length) @ u) / 2


def _base_history(structure: MovingStructure, base: FloatArray, motion: FloatArray) -> FloatArray:
    """Return the reaction of the base: rate of elastic momentum less the force on the tip, plus the reaction at rest."""
    if not len(base):
        return np.zeros((0, 6))
    node, share = between_nodes(structure.system.length, motion[:, 0])

    def along(values: FloatArray) -> FloatArray:
        return values[node] + share.reshape(-1, *[1] * (values.ndim - 1)) * (values[node + 1] - values[node])

    force = (along(structure.axes) @ base[:, 6:, None])[..., 0]
    wrench = np.concatenate([force, np.cross(along(structure.tips), force)], axis=1)
    return base[:, :6] - wrench + along(structure.nominal)


def _notes(structure: MovingStructure) -> tuple[str, ...]:
    size = float(np.abs(np.diff(np.stack(list(structure.reach.batch().values())), axis=1)).max())
    return (*branch_lines(structure.reach.branches),
            f"forces of the axes' own speed on the vibration (Coriolis) are left out; between nodes no axis moves more than "
            f"{size:.2g} (rad, m)",
            "every side begins in the periodic state of the cut at its start; from rest the means would hold what rings then")
