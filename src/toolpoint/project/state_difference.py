"""Difference of two kept states of a project: limits, modes and springs side by side, and what was changed between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95, with_uncertainty
from toolpoint.project.kept_states import KeptState, limit_words
from toolpoint.studies.text_table import text_table

MAX_LISTED_CHANGES = 12  # files and options that differ
EQUAL_NUMBERS = 1e-9  # relative difference below which two numbers are the same
MAX_PAIRED_DIFFERENCE = 0.1  # relative difference of the frequencies of two modes that are one
# Options of a step that say again what a goal, a test or a program says.
_REPEATED_NAMES = ("name", "cut_name", "has_poses", "struck_pose", "whole_band")
_ANSWER_KEYS = ("limit_m", "interval_m", "depth_max_m", "stable_probability", "chatter_frequency_hz")


@dataclass(frozen=True)
class StateDifference(NotebookText):
    """Two kept states of a project, and how the newer differs.

    >>> may, june = (KeptState(key, date, {"goals": {"rough": {"limit_m": depth, "interval_m": [0.9 * depth, 1.1 * depth]}}})
    ...              for key, date, depth in (("a", "2026-05-04", 3e-3), ("b", "2026-06-01", 2e-3)))
    >>> StateDifference(may, june).limit_rows
    (('rough', '3 mm', '2.7 .. 3.3', '2 mm', '1.8 .. 2.2', '-33.3 %', 'intervals are apart'),)
    """

    older: KeptState
    newer: KeptState

    @property
    def limit_rows(self) -> tuple[tuple[str, ...], ...]:
        """Rows of the goals: name, limit and interval (mm) of both, change, verdict."""
        first, second = self.older.data.get("goals", {}), self.newer.data.get("goals", {})
        return tuple(_limit_row(name, first.get(name), second.get(name)) for name in dict.fromkeys([*first, *second]))

    @property
    def mode_rows(self) -> tuple[tuple[str, ...], ...]:
        """Rows of the modes that differ, paired by the nearest frequency: test, Hz of both, change, damping (%) of both."""
        first, second = self.older.data.get("modes", {}), self.newer.data.get("modes", {})
        rows = (row for name in dict.fromkeys([*first, *second])
                for row in _mode_rows(name, first.get(name), second.get(name)))
        return tuple(row for row in rows if row[1] != row[2] or row[4] != row[5])

    @property
    def spring_rows(self) -> tuple[tuple[str, ...], ...]:
        """Rows of the springs that differ: path, value of both with its 95 % interval, change, verdict."""
        first, second = self.older.data.get("springs", {}), self.newer.data.get("springs", {})
        rows = (_spring_row(path, first.get(path), second.get(path)) for path in dict.fromkeys([*first, *second]))
        return tuple(row for row in rows if row is not None)

    @property
    def changed_inputs(self) -> tuple[str, ...]:
        """Files and numbers of project.yaml that differ, in words."""
        first, second = self.older.data.get("sources", {}), self.newer.data.get("sources", {})
        files = [f"{place}: " + ("new" if place not in first else "gone" if place not in second else "another content")
                 for place in dict.fromkeys([*first, *second]) if first.get(place) != second.get(place)]
        options = [_project_numbers(state.data.get("options", {})) for state in (self.older, self.newer)]
        numbers = [f"{name}: {options[0].get(name, 'not used')} -> {options[1].get(name, 'not used')}"
                   for name in dict.fromkeys([*options[0], *options[1]]) if options[0].get(name) != options[1].get(name)]
        return tuple(dict.fromkeys([*files, *numbers]))

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the difference: shared intervals, pairing of modes, other questions, another program."""
        doubts = [Doubt("intervals of the two states", "what did not change between them (records, coefficients, draws) is in "
                        "both", "intervals that overlap do not show that nothing changed: see what was changed")]
        if self.mode_rows:
            doubts.append(Doubt("modes of the two states", "are paired by the nearest frequency, not by their shape",
                                "pair them by shape with toolpoint compare and the saved modes of both tests"))
        versions = [state.data.get("version") for state in (self.older, self.newer)]
        if versions[0] != versions[1]:
            doubts.append(Doubt("programs", f"toolpoint {versions[0]} computed the older state, {versions[1]} the newer",
                                "a change of the program can be the difference"))
        if changed_steps := self._recomputed_steps:
            doubts.append(Doubt(f"steps {', '.join(changed_steps)}", "are computed in another way in the newer state",
                                "this change of the program can be the difference"))
        first, second = self.older.data.get("goals", {}), self.newer.data.get("goals", {})
        doubts += [Doubt(f"goal {name}", "asks another cut, speed, depth or pose in the two states",
                         "its limits are answers to two questions") for name in first if name in second
                   and any(first[name].get(key) != second[name].get(key) for key in first[name] if key not in _ANSWER_KEYS)]
        return tuple(doubts)

    @property
    def _recomputed_steps(self) -> list[str]:
        """Steps of both states whose computation has another version in the newer one."""
        first, second = (state.data.get("step_versions", {}) for state in (self.older, self.newer))
        return [step for step in first if step in second and first[step] != second[step]]

    @property
    def summary(self) -> str:
        """The difference in a sentence."""
        words = [f"limit of {row[0]} from {row[1]} to {row[3]} ({row[6]})" for row in self.limit_rows]
        count = len(self.changed_inputs)
        changes = f"{count} file{'s' * (count != 1)} or number{'s' * (count != 1)} changed" if count else "nothing was changed"
        older, newer = (state.date.replace("T", " ") for state in (self.older, self.newer))
        return f"From {older} to {newer}: {'; '.join([*words, changes])}."

    def table(self) -> str:
        """Return the difference as text."""
        return "\n".join([*mark_notes(self.doubts), self.evidence()])

    def evidence(self) -> str:
        """Return the difference as text without its doubts."""
        parts = [self.summary]
        for title, header, rows in self.tables():
            if rows:
                parts.append(text_table(title, header, rows))
        listed = self.changed_inputs[:MAX_LISTED_CHANGES]
        hidden = len(self.changed_inputs) - len(listed)
        return "\n".join([*parts, "What was changed (numbers in SI)", *(f"  {line}" for line in listed or ("nothing",)),
                          *([f"  and {hidden} more"] if hidden else [])])

    def tables(self) -> tuple[tuple[str, tuple[str, ...], tuple[tuple[str, ...], ...]], ...]:
        """Return title, header and rows of limits, modes and springs."""
        limits = ("goal", "older", "its interval mm", "newer", "its interval mm", "change", "verdict")
        modes = ("test", "older Hz", "newer Hz", "change", "older damping %", "newer damping %")
        return (("Limits of the goals", limits, self.limit_rows), ("Modes that differ", modes, self.mode_rows),
                ("Springs that differ", ("spring", "older", "newer", "change", "verdict"), self.spring_rows))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: both states, what was changed, and the rows in words."""
        return {"older": self.older.to_dict(), "newer": self.newer.to_dict(), "summary": self.summary,
                "changed_inputs": list(self.changed_inputs), "doubts": list(map(str, self.doubts)),
                "tables": [{"title": title, "header": list(header), "rows": [list(row) for row in rows]}
                           for title, header, rows in self.tables()]}


def _limit_row(name: str, first: Mapping[str, Any] | None, second: Mapping[str, Any] | None) -> tuple[str, ...]:
    """Return the row of a goal, of which one state may have no answer."""
    words = [("no answer", "") if goal is None else (limit_words(goal), _interval_words(goal)) for goal in (first, second)]
    limits = [None if goal is None else goal.get("limit_m") for goal in (first, second)]
    intervals = [_ends(goal) if goal is not None and goal.get("interval_m") else None for goal in (first, second)]
    return (name, *words[0], *words[1], _change(*limits), verdict_of(limits, intervals))


def _interval_words(goal: Mapping[str, Any]) -> str:
    if not goal.get("interval_m"):
        return ""
    lower, upper = goal["interval_m"]
    above = f"above {1e3 * goal['depth_max_m']:.3g}" if goal.get("depth_max_m") else "no end"
    return above if lower is None else " .. ".join(above if end is None else f"{1e3 * end:.3g}" for end in (lower, upper))


def _ends(goal: Mapping[str, Any]) -> tuple[float, float]:
    """Return the ends of an interval; an end beyond the searched depths is infinite."""
    lower, upper = (float("inf") if end is None else float(end) for end in goal["interval_m"])
    return lower, upper


def verdict_of(values: list[float | None], intervals: list[tuple[float, float] | None]) -> str:
    """Return whether two numbers differ by more than their 95 % intervals say."""
    value, other = values
    if value is not None and other is not None and _is_equal(value, other):
        return "the same"
    first, second = intervals
    if first is None or second is None:
        return "no interval"
    return "intervals are apart" if first[0] > second[1] or second[0] > first[1] else "intervals overlap"


def _is_equal(first: float, second: float) -> bool:
    return abs(first - second) <= EQUAL_NUMBERS * max(abs(first), abs(second))


def _change(first: float | None, second: float | None) -> str:
    if first is None or second is None or first == 0:
        return ""
    return "0 %" if _is_equal(first, second) else f"{100 * (second / first - 1):+.3g} %"


def _mode_rows(name: str, first: Mapping[str, Any] | None, second: Mapping[str, Any] | None) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a test's modes: each of the older state with the nearest of the newer, then those that are left."""
    older, newer = (list(zip(modes["frequency_hz"], modes["damping_ratio"], strict=True)) if modes else []
                    for modes in (first, second))
    for frequency, damping in older:
        partner = min(newer, key=lambda mode: abs(mode[0] - frequency), default=None)
        if partner is None or abs(partner[0] - frequency) > MAX_PAIRED_DIFFERENCE * frequency:
            yield (name, f"{frequency:.5g}", "", "", f"{100 * damping:.3g}", "")
            continue
        newer.remove(partner)
        yield (name, f"{frequency:.5g}", f"{partner[0]:.5g}", _change(frequency, partner[0]), f"{100 * damping:.3g}",
               f"{100 * partner[1]:.3g}")
    for frequency, damping in newer:
        yield (name, "", f"{frequency:.5g}", "", "", f"{100 * damping:.3g}")


