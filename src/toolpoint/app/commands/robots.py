"""Commands about robots and other machines that put a tool to places: robot, reach, region."""

from __future__ import annotations

from pathlib import Path

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, NEW_FILE, OUTPUT, POSE, REPLACE
from toolpoint.app.place_options import DIRECTION, TURN, direction_of, numbers_of


@click.command()
@click.argument("datasheet", type=FILE)
@click.option("--machine", "written", type=NEW_FILE, help="Write the machine here.")
@REPLACE
@OUTPUT
@JSON
def robot(datasheet: Path, written: Path | None, output: Path, as_json: bool) -> None:
    """A robot from its datasheet (YAML): gear ratios, reducers, density, forces on the base, and the machine they make."""
    from toolpoint.io.yaml import machine_file, robot_file

    with frame(None if as_json else output, as_json, steps=2) as run:
        run.step("datasheet")
        sheet, description = robot_file.read(datasheet), robot_file.read_robot_machine(datasheet)

        from toolpoint.pages.robots.robot import robot_page
        from toolpoint.studies.robots.datasheet_study import study_datasheet

        result = study_datasheet(sheet, description)
        if written is not None:
            machine_file.write(description, written)
        run.step("page")
        if not as_json:
            run.save(robot_page(result, datasheet.read_text(encoding="utf-8-sig"), datasheet.name))
    run.show(result, written={"Machine file": written})


@click.command()
@click.argument("machine", type=FILE)
@click.option("--tip", required=True, metavar="600mm,0,300mm", help="Where the tip shall be, from the table point.")
@DIRECTION
@TURN
@click.option("--count", type=click.IntRange(1), default=4, show_default=True, help="How many of the lowest modes.")
@JSON
def reach(machine: Path, tip: str, direction: str | None, turn: str, count: int, as_json: bool) -> None:
    """All poses that bring the tool to a place: axes, distance to singular poses, holding torque, natural frequencies."""
    from toolpoint.io.yaml import machine_file

    with frame(None, as_json) as run:
        built = machine_file.read(machine)

        from toolpoint.studies.robots.reach_study import study_reach

        result = study_reach(built, numbers_of(tip, "--tip", 3), direction_of(direction, "--direction"),
                             turn=numbers_of(turn, "--turn", 1, True)[0], modes=count)
    run.show(result)


@click.command()
@click.argument("machine", type=FILE)
@click.option("--along", "lines", multiple=True, required=True, metavar="x=300mm:700mm:9",
              help="Places along x, y or z: first, last, number; once for a line, twice for a plane, three times for a volume.")
@click.option("--origin", default="0,0,0", show_default=True, help="Where all places are zero.")
@click.option("--quantity", type=click.Choice(["frequency", "static", "dynamic", "depth"]), default="frequency",
              show_default=True, help="Natural frequencies, stiffness of the tool, or the lowest stable depth.")
@click.option("--count", type=click.IntRange(1), default=4, show_default=True, help="How many of the lowest modes.")
@click.option("--length", default="200mm", show_default=True,
              help="Length of the segment that is searched; 0 for the map alone.")
@click.option("--directions", type=click.IntRange(1), default=4, show_default=True,
              help="Directions of segments in the plane, evenly over half a turn.")
@click.option("--feed-directions", type=click.IntRange(1), default=1, show_default=True, help="Feed directions of a depth.")
@click.option("--point", default="", help="Another point of the tool's body in place of the tip.")
@click.option("--branch", default="", help="Branch of an arm, as 'front up no flip'; the nearest where left out.")
@DIRECTION
@TURN
@OUTPUT
@JSON
def region(machine: Path, lines: tuple[str, ...], origin: str, quantity: str, count: int, length: str, directions: int,
           feed_directions: int, point: str, branch: str, direction: str | None, turn: str, output: Path,
           as_json: bool) -> None:
    """A quantity over places of the tool, and the straight segment over which it is most even: the best place to mill."""
    from toolpoint.app.poses import line_of
    from toolpoint.io.yaml import machine_file

    built = machine_file.read(machine)

    import numpy as np

    from toolpoint.pages.robots.places import place_page
    from toolpoint.studies.robots.place_map import PlaceQuantity, map_places, place_grid
    from toolpoint.studies.robots.regions import plane_directions, search_regions

    along = {name: np.linspace(first, last, number) for name, first, last, number in (line_of(t, "--along") for t in lines)}
    grid = place_grid(along, numbers_of(origin, "--origin", 3))
    feeds = tuple(float(v) for v in np.pi * np.arange(feed_directions) / feed_directions)
    asked = PlaceQuantity(quantity, count, feeds)
    way, turned = direction_of(direction, "--direction"), numbers_of(turn, "--turn", 1, True)[0]
    size = numbers_of(length, "--length", 1)[0]
    with frame(None if as_json else output, as_json, steps=3) as run:
        run.step("map over places")
        result = map_places(built, grid, asked, direction=way, turn=turned, branch=branch, point=point)
        search = None
        if size > 0:
            run.step("segments")
            units = dict(zip("xyz", np.eye(3), strict=True))
            first, second = (list(grid.names) * 2)[:2]
            ways = units[first][None] if len(grid.names) == 1 else plane_directions(units[first], units[second], directions)
            search = search_regions(built, grid.places.reshape(-1, 3), ways, length=size, quantity=asked, direction=way,
                                    turn=turned, branch=branch, point=point)
        run.step("page")
        if not as_json:
            run.save(place_page(result, search, machine.stem))
    if as_json:
        run.show_json({"map": result.to_dict(), "search": None if search is None else search.to_dict()})
        return
    run.print_table(result)
    if search is not None:
        run.print_table(search)
    run.show_rest()


@click.command()
@click.argument("machine", type=FILE)
@click.argument("target", type=NEW_FILE)
@POSE
@REPLACE
def export(machine: Path, target: Path, pose: dict[str, float] | None) -> None:
    """A machine at a pose for multibody programs: MuJoCo (target.xml) or a script for Exudyn (target.py)."""
    from toolpoint.app import console
    from toolpoint.app.poses import machine_at

    if target.suffix not in (".xml", ".py"):
        raise ToolpointError(f"{target}: must end in .xml (MuJoCo) or .py (Exudyn)")
    built = machine_at(machine, pose)

    from toolpoint.io.multibody import exudyn_script, mjcf

    {".xml": mjcf.write, ".py": exudyn_script.write}[target.suffix](built, target, pose)
    console.text(f"Written: {target}")
