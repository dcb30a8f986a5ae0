"""Commands about drives: drive (along a program or a circle, over a map, in steps, tuned, or as a unit) and servo-data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from toolpoint import drives as servos
from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, mark_notes
from toolpoint.app.declare import Argument, Help, Reading, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import Pose
from toolpoint.app.values import AxisPositions, AxisRange, Length, NewFile, SourceFile
from toolpoint.io.quantities.written import read_axis_names, read_circle, read_pairs, read_servo_step
from toolpoint.machine.description.project_plan import ContourGoal

if TYPE_CHECKING:
    from toolpoint.drives.description import DriveDescription
    from toolpoint.machine import Machine

Circle = Annotated[tuple[float, float], Reading(read_circle, "RADIUS,FEED in mm and mm/min, for example 50,4000")]
TwoAxes = Annotated[tuple[str, str], Reading(read_axis_names, "two axes, as X,Z")]
Step = Annotated[tuple[str, str, float, bool], Reading(
    read_servo_step, "AXIS:LEVEL=HEIGHT, for example X:velocity=500mm/min, X:position=0.5mm, X:current=2A or X:current=3%")]
Unit = Annotated[dict[str, str], Reading(lambda text: read_pairs(text, str, "COLUMN=UNIT, for example pos=mm"))]


@command(steps=4, replace=True)
def drive(run: Frame, drives: Annotated[SourceFile, Argument()], *,
          program: Annotated[SourceFile | None, Help("G-code (ISO and the common Siemens words), mm.",
                                                     excludes="--circle")] = None,
          circle: Annotated[Circle | None, Help("A circular test instead, mm and mm/min.", metavar="RADIUS,FEED")] = None,
          plane: Annotated[TwoAxes | None, Help("Axes of the circle; X,Y where left out.", metavar="X,Z",
                                                needs="--circle")] = None,
          deviation: Annotated[Length | None, Help("Radial deviation that the circle may have; where it has more, gains and "
                                                   "feeds that meet it are looked for.", metavar="10um",
                                                   needs="--circle")] = None,
          machine: Annotated[SourceFile | None, Help("Machine file whose structure the drives push against.")] = None,
          pose: Pose = None,
          grid: Annotated[tuple[AxisRange, ...], Help("Margins and bandwidth over positions of the machine, with --circle its "
                                                      "deviation too; one or two axes.", name="--map", metavar="X=-0.3:0.3:7",
                                                      needs="--machine, a map needs the machine")] = (),
          ideal: Annotated[tuple[str, ...], Help("An axis of the program that DRIVES lacks and that follows without error; "
                                                 "without it such an axis may only position.", metavar="AXIS")] = (),
          feed: Annotated[float | None, Help("Feed of cuts before the program's first F.", metavar="MM/MIN", above=0,
                                             scale=1 / 60e3)] = None,
          cutter_radius: Annotated[float | None, Help("Radius of the tool for G41 and G42 of the program, mm; 0 where it holds "
                                                      "the path of the centre.", scale=1e-3, minimum=0,
                                                      needs="--program")] = None,
          steps: Annotated[tuple[Step, ...], Help(
              "Step test instead: set point of the current (A, or % of its limit), velocity or position loop, the loops "
              "outside it open; several times.", name="--step", metavar="X:velocity=500mm/min")] = (),
          tune: Annotated[bool, Help("Largest gains that keep the margins, before and after, with a notch where one "
                                      "helps.")] = False,
          phase_margin: Annotated[float, Help("With --tune: phase margin of the velocity loops, degrees.")] = 45.0,
          gain_margin: Annotated[float, Help("With --tune: gain margin of the velocity loops, dB.")] = 8.0,
          save: Annotated[NewFile | None, Help("With --tune: write the drive file with the new gains here.",
                                               needs="--tune")] = None,
          fmu: Annotated[NewFile | None, Help("Write the servo as a co-simulation unit (FMI 2.0) here.")] = None,
          fmu_sources: Annotated[bool, Help("The unit with its C sources only: no compiler needed here.")] = False) -> None:
    """Contour error, torque and loops of a servo along a program or a circle; DRIVES is a YAML file of axes and control.
    Rotary axes (kind reducer) have no path of their own: without a path their loops are shown."""
    description = io.read_drives(drives)
    built = None if machine is None else io.read_machine_at(machine, pose)
    # Each of these is a study of its own: the first that is asked for is all that the command does.
    if grid and built is not None:
        positions = io.lay_grid(built, grid)
        mapped = studies.map_servo(description, machine=built, grid=positions, circle=circle, progress=run.progress("poses"))
        run.present(pages.servo_map_page, mapped, warnings=run.warnings)
        return
    if steps:
        settings = [studies.StepSetting(*step) for step in steps]
        result = studies.step_drives(description, settings, machine=built, pose=pose)
        run.present(pages.step_page, result, warnings=run.warnings)
        return
    if tune:
        tuned = studies.tune_drives(description, studies.TuningTarget(phase_margin, gain_margin), machine=built, pose=pose,
                                    progress=run.step)
        run.write("Drive file", save, io.write_gains, drives, tuned.drives)
        run.present(pages.tuning_page, tuned, warnings=run.warnings)
        return
    if deviation is not None and circle is not None:
        goal = ContourGoal(*circle, deviation, plane or ("X", "Y"), pose or {})
        run.steps += 1  # gains and feeds are looked for
        study = studies.study_circle(description, goal, machine=built, progress=run.step)
        run.present(pages.circle_page, study, source_text=drives.read_text(encoding="utf-8-sig"), warnings=run.warnings)
        return
    # The unit is written before the path is run: it does not depend on the run, and may be all that is asked for.
    doubts = [] if fmu is None else _export(run, description, built, pose, fmu, fmu_sources)
    if program is None and circle is None:
        if fmu is None:
            _show_loops(run, description)
        elif run.as_json:
            run.show_json({"doubts": doubts, "unit": str(fmu)})
        else:
            run.show_text(*mark_notes(doubts))
            run.show_rest()
        return
    parsed_program = None if program is None else io.read_program(program, feed=feed, cutter_radius=cutter_radius)
    path, remarks = (None, ()) if parsed_program is None else (parsed_program.path, parsed_program.notes)
    experiment = studies.run_drives(description, path=path, circle=circle, plane=plane or ("X", "Y"), machine=built,
                                    pose=pose, ideal=ideal, remarks=remarks, progress=run.step)
    # The page has the notes of the result by itself; the terminal prints them before the warnings.
    warned, run.warnings[:0] = list(run.warnings), experiment.notes
    run.present(pages.drive_page, experiment, source_text=drives.read_text(encoding="utf-8-sig"), warnings=warned,
                has_answer=False)


def _show_loops(run: Frame, description: DriveDescription) -> None:
    """Print the loops of rotary axes, which have no path of their own."""
    if any(axis.mechanics.kind != "reducer" for axis in description.axes.values()):
        raise ToolpointError("drive: give either --program FILE or --circle RADIUS,FEED")
    run.show(servos.compute_loops(servos.build_servo(description)))


def _export(run: Frame, description: DriveDescription, machine: Machine | None, pose: AxisPositions | None, unit: Path,
            sources_only: bool) -> list[Doubt]:
    """Write the servo as a functional mock-up unit (FMI 2.0, co-simulation), and return the doubts that it repeats."""
    servo = servos.build_servo(description, studies.structure_of(description, machine, pose))
    if any(axis.mechanics.nut_moves for axis in description.axes.values()):
        run.warnings.append("nut_moves: the unit keeps every nut at its nut_position")
    doubts = studies.question_structure(description, machine, pose)
    run.write("Unit", unit, lambda path: io.write_unit(servo, path, description.name, substeps=description.substeps,
                                                       binary=not sources_only, notes=doubts))
    return doubts


@command(steps=2)
def servo_data(run: Frame, file: Annotated[SourceFile, Argument()], *,
               units: Annotated[tuple[Unit, ...], Help("Unit of a column of a table that names none.", name="--unit",
                                                       metavar="COLUMN=UNIT")] = (),
               sample_time: Annotated[float | None, Help("s; of a table without a time column.", above=0)] = None) -> None:
    """Friction, K_v, following error, loop margins or positioning from a controller's record FILE (Sinumerik, TNCscope, TwinCAT
    Scope, ISO 230-2 runs, tables)."""
    record = io.read_servo_data(file, {column: unit for pair in units for column, unit in pair.items()}, sample_time)
    result = studies.judge_servo_data(record, source=file.name)
    run.present(pages.servo_data_page, result, warnings=run.warnings)
