"""Circle that a servo must follow: the radial deviation beside the goal, what causes it, and the gains or feed that meet it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, ToolpointWarning, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import number_text
from toolpoint.drives.description import DriveAxisDescription, DriveDescription
from toolpoint.machine import Machine
from toolpoint.machine.description.project_plan import ContourGoal
from toolpoint.studies.servos.drive_experiment import CircleTurn, DriveExperiment, run_drives
from toolpoint.studies.servos.drive_tuning import TunedDrives, tune_drives

FEED_HALVINGS, FEED_BISECTIONS = 3, 2  # feeds tried below the one asked for: halves of it, then between the last two
GAIN_BISECTIONS = 5  # of the way from today's gains to the largest ones
REVERSAL_ANGLE = math.radians(20)  # on either side of a reversal, in which friction moves the radius
CAUSES = {
    "first": "is a peak where {0} reverses: friction; stiffer loops or a friction compensation of the control act on it",
    "second": "is a peak where {1} reverses: friction; stiffer loops or a friction compensation of the control act on it",
    "radius": "is a change of the whole radius: the loops of both axes cannot follow at this feed; a lower feed or larger "
              "gains act on it",
    "oval": "makes the circle oval: {0} and {1} lag by different amounts; make their gains alike"}
NO_INTERVAL_DOUBT = Doubt(
    "contour", "the numbers of the servo file have no stated uncertainty, so this deviation has no interval",
    "measure a circle on the machine and compare it (toolpoint servo-data)")

POSE_DOUBT = Doubt("pose", "no drive ends on a machine, so the pose of the goal changes nothing",
                   "leave it out, or describe the drives as ball screws that end on the machine")
STRUCTURE_DOUBT = Doubt(
    "structure", "no axis of the servo file ends at points of the machine, so what the structure gives way by is not in this "
    "deviation", "describe the drives as ball screws that end on the machine")


@dataclass(frozen=True)
class CircleRemedy:
    """Change of a servo's gains or of the feed, with the radial deviation (m) of the circle after it.

    drives : with the gains; feed : m/s; goal : m; kind : what is changed (gains, feed, gains and feed); change : in words;
    doubts : of its loops, beside those of today's gains.
    """

    drives: DriveDescription
    feed: float
    deviation: float
    goal: float
    kind: str
    change: str
    doubts: tuple[Doubt, ...] = ()

    @property
    def is_met(self) -> bool:
        """Whether the deviation is within the goal, by loops that are not doubted."""
        return self.deviation <= self.goal and not self.doubts

    def words(self) -> str:
        """Return the change and what it gives."""
        relation = "within" if self.deviation <= self.goal else "still beyond"
        return "; ".join([f"{self.change}: radial deviation {1e6 * self.deviation:.3g} µm, {relation} the goal", *self.doubts])

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data, SI."""
        return {"kind": self.kind, "change": self.change, "feed_m_s": self.feed, "deviation_m": self.deviation,
                "met": self.is_met, "words": self.words(), "gains": {
                    name: {"position": axis.position.gain, "velocity": axis.velocity.gain,
                           "integral_time_s": axis.velocity.integral_time} for name, axis in self.drives.axes.items()}}


