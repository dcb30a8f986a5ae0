r"""Time-domain milling: regeneration with loss of contact, helix, run-out, unequal pitch, several flutes' memory."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointWarning, count, fail, floats, positive
from toolpoint._threads import on_one_thread
from toolpoint.cutting.cut.modal_state import ModalState, modal_plane
from toolpoint.cutting.cut.problem import MillingProblem, check_speeds
from toolpoint.cutting.simulation.march import BLOCK_STEPS, March, advance, begin, kept_trace, steps_of_repeat
from toolpoint.cutting.simulation.records import EdgeElements, ElementForces, ModalSteps, Rotation
from toolpoint.cutting.simulation.simulated_run import Simulation

FINER_STEPS_FACTOR = 4  # steps that confirm chatter of a low level over those that found it


@dataclass(frozen=True)
class ExactSteps:
    """Settings of a simulation.

    Parameters
    ----------
    steps : int
        Steps in one tooth period; forces are linear over a step, the structure's response to them exact, entry and
        exit weighted exactly, so the error is second order in 1/steps. 0 takes at least 400, and 40 in each period of
        the highest mode.
    slices : int
        Axial slices of a helical tool.
    memory : int
        How many earlier passages may have left the surface (0: number of teeth).
    keeps_contact : bool
        True keeps an edge in contact also where it has left the material (one passage of memory): the linear cut that
        stability charts are about. Close below the limit a real cut may chatter on once it has been disturbed so far that
        edges leave the material (a subcritical loss of stability); the linear one does not.
    """

    steps: int = 0
    slices: int = 12
    memory: int = 0
    keeps_contact: bool = False

    def __post_init__(self) -> None:
        for name in ("steps", "slices", "memory"):
            count(f"ExactSteps.{name}", getattr(self, name), 0)

    def chosen(self, problem: MillingProblem, speed: float) -> int:
        """Return the number of steps in a tooth period."""
        if self.steps:
            return self.steps
        highest = np.abs(problem.plane_at(speed).poles).max() / (2 * np.pi)
        return int(max(400, np.ceil(40 * highest * float(problem.tooth_period(speed)))))


@on_one_thread
def simulate(problem: MillingProblem, speed: float, depth: float, *, revolutions: int = 50,
             method: ExactSteps | None = None, start: FloatArray | None = None) -> Simulation:
    """Simulate a cut from rest (or from a first displacement `start` of the modes, m of each pole).

    Parameters
    ----------
    problem : MillingProblem
        With `feed_per_tooth` above zero.
    speed, depth : float
        rev/min and m.
    revolutions : int
    method : ExactSteps, optional
    start : (n_poles,) complex, optional
        Modal states at time zero.
    """
    march = RunningCut(problem, speed, depth, method=method, start=start)
    march.advance(count("revolutions", revolutions))
    return march.result()


class RunningCut:
    """Simulated cut that can be continued: `advance` by revolutions, then `result`; of long ones the last revolutions are kept.

    Parameters are those of `simulate`; kept : about how many of the last steps are kept, all where None.
    """

    def __init__(self, problem: MillingProblem, speed: float, depth: float, *, method: ExactSteps | None = None,
                 start: FloatArray | None = None, kept: int | None = None) -> None:
        method = method or ExactSteps()
        self.problem, self.kept, self.method, self.start = problem, kept, method, start
        self.speed, self.depth = float(check_speeds(speed)[0]), positive("depth", depth, 1.0)
        if problem.feed_per_tooth <= 0:
            fail("MillingProblem.feed_per_tooth", "0", "must be above zero in the time domain",
                 remedy="problem.changed(feed_per_tooth=...)")
        plane = modal_plane(problem.plane_at(self.speed))
        self.notes = tuple(dict.fromkeys((*problem.notes, *plane.notes)))
        system = ModalState(plane)
        self.steps_per_period = method.chosen(problem, self.speed)
        self.clock = Clock.of(problem, self.speed, self.steps_per_period)
        self.march = _march_of(problem, system, self.clock, self.depth, self.steps_per_period, method)
        modal = np.zeros(system.poles.size, complex)
        if start is not None:
            modal[:] = start
        self.state = begin(self.march, modal)

    @property
    def steps_per_revolution(self) -> int:
        """Time steps of a revolution."""
        return self.steps_per_period * self.problem.tool.teeth

    @property
    def revolutions(self) -> int:
        """Whole revolutions so far."""
        return self.state.steps // self.steps_per_revolution

    @on_one_thread
    def advance(self, revolutions: int) -> None:
        """Continue by some revolutions (with a varied speed the last of them may be part of its period)."""
        advance(self.march, self.state, revolutions * self.steps_per_revolution, kept=self.kept)
        if self.state.stopped:
            warnings.warn(self._status(), ToolpointWarning, stacklevel=3)

    def result(self) -> Simulation:
        """Return the cut so far."""
        trace, first = kept_trace(self.state), self.state.dropped
        time = self.clock.at(np.arange(first, first + trace.torque.size))
        return Simulation(self.problem, self.speed, self.depth, time, trace.displacement, trace.force,
                          trace.torque * self.problem.tool.radius, trace.chip, self.steps_per_period, self._status(),
                          self.notes, np.array(self.state.changes), first)

    def _status(self) -> str:
        if not self.state.stopped:
            return "complete"
        time = float(self.clock.at(np.array([self.state.steps]))[0])
        return f"stopped at {time:.4g} s: the vibration passed 1 m; the cut is unstable"


@dataclass(frozen=True, eq=False)
class Clock:
    """Times of steps of equal angle: `within` (n + 1,) s over the n steps after which the speed repeats, from zero."""

    within: FloatArray

    @classmethod
    def of(cls, problem: MillingProblem, speed: float, steps_per_period: int) -> Clock:
        """Return the clock of a spindle, at constant or varied speed."""
        per_turn, variation = steps_per_period * problem.tool.teeth, problem.speed_variation
        if variation is None:
            return cls(np.array([0.0, 60 / speed / per_turn]))
        angle = problem.engagement.entry + 2 * np.pi / per_turn * np.arange(per_turn * variation.revolutions + 1)
        time = variation.clock(angle, 2 * np.pi * speed / 60)
        return cls(time - time[0])

    @property
    def steps(self) -> FloatArray:
        """Length of every step, s."""
        return np.asarray(np.diff(self.within), float)

    @property
    def varies(self) -> bool:
        """Whether the speed varies."""
        return self.within.size > 2

    def at(self, step: Array) -> FloatArray:
        """Return the time of these steps from the start, s; negative steps are before it."""
        repeats, part = np.divmod(step, self.within.size - 1)
        return np.asarray(repeats * self.within[-1] + self.within[part], float)


def _march_of(problem: MillingProblem, system: ModalState, clock: Clock, depth: float, m: int, method: ExactSteps) -> March:
    """Return the records of a cut for its blocks, with m steps in a tooth period."""
    edges = edge_elements(problem, depth, m, method=method)
    per_turn, block = m * problem.tool.teeth, clock.steps.size
    repeat = max(per_turn, block)
    period = steps_of_repeat(problem, m)
    history = int(np.ceil(max(float(edges.delay.max()) + 2, period) / repeat)) * repeat
    longest = history + max(BLOCK_STEPS // repeat, 1) * repeat
    return March(_rotation(problem, clock, m, longest, edges), modal_steps(system, clock.steps), edges,
                 _force_law(problem, clock, m, method), repeat, history, period, system.left.shape[0])


def _rotation(problem: MillingProblem, clock: Clock, m: int, steps: int, edges: EdgeElements) -> Rotation:
    per_turn = m * problem.tool.teeth
    # The table moves at constant speed: with a varied spindle the feed of a tooth varies with it.
    lead_steps = int(np.ceil(edges.delay.max())) + 1
    rate = problem.feed_per_tooth * clock.steps.size / m / clock.within[-1]
    fed = rate * clock.at(np.arange(-lead_steps, steps + 1)) if clock.varies else np.empty(0)
    return Rotation(0, steps, per_turn, problem.engagement.entry, 2 * np.pi / per_turn, problem.feed_per_tooth / m, fed)


def _force_law(problem: MillingProblem, clock: Clock, m: int, method: ExactSteps) -> ElementForces:
    angle_step = 2 * np.pi / (m * problem.tool.teeth)
    drag = problem.process_damping * clock.steps / (angle_step * problem.tool.radius)
    material, law = problem.coefficients, problem.law
    if law is None or method.keeps_contact:  # the linear cut beside a chart takes the law's tangent, as the chart does
        cutting, edge, exponent = material.cutting, material.edge, 0.0
    else:
        cutting, edge, exponent = law.energy * law.ratios, np.zeros(3), law.exponent
    k, e = cutting.tolist(), edge.tolist()
    return ElementForces((k[0], k[1], k[2]), (e[0], e[1], e[2]), drag, problem.damping_friction, method.keeps_contact,
                         float(exponent))


def modal_steps(system: ModalState, lengths: FloatArray) -> ModalSteps:
    """Return the exact steps of the modal states over these lengths, s, for a force that is linear over each."""
    x = system.poles * lengths[:, None]
    phi1 = np.expm1(x) / x
    # Below, the closed form loses digits by 1/x; what the series leaves out is below 1e-13.
    is_small = np.abs(x) < 1e-2
    phi2 = np.where(is_small, 0.5 + x / 6 + x**2 / 24 + x**3 / 120 + x**4 / 720, (phi1 - 1) / np.where(is_small, 1, x))
    first, last = (weight[:, None, :] * lengths[:, None, None] * system.right.T for weight in (phi1 - phi2, phi2))
    compliance = 2 * np.real(np.einsum("am,nbm->nab", system.left, last))
    # In one order of storage whatever the number of modes: the kernel would be compiled for each.
    left, first, last = (np.ascontiguousarray(each) for each in (system.left, first, last))
    return ModalSteps(left, np.exp(x), first, last, compliance, lengths)


def edge_elements(problem: MillingProblem, depth: float, m: int, *, method: ExactSteps) -> EdgeElements:
    """Return the edge elements of a cut at `m` steps in a tooth period."""
    tool = problem.tool
    slices = method.slices if tool.has_helix or tool.tilt or tool.corner_radius else 1
    share = tool.edge_length(depth) / slices
    height, kappa, radius = tool.along_edge((np.arange(slices) + 0.5) * share)
    lag, distance = tool.angles(height), tool.edge_radius(height)
    memory = 1 if method.keeps_contact else method.memory or tool.teeth
    delay, extra = np.zeros((slices, tool.teeth, memory)), np.zeros((slices, tool.teeth, memory))
    for i in range(1, memory + 1):
        earlier = (np.arange(tool.teeth) - i) % tool.teeth  # the tooth that cut there i passages earlier
        angle = (lag - lag[:, earlier]) % (2 * np.pi)
        angle = np.where(angle < 1e-12, 2 * np.pi, angle) + 2 * np.pi * ((i - 1) // tool.teeth)
        delay[:, :, i - 1] = np.round(angle / (2 * np.pi) * m * tool.teeth, 9)
        extra[:, :, i - 1] = distance - distance[:, earlier]
    element_count = slices * tool.teeth
    upward = np.where(kappa == np.pi / 2, 0.0, np.cos(kappa))
    entry, leave = problem.engagement.at_radius(tool.radius / radius)
    outward, upward, ratio, entry, leave = (
        np.repeat(values, tool.teeth) for values in (np.sin(kappa), upward, radius / tool.radius, entry, leave))
    return EdgeElements(lag.ravel() % (2 * np.pi), np.full(element_count, share), outward, upward, ratio, entry, leave,
                        delay.reshape(element_count, memory), extra.reshape(element_count, memory))


def run_until_decided(cut: RunningCut, first: int, revolutions_max: int) -> Simulation:
    """Continue a cut to `first`, twice, four times as many revolutions until it is decided, at most `revolutions_max`.

    Chatter of a level so low that the time steps may keep it up is run again with finer ones, which decide.
    """
    run = _run_until_decided(cut, first, revolutions_max)
    if not run.verdict().may_be_of_steps:
        return run
    refined_cut = RunningCut(cut.problem, cut.speed, cut.depth, kept=cut.kept, start=cut.start,
                             method=replace(cut.method, steps=FINER_STEPS_FACTOR * cut.steps_per_period))
    refined = _run_until_decided(refined_cut, first, run.revolutions)
    return run if refined.verdict().chatters is None else refined


def _run_until_decided(cut: RunningCut, first: int, revolutions_max: int) -> Simulation:
    variation = cut.problem.speed_variation
    variation_period = 1 if variation is None else variation.revolutions
    revolutions = min(first, revolutions_max)
    while True:
        cut.advance(max(-(-(revolutions - cut.revolutions) // variation_period) * variation_period, variation_period))
        run = cut.result()
        if cut.revolutions >= revolutions_max or run.verdict().state != "undecided":
            return run
        revolutions = min(2 * revolutions, revolutions_max)


def peak_to_peak_map(problem: MillingProblem, speeds: FloatArray, depths: FloatArray, *, revolutions: int = 40,
                     method: ExactSteps | None = None) -> FloatArray:
    """Return the peak-to-peak displacement of the last ten revolutions, m, shape (n_speeds, n_depths, 2 or 3)."""
    n, w = check_speeds(speeds), floats("depths", np.atleast_1d(depths))
    out = np.empty((n.size, w.size, problem.plane.size))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToolpointWarning)
        for i, speed in enumerate(n):
            for j, depth in enumerate(w):
                out[i, j] = simulate(problem, float(speed), float(depth), revolutions=revolutions, method=method).peak_to_peak()
    return out
