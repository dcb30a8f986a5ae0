"""Commands about robots and places of a tool, the accuracy of its path, and what to change: robot, reach, region, export,
accuracy, screen, improve."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.app.declare import Argument, Help, Reading, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import ArmBranch, Count, Depth, Folder, MachineFile, Pose, Speed, ToolDirection, ToolTurn, Workers
from toolpoint.app.values import AxisPositions, Length, LengthRange, NewFile, Place, Plane, SourceFile
from toolpoint.io.quantities.written import read_block, read_goal

if TYPE_CHECKING:
    from toolpoint.machine import Machine
    from toolpoint.machine.description.screening_plan import ScreeningPlan
    from toolpoint.studies.accuracy.tool_paths import PathSide

Corners = Annotated[tuple[tuple[float, float], tuple[float, float]], Reading(read_block)]


@command(steps=2, replace=True, page_beside_json=False)
def robot(run: Frame, datasheet: Annotated[SourceFile, Argument()], *, pose: Pose = None,
          written: Annotated[NewFile | None, Help("Write the machine here.", name="--machine")] = None) -> None:
    """A robot from its datasheet (YAML): gear ratios, reducers, density, forces on the base, and the machine they make, its
    reducers about gravity's load at the pose."""
    sheet, description = io.read_datasheet(datasheet), io.read_robot_machine(datasheet, pose=pose)
    result = studies.study_datasheet(sheet, description, pose=pose)
    run.write("Machine file", written, io.write_machine, description)
    run.present(pages.robot_page, result, datasheet.read_text(encoding="utf-8-sig"), datasheet.name, has_answer=False)


@command(page=False)
def reach(run: Frame, machine: MachineFile, *,
          tip: Annotated[Place | None, Help("Where the tip shall be, from the table point.", metavar="600mm,0,300mm")] = None,
          pose: Annotated[AxisPositions | None, Help("A pose instead, by axes or in the machine's own coordinates (`task`).",
                                                     metavar="Z=-650mm,tilt=20deg", excludes="--tip")] = None,
          direction: ToolDirection = None, turn: ToolTurn, branch: ArmBranch = "", count: Count = 4) -> None:
    """All poses that bring the tool to a place, or one pose: axes, own coordinates and parasitic shift of a head, distance to
    singular poses, holding torque, natural frequencies."""
    built = io.read_machine_at(machine, pose)
    if pose is not None:
        run.show(studies.study_pose(built, pose, modes=count))
        return
    if tip is None:
        raise ToolpointError("reach: neither --tip nor --pose; needs the place of the tool, or a pose")
    run.show(studies.study_reach(built, tip, direction, turn=turn, modes=count, branch=branch))


@command(steps=4, page_beside_json=False)
def region(run: Frame, machine: MachineFile, *,
           along: Annotated[tuple[LengthRange, ...], Help("Places along x, y or z: first, last, number; once for a line, twice "
                                                          "for a plane, three times for a volume.", metavar="x=300mm:700mm:9")],
           origin: Annotated[Place, Help("Where all places are zero.", default="0,0,0")],
           quantity: Annotated[Literal["frequency", "static", "dynamic", "depth"], Help(
               "Natural frequencies, stiffness of the tool, or the lowest stable depth.")] = "frequency", count: Count = 4,
           length: Annotated[Length, Help("Length of the segment that is searched; 0 for the map alone.", default="200mm")],
           directions: Annotated[int, Help("Directions of segments in the plane, evenly over half a turn.", minimum=1)] = 4,
           samples: Annotated[int, Help("Places at which a segment is judged, both ends included.", minimum=2)] = 5,
           feed_directions: Annotated[int, Help("Feed directions of a depth.", minimum=1)] = 1,
           point: Annotated[str, Help("Another point of the tool's body in place of the tip.")] = "",
           branch: ArmBranch = "",
           direction: ToolDirection = None, turn: ToolTurn) -> None:
    """A quantity over places of the tool, and the straight segment over which it is most even: the best place to mill."""
    built = io.read_machine(machine)
    place_quantity = studies.PlaceQuantity.over_feeds(quantity, count, feed_directions)
    result = studies.study_region(
        built, studies.place_grid({axis.name: axis.positions for axis in along}, origin), place_quantity,
        length=length, directions=directions, samples=samples, direction=direction, turn=turn, branch=branch, point=point,
        step=run.step, progress=run.progress("places"))
    run.step("page")
    run.save(pages.place_page, result.map, result.search, machine.stem)
    run.show(result)


@command(replace=True)
def export(machine: MachineFile, target: Annotated[NewFile, Argument()], *, pose: Pose = None) -> None:
    """A machine at a pose for multibody programs: MuJoCo (target.xml) or a script for Exudyn (target.py)."""
    io.write_multibody(io.read_machine_at(machine, pose), target, pose)
    console.text(f"Written: {target}")


