"""Decision about a step: whether it runs, and why, in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from toolpoint.project.engine.content import ContentCache
from toolpoint.project.engine.record import DONE, FAILED, IN_MOTION, KeyParts, StepRecord
from toolpoint.project.engine.step import ProjectStep, result_path

RUN, SKIP, KEEP, STOP, REPEAT = "run", "fresh", "kept", "stopped", "failed"


@dataclass(frozen=True)
class Decision:
    """Whether a step runs, and why.

    action : ``run``, ``fresh`` (nothing to do), ``kept`` (changed by hand), ``stopped`` (what it rests on failed), ``failed``
    (as before); reason : in words; by_hand : files of its results that somebody changed.
    """

    step: str
    action: str
    reason: str
    by_hand: tuple[str, ...] = ()


def decide(step: ProjectStep, parts: KeyParts, record: StepRecord | None, *, cache: ContentCache, overwrite: bool = False
           ) -> Decision:
    """Return what is to be done about a step whose inputs are all there."""
    by_hand = () if overwrite else find_hand_changes(step, record, cache)
    reasons = _reasons(step, parts, record, cache)
    if by_hand:
        also = f"; not computed again although {', '.join(reasons)}" if reasons else ""
        return Decision(step.name, KEEP, f"changed by hand, kept: {', '.join(by_hand)}{also}", by_hand)
    if reasons:
        return Decision(step.name, RUN, "; ".join(reasons))
    if record is not None and record.status == FAILED:
        return Decision(step.name, REPEAT, f"failed before, and nothing that it rests on has changed: {record.words}")
    return Decision(step.name, SKIP, "nothing that it rests on has changed")


def find_hand_changes(step: ProjectStep, record: StepRecord | None, cache: ContentCache) -> tuple[str, ...]:
    """Return the files of a step's results that are not as the step left them."""
    places = {file: result_path(step.name, file) for file in step.outputs} if record is None else {
        file: result_path(step.name, file) for file in {**record.outputs, **dict.fromkeys(step.outputs, "")}}
    changed = []
    for file, place in places.items():
        digest = cache.digest(place)
        written = () if record is None else (record.outputs.get(file), record.earlier.get(file))
        if digest and digest not in written:
            changed.append(place)
    return tuple(changed)


def _reasons(step: ProjectStep, parts: KeyParts, record: StepRecord | None, cache: ContentCache) -> list[str]:
    """Return in words why a step must run, nothing where it need not."""
    if record is None:
        return ["it was never run"]
    if record.status == IN_MOTION:
        return ["its last run was cut off"]
    reasons = _changes(parts, record.parts)
    if record.status == DONE:
        reasons += [f"its result {file} is not there" for file in record.outputs
                    if not cache.digest(result_path(step.name, file))]
    return reasons


def _changes(parts: KeyParts, earlier: KeyParts) -> list[str]:
    """Return what differs between two keys, in words."""
    reasons = []
    if parts.version != earlier.version:
        reasons.append(f"its computation has changed (version {earlier.version} -> {parts.version})")
    for path in dict.fromkeys([*parts.inputs, *earlier.inputs]):
        if path not in earlier.inputs:
            reasons.append(f"{path} is a new input")
        elif path not in parts.inputs:
            reasons.append(f"{path} is no longer an input")
        elif parts.inputs[path] != earlier.inputs[path]:
            reasons.append(f"{path} has changed")
    reasons += _option_changes(parts.options, earlier.options)
    if parts.inherited != earlier.inherited:
        reasons.append("the doubts of what it rests on have changed")
    return reasons


def _option_changes(options: Mapping[str, Any], earlier: Mapping[str, Any], place: str = "option") -> list[str]:
    """Return the options that differ, by name with their old and new value."""
    lines = []
    for name in dict.fromkeys([*options, *earlier]):
        new, old = options.get(name), earlier.get(name)
        if isinstance(new, Mapping) and isinstance(old, Mapping):
            lines += _option_changes(new, old, f"{place} {name}")
        elif new != old or (name in options) != (name in earlier):
            lines.append(f"{place} {name}: {_short(old)} -> {_short(new)}")
    return lines


def _short(value: Any) -> str:
    text = "none" if value is None else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
