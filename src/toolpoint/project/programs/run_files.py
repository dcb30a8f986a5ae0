"""Study of a project's NC program from its files: as `toolpoint machining` runs it, on the likeliest machine or tip."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.quantities.written import read_stock
from toolpoint.machine import Machine
from toolpoint.machine.description.project_plan import ASSUMED_COEFFICIENT_DEVIATION
from toolpoint.material_removal import Stock
from toolpoint.project.limits.line_draws import read_tip_file, read_work_file
from toolpoint.project.limits.systems import DrawnSystems, MachineDraws, TipDraws, cut_of
from toolpoint.project.limits.tips import read_tip
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.tilted_stages import StagedStudy


@dataclass(frozen=True)
class ProgramFiles:
    """Files of a program: itself, and those of its stock, part, tools with their tips and shafts, servo, record, its work by
    finite elements or the responses of it, None where it has none."""

    program: Path
    stock: Path | None = None
    part: Path | None = None
    tools: tuple[Path, ...] = ()
    tips: tuple[Path, ...] = ()
    shafts: tuple[Path, ...] = ()
    servo: Path | None = None
    record: Path | None = None
    work: Path | None = None
    responses: tuple[Path, ...] = ()


@dataclass(frozen=True, eq=False)
class ProgramRun:
    """Study of a program; and by tool number (0 for all others) the name under which the draws of its coefficients are made,
    with their relative deviation; assumed : names of those whose deviation is; doubts : of its files alone; tips : of tools
    with a response of their own."""

    study: MachiningStudy | StagedStudy
    deviations: Mapping[int, tuple[str, float]]
    assumed: tuple[str, ...]
    doubts: tuple[Doubt, ...]
    tips: studies.ToolTips

    @property
    def stages(self) -> tuple[MachiningStudy, ...]:
        """Studies of the stages: the one study of an upright program."""
        return self.study.stages if isinstance(self.study, StagedStudy) else (self.study,)

    def deviation_of(self, tool: int) -> tuple[str, float]:
        """Return name and deviation of a tool's coefficients."""
        return self.deviations.get(tool, self.deviations[0])


def systems_of_program(machine: Path | None, tip_x: Path | None, tip_y: Path | None, *, zero: Mapping[str, float], draws: int,
                       seed: int) -> tuple[DrawnSystems | None, Machine | ToolDynamics | None]:
    """Return the draws that a program is judged by, and what it runs on: the machine posed along it, a tip, or nothing."""
    if machine is not None:
        built = io.read_machine_at(machine, zero or None)
        return MachineDraws(built, draws, seed), built
    if tip_x is None:
        return None, None
    tip = TipDraws(read_tip(tip_x, tip_y), draws, seed)
    return tip, tip.nominal({})


def run_step(arguments: Mapping[str, Any], *, lobes: int = 0, with_advice: bool = False) -> ProgramRun:
    """Return the study of a program from the arguments of its step; raises as `run_files` does."""
    settings = arguments["settings"]
    dynamics = systems_of_program(*(arguments.get(name) for name in ("machine", "tip_x", "tip_y")), zero=settings["zero"],
                                  draws=arguments["draws"], seed=arguments["seed"])[1]
    files = ProgramFiles(**{field.name: arguments[field.name] for field in fields(ProgramFiles) if field.name in arguments})
    return run_files(files, settings, dynamics, lobes=lobes, with_advice=with_advice)


def run_files(files: ProgramFiles, settings: Mapping[str, Any], dynamics: Machine | ToolDynamics | None, *, lobes: int = 0,
              with_advice: bool = True, progress: Callable[..., None] = lambda name, finished, total: None) -> ProgramRun:
    """Return what every block of a project's program meets; settings : those of `ProjectProgram`, the cut as flat values.

    Raises ToolpointError where no cut is described, and as `studies.run_program` does.
    """
    machine = dynamics if isinstance(dynamics, Machine) else None
    cut = _cut(machine, settings)
    cuts = {int(number): io.read_tool(path) for number, path in zip(settings["tools"], files.tools, strict=True)}
    radii = io.CutterRadii.of_cuts(cut, cuts, wear_only=settings["wear_only"])
    stock, parsed = read_stock_and_program(files, settings, radii)
    text = files.program.read_text(encoding="utf-8-sig", errors="replace")
    is_tilted, tips = parsed.is_tilted, read_tips(files, settings)
    servo = None if files.servo is None or is_tilted else io.read_drives(files.servo)
    setup = studies.describe_machining(
        stock, cut, cuts=cuts, stick_out=settings["stick_out"],
        stick_outs={int(number): length for number, length in settings["stick_outs"]}, holder_diameter=settings["holder"],
        zero=settings["zero"], speed=settings["speed"], spacing=settings["spacing"],
        limits=studies.CuttingLimits(**settings["spindle"]), drives=servo, **_rotary(settings),
        part=None if files.part is None or is_tilted else io.read_surface(files.part))
    name, record, work = files.program.name, _read_record(files.record, settings), read_work(files, settings)
    if parsed.is_tilted:
        staged = studies.run_stages(parsed, setup, dynamics, name=name, text=text, lobes=lobes, progress=progress, tips=tips,
                                    work=work, with_advice=with_advice and dynamics is not None)
        if record is not None:
            staged = studies.compare_stages(staged, *record[0], **record[1])
        return ProgramRun(staged, *_deviations(files, settings), tuple(_left_out(files)), tips)
    run_all = studies.run_five_axes if parsed.is_five_axis else studies.run_program
    study = run_all(parsed, setup, dynamics, name=name, text=text, lobes=lobes, tips=tips, work=work,
                    with_advice=with_advice and dynamics is not None, progress=progress)
    if record is not None:
        study = studies.compare_record(study, *record[0], **record[1])
    return ProgramRun(study, *_deviations(files, settings), tuple(_left_out(files)) if is_tilted else (), tips)


