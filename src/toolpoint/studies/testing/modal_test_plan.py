"""Plan of a hammer test from a machine file: points to measure and strike, length and spacing of lines, expected errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, positive
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import Pose
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.virtual_test import Hammer, MeasuringPoints, surface_points, true_modes
from toolpoint.studies.testing.point_choice import choose_points, choose_struck, largest_likeness, visibility
from toolpoint.studies.testing.virtual_outcome import VirtualOutcome, run_virtual_test
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof, Modes

# points that could be measured where the file names none; random sets beside the chosen one
DEFAULT_CANDIDATE_POINTS, RANDOM_SETS = 131, 3
DEFAULT_PLANNED_MODES = 18  # a test that should tell forty modes apart takes a day, and minutes to plan
DEFAULT_MEASURED_POINTS = 12  # of a plan whose modes need no more
PLANNED_DAMPING_RATIO = 0.02  # where the machine states none, or so little that it must be left out
RING_DOWN_FRACTION = 0.01  # of the slowest ring-down, at the end of a block
LINE_RANGE_RATIO = 1.3  # highest line over the highest mode
HALF_POWER_LINES = 4.0  # lines in a half-power width
MIN_MOTION_RATIO = 1e-9  # of the largest motion in any mode; less is no motion
MIN_VISIBILITY = 0.1  # of a mode, below which another point should be struck too
PULSE_CONTACT_CYCLES = 1.25  # frequency times contact of a half-sine pulse that is 20 dB down
ROUND_STEPS = (1, 1.25, 1.6, 2, 2.5, 3.2, 4, 5, 6.4, 8, 10)  # of one decade
STEP_COLUMNS = ("step", "what")
EXPECTED_COLUMNS = ("mode", "Hz", "struck moves %", "frequency error %", "damping error %", "MAC expanded")
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class ModalTestPlan(NotebookText):
    """A planned hammer test.

    candidates : all points that could be measured; modes : the model's, at all of them; points : those to measure, with a
    sensor of three directions each; struck : Dofs to strike at every place of the sensor; block, sample_rate, highest, contact
    : s, Hz, Hz, s; expected, random : outcomes of virtual tests at the chosen points and at random ones; notes.
    """

    machine: Machine
    candidates: MeasuringPoints
    modes: Modes
    points: tuple[str | int, ...]
    struck: tuple[Dof, ...]
    block: float
    sample_rate: float
    highest: float
    contact: float
    noise: float
    expected: VirtualOutcome
    random: tuple[VirtualOutcome, ...]
    notes: tuple[str, ...]

    @property
    def visibility(self) -> FloatArray:
        """Motion of the best struck Dof in every mode, 0 .. 1 of its largest motion."""
        return visibility(self.modes, self.struck)

    @property
    def status(self) -> str:
        """The answer in a sentence."""
        error = np.nanmax(np.abs(self.expected.frequency_error), initial=0.0)
        best = max(self.random, key=lambda outcome: (outcome.seen, outcome.least_mac), default=None)
        random_words = "" if best is None else (f" (random points of the same number, at best: {best.seen} modes, "
                                                f"MAC {best.least_mac:.4f})")
        return (f"Strike {', '.join(map(str, self.struck))} with a sensor at {len(self.points)} points: {self.expected.seen} "
                f"of {self.modes.count} modes to be found, frequencies within {100 * float(error):.2g} %, MAC of the expanded "
                f"shapes at least {self.expected.least_mac:.4f}{random_words}.")

    def mode_rows(self) -> list[list[str]]:
        """Return a row for every mode: frequency, visibility, expected errors and MAC."""
        error_text = (lambda value, scale, form: "not found" if np.isnan(value) else format(scale * value, form))
        expected = self.expected
        return [[str(i + 1), f"{self.modes.frequency[i]:.2f}", f"{100 * self.visibility[i]:.0f}",
                 error_text(expected.frequency_error[i], 100, "+.1g"), error_text(expected.damping_error[i], 100, "+.1g"),
                 f"{expected.mac[i]:.4f}"] for i in range(self.modes.count)]

    def steps(self) -> list[list[str]]:
        """Return the check list in order: preparation, settings, blows, checks."""
        hits = len(self.points) * len(self.struck)
        minutes = hits * (4 * self.block + 60) / 60
        rows = [
            ["sensor", f"one of three directions, moved over {len(self.points)} points: {', '.join(map(str, self.points))}"],
            ["hammer", f"a tip whose pulse lasts {1e3 * self.contact:.2g} ms or less: 20 dB down not below {self.highest:.0f} "
                       "Hz"],
            ["acquisition", f"{self.sample_rate:.0f} samples a second, records of {1.05 * self.block:.2g} s and "
                            f"{0.02 * self.block:.2g} s of pretrigger"],
            *[["strike", f"{dof}: at least 3 good blows for every place of the sensor"] for dof in self.struck],
            ["files", "P{output}_at{input}_*.csv, for example P3_at" + f"{self.struck[0]}_1.csv".replace(":", "=")],
            ["time", f"about {minutes:.0f} minutes for {hits} set-ups of three blows"],
            ["look at", "weak and double blows, overload, the force spectrum, coherence, and the driving points, while the "
                        "machine still stands there"]]
        return rows

    def table(self) -> str:
        """Return answer, check list and expected errors as text."""
        return "\n".join([self.status, text_table("Check list", STEP_COLUMNS, self.steps()),
                          text_table("Expected by a virtual test", EXPECTED_COLUMNS, self.mode_rows())])

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI."""
        return {"status": self.status, "points": list(self.points), "struck": [str(dof) for dof in self.struck],
                "coordinates_m": {str(name): self.candidates.coordinates[name].tolist() for name in self.points},
                "block_s": self.block, "sample_rate_hz": self.sample_rate, "highest_hz": self.highest,
                "contact_s": self.contact,
                "frequency_hz": self.modes.frequency.tolist(), "visibility": self.visibility.tolist(),
                "largest_auto_mac": largest_likeness(self.modes, self.points), "expected": self.expected.to_dict(),
                "random": [outcome.to_dict() for outcome in self.random], "notes": list(self.notes)}