@dataclass(frozen=True, eq=False)
class CircleStudy(NotebookText):
    """A circle beside its goal.

    experiment : its simulation; deviation : the largest radial one, m; remedies : where the goal is not met, what was tried;
    tuned : the drive with the largest gains that keep the margins, None where it was not needed or none keeps them.
    """

    goal: ContourGoal
    experiment: DriveExperiment
    deviation: float
    remedies: tuple[CircleRemedy, ...] = ()
    tuned: TunedDrives | None = None
    structure_doubts: tuple[Doubt, ...] = ()

    @property
    def is_met(self) -> bool:
        """Whether the deviation is within the goal."""
        return self.deviation <= self.goal.deviation

    @property
    def doubts(self) -> list[Doubt]:
        """Doubts of the loops, of the structure that is left out, of the proposed gains, and that there is no interval."""
        of_gains = [] if self.tuned is None else self.tuned.rigid_doubts
        return [*self.experiment.doubts, *self.structure_doubts, *of_gains, NO_INTERVAL_DOUBT]

    @property
    def status(self) -> str:
        """The deviation beside the goal, in words."""
        relation = "within" if self.is_met else "beyond"
        return f"radial deviation {1e6 * self.deviation:.3g} µm, {relation} the goal of {1e6 * self.goal.deviation:.3g} µm"

    def cause(self) -> str:
        """Return where the largest deviation of a missed goal arises, in words; empty where the goal is met."""
        turn = self.experiment.turn
        if self.is_met or turn is None:
            return ""
        parts = part_deviation(turn)
        largest = max(parts, key=lambda part: abs(parts[part]))
        return f"its largest part, {1e6 * abs(parts[largest]):.3g} µm, {CAUSES[largest].format(*turn.axes)}"

    def lines(self) -> list[str]:
        """Return cause and remedies of a missed goal, a sentence each."""
        return [line for line in (self.cause(), *(remedy.words() for remedy in self.remedies)) if line]

    def table(self) -> str:
        """Return doubts, the answer, cause and remedies as text."""
        return "\n".join([*mark_notes([*self.doubts, *self.experiment.notes], "note: "), self.status, *self.lines()])

    def to_dict(self) -> dict[str, Any]:
        """Return deviation, goal, cause and remedies as plain data, SI."""
        goal = self.goal
        return {"deviation_m": self.deviation, "goal_m": goal.deviation, "met": self.is_met, "axes": list(goal.axes),
                "radius_m": goal.radius, "feed_m_s": goal.feed, "pose": dict(goal.pose), "cause": self.cause(),
                "remedies": [remedy.to_dict() for remedy in self.remedies], "notes": list(self.experiment.notes),
                "doubts": list(self.doubts)}

    def __repr__(self) -> str:
        return f"CircleStudy({self.status})"


def part_deviation(turn: CircleTurn) -> dict[str, float]:
    r"""Return the parts of a turn's radial deviation, m, each by its cause: ``first`` and ``second`` peaks at the reversals of
    the axes, ``radius`` of the whole circle, ``oval`` (half the difference of its axes).

    Without reversals the deviation is :math:`a_0 + a_1\cos(\theta-\alpha_1) + a_2\cos 2(\theta-\alpha_2)`: radius, shift of
    the centre, lags of the axes that differ. It is fitted away from the reversals; what stands above it there is a peak.

    >>> import numpy as np
    >>> angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    >>> oval = (0.03 + 5e-6 * np.sin(2 * angle))[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    >>> {name: round(1e6 * part, 3) for name, part in part_deviation(CircleTurn({"tool": oval}, 0.03, np.zeros(4))).items()}
    {'first': 0.0, 'second': 0.0, 'radius': 0.0, 'oval': 5.0}
    """
    points = turn.points["tool"]
    angle, deviation = np.arctan2(points[:, 1], points[:, 0]), np.hypot(*points.T) - turn.radius
    columns = np.stack([np.ones(angle.size), np.cos(angle), np.sin(angle), np.cos(2 * angle), np.sin(2 * angle)], axis=1)
    distances = [np.abs(np.angle(np.exp(1j * (angle - k * np.pi / 2)))) for k in range(4)]  # to the reversals
    smooth = np.min(distances, axis=0) > REVERSAL_ANGLE
    fit = np.linalg.lstsq(columns[smooth], deviation[smooth], rcond=None)[0]
    excess = deviation - columns @ fit
    peaks = [float(np.abs(excess[distance <= REVERSAL_ANGLE]).max(initial=0.0)) for distance in distances]
    return {"first": max(peaks[0], peaks[2]), "second": max(peaks[1], peaks[3]), "radius": float(fit[0]),
            "oval": float(np.hypot(*fit[3:]))}