def _rotary(settings: Mapping[str, Any]) -> dict[str, float]:
    """Return the limits of the rotary axes that are given, rad/s and rad/s^2."""
    names = ("rotary_speed", "rotary_acceleration")
    return {name: value for name, value in zip(names, settings["rotary"], strict=True) if value is not None}


def read_work(files: ProgramFiles, settings: Mapping[str, Any]) -> ClampedPart | studies.MeasuredWork | None:
    """Return the work of a program that gives way, None where it is rigid."""
    described = settings["work"]
    if described is None:
        return None
    if files.work is None:
        return studies.MeasuredWork({int(line): read_work_file(path)
                                     for line, path in zip(described["responses"], files.responses, strict=True)})
    return studies.describe_part(io.read_description(files.work), described["held"], damping_ratio=described["damping_ratio"],
                                 stage_change=described["stage_change"])


def read_tips(files: ProgramFiles, settings: Mapping[str, Any]) -> studies.ToolTips:
    """Return the tips of tools with a response or a shaft of their own."""
    struck = {int(n): read_tip_file(path) for n, path in zip(settings["tips"], files.tips, strict=True)}
    shafts = {int(n): io.read_shaft(path) for n, path in zip(settings["shafts"], files.shafts, strict=True)}
    return studies.ToolTips(struck, shafts, settings["point"])


def _read_record(file: Path | None, settings: Mapping[str, Any]) -> tuple[tuple[Any, Any], dict[str, Any]] | None:
    """Return time and values of a record, with the options of its comparison; None without a file."""
    if file is None:
        return None
    signal = studies.spindle_signal(io.read_servo_data(file), settings["signal"])
    return (signal.time, signal.values), {"unit": signal.unit, "name": signal.name, "efficiency": settings["efficiency"]}


def read_stock_and_program(files: ProgramFiles, settings: Mapping[str, Any], radii: io.CutterRadii) -> tuple[Stock, Any]:
    """Return the stock of a program, and the program as its reader gives it, begun above the stock."""
    kind, lengths = read_stock(settings["stock"])
    stock = studies.stock_of(kind, lengths, None if files.stock is None else io.read_surface(files.stock))
    # The tool waits 100 mm above the stock: the first rapid of a program must not pass through it.
    return stock, io.read_program(files.program, start=(0.0, 0.0, float(stock.upper[2]) + 0.1), feed=settings["first_feed"],
                                  cutter_radius=radii)


def _cut(machine: Machine | None, settings: Mapping[str, Any]) -> CuttingDescription:
    """Return the cut of the project, else that of the machine file."""
    if settings["cut"] is not None:
        return cut_of(settings["cut"]["values"])
    described = None if machine is None else machine.description.cutting
    if described is None:
        raise ToolpointError("cut: the project describes none, and the machine file has no section 'cutting'; add one under "
                             "cuts: in project.yaml")
    return described


def _deviations(files: ProgramFiles, settings: Mapping[str, Any]) -> tuple[dict[int, tuple[str, float]], tuple[str, ...]]:
    """Return name and deviation of the coefficients of every tool, and the names of those whose deviation is assumed."""
    described = {} if settings["cut"] is None else settings["cut"]
    entries = {0: (settings["cut_name"] or "the machine file's cut", described.get("deviation"))}
    entries |= {int(number): (path.name, settings["coefficient_deviation"])
                for number, path in zip(settings["tools"], files.tools, strict=True)}
    assumed = tuple(dict.fromkeys(name for name, deviation in entries.values() if not deviation))
    stated = {number: (name, deviation or ASSUMED_COEFFICIENT_DEVIATION) for number, (name, deviation) in entries.items()}
    return stated, assumed


def _left_out(files: ProgramFiles) -> list[Doubt]:
    """Return the doubt about files that programs in tilted planes do not take."""
    names = [name for name in ("servo", "part") if getattr(files, name) is not None]
    return [] if not names else [Doubt("program with a turned tool", f"{', '.join(names)} left out: taken upright alone",
                                       "judge the upright part of the program by itself")]