@dataclass(frozen=True)
class MilledPath:
    """The path along which the tool goes: exactly one of a square, a line, points and a program."""

    centre: Annotated[Place, Help("Centre of the square, or zero of the program.", default="0,0,0")]
    plane: Annotated[Plane, Help("Directions of the plane, as y,z.", default="x,y", metavar="FIRST,SECOND")]
    square: Annotated[Length | None, Help("A square of this side.", metavar="200mm")] = None
    line: Annotated[tuple[Place, ...], Help("A line: twice, its start and end.", metavar="X,Y,Z")] = ()
    points: Annotated[SourceFile | None, Help("A CSV of places x,y,z (m) along which the tool goes.")] = None
    program: Annotated[SourceFile | None, Help("A G-code program; its zero lies at --centre, its plane is --plane.")] = None
    cutter_radius: Annotated[float | None, Help("Radius of the tool for G41 and G42 of the program, mm; 0 where it holds the "
                                                "path of the centre.", scale=1e-3, minimum=0, needs="--program")] = None
    feed: Annotated[float, Help("Feed, mm/min.", scale=1 / 60e3)] = 300.0
    law: Annotated[Literal["quintic", "jerk-limited"], Help("Motion law.")] = "quintic"

    def sides(self) -> tuple[PathSide, ...]:
        """Return the sides of the path."""
        points = None if self.points is None else io.read_places(self.points)
        path = None if self.program is None else io.read_path(self.program, cutter_radius=self.cutter_radius)
        return studies.lay_path(square_side=self.square, ends=self.line, points=points, path=path, centre=self.centre,
                                plane=self.plane, feed=self.feed, law=self.law)


@command(page_beside_json=False)
def accuracy(run: Frame, machine: MachineFile, path: MilledPath, *, speed: Speed, depth: Depth,
             loads: Annotated[str, Help("Which loads count: the cut, gravity's changing sag, inertia of the path.",
                                        metavar="cutting,gravity,path")] = "cutting",
             regenerative: Annotated[bool, Help("The vibration feeds back on the chip.")] = False,
             chip: Annotated[Literal["path", "constant"] | None, Help(
                 "The chip: the path's feed over speed and teeth, or feed_per_tooth of the file all along; as the file's chip "
                 "says where left out.")] = None,
             window: Annotated[float | None, Help("Only so many seconds of the middle of every side.")] = None,
             work: Annotated[Corners | None, Help("A block in the plane of the path, from its zero: pixels decide what the "
                                                  "cutter meets, and what sides before have left.",
                                                  metavar="X1,Y1,X2,Y2")] = None,
             pixel: Annotated[Length, Help("Side of a pixel of the block.", default="0.1mm")],
             spacing: Annotated[Length, Help("Between nodes of the structure along the path.", default="2mm")],
             steps: Annotated[int, Help("Steps in a tooth period.", minimum=32)] = 100,
             drives: Annotated[SourceFile | None, Help("A drive file: motors of its axes give way as their loops let them; "
                                                       "rotary axes by their gear_ratio.")] = None,
             base: Annotated[bool, Help("Reaction of the base along the path too.")] = False,
             branch: ArmBranch = "",
             folder: Folder = None, direction: ToolDirection = None, turn: ToolTurn) -> None:
    """Milling accuracy along a path: flexible against rigid run with the cut at the moving tool, error spheres, spectra."""
    built = io.read_machine(machine)
    described = None if drives is None else io.read_drives(drives)
    setup = studies.MillingSetup(
        speed, depth, tuple(loads.split(",")), regenerative, spacing, steps, window=window, chip=chip or "",
        stance=studies.ToolStance(direction, turn, branch),
        work=None if work is None else studies.WorkBlock(*work, pixel),
        servos=None if described is None else studies.servos_of(described, built), with_base=base)
    result = studies.mill_path(built, path.sides(), setup, progress=run.progress("thousandths of the path", folder),
                               folder=folder)
    cut = built.description.cutting
    run.present(pages.accuracy_page, result, 1 if cut is None else cut.tool.teeth, run.warnings, has_answer=False)


@command(page_beside_json=False)
def screen(run: Frame, plan: MachineFile, *, workers: Workers = 0,
           scheduler: Annotated[str | None, Help("A running Dask scheduler instead, in a network that you trust.",
                                                 metavar="tcp://HOST:8786")] = None, folder: Folder = None) -> None:
    """Design changes screened by a plan (YAML): every variant's metrics, effects and their ranking with confidence."""
    planned, built = _read_plan(plan)
    result = studies.run_plan(planned, built, engine=studies.choose_engine(workers, scheduler), folder=folder,
                              progress=run.progress("variants", folder))
    run.present(pages.screening_page, result, plan.stem, run.warnings, has_answer=False)


@command(page=False)
def improve(run: Frame, plan: MachineFile, *,
            answer: Annotated[Literal["response peak", "static compliance", "depth limit", "position error"], Help(
                "What is to be improved, at the pose of the plan.")],
            goal: Annotated[str, Help("What it shall become: a compliance or stiffness with its unit (0.12um/N, 8N/um), mm for "
                                      "a depth limit, µm for an error.", metavar="0.12um/N|8N/um|2.5|30")]) -> None:
    """The cheapest changes (factors of a plan with their costs) that bring the tool point to a goal, from exact slopes."""
    value = read_goal(goal, answer)
    planned, built = _read_plan(plan)
    run.show(studies.improve_by_plan(planned, built, answer, goal=value))


def _read_plan(plan: Path) -> tuple[ScreeningPlan, Machine]:
    """Return a plan and the machine that it names, beside it."""
    planned = io.read_plan(plan)
    return planned, io.read_machine(plan.parent / planned.machine)
