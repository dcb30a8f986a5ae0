"""Step of an NC program: its blocks on the project's machine, the worst by all draws, the speed that keeps it stable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.machine.description.project_plan import ASSUMED_COEFFICIENT_DEVIATION
from toolpoint.project.engine.step import StepOutcome
from toolpoint.project.limits.systems import DrawnSystems
from toolpoint.project.programs.drawn_places import DrawnPlaces, ProgramDraws, draw_places
from toolpoint.project.programs.run_files import ProgramFiles, ProgramRun, run_files, systems_of_program
from toolpoint.project.programs.words import program_numbers, program_words, speed_factors
from toolpoint.project.steps.plain_files import read_json, write_json
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics


def judge_program(folder: Path, program: Path, *, settings: Mapping[str, Any], draws: int, seed: int,
                  machine: Path | None = None, tip_x: Path | None = None, tip_y: Path | None = None,
                  stock: Path | None = None, part: Path | None = None, tools: Sequence[Path] = (), tips: Sequence[Path] = (),
                  shafts: Sequence[Path] = (), servo: Path | None = None,
                  record: Path | None = None, weights: Path | None = None, verdict: Path | None = None,
                  checked: Path | None = None, work: Path | None = None, responses: Sequence[Path] = ()) -> StepOutcome:
    """Write what the blocks of an NC program meet, and how sure that is (program.json).

    Without machine and tip its stability stays unknown. weights : of the draws after tried cuts; verdict, checked : what the
    answer rests on besides, as in `limit_goal`.

    Raises ToolpointError for a program that meets no material.
    """
    systems, dynamics = systems_of_program(machine, tip_x, tip_y, zero=settings["zero"], draws=draws, seed=seed)
    files = ProgramFiles(program, stock, part, tuple(tools), tuple(tips), tuple(shafts), servo, record, work,
                         tuple(responses))
    run = run_files(files, settings, dynamics)
    if not any((stage.blocks.verdict > 0).any() for stage in run.stages):
        raise ToolpointError(f"{program.name}: no block cuts: the tool meets no material; mend stock or zero in project.yaml")
    weighed = np.full(draws, 1 / draws) if weights is None else np.asarray(read_json(weights)["weights"], float)
    places, after = draw_program(run, systems)
    data = program_numbers(run, places, after, weights=weighed)
    write_json(folder / "program.json", data)
    return StepOutcome(program_words(data), tuple(dict.fromkeys([*_doubts(run, systems, dynamics), *(
        () if places is None else places.doubts)])))


def draw_program(run: ProgramRun, systems: DrawnSystems | None) -> tuple[DrawnPlaces | None, DrawnPlaces | None]:
    """Return the places of a program nearest to their limit by all draws, as it is and at the advised speeds."""
    judged = [stage.judged for stage in run.stages if stage.judged is not None]
    if systems is None or not judged:
        return None, None
    drawn = ProgramDraws(systems, run.tips)
    places = draw_places(drawn, judged, run.deviation_of)
    factors = [speed_factors(stage) for stage in run.stages if stage.judged is not None]
    if not any(factors):
        return places, None
    changed = [part.at_speeds(factor) if factor else part for part, factor in zip(judged, factors, strict=True)]
    return places, draw_places(drawn, changed, run.deviation_of)


def _doubts(run: ProgramRun, systems: DrawnSystems | None, dynamics: Machine | ToolDynamics | None) -> list[Doubt]:
    """Return the doubts of a program: those of its blocks and files, of the draws, of coefficients and of a fixed tip."""
    doubts = [*run.study.doubts, *run.doubts, *(() if systems is None else ProgramDraws(systems, run.tips).doubts)]
    if systems is not None:
        doubts += [Doubt(f"coefficients of {name}", f"no deviation is given: {100 * ASSUMED_COEFFICIENT_DEVIATION:.0f} % is "
                         "assumed", "calibrate them (toolpoint calibrate), and write coefficient_deviation beside them")
                   for name in run.assumed]
    if isinstance(dynamics, ToolDynamics):
        doubts.append(Doubt("pose of the program", "the tip was struck at one pose; its response is taken all along the "
                            "program", "add a test of the structure (components, geometry), or strike the tip at its ends"))
    recorded = [doubt for stage in run.stages if stage.record is not None for doubt in stage.record.doubts]
    return [*recorded, *doubts]