def plan_test(machine: Machine, number: int | None = None, *, pose: Pose | None = None, highest: float | None = None,
              struck: int = 3, candidates: MeasuringPoints | None = None, noise: float = 0.01, hits: int = 3,
              rng: np.random.Generator, progress: Progress = lambda name, finished, total: None) -> ModalTestPlan:
    """Return a planned hammer test of a machine.

    Parameters
    ----------
    machine : Machine
    number : int, optional
        Points to measure, three directions each; where left out 12, or as many as tell all modes apart with half as many
        directions to spare.
    pose : axis positions, optional
    highest : float, optional
        Highest mode that matters, Hz; the 18th where left out.
    struck : int
        Most Dofs to strike; fewer where one shows all modes.
    candidates : MeasuringPoints, optional
        Where can be measured; 131 points spread over the bodies where left out.
    noise : float
        Of every channel of the virtual tests, as share of its rms.
    hits : int
        Blows at every set-up.
    rng : numpy.random.Generator

    Raises
    ------
    ToolpointError
        For fewer directions than modes, no mode below `highest`, bodies without extent.

    Examples
    --------
    Runs in ``examples/plan_a_hammer_test.py``.
    """
    places = surface_points(machine, DEFAULT_CANDIDATE_POINTS, rng) if candidates is None else candidates
    modes, notes = _modes(machine, places, pose, highest)
    if number is None:
        number = min(max(DEFAULT_MEASURED_POINTS, -(-modes.count // 2)), len(places.places))
        if number > DEFAULT_MEASURED_POINTS:
            notes.append(f"{number} points are taken, because {modes.count} modes are to be told apart; `highest` leaves those "
                         "out that do not matter")
    if len(places.places) < number:
        fail("number", f"{number} points of {len(places.places)} that could be measured", "must not be more",
             remedy="name more points in the machine file, or ask for fewer")
    progress("points", 0, 1)
    chosen = _choose_struck_dofs(modes, modes.dofs, struck)
    points = choose_points(modes, number, list(dict.fromkeys(dof.point for dof in chosen)))
    line_max = LINE_RANGE_RATIO * float(modes.frequency.max())
    block = _block_length(modes)
    # 2.56 times the highest line, as analysers take it: the slope of the anti-alias filter needs what lies above.
    rate = float(_round_up(2.56 * line_max))
    hammer = Hammer(contact=PULSE_CONTACT_CYCLES / line_max, hits=hits, block=1.05 * block, sample_rate=rate)
    settings: dict[str, Any] = {"hammer": hammer, "block": block, "highest": line_max, "noise": noise, "rng": rng}
    names = _moving_points(modes, places)
    tests = (RANDOM_SETS if number < len(names) else 0) + 1
    expected = run_virtual_test(modes, points, chosen, progress=_part_of_progress("virtual test at the chosen points", 0, tests,
                                                                                  progress),
                                **settings)
    random = []
    for k in range(1, tests):
        random_points = [names[i] for i in sorted(rng.choice(len(names), number, replace=False).tolist())]
        force = choose_struck(modes, [dof for dof in modes.dofs if dof.point in set(random_points)], len(chosen))
        random.append(run_virtual_test(modes, random_points, force,
                                       progress=_part_of_progress("virtual tests at random points", k, tests, progress),
                                       **settings))
    notes += _doubts(modes, points, chosen, expected)
    return ModalTestPlan(machine, places, modes, tuple(points), tuple(chosen), block, rate, line_max, hammer.contact, noise,
                         expected, tuple(random), tuple(notes))


def _moving_points(modes: Modes, places: MeasuringPoints) -> list[str | int]:
    """Return the points that some mode moves: those of a base that is fixed to the ground show nothing to a test."""
    size = np.abs(modes.shape).max(axis=1)
    moving = {str(dof.point) for dof, largest in zip(modes.dofs, size, strict=True) if largest > MIN_MOTION_RATIO * size.max()}
    return [name for name in places.places if str(name) in moving]


def _part_of_progress(name: str, index: int, tests: int, progress: Progress) -> Callable[[int, int], None]:
    """Return the progress of one virtual test as that of all of them."""
    return lambda finished, total: progress(name, index * total + finished, tests * total)


def _modes(machine: Machine, places: MeasuringPoints, pose: Pose | None, highest: float | None) -> tuple[Modes, list[str]]:
    """Return the modes of the plan at all points, and the assumptions."""
    all_modes = true_modes(machine, places, PLANNED_DAMPING_RATIO, pose=pose)
    elastic = np.sort(all_modes.frequency[all_modes.frequency > 0])
    frequency_max = (float(elastic[:DEFAULT_PLANNED_MODES][-1]) if elastic.size else np.inf) if highest is None else \
        positive("highest", highest)
    kept = np.flatnonzero((all_modes.frequency > 0) & (all_modes.frequency <= frequency_max))
    if kept.size == 0:
        raise ToolpointError(f"highest: {frequency_max:g} Hz; no mode of the machine lies below it; its first is at "
                             f"{all_modes.frequency.min():.4g} Hz")
    rigid_count = int((all_modes.frequency <= 0).sum())
    left_out = [f"planned for the lowest {kept.size} of {elastic.size} modes, to {frequency_max:.4g} Hz; `highest` takes others"
                ] if highest is None and kept.size < elastic.size else []
    notes = [*left_out,
             f"every mode is given a damping ratio of {100 * PLANNED_DAMPING_RATIO:g} %: it is what a test measures, and no "
             f"model knows",
             "the machine file is believed: a mode that it does not have is planned for by no point; look at the whole machine",
             "expected errors are those of noise and processing alone; a sensor's mass, play and friction come on top",
             "a point that cannot be reached moves to the nearest place that can: note where it was"]
    if rigid_count:
        notes.append(f"{rigid_count} rigid modes (0 Hz) are left out")
    return all_modes.selected(kept.tolist()), notes


def _choose_struck_dofs(modes: Modes, dofs: Sequence[Dof], max_count: int) -> list[Dof]:
    for number in range(1, max_count + 1):
        chosen = choose_struck(modes, dofs, number)
        if visibility(modes, chosen).min() > 2 * MIN_VISIBILITY:
            return chosen
    return chosen


def _block_length(modes: Modes) -> float:
    """Return the length (s) in which the slowest ring-down ends, and that separates the lines of the narrowest mode."""
    decay = modes.damping_ratio * 2 * np.pi * modes.frequency
    width = 2 * modes.damping_ratio * modes.frequency
    return float(_round_up(max(np.log(1 / RING_DOWN_FRACTION) / decay.min(), HALF_POWER_LINES / width.min())))


def _round_up(value: float) -> float:
    """Return the next of `ROUND_STEPS` times a power of ten."""
    scale = 10.0 ** np.floor(np.log10(value))
    return float(next(step for step in ROUND_STEPS if step * scale >= value * (1 - 1e-9)) * scale)


def _doubts(modes: Modes, points: Sequence[str | int], struck: Sequence[Dof], expected: VirtualOutcome) -> list[Doubt]:
    lines = [Doubt(f"mode {i + 1} at {modes.frequency[i]:.4g} Hz",
                   f"is moved by only {100 * share:.0f} % of its largest motion",
                   "strike another point too", figure=float(share))
             for i, share in enumerate(visibility(modes, struck)) if share < MIN_VISIBILITY]
    likeness = largest_likeness(modes, points)
    if likeness > 0.5:
        lines.append(Doubt("shapes", f"two modes look alike at these points (MAC {likeness:.2f})",
                           "more points would part them",
                           figure=float(likeness)))
    lost_modes = [f"{modes.frequency[i]:.4g}" for i in range(modes.count) if expected.mac[i] <= 0.9]
    if lost_modes:
        lines.append(Doubt("virtual test", f"it does not find the modes at {', '.join(lost_modes)} Hz",
                           "take more points, more "
                           "blows, or another point to strike"))
    return lines
