r"""Time-domain milling: regeneration with loss of contact, helix, run-out, unequal pitch, several flutes' memory."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointWarning, count, fail, floats, positive
from toolpoint._notebook import NotebookText
from toolpoint._threads import on_one_thread
from toolpoint.cutting.cut.modal_state import ModalState, modal_plane
from toolpoint.cutting.cut.problem import MillingProblem, check_speeds
from toolpoint.cutting.simulation.march import BLOCK_STEPS, March, advance, begin, kept_trace, steps_of_repeat
from toolpoint.cutting.simulation.records import EdgeElements, ElementForces, ModalSteps, Rotation
from toolpoint.cutting.simulation.verdict import Verdict, judge
from toolpoint.vibration import Dof, Record


@dataclass(frozen=True, eq=False)
class Simulation(NotebookText):
    """Result of a simulated cut.

    Parameters
    ----------
    problem, speed, depth : MillingProblem, float (rev/min), float (m)
    time : (n,) floats
        s.
    displacement : (n, 2 or 3) floats
        Tool against work in the feed frame, m; three directions where the problem's dynamics have z.
    force : (n, 3) floats
        Force on the tool, N.
    torque : (n,) floats
        Spindle torque, N m.
    chip : (n,) floats
        Largest chip thickness of any edge element, m.
    steps_per_period : int
        Samples in one tooth period.
    status : str
    notes : sequence of str
    changes : (n_periods - 1,) floats
        Root mean square change of the displacement from each period of the cut to the next, m, from the start.
    dropped : int
        Steps before the first sample: of a long cut only the last revolutions are kept.
    """

    problem: MillingProblem
    speed: float
    depth: float
    time: FloatArray
    displacement: FloatArray
    force: FloatArray
    torque: FloatArray
    chip: FloatArray
    steps_per_period: int
    status: str = "complete"
    notes: tuple[str, ...] = ()
    changes: FloatArray = field(default_factory=lambda: np.zeros(0))
    dropped: int = 0

    @property
    def revolutions(self) -> int:
        """Whole revolutions from the start."""
        return (self.dropped + self.time.size - 1) // self.steps_per_revolution

    @property
    def steps_per_revolution(self) -> int:
        """Samples in one revolution."""
        return self.steps_per_period * self.problem.tool.teeth

    @property
    def steps_per_repeat(self) -> int:
        """Samples after which a stable cut repeats: a tooth period, a revolution of an irregular tool, or the variation."""
        return steps_of_repeat(self.problem, self.steps_per_period)

    @property
    def power(self) -> FloatArray:
        """Cutting power, W."""
        return self.torque * 2 * np.pi * self.speed / 60

    def once_per_revolution(self) -> FloatArray:
        """Return the displacement sampled once a revolution: a point when stable, a closed curve in Hopf chatter, two points in
        flip."""
        return self.displacement[::self.steps_per_revolution]

    def once_per_tooth(self) -> FloatArray:
        """Return the displacement sampled once a tooth period."""
        return self.displacement[::self.steps_per_period]

    def peak_to_peak(self, last_revolutions: int = 10) -> FloatArray:
        """Return the peak-to-peak displacement in every direction over the last revolutions, m."""
        return np.ptp(self.displacement[-last_revolutions * self.steps_per_revolution:], axis=0)

    def verdict(self) -> Verdict:
        """Return whether the cut is stable, chatters, or whether this run is too short to tell, with the growth a period."""
        return judge(self)

    def is_chattering(self) -> bool | None:
        """Whether the cut chatters; None where the run is too short to tell (see `verdict`)."""
        return self.verdict().chatters

    def growth(self, periods: int = 80) -> float:
        """Return the growth of the difference between periods of the cut, per period, over the last `periods`; 1 on the
        boundary.

        Raises ToolpointError where the run holds fewer periods (it may have been stopped, see `status`).
        """
        m = self.steps_per_repeat
        held = (self.displacement.shape[0] - 1) // m - 2
        if not 1 <= periods <= held:
            fail("periods", str(periods), f"must be 1 to {held}, what the run holds ({self.status})",
                 remedy="simulate more revolutions")
        d = self.displacement[-(periods + 2) * m - 1:]
        change = d[m:] - d[:-m]
        energy = np.array([np.linalg.norm(change[i * m:(i + 1) * m]) for i in range(periods + 1)])
        slope = np.polyfit(np.arange(energy.size), np.log(np.maximum(energy, 1e-300)), 1)[0]
        return float(np.exp(slope))

    def spectrum(self, what: str = "displacement", direction: int = 0, last_revolutions: int | None = None) -> Spectrum:
        """Return the amplitude spectrum over whole revolutions with spindle, tooth-passing and chatter lines marked."""
        values = np.asarray(getattr(self, what), float)
        values = values[:, direction] if values.ndim == 2 else values
        turn_count = (values.size - 1) // self.steps_per_revolution
        turns = min(turn_count, last_revolutions or turn_count)
        if self.problem.speed_variation is not None:
            # The samples are equal steps of angle; a spectrum over time needs equal steps of time.
            values = np.interp(np.linspace(self.time[0], self.time[-1], self.time.size), self.time, values)
        part = values[-turns * self.steps_per_revolution:]
        amplitude = np.abs(np.fft.rfft(part - part.mean())) / part.size * 2
        frequency = np.arange(amplitude.size) * (self.speed / 60) / turns
        return Spectrum(frequency, amplitude, self.speed / 60, self.problem.tool.teeth)

    def record(self) -> Record:
        """Return the displacement as a Record (tool x, y and, where it is known, z); under speed variation by interpolation."""
        ways = self.displacement.shape[1]
        labels, rate = tuple(Dof("tool", way) for way in "xyz"[:ways]), (self.time.size - 1) / float(self.time[-1])
        samples = self.displacement
        if self.problem.speed_variation is not None:
            even_times = np.linspace(0.0, self.time[-1], self.time.size)
            samples = np.stack([np.interp(even_times, self.time, column) for column in samples.T], axis=1)
        return Record(samples, rate, labels, ("displacement",) * ways)

    def __repr__(self) -> str:
        return (f"Simulation({self.speed:g} rev/min, {1e3 * self.depth:g} mm, {self.time.size} samples, "
                f"{self.time[-1]:.3g} s, {self.status})")


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Amplitude spectrum with the frequencies that a cut is expected to show, Hz."""

    frequency: FloatArray
    amplitude: FloatArray
    spindle: float
    teeth: int

    def lines(self, share: float = 0.05) -> list[tuple[float, float, str]]:
        """Return (Hz, amplitude, kind) of peaks above `share` of the largest: spindle, tooth passing or chatter."""
        a = self.amplitude
        peak = np.flatnonzero((a[1:-1] >= a[:-2]) & (a[1:-1] > a[2:]) & (a[1:-1] > share * a.max())) + 1
        peaks = []
        for i in peak.tolist():
            order = self.frequency[i] / self.spindle
            kind = "chatter"
            if abs(order - round(order)) < 1e-6:
                kind = "tooth passing" if round(order) % self.teeth == 0 else "spindle"
            peaks.append((float(self.frequency[i]), float(a[i]), kind))
        return peaks


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
        self.problem, self.kept = problem, kept
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
