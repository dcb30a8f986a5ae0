"""Result of a simulated cut: displacement, forces and chip over time, its verdict, growth and spectrum."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.simulation.march import steps_of_repeat
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
        return judge(self.changes, status=self.status, time_constants=self.time_constants,
                     thickest_chip=float(self.chip[-self.steps_per_revolution:].max(initial=0.0)))

    def time_constants(self, periods: int) -> float:
        """Return how many time constants of the slowest mode pass in a number of periods of the cut."""
        slowest = float((-self.problem.plane_at(self.speed).poles.real).min())
        # Periods of the cut are of one length, also where the speed varies within them.
        return slowest * periods * self.steps_per_repeat / self.steps_per_revolution * 60 / self.speed

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
        """Return the amplitude spectrum over whole revolutions with spindle, tooth-passing and chatter lines marked.

        Of a run that ended within its first revolution it is over all of it.
        """
        values = np.asarray(getattr(self, what), float)
        values = values[:, direction] if values.ndim == 2 else values
        turn_count = (values.size - 1) // self.steps_per_revolution
        turns = min(turn_count, last_revolutions or turn_count)
        if self.problem.speed_variation is not None:
            # The samples are equal steps of angle; a spectrum over time needs equal steps of time.
            values = np.interp(np.linspace(self.time[0], self.time[-1], self.time.size), self.time, values)
        part = values[-turns * self.steps_per_revolution:]  # all of it where there is no whole turn
        amplitude = np.abs(np.fft.rfft(part - part.mean())) / part.size * 2
        frequency = np.arange(amplitude.size) * (self.speed / 60) * self.steps_per_revolution / part.size
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
