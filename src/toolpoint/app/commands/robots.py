"""Commands about robots and other machines that put a tool to places: robot, reach, region, export."""

from __future__ import annotations

from typing import Annotated, Literal

from toolpoint import io, pages, studies
from toolpoint.app import console
from toolpoint.app.declare import Argument, Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import Count, MachineFile, Pose, ToolDirection, ToolTurn
from toolpoint.app.values import Length, LengthRange, NewFile, Place, SourceFile


@command(steps=2, replace=True, page_beside_json=False)
def robot(run: Frame, datasheet: Annotated[SourceFile, Argument()], *, pose: Pose = None,
          written: Annotated[NewFile | None, Help("Write the machine here.", name="--machine")] = None) -> None:
    """A robot from its datasheet (YAML): gear ratios, reducers, density, forces on the base, and the machine they make, its
    reducers about gravity's load at the pose."""
    run.step("datasheet")
    sheet, description = io.read_datasheet(datasheet), io.read_robot_machine(datasheet, pose=pose)
    result = studies.study_datasheet(sheet, description, pose=pose)
    if written is not None:
        io.write_machine(description, written)
    run.step("page")
    run.save(pages.robot_page, result, datasheet.read_text(encoding="utf-8-sig"), datasheet.name)
    run.show(result, written={"Machine file": written})


@command(page=False)
def reach(run: Frame, machine: MachineFile, *, tip: Annotated[Place, Help("Where the tip shall be, from the table point.",
                                                                          metavar="600mm,0,300mm")],
          direction: ToolDirection = None, turn: ToolTurn, count: Count = 4) -> None:
    """All poses that bring the tool to a place: axes, distance to singular poses, holding torque, natural frequencies."""
    built = io.read_machine(machine)
    run.show(studies.study_reach(built, tip, direction, turn=turn, modes=count))


@command(steps=3, page_beside_json=False)
def region(run: Frame, machine: MachineFile, *,
           along: Annotated[tuple[LengthRange, ...], Help("Places along x, y or z: first, last, number; once for a line, twice "
                                                          "for a plane, three times for a volume.", metavar="x=300mm:700mm:9")],
           origin: Annotated[Place, Help("Where all places are zero.", default="0,0,0")],
           quantity: Annotated[Literal["frequency", "static", "dynamic", "depth"], Help(
               "Natural frequencies, stiffness of the tool, or the lowest stable depth.")] = "frequency", count: Count = 4,
           length: Annotated[Length, Help("Length of the segment that is searched; 0 for the map alone.", default="200mm")],
           directions: Annotated[int, Help("Directions of segments in the plane, evenly over half a turn.", least=1)] = 4,
           feed_directions: Annotated[int, Help("Feed directions of a depth.", least=1)] = 1,
           point: Annotated[str, Help("Another point of the tool's body in place of the tip.")] = "",
           branch: Annotated[str, Help("Branch of an arm, as 'front up no flip'; the nearest where left out.")] = "",
           direction: ToolDirection = None, turn: ToolTurn) -> None:
    """A quantity over places of the tool, and the straight segment over which it is most even: the best place to mill."""
    built = io.read_machine(machine)
    asked = studies.PlaceQuantity.over_feeds(quantity, count, feed_directions)
    result = studies.study_region(
        built, studies.place_grid({axis.name: axis.positions for axis in along}, origin), asked,
        length=length, directions=directions, direction=direction, turn=turn, branch=branch, point=point, step=run.step)
    run.step("page")
    run.save(pages.place_page, result.map, result.search, machine.stem)
    run.show(result)


@command(replace=True)
def export(machine: MachineFile, target: Annotated[NewFile, Argument()], *, pose: Pose = None) -> None:
    """A machine at a pose for multibody programs: MuJoCo (target.xml) or a script for Exudyn (target.py)."""
    io.write_multibody(io.read_machine_at(machine, pose), target, pose)
    console.text(f"Written: {target}")