def study_circle(drives: DriveDescription, goal: ContourGoal, *, machine: Machine | None = None,
                 progress: Callable[[str], None] | None = None) -> CircleStudy:
    """Return how a servo follows a circle beside the deviation that is allowed, and what would meet it.

    Parameters
    ----------
    drives : DriveDescription
    goal : ContourGoal
        Radius (m), feed (m/s), largest radial deviation (m), the two axes, and the pose of the machine.
    machine : Machine, optional
        Whose structure the drives push against; left out, with a doubt, where no axis of the drives ends on it.
    progress : callable, optional
        Called with the name of every step at its start.

    Where the goal is missed, gains between today's and the largest that keep the usual margins (`tune_drives`), lower feeds
    with today's gains, and lower feeds with the largest ones are simulated in turn. The deviation need not fall with the feed,
    as friction does not: every feed that is named was simulated.

    Examples
    --------
    Runs in ``examples/drive_a_circle.py``.
    """
    structure = machine if ends_on_machine(drives) else None
    left_out = (*((STRUCTURE_DOUBT,) if machine is not None and structure is None else ()),
                *((POSE_DOUBT,) if goal.pose and structure is None else ()))
    if not 0 < goal.deviation < goal.radius:
        fail("deviation", f"{1e6 * goal.deviation:.4g} µm", f"must be above 0 and below the radius, {1e3 * goal.radius:.4g} mm",
             remedy="give it with its unit, as 10um")
    search = _RemedySearch(drives, goal, structure)
    experiment = search.run(drives, goal.feed, progress)
    deviation = _deviation(experiment)
    if deviation <= goal.deviation:
        return CircleStudy(goal, experiment, deviation, structure_doubts=left_out)
    if progress is not None:
        progress("gains and feeds that would meet the goal")
    tuned = search.tune()
    remedies = replace(search, doubts_today=tuple(experiment.doubts)).remedies(tuned)
    return CircleStudy(goal, experiment, deviation, tuple(remedies), tuned, left_out)


def ends_on_machine(drives: DriveDescription) -> bool:
    """Whether a drive ends at points of a machine, so that its structure is in the loops."""
    return any(axis.ends is not None for axis in drives.axes.values())


def _deviation(experiment: DriveExperiment) -> float:
    """Return the largest radial deviation of the second turn, m."""
    test: Any = experiment.circle
    return float(max(abs(test.radial_max), abs(test.radial_min)))


