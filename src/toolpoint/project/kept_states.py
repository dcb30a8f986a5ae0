"""Kept states of a project: limits, modes and springs of its last runs, dated and named by their content."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import toolpoint
from toolpoint import io
from toolpoint._check import FileDoubt, ToolpointError
from toolpoint._notebook import NotebookText
from toolpoint.project.engine.content import text_digest
from toolpoint.project.engine.drafts import write_whole
from toolpoint.project.engine.record import RecordStore, StepRecord
from toolpoint.project.engine.step import ProjectStep
from toolpoint.project.steps.plain_files import plain, read_json

STATES_PLACE = ".toolpoint/states"
MAX_KEPT_STATES = 40  # of a project; the oldest are removed
SHOWN_KEY_DIGITS = 8  # of a state's name: enough to tell forty apart
_GOAL_NUMBERS = ("cut", "speed_rpm", "depth_m", "pose", "limit_m", "interval_m", "depth_max_m", "stable_probability",
                 "chatter_frequency_hz")


@dataclass(frozen=True)
class KeptState(NotebookText):
    """Answers of a project at one time.

    key : digest of what the answers rest on; date : when the last of its steps began, ISO; data : goals (limit, interval),
    modes of the tests, springs of the machine (value, standard deviation), the files and options that they rest on, SI.

    >>> KeptState("0f3a5b7c", "2026-05-04T10:30:00", {"goals": {"rough": {"limit_m": 3e-3}}}).table()
    '2026-05-04 10:30:00 (0f3a5b7c): rough 3 mm'
    """

    key: str
    date: str
    data: Mapping[str, Any]

    def table(self) -> str:
        """Return date, key and the limits in a line."""
        limits = [f"{name} {limit_words(goal)}" for name, goal in self.data.get("goals", {}).items()]
        return f"{self.date.replace('T', ' ')} ({self.key}): {', '.join(limits) or 'no limits'}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"key": self.key, "date": self.date, **self.data}


def limit_words(goal: Mapping[str, Any]) -> str:
    """Return the limit of a goal in mm; where none was found, the depth up to which it was looked for."""
    limit, searched = goal.get("limit_m"), goal.get("depth_max_m")
    return f"{1e3 * limit:.3g} mm" if limit is not None else f"above {1e3 * searched:.3g} mm" if searched else "none"


def read_states(folder: Path) -> tuple[KeptState, ...]:
    """Return the kept states of a project's folder, the oldest first; a damaged file is left out."""
    states = []
    for path in _state_files(folder):
        try:
            data = dict(read_json(path))
            states.append(KeptState(str(data.pop("key")), str(data.pop("date")), data))
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return tuple(states)


def find_state(states: Sequence[KeptState], text: str) -> KeptState:
    """Return the last state whose date or key begins with a text; raises ToolpointError where none does."""
    written = text.strip().replace(" ", "T")
    match = next((state for state in reversed(states) if written and (state.date.startswith(written) or
                                                                      state.key.startswith(written))), None)
    if match is None:
        listed = "\n".join(f"  {state.table()}" for state in states) or "  none: a run of the whole project keeps one"
        raise ToolpointError(f"state {text!r}: must be the beginning of a date or of a key of those that are kept:\n{listed}")
    return match


def keep_state(folder: Path, steps: Sequence[ProjectStep], goals: Mapping[str, Mapping[str, Any]]) -> KeptState | None:
    """Keep the answers of a project's last run; return what was kept, None where nothing differs from the last kept state.

    folder, steps : of the project; goals : numbers of every goal that has an answer.
    """
    store = RecordStore(folder / ".toolpoint/steps")
    records = [record for step in steps if (record := store.read(step.name)) is not None]
    key = text_digest(json.dumps(sorted((record.step, record.parts.key) for record in records)))[:SHOWN_KEY_DIGITS]
    states = read_states(folder)
    if not records or (states and states[-1].key == key):
        return None
    state = KeptState(key, max(record.started for record in records), plain(_content(folder, steps, records, goals=goals)))
    place = folder / STATES_PLACE
    write_whole(place / f"{state.date.replace(':', '-')}_{key}.json", json.dumps(state.to_dict(), indent=1) + "\n")
    drop_oldest_states(folder)
    return state


def drop_oldest_states(folder: Path) -> None:
    """Remove all but the last `MAX_KEPT_STATES` states of a project's folder."""
    for path in _state_files(folder)[:-MAX_KEPT_STATES]:
        path.unlink(missing_ok=True)


def _state_files(folder: Path) -> list[Path]:
    """Return the files of kept states, the oldest first, by the dates in their names; of one second by the files' times."""
    return sorted((folder / STATES_PLACE).glob("*.json"),
                  key=lambda path: (path.name.partition("_")[0], path.stat().st_mtime_ns, path.name))


def _content(folder: Path, steps: Sequence[ProjectStep], records: Sequence[StepRecord], *,
             goals: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the numbers of a state and what they rest on."""
    sources = {place: digest for record in records for place, digest in record.parts.inputs.items()
               if not place.startswith("results/")}
    return {"goals": {name: {key: goal.get(key) for key in _GOAL_NUMBERS} for name, goal in goals.items()},
            "modes": _modes(folder, steps), "springs": _springs(folder, steps), "sources": sources,
            "options": {record.step: record.parts.options for record in records},
            "step_versions": {record.step: record.parts.version for record in records}, "version": toolpoint.__version__}


def _modes(folder: Path, steps: Sequence[ProjectStep]) -> dict[str, Any]:
    """Return frequency (Hz) and damping ratio of the modes of every test."""
    modes = {}
    for step in steps:
        place = next((folder / path for path in step.output_paths if path.endswith("modes.json")), None)
        if place is not None and place.is_file():
            data = read_json(place)
            modes[step.name.partition("/")[2]] = {key: data[key] for key in ("frequency_hz", "damping_ratio")}
    return modes


def _springs(folder: Path, steps: Sequence[ProjectStep]) -> dict[str, Any]:
    """Return value and standard deviation (None where the file states none) of every spring, by its path; SI."""
    from toolpoint.studies.machines.tool_yielding import spring_paths

    place = next((folder / str(step.inputs["machine"]) for step in steps if step.name == "machine"), None)
    if place is None or not place.is_file():
        return {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FileDoubt)  # they stand in the records of the steps
            machine = io.read_machine(place)
    except ToolpointError:  # a faulty one, of which its step has spoken
        return {}
    identified = machine.description.identified
    deviations = {} if identified is None else dict(zip(identified.parameters, np.sqrt(np.diag(identified.matrix)),
                                                        strict=True))
    return {path: {"value": machine.value(path), "deviation": deviations.get(path)} for path in spring_paths(machine)}
