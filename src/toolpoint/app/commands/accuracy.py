"""Commands about what to change: accuracy, screen, improve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, OUTPUT, PATH
from toolpoint.app.place_options import DIRECTION, TURN, direction_of, numbers_of

LOADS = ("cutting", "gravity", "path")


@click.command()
@click.argument("machine", type=FILE)
@click.option("--square", "side", metavar="200mm", help="A square of this side.")
@click.option("--line", "ends", multiple=True, metavar="X,Y,Z", help="A line: twice, its start and end.")
@click.option("--points", type=FILE, help="A CSV of places x,y,z (m) along which the tool goes.")
@click.option("--program", type=FILE, help="A G-code program; its zero lies at --centre, its plane is --plane.")
@click.option("--centre", default="0,0,0", show_default=True, help="Centre of the square, or zero of the program.")
@click.option("--plane", default="x,y", show_default=True, metavar="FIRST,SECOND", help="Directions of the plane, as y,z.")
@click.option("--feed", default=300.0, show_default=True, help="Feed, mm/min.")
@click.option("--law", type=click.Choice(["quintic", "jerk-limited"]), default="quintic", show_default=True, help="Motion law.")
@click.option("--speed", type=float, required=True, help="Spindle speed, rev/min.")
@click.option("--depth", type=float, required=True, help="Depth of cut, mm.")
@click.option("--loads", default="cutting", show_default=True, metavar="cutting,gravity,path",
              help="Which loads count: the cut, gravity's changing sag, inertia of the path.")
@click.option("--regenerative", is_flag=True, help="The vibration feeds back on the chip.")
@click.option("--window", type=float, help="Only so many seconds of the middle of every side.")
@click.option("--work", metavar="X1,Y1,X2,Y2", help="A block in the plane of the path, from its zero: pixels decide what the "
                                                     "cutter meets, and what sides before have left.")
@click.option("--pixel", default="0.1mm", show_default=True, help="Side of a pixel of the block.")
@click.option("--drives", type=FILE, help="A drive file: motors of its axes give way as their loops let them; rotary axes by "
                                          "their gear_ratio.")
@click.option("--base", is_flag=True, help="Reaction of the base along the path too.")
@click.option("--branch", default="", help="Branch of an arm, as 'front up no flip'.")
@click.option("--folder", type=PATH, help="Keep finished steps here, and go on from them.")
@DIRECTION
@TURN
@OUTPUT
@JSON
def accuracy(machine: Path, folder: Path | None, output: Path, as_json: bool, **options: Any) -> None:
    """Milling accuracy along a path: flexible against rigid run with the cut at the moving tool, error spheres, spectra."""
    from toolpoint.io.yaml import machine_file

    built = machine_file.read(machine)

    from toolpoint.pages.robots.accuracy import accuracy_page
    from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_path
    from toolpoint.studies.accuracy.moving_structure import ToolStance

    way = direction_of(options["direction"], "--direction")
    stance = ToolStance(None if way is None else (way[0], way[1], way[2]), numbers_of(options["turn"], "--turn", 1, True)[0],
                        options["branch"])
    setup = MillingSetup(options["speed"], 1e-3 * options["depth"], tuple(options["loads"].split(",")), options["regenerative"],
                         window=options["window"], stance=stance, work=_work(options),
                         servos=_servos(options["drives"], built), with_base=options["base"])
    sides = _sides(options)
    with frame(None if as_json else output, as_json) as run, run.progress("thousandths of the path", folder) as progress:
        result = mill_path(built, sides, setup, progress=progress, folder=folder)
        if not as_json:
            cut = built.description.cutting
            run.save(accuracy_page(result, 1 if cut is None else cut.tool.teeth, run.warnings))
    run.show(result)


def _work(options: dict[str, Any]) -> Any:
    """The block of the options, None without."""
    from toolpoint.studies.accuracy.cut_course import WorkBlock

    if options["work"] is None:
        return None
    left, low, right, high = numbers_of(options["work"], "--work", 4)
    return WorkBlock((left, low), (right, high), numbers_of(options["pixel"], "--pixel", 1)[0])


def _servos(drives: Path | None, machine: Any) -> Any:
    """The servos of a drive file, None without."""
    if drives is None:
        return None
    from toolpoint.io.yaml import drive_file
    from toolpoint.studies.accuracy.joint_servos import servos_of

    return servos_of(drive_file.read(drives), machine)


def _sides(options: dict[str, Any]) -> Any:
    """The path of the options: exactly one of square, line, points and program."""
    import numpy as np

    from toolpoint.io import read_path
    from toolpoint.studies.accuracy import tool_paths

    given = [name for name in ("side", "ends", "points", "program") if options[name]]
    if len(given) != 1:
        raise ToolpointError("accuracy: give exactly one of --square, --line (twice), --points and --program")
    centre, feed = numbers_of(options["centre"], "--centre", 3), options["feed"] / 60e3
    words = options["plane"].split(",")
    if len(words) != 2:
        raise ToolpointError(f"--plane: {options['plane']!r}; must be two directions, as y,z")
    first, second = (direction_of(word, "--plane") for word in words)
    assert first is not None and second is not None
    more: dict[str, Any] = {"feed": feed, "law": options["law"]}
    if given == ["side"]:
        return tool_paths.square(numbers_of(options["side"], "--square", 1)[0], centre=centre, first=first, second=second,
                                 **more)
    if given == ["ends"]:
        if len(options["ends"]) != 2:
            raise ToolpointError("--line: must be given twice, the start and the end")
        return tool_paths.line(*(numbers_of(end, "--line", 3) for end in options["ends"]), **more)
    place = tool_paths.plane_frame(centre, first, second)
    if given == ["points"]:
        try:
            rows = np.loadtxt(options["points"], delimiter=",", ndmin=2)
        except ValueError as error:
            raise ToolpointError(f"{options['points']}: not lines of x,y,z ({error})") from None
        return tool_paths.along_points(rows, place=place, **more)
    return tool_paths.sides_of(read_path(options["program"]), place=place, law=options["law"])


@click.command()
@click.argument("plan", type=FILE)
@click.option("--workers", default=0, show_default=True, help="Worker processes (extra 'cluster'); 0 is this process.")
@click.option("--scheduler", metavar="tcp://HOST:8786", help="A running Dask scheduler instead, in a network that you trust.")
@click.option("--folder", type=PATH, help="Keep finished parts here and resume from them.")
@OUTPUT
@JSON
def screen(plan: Path, workers: int, scheduler: str | None, folder: Path | None, output: Path, as_json: bool) -> None:
    """Design changes screened by a plan (YAML): every variant's metrics, effects and their ranking with confidence."""
    from toolpoint.io.yaml import machine_file, plan_file

    planned = plan_file.read(plan)
    built = machine_file.read(plan.parent / planned.machine)

    from toolpoint.pages.robots.screening import screening_page
    from toolpoint.studies.execute import Dask, Serial
    from toolpoint.studies.screening.planned import run_plan

    engine = Dask(workers, scheduler) if workers or scheduler else Serial()
    with frame(None if as_json else output, as_json) as run, run.progress("variants", folder) as progress:
        result = run_plan(planned, built, engine=engine, folder=folder, progress=progress)
        if not as_json:
            run.save(screening_page(result, plan.stem, run.warnings))
    run.show(result)