@dataclass(frozen=True, eq=False)
class _RemedySearch:
    """Search for gains and feeds that meet a goal."""

    drives: DriveDescription
    goal: ContourGoal
    machine: Machine | None
    doubts_today: tuple[Doubt, ...] = ()

    def run(self, drives: DriveDescription, feed: float, progress: Callable[[str], None] | None = None) -> DriveExperiment:
        """Return the simulation with gains at a feed."""
        pose: Mapping[str, float] | None = self.goal.pose if self.machine is not None and self.goal.pose else None
        return run_drives(drives, circle=(self.goal.radius, feed), plane=self.goal.axes, machine=self.machine, pose=pose,
                          progress=progress)

    def tune(self) -> TunedDrives | None:
        """Return the drive with the largest gains that keep the margins, None where no gain keeps them."""
        pose = self.goal.pose if self.machine is not None and self.goal.pose else None
        try:
            return tune_drives(self.drives, machine=self.machine, pose=pose)
        except ToolpointError:
            return None  # the loops' own doubts say why

    def remedies(self, tuned: TunedDrives | None) -> list[CircleRemedy]:
        """Return what was tried, in turn: gains, feed, both; the last one only where neither meets the goal."""
        found = [self._slower(self.drives, "with today's gains")]
        if tuned is not None:
            found.insert(0, self._stiffer(tuned))
            if not any(remedy.is_met for remedy in found):
                found.append(self._slower(tuned.drives, "with the largest gains that keep the margins"))
        return sorted(found, key=lambda remedy: not remedy.is_met)

    def _stiffer(self, tuned: TunedDrives) -> CircleRemedy:
        """Return the least raise of the gains that meets the goal, or the largest gains that keep the margins.

        The largest gains are the end of a line of gains that begins at today's: a goal is met with what it needs, since the
        margins of a model without resonances allow gains that no machine bears.
        """
        def at(share: float) -> CircleRemedy:
            drives = _between(self.drives, tuned.drives, share)
            bound = "the largest gains that keep the margins" if share == 1 else "larger gains"
            return self._remedy(drives, self.goal.feed, kind="gains", change=f"{bound} ({_gain_words(self.drives, drives)})")

        largest = best = at(1.0)
        if largest.deviation > self.goal.deviation:
            return largest
        lower, upper = 0.0, 1.0
        for _ in range(GAIN_BISECTIONS):
            middle = (lower + upper) / 2
            remedy = at(middle)
            lower, upper = (lower, middle) if remedy.deviation <= self.goal.deviation else (middle, upper)
            best = remedy if remedy.is_met else best
        return best

    def _slower(self, drives: DriveDescription, gains: str) -> CircleRemedy:
        """Return the highest feed among those tried that meets the goal, or the best of them."""
        def at(feed: float) -> CircleRemedy:
            kind = "feed" if drives is self.drives else "gains and feed"
            return self._remedy(drives, feed, kind=kind, change=f"feed {_feed_words(feed)} instead of "
                                                             f"{_feed_words(self.goal.feed)} {gains}")

        tried = list[CircleRemedy]()
        for power in range(1, FEED_HALVINGS + 1):
            tried.append(at(self.goal.feed / 2**power))
            if tried[-1].is_met:
                break
        else:
            best = min(tried, key=lambda remedy: remedy.deviation)
            return replace(best, change=f"feeds down to {_feed_words(tried[-1].feed)} {gains}, at best")
        lower, upper = tried[-1].feed, 2 * tried[-1].feed
        best = tried[-1]
        for _ in range(FEED_BISECTIONS):
            between = at((lower * upper) ** 0.5)
            if between.is_met:
                lower, best = between.feed, between
            else:
                upper = between.feed
        return best

    def _remedy(self, drives: DriveDescription, feed: float, *, kind: str, change: str) -> CircleRemedy:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ToolpointWarning)  # those of today's gains are said; these are trials
            experiment = self.run(drives, feed)
        # Loops are those of the gains: a feed changes none of their margins.
        new_doubts = () if drives is self.drives else tuple(
            doubt for doubt in experiment.doubts if doubt not in self.doubts_today)
        return CircleRemedy(drives, feed, _deviation(experiment), self.goal.deviation, kind, change, new_doubts)


def _between(old: DriveDescription, new: DriveDescription, share: float) -> DriveDescription:
    """Return the drives with gains a share of the way from old to new ones, in their logarithms; notches are the new ones."""
    def blend(one_end: float | None, other_end: float | None) -> float | None:
        return other_end if one_end is None or other_end is None else one_end ** (1 - share) * other_end**share

    def axis_of(name: str) -> DriveAxisDescription:
        first, second = old.axes[name], new.axes[name]
        gain = blend(first.position.gain, second.position.gain) or second.position.gain
        velocity_gain = blend(first.velocity.gain, second.velocity.gain) or second.velocity.gain
        integral_time = blend(first.velocity.integral_time, second.velocity.integral_time)
        return replace(second, position=replace(second.position, gain=gain),
                       velocity=replace(second.velocity, gain=velocity_gain, integral_time=integral_time))

    return replace(new, axes={name: axis_of(name) for name in new.axes})


def _gain_words(old: DriveDescription, new: DriveDescription) -> str:
    """Return the gains that change, in words."""
    return "; ".join(
        f"{name}: K_v {number_text(old_axis.position.gain)} to {number_text(axis.position.gain)} 1/s, velocity gain "
        f"{number_text(old_axis.velocity.gain)} to {number_text(axis.velocity.gain)} N m s/rad, integral time "
        f"{_time_words(old_axis)} to {_time_words(axis)}" for name, axis in new.axes.items() for old_axis in [old.axes[name]])


def _feed_words(feed: float) -> str:
    return f"{number_text(6e4 * feed, digits=3)} mm/min"


def _time_words(axis: DriveAxisDescription) -> str:
    time = axis.velocity.integral_time
    return "none" if time is None else f"{number_text(1e3 * time, digits=3)} ms"
