"""Commands about what to change: accuracy, screen, improve."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from toolpoint import io, pages, studies
from toolpoint.app.declare import Help, Reading, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import Folder, MachineFile, Speed, ToolDirection, ToolTurn, Workers
from toolpoint.app.values import Length, Place, Plane, SourceFile
from toolpoint.io.quantities.written import read_lengths

if TYPE_CHECKING:
    from toolpoint.machine import Machine
    from toolpoint.machine.description.screening_plan import ScreeningPlan
    from toolpoint.studies.accuracy.tool_paths import PathSide

def _corners(text: str) -> tuple[tuple[float, float], tuple[float, float]]:
    left, low, right, high = read_lengths(text, 4)
    return (left, low), (right, high)


Corners = Annotated[tuple[tuple[float, float], tuple[float, float]], Reading(_corners)]
PlanFile = MachineFile
SCALES = {"depth limit": 1e-3, "position error": 1e-6}


@dataclass(frozen=True)
class MilledPath:
    """The path along which the tool goes: exactly one of a square, a line, points and a program."""

    centre: Annotated[Place, Help("Centre of the square, or zero of the program.", default="0,0,0")]
    plane: Annotated[Plane, Help("Directions of the plane, as y,z.", default="x,y", metavar="FIRST,SECOND")]
    square: Annotated[Length | None, Help("A square of this side.", metavar="200mm")] = None
    line: Annotated[tuple[Place, ...], Help("A line: twice, its start and end.", metavar="X,Y,Z")] = ()
    points: Annotated[SourceFile | None, Help("A CSV of places x,y,z (m) along which the tool goes.")] = None
    program: Annotated[SourceFile | None, Help("A G-code program; its zero lies at --centre, its plane is --plane.")] = None
    feed: Annotated[float, Help("Feed, mm/min.")] = 300.0
    law: Annotated[Literal["quintic", "jerk-limited"], Help("Motion law.")] = "quintic"

    def sides(self) -> tuple[PathSide, ...]:
        """Return the sides of the path."""
        points = None if self.points is None else io.read_places(self.points)
        path = None if self.program is None else io.read_path(self.program)
        return studies.lay_path(square_side=self.square, ends=self.line, points=points, path=path, centre=self.centre,
                                plane=self.plane, feed=self.feed / 60e3, law=self.law)


@command(page_beside_json=False)
def accuracy(run: Frame, machine: MachineFile, path: MilledPath, *, speed: Speed,
             depth: Annotated[float, Help("Depth of cut, mm.")],
             loads: Annotated[str, Help("Which loads count: the cut, gravity's changing sag, inertia of the path.",
                                        metavar="cutting,gravity,path")] = "cutting",
             regenerative: Annotated[bool, Help("The vibration feeds back on the chip.")] = False,
             window: Annotated[float | None, Help("Only so many seconds of the middle of every side.")] = None,
             work: Annotated[Corners | None, Help("A block in the plane of the path, from its zero: pixels decide what the "
                                                  "cutter meets, and what sides before have left.",
                                                  metavar="X1,Y1,X2,Y2")] = None,
             pixel: Annotated[Length, Help("Side of a pixel of the block.", default="0.1mm")],
             spacing: Annotated[Length, Help("Between nodes of the structure along the path.", default="2mm")],
             steps: Annotated[int, Help("Steps in a tooth period.", least=32)] = 100,
             drives: Annotated[SourceFile | None, Help("A drive file: motors of its axes give way as their loops let them; "
                                                       "rotary axes by their gear_ratio.")] = None,
             base: Annotated[bool, Help("Reaction of the base along the path too.")] = False,
             branch: Annotated[str, Help("Branch of an arm, as 'front up no flip'.")] = "",
             folder: Folder = None, direction: ToolDirection = None, turn: ToolTurn) -> None:
    """Milling accuracy along a path: flexible against rigid run with the cut at the moving tool, error spheres, spectra."""
    built = io.read_machine(machine)
    described = None if drives is None else io.read_drives(drives)
    setup = studies.MillingSetup(
        speed, 1e-3 * depth, tuple(loads.split(",")), regenerative, spacing, steps, window=window,
        stance=studies.ToolStance(direction, turn, branch),
        work=None if work is None else studies.WorkBlock(*work, pixel),
        servos=None if described is None else studies.servos_of(described, built), with_base=base)
    result = studies.mill_path(built, path.sides(), setup, progress=run.progress("thousandths of the path", folder),
                               folder=folder)
    cut = built.description.cutting
    run.save(pages.accuracy_page, result, 1 if cut is None else cut.tool.teeth, run.warnings)
    run.show(result)


@command(page_beside_json=False)
def screen(run: Frame, plan: PlanFile, *, workers: Workers = 0,
           scheduler: Annotated[str | None, Help("A running Dask scheduler instead, in a network that you trust.",
                                                 metavar="tcp://HOST:8786")] = None, folder: Folder = None) -> None:
    """Design changes screened by a plan (YAML): every variant's metrics, effects and their ranking with confidence."""
    planned, built = _read_plan(plan)
    result = studies.run_plan(planned, built, engine=studies.choose_engine(workers, scheduler), folder=folder,
                              progress=run.progress("variants", folder))
    run.save(pages.screening_page, result, plan.stem, run.warnings)
    run.show(result)


@command(page=False)
def improve(run: Frame, plan: PlanFile, *,
            answer: Annotated[Literal["response peak", "static compliance", "depth limit", "position error"], Help(
                "What is to be improved, at the pose of the plan.")],
            goal: Annotated[float, Help("What it shall become: m/N, or mm for a depth limit, µm for an error.")]) -> None:
    """The cheapest changes (factors of a plan with their costs) that bring the tool point to a goal, from exact slopes."""
    planned, built = _read_plan(plan)
    run.show(studies.improve_by_plan(planned, built, answer, goal=SCALES.get(answer, 1.0) * goal))


def _read_plan(plan: Path) -> tuple[ScreeningPlan, Machine]:
    planned = io.read_plan(plan)
    return planned, io.read_machine(plan.parent / planned.machine)
