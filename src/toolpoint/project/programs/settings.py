"""Inputs, options and command of the step of an NC program, from what the project file says of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from toolpoint.cutting.description import flat_values
from toolpoint.cutting.option_words import cut_words
from toolpoint.machine.description.project_plan import ContourGoal, ProgramWork, ProjectDescription, ProjectProgram


def program_inputs(program: ProjectProgram, servo: str | None) -> dict[str, Any]:
    """Return the files of a program, relative to the project; servo : of the project."""
    files = {"program": program.program, "stock": None if "=" in program.stock else program.stock, "part": program.part,
             "servo": servo if program.servo else None, "record": program.record,
             **{name: tuple(getattr(program, name).values()) or None for name in ("tools", "tips", "shafts")}}
    if program.work is not None:
        files |= {"work": program.work.part, "responses": tuple(program.work.responses.values()) or None}
    return {name: path for name, path in files.items() if path is not None}


def program_settings(program: ProjectProgram, project: ProjectDescription) -> dict[str, Any]:
    """Return the options of a program as plain data, SI; limits of the spindle that are not given are left out."""
    cut = project.cuts.get(program.cut)
    spindle = {name: value for name, value in asdict(program.spindle).items()
               if (value if name == "curve" else math.isfinite(value))}
    coupling = project.coupling
    return {"stock": program.stock, "cut_name": program.cut, "tools": list(program.tools), "tips": list(program.tips),
            "shafts": list(program.shafts), "point": "" if coupling is None or coupling.point is None else coupling.point,
            "cut": None if cut is None else {"values": flat_values(cut.cut), "deviation": cut.coefficient_deviation},
            "coefficient_deviation": program.coefficient_deviation, "zero": dict(program.zero), "speed": program.speed,
            "first_feed": program.first_feed, "stick_out": program.stick_out,
            "stick_outs": list(program.stick_outs.items()), "wear_only": program.wear_only, "holder": program.holder,
            "spacing": program.spacing, "signal": program.signal, "efficiency": program.efficiency, "spindle": spindle,
            "rotary": [value if math.isfinite(value) else None
                       for value in (program.rotary_speed, program.rotary_acceleration)],
            "work": None if program.work is None else {**asdict(program.work), "responses": list(program.work.responses)}}


def circle_command(servo: str, goal: ContourGoal, machine: str | None) -> list[str]:
    """Return the command that shows a circle with its own page, from the project's folder."""
    words = ["drive", servo, "--circle", f"{1e3 * goal.radius:.9g},{6e4 * goal.feed:.9g}", "--deviation",
             f"{1e6 * goal.deviation:.9g}um"]
    words += ["--plane", ",".join(goal.axes)] if goal.axes != ("X", "Y") else []
    words += [] if machine is None else ["--machine", machine]
    pose = ",".join(f"{axis}={position!r}" for axis, position in goal.pose.items())
    return [*words, *(["--pose", pose] if machine is not None and pose else [])]


def program_command(program: ProjectProgram, project: ProjectDescription, source: Mapping[str, str]) -> list[str]:
    """Return the command that shows the same program with its own page, from the project's folder."""
    words = ["machining", program.program, "--stock", program.stock]
    words += ["--machine", source["machine"]] if "machine" in source else []
    words += ["--frf-x", source["tip_x"]] if "tip_x" in source else []
    words += ["--frf-y", source["tip_y"]] if "tip_y" in source else []
    if program.zero and "machine" in source:
        words += ["--zero", ",".join(f"{axis}={position!r}" for axis, position in program.zero.items())]
    cut = project.cuts.get(program.cut)
    words += [] if cut is None else cut_words(cut.cut)
    for number, file in program.tools.items():
        words += ["--tool", f"{number}={file}"]
    words += [word for number, file in program.tips.items() for word in ("--tip", f"{number}={file}")]
    words += [word for number, file in program.shafts.items() for word in ("--shaft", f"{number}={file}")]
    words += ["--at", str(project.coupling.point)] if program.shafts and project.coupling is not None else []
    numbers = {"--speed": program.speed, "--stick-out": 1e3 * program.stick_out, "--holder": 1e3 * program.holder,
               "--spacing": 1e3 * program.spacing, "--first-feed": 60e3 * (program.first_feed or 0.0)}
    words += [word for name, number in numbers.items() if number for word in (name, f"{number:.9g}")]
    for number, length in program.stick_outs.items():
        words += ["--stick-out-of", f"{number}={1e3 * length:.9g}"]
    words += ["--wear-only"] if program.wear_only else []
    words += [*_spindle_words(program), *_work_words(program.work)]
    limits = {"--rotary-speed": program.rotary_speed, "--rotary-acceleration": program.rotary_acceleration}
    words += [word for name, value in limits.items() if math.isfinite(value) for word in (name, f"{math.degrees(value):.9g}")]
    files = {"--part": program.part, "--record": program.record, "--drives": project.servo if program.servo else None}
    words += [word for name, file in files.items() if file is not None for word in (name, file)]
    if program.record is not None:
        words += ["--signal", program.signal] if program.signal else []
        words += ["--efficiency", f"{program.efficiency:g}"] if program.efficiency != 1 else []
    return [*words, "--advice"]


def _work_words(work: ProgramWork | None) -> list[str]:
    """Return the options of work that gives way."""
    if work is None:
        return []
    if work.part is None:
        return [word for line, file in work.responses.items() for word in ("--work-response", f"{line}={file}")]
    words = ["--work", work.part, *(word for name in work.held for word in ("--held", name))]
    words += ["--work-damping", f"{work.damping_ratio:.9g}"] if work.damping_ratio else []
    return [*words, "--stage-change", f"{100 * work.stage_change:.9g}"]


def _spindle_words(program: ProjectProgram) -> list[str]:
    limits = program.spindle
    numbers = {"--spindle-power": 1e-3 * limits.power, "--spindle-torque": limits.torque, "--spindle-speed": limits.speed,
               "--bending": limits.bending}
    words = [word for name, number in numbers.items() if math.isfinite(number) for word in (name, f"{number:.9g}")]
    curve = ",".join(f"{speed:g}:{torque:g}" for speed, torque in limits.curve)
    return [*words, *(["--spindle-curve", curve] if curve else [])]