def _spring_row(path: str, first: Mapping[str, Any] | None, second: Mapping[str, Any] | None) -> tuple[str, ...] | None:
    """Return the row of a spring, None where it is the same in both."""
    values = [None if spring is None else float(spring["value"]) for spring in (first, second)]
    intervals = [_spring_interval(spring) for spring in (first, second)]
    verdict = verdict_of(values, intervals)
    if verdict == "the same":
        return None
    unit = "N m/rad" if path.rsplit(".", 1)[-1].startswith("r") else "N/m"
    texts = ["" if value is None else with_uncertainty(value, None if ends is None else (ends[1] - ends[0]) / 2, unit)
             for value, ends in zip(values, intervals, strict=True)]
    if None in values:
        verdict = "only in the newer" if values[0] is None else "only in the older"
    return (path, *texts, _change(*values), verdict)


def _spring_interval(spring: Mapping[str, Any] | None) -> tuple[float, float] | None:
    if spring is None or spring.get("deviation") is None:
        return None
    half_width = NORMAL_QUANTILE_95 * float(spring["deviation"])
    return spring["value"] - half_width, spring["value"] + half_width


def _project_numbers(options: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return the numbers and texts of the options of all steps by their place in project.yaml, each place once.

    Several steps take one coefficient. A step whose results were changed by hand keeps its own: both values are given then.
    """
    values: dict[str, list[str]] = {}
    for step, settings in options.items():
        for path, value in _leaves(settings):
            if path[-1] in _REPEATED_NAMES or path[0] in _REPEATED_NAMES:
                continue
            listed = values.setdefault(".".join(_project_place(step, path, settings)), [])
            listed += [value] if value not in listed else []
    return {place: " and ".join(listed) for place, listed in values.items()}


def _project_place(step: str, path: tuple[str, ...], settings: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the place in project.yaml of an option of a step; the step and the option where it comes from no single place."""
    kind, _, name = step.partition("/")
    head, *tail = path[1:] if path[0] == "settings" else path
    if head == "cut" and tail:
        cut_name = settings.get("settings", settings).get("cut_name")
        return ("cuts", str(cut_name), *_cut_keys(tail))
    if head == "cuts" and tail:
        return ("cuts", tail[0], *_cut_keys(tail[1:]))
    if kind == "tip" and head == "values":
        return ("cuts", name, *tail)
    if head in ("goals", "changes", "coupling", "draws", "seed"):
        return (head, *tail)
    if head == "goal":
        return ("goals", name, *tail)
    section = {"responses": "tests", "modes": "tests", "program": "programs", "contour": "contours"}.get(kind)
    return (step, head, *tail) if section is None else (section, name, head, *tail)


def _cut_keys(path: Sequence[str]) -> tuple[str, ...]:
    """Return the keys of a number of a cut as project.yaml has them."""
    return tuple("coefficient_deviation" if key == "deviation" else key for key in path if key != "values")


def _leaves(data: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the numbers and texts of nested data, with their paths."""
    if isinstance(data, Mapping):
        for key, value in data.items():
            yield from _leaves(value, (*path, str(key)))
        return
    yield path, "none" if data is None else f"{data:.9g}" if isinstance(data, float) else str(data)
