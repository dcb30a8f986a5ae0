"""Step of comparison: later tests of a machine beside its first one, whether it has changed, and which part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from toolpoint import io, studies
from toolpoint._doubt import Doubt
from toolpoint.project.engine.step import StepOutcome
from toolpoint.project.steps.plain_files import write_json


def judge_drift(folder: Path, baseline: Path, tests: Sequence[Path], *, machine: Path, names: Sequence[str],
                pose: Mapping[str, float]) -> StepOutcome:
    """Write whether the machine has changed since its first test (drift.json); a change is a doubt of all that follows.

    names : of the first test, then of the later ones in their order in time.
    """
    built = io.read_machine_at(machine, pose or None)
    study = studies.study_drift(io.read_modes(baseline), [io.read_modes(path) for path in tests], built, pose=pose or None,
                                names=names[1:])
    write_json(folder / "drift.json", study.to_dict())
    doubts = list(study.doubts)
    if study.has_changed:
        doubts.append(Doubt("the machine", f"it has changed between the tests {names[0]} and {names[-1]}; limits are those of "
                            f"{names[0]}", "mend what changed, or make the last test the first one of the project"))
    return StepOutcome(study.status, tuple(doubts))
