"""Results of a project: an answer to each goal, the steps with their doubts, what to do next; one JSON of it all."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.project.engine.decision import KEEP, STOP
from toolpoint.project.engine.record import TracedDoubt
from toolpoint.project.engine.run import RunResult, StepEvent
from toolpoint.project.engine.step import ProjectStep, result_path
from toolpoint.project.steps.plain_files import plain, read_json

if TYPE_CHECKING:
    from toolpoint.project.state_difference import StateDifference

CERTAIN_PROBABILITY, UNLIKELY_PROBABILITY = 0.95, 0.05  # of a stable cut, from which it is called stable, or not
METHODS = (
    "Responses were estimated from the hits that passed the judgement (H1), modes identified with their covariance, joints and "
    "their machine fitted to poles and shapes at once, and limits of stability computed as the first loss of stability "
    "(Floquet multipliers, counted by the phase of a determinant). Intervals are quantiles of {draws} draws of the identified "
    "numbers and of the cutting coefficients, weighed by the cuts that were tried; other draws, as many, move either end by "
    "some {scatter:.0f} % of the half width (`draws` of the project file). toolpoint {version}.")
ASSUMPTIONS = (
    "Coefficients K_t and K_n are lognormal and independent of each other; those of two cuts are independent.",
    "The numbers of the machine are normal with the covariance of its identification; uncertain masses and coordinates are in "
    "it where the component file states them.",
    "Tool wear, run-out beyond what is described, warm-up, and a workpiece that yields are in no interval.",
    "A cut above the first loss of stability counts as chatter, also where an island of stability lies there.")


@dataclass(frozen=True)
class ProjectResults(NotebookText):
    """Results of a project as its JSON holds them.

    data : plain data, SI: answers, goals, programs, contours, changes, next, steps, doubts, missing, assumptions, methods;
    difference : of two kept states, where it was asked for.

    >>> ProjectResults({"goals": {"rough": {"limit_m": 3e-3}}}).goal("rough")["limit_m"]
    0.003
    """

    data: Mapping[str, Any]
    difference: StateDifference | None = None

    @property
    def answers(self) -> tuple[str, ...]:
        """The answer to each goal in a sentence."""
        return tuple(self.data["answers"])

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """All doubts of the steps, each named with the step where it can be mended."""
        traced = [TracedDoubt.of(entry) for entry in self.data["doubts"]]
        # What several steps doubt alike is said once, for the first of them.
        first = {str(entry.doubt): entry for entry in reversed(traced)}
        doubts = (entry.doubt.within(entry.step) for entry in traced if first[str(entry.doubt)] is entry)
        return (*doubts, *(() if self.difference is None else self.difference.doubts))

    @property
    def next_steps(self) -> tuple[str, ...]:
        """Next things to do, in words."""
        return tuple(self.data["next_steps"])

    def beside(self, difference: StateDifference) -> ProjectResults:
        """Return the results with the difference of two kept states beside them."""
        return ProjectResults({**self.data, "difference": difference.to_dict()}, difference)

    def goal(self, name: str) -> Mapping[str, Any]:
        """Return the numbers of a goal, SI."""
        return self.data["goals"][name]

    def table(self) -> str:
        """Return answers, doubts, steps and what comes next as text."""
        steps = [f"  {entry['step']:24s} {entry['state']:8s} {entry['words']}" for entry in self.data["steps"]]
        rows = [*self.answers, *mark_notes(self.doubts), "Steps", *steps]
        changes = [f"  {change['words']}" for change in self.data["changes"][:3]]
        changes += [f"  for {name}: {line}" for name, data in self.data["contours"].items() for line in contour_lines(data)]
        rows += ["What to change", *changes] if changes else []
        rows += [self.difference.evidence()] if self.difference is not None else []
        return "\n".join([*rows, *(["Next", *(f"  {line}" for line in self.next_steps)] if self.next_steps else [])])

    def to_dict(self) -> dict[str, Any]:
        """Return the plain data."""
        return dict(self.data)

    def __repr__(self) -> str:
        return f"ProjectResults({self.data['project']!r}, {len(self.answers)} answers, {len(self.data['doubts'])} doubts)"


def contour_lines(data: Mapping[str, Any]) -> list[str]:
    """Return cause and remedies of a missed circle (contour.json), a sentence each; none where it is met."""
    # Results that an older version wrote hold neither.
    return [line for line in (data.get("cause", ""), *(remedy["words"] for remedy in data.get("remedies", ()))) if line]


def end_scatter(draws: int) -> float:
    """Return the standard deviation of either end of a 95 % interval from so many draws, over its half width.

    Of a normal quantity, by the density at its quantile: the root of p (1 - p)/n over the density, with p = 0.025.
    """
    normal, tail = NormalDist(), 0.025
    end = normal.inv_cdf(1 - tail)
    return math.sqrt(tail * (1 - tail) / draws) / normal.pdf(end) / end


def gather_results(name: str, root: Path, steps: Sequence[ProjectStep], *, run: RunResult, absent_parts: Sequence[str],
                   version: str
                   ) -> ProjectResults:
    """Return the results of a run; the same results on the disk give the same data."""
    files = {step.name: _json_of(step, root, run.of(step.name)) for step in steps}
    goals = {key.partition("/")[2]: data for key, data in files.items() if key.startswith("limits/") and data}
    contours = {key.partition("/")[2]: data for key, data in files.items() if key.startswith("contour/") and data}
    programs = {key.partition("/")[2]: data for key, data in files.items() if key.startswith("program/") and data}
    answers = [_answer(step, run.of(step.name), files[step.name], run.doubts.get(step.name, ())) for step in steps
               if step.name.startswith(("limits/", "program/", "contour/")) and run.of(step.name) is not None]
    changes = (files.get("changes") or {}).get("changes", [])
    doubts = list(dict.fromkeys(entry for event in run.events for entry in run.doubts[event.decision.step]))
    draws = next((data["draws"] for data in [*goals.values(), *programs.values()]), 0)
    data = {"project": name, "answers": answers, "goals": goals, "programs": programs, "contours": contours, "changes": changes,
            "next": files.get("next") or {},
            "next_steps": _next_steps(run, goals, programs, contours=contours, files=files, absent_parts=absent_parts),
            "steps": [_step_entry(step, event, run) for step in steps if (event := run.of(step.name)) is not None],
            "doubts": [entry.to_dict() for entry in doubts], "missing": list(absent_parts), "assumptions": list(ASSUMPTIONS),
            "methods": METHODS.format(draws=draws, scatter=100 * end_scatter(max(draws, 1)), version=version)}
    return ProjectResults(plain(data))


def _json_of(step: ProjectStep, root: Path, event: StepEvent | None) -> Any:
    """Return the plain data of a step, None where it failed or was stopped."""
    if event is None or event.failed or event.decision.action == STOP:
        return None
    place = next((root / path for path in step.output_paths if path.endswith(".json")), None)
    return read_json(place) if place is not None and place.is_file() else None


def _answer(step: ProjectStep, event: StepEvent | None, data: Any, doubts: Sequence[TracedDoubt]) -> str:
    """Return the answer to a goal in a sentence: whether it is met, how sure, and how many doubts it rests on."""
    name = step.name.partition("/")[2]
    if event is None or data is None:
        return f"{name}: no answer, because {event.words or event.decision.reason if event else 'its step was not run'}."
    count = len({str(entry.doubt) for entry in doubts})
    doubt_words = f" It rests on {count} doubt{'s' if count > 1 else ''}." if count else ""
    if "stable_probability" not in data:
        return f"{name}: {'met' if data['met'] else 'not met'}; {event.words}.{doubt_words}"
    chance = data["stable_probability"]
    if data.get("grave") or chance is None:
        return f"{name}: {'no' if data.get('grave') else 'not known'}; {event.words}.{doubt_words}"
    verdict = "yes" if chance >= CERTAIN_PROBABILITY else "no" if chance <= UNLIKELY_PROBABILITY else "not certain"
    return f"{name}: {verdict}; {event.words}.{doubt_words}"


def _next_steps(run: RunResult, goals: Mapping[str, Any], programs: Mapping[str, Any], *, contours: Mapping[str, Any],
                files: Mapping[str, Any], absent_parts: Sequence[str]) -> list[str]:
    """Return what to do next: mend what failed, mend the gravest doubts, measure, try a cut, add a part."""
    lines = [f"mend {event.decision.step}: {event.words or event.decision.reason}" for event in run.failed]
    remedies = [f"{entry.step}: {entry.doubt.remedy}" for event in run.events for entry in run.doubts[event.decision.step]
                if entry.doubt.grave and entry.doubt.remedy]
    lines += dict.fromkeys(remedies)
    lines += _measuring_step(files.get("next") or {})
    undecided = {name: goal for name, goal in goals.items()
                 if UNLIKELY_PROBABILITY < goal["stable_probability"] < CERTAIN_PROBABILITY}
    for name, goal in goals.items():
        better_speed = goal["better_speed"]
        if goal["stable_probability"] < CERTAIN_PROBABILITY and better_speed is not None:
            lines.append(f"for {name} take {better_speed['speed_rpm']:.0f} rev/min: "
                         f"{1e3 * better_speed['certain_depth_m']:.2g} mm is "
                         "stable there, and 2 % beside it, with 95 %")
    lines += [line for name, data in programs.items() if (line := _program_step(name, data))]
    lines += [f"for {name} change the {remedy['kind']} as said: {1e6 * remedy['deviation_m']:.3g} µm is within the goal"
              for name, data in contours.items() for remedy in data.get("remedies", ())[:1] if remedy["met"]]
    for name, goal in undecided.items():
        cut = goal["next_cut"]
        lines.append(f"for {name} try a cut of {1e3 * cut['depth_m']:.2g} mm at {cut['speed_rpm']:.5g} rev/min and report it "
                     f"(toolpoint tried): the interval would be {100 * cut['interval_over_today']:.0f} % of today's, in the "
                     "mean")
    return [*lines, *absent_parts]


def _measuring_step(following: Mapping[str, Any]) -> list[str]:
    """Return the line on the next test: the best one, or that none narrows the answer."""
    from toolpoint.studies.machines.next_test import FLAT_WORDS, narrows  # a run alone loads machines

    candidates = following.get("candidates")
    if not candidates:
        return []
    if narrows(following["today"], candidates[0]["after"]):
        return [f"measure {candidates[0]['test']}: it narrows the compliance of the tool most"]
    return [FLAT_WORDS.format(answer="compliance of the tool", today=100 * following["today"])]


def _program_step(name: str, data: Mapping[str, Any]) -> str:
    """Return what to do about a program that is not certain: the command that writes it with the advised S and F."""
    chance, chance_after = data["stable_probability"], data["stable_probability_advised"]
    if chance is None or chance >= CERTAIN_PROBABILITY or chance_after is None or chance_after <= chance:
        return ""
    speeds = ", ".join(f"S {tool['advised_rpm']:.0f}" for tool in data["advice"]
                       if tool["advised_rpm"] != tool["programmed_rpm"])
    return (f"for the program {name} take {speeds}: every block is stable there with {100 * chance_after:.0f} % "
            f"(today {100 * chance:.0f} %); its command with --write NEW writes them")


def _step_entry(step: ProjectStep, event: StepEvent, run: RunResult) -> dict[str, Any]:
    """Return a step with its state, words, files, and the doubts that arose in it."""
    state = ("failed" if event.failed else "stopped" if event.decision.action == STOP
             else "by hand" if event.decision.action == KEEP else "done")
    words = event.words or event.decision.reason
    arisen = [str(entry.doubt) for entry in run.doubts[step.name] if entry.step == step.name]
    return {"step": step.name, "does": step.words, "state": state, "words": words,
            "files": [result_path(step.name, file) for file in step.outputs] if state in ("done", "by hand") else [],
            "doubts": arisen, "command": step.command}