@click.command()
@click.argument("plan", type=FILE)
@click.option("--answer", type=click.Choice(["response peak", "static compliance", "depth limit", "position error"]),
              required=True,
              help="What is to be improved, at the pose of the plan.")
@click.option("--goal", type=float, required=True, help="What it shall become: m/N, or mm for a depth limit, µm for an error.")
@JSON
def improve(plan: Path, answer: str, goal: float, as_json: bool) -> None:
    """The cheapest changes (factors of a plan with their costs) that bring the tool point to a goal, from exact slopes."""
    from toolpoint.io.yaml import machine_file, plan_file

    planned = plan_file.read(plan)
    built = machine_file.read(plan.parent / planned.machine)
    cut = built.description.cutting
    if answer in ("depth limit", "position error") and cut is None:
        raise ToolpointError(f"--answer {answer}: the machine file has no 'cutting'")
    if planned.swaps:
        raise ToolpointError("improve: the plan holds swaps, which have no slope; give factors, or screen them")
    if answer == "position error" and planned.square is None:
        raise ToolpointError("--answer position error: the plan needs a square, for its speed and depth")
    import numpy as np

    from toolpoint.studies.screening import answers
    from toolpoint.studies.screening.improve import improve as improve_machine

    scale = {"depth limit": 1e-3, "position error": 1e-6}.get(answer, 1.0)
    with frame(None, as_json) as run:
        chosen: Any = answers.ResponsePeak(static=answer == "static compliance")
        if answer == "depth limit" and cut is not None:
            chosen = answers.DepthLimit(cut)
        if answer == "position error" and cut is not None and planned.square is not None:
            chosen = answers.PeriodicError(cut, planned.square.speed, planned.square.depth)
        result = improve_machine(built, planned.factors, chosen, goal=scale * goal, poses=(dict(planned.pose),),
                                 doubts=planned.doubts, draws=planned.draws, rng=np.random.default_rng(planned.seed))
    run.show(result)
