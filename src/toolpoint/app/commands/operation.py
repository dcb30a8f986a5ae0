"""Commands about a machine at work: operational, traverse, axis-test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from toolpoint import io, pages, signals, studies
from toolpoint._check import ToolpointError
from toolpoint.app.declare import Argument, Help, Reading, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import Band, Files, Geometry, Pose, Variables
from toolpoint.app.values import AxisRange, NewFile, SourceFile
from toolpoint.io.quantities.written import read_masses

Masses = Annotated[dict[str, float], Reading(read_masses, "a mass at a degree of freedom, for example tip:+x=0.5kg")]


@dataclass(frozen=True)
class ScaleOptions:
    """Options of `operational` that give the scale of the modes: one of three ways, or none."""

    loaded: Annotated[tuple[SourceFile, ...], Help("Scale: records of the same channels with known masses added; several "
                                                   "times.")] = ()
    masses: Annotated[tuple[Masses, ...], Help("Scale: such a mass, in every measured direction of its point; several times.",
                                               name="--mass", metavar="POINT:DIRECTION=MASS")] = ()
    blow: Annotated[SourceFile | None, Help("Scale: the driving-point response of one hammer blow at a measured point (any "
                                            "format of `toolpoint identify`).")] = None
    machine: Annotated[SourceFile | None, Help("Scale: the machine file (YAML); its points bear the names of the "
                                               "channels.")] = None
    pose: Pose = None


@command(steps=3, replace=True)
def operational(run: Frame, files: Files, *, geometry: Geometry = None,
                channel: Annotated[tuple[str, ...], Help("What a channel (by name or number) measures, where, its sensitivity; "
                                                         "several times.", metavar="'1=acceleration 5:+x 100mV/g'")] = (),
                rate: Annotated[float | None, Help("Samples per second, Hz, where the files do not say it.")] = None,
                variables: Annotated[Variables | None, Help("Variables of MATLAB and NumPy files (time, rate, samples).",
                                                            metavar="time=t,samples=y")] = None,
                references: Annotated[tuple[str, ...], Help("A channel that the others are correlated with; several times. All "
                                                            "where left out, or those that all set-ups share.",
                                                            name="--reference", metavar="POINT:DIRECTION")] = (),
                method: Annotated[Literal["ssi-cov", "ssi-data"], Help("Identification method.")] = "ssi-cov",
                band: Band = None,
                keep_harmonics: Annotated[bool, Help("Leave the lines of rotating parts in the records.")] = False,
                modes: Annotated[NewFile | None, Help("Save the modes here (HDF5).", name="-m --modes")] = None,
                scale: ScaleOptions) -> None:
    """Modes of a machine at work: from accelerations, velocities or displacements alone, no force is measured.

    FILES are records (universal 58, CSV, LVM, WAV, TDMS, MATLAB, NumPy, HDF5) of ten minutes or so under random loads.
    Records with other channels are further set-ups; they share the channels that stayed. Lines of rotating parts are found,
    taken off, and listed: they are no modes. `toolpoint correlate`, `update` and `joints` take what --modes saves.
    """
    named = None if variables is None else dict(variables)
    records = io.read_records(files, channel, rate=rate, variables=named)
    loaded = io.read_records(scale.loaded, channel, rate=rate, variables=named) if scale.loaded else None
    shape = None if geometry is None else io.read_geometry(geometry)
    masses = {dof: mass for part in scale.masses for dof, mass in part.items()}
    blow = None if scale.blow is None else io.read_frf([scale.blow])
    machine = None if scale.machine is None else io.read_machine_at(scale.machine, scale.pose)
    run.step("identification")
    result = studies.study_operational(records, method, references=references or None, band=band, keep_harmonics=keep_harmonics,
                                       loaded=loaded, masses=masses, blow=blow, machine=machine)
    run.step("page")
    run.write("Modes", modes, io.write_nouns, result.modes)
    run.save(pages.operational_page, result, shape, [file.name for file in files], warnings=run.warnings)
    run.show(result, [*result.doubts, *result.notes])


@command(steps=3)
def traverse(run: Frame, files: Files, *,
             travel: Annotated[AxisRange | None, Help("Steady travel of an axis during one file, and the number of windows to "
                                                      "cut it into.", metavar="Y=-250mm:250mm:10")] = None,
             value: Annotated[tuple[float, ...], Help("In place of --travel: what each file was taken at, such as the speed of "
                                                      "the axis; once for each file, in their order.")] = (),
             quantity: Annotated[str, Help("Name and unit of --value.", needs="--value")] = "speed",
             channel: Annotated[tuple[str, ...], Help("What a channel (by name or number) measures, where, its sensitivity; "
                                                      "several times.", metavar="'1=acceleration 5:+x 100mV/g'")] = (),
             rate: Annotated[float | None, Help("Samples per second, Hz, where the files do not say it.")] = None,
             band: Band = None,
             machine: Annotated[SourceFile | None, Help("The machine file (YAML): what it predicts at each pose, and which "
                                                        "joint changes; its points bear the names of the channels.")] = None,
             pose: Pose = None) -> None:
    """Modes of a machine over the travel or the speed of an axis, from its vibration while it moves.

    FILES are one record of a long steady traverse, with --travel, or one record for each --value. No force is measured; loads
    must be random. With --machine the courses stand beside what the file predicts, and the joint is named that must change on
    the way.
    """
    records = io.read_records(files, channel, rate=rate)
    built = None if machine is None else io.read_machine_at(machine, pose)
    if (travel is None) == (not value):
        raise ToolpointError("--travel and --value: must be one of them")
    if travel is not None and len(records.records) != 1:
        raise ToolpointError(f"--travel: {len(records.records)} records; must be one; give --value for each of several")
    if value and len(value) != len(records.records):
        raise ToolpointError(f"--value: {len(value)} values for {len(records.records)} records; must be one for each")
    run.step("identification")
    if travel is not None:
        windows = studies.cut_windows(records.records[0], (float(travel.first), float(travel.last)), travel.number)
        poses = [{**(pose or {}), travel.name: window.value} for window in windows]
        quantity = f"{travel.name}, m"
    else:
        ordered = sorted(zip(value, records.records, strict=True), key=lambda pair: pair[0])
        windows = [studies.TraverseWindow(record, each) for each, record in ordered]
        poses = [dict(pose or {}) for _ in windows]
    result = studies.study_traverse(windows, quantity=quantity, machine=built, poses=None if built is None else poses,
                                    band=band)
    run.step("page")
    run.save(pages.traverse_page, result, ", ".join(file.name for file in files), warnings=run.warnings)
    run.show(result, [*result.doubts, *result.notes])


@command(steps=3)
def axis_test(run: Frame, file: Annotated[SourceFile, Argument()], *,
              moving: Annotated[SourceFile | None, Help("The same test while the axis moves steadily; FILE is the standing "
                                                        "one.")] = None,
              set_point: Annotated[str, Help("Column (name or number) of the set point that carried noise or a chirp.")],
              force: Annotated[str, Help("Column of the motor's force, torque or current.")],
              newtons: Annotated[float, Help("Newtons at the axis in one unit of that column.")] = 1.0,
              at_force: Annotated[str, Help("Where and in which direction the force acts.", name="--at",
                                            metavar="POINT:DIRECTION")] = "motor:+x",
              channel: Annotated[tuple[str, ...], Help("What a further column (by name or number) measures, where, its "
                                                       "sensitivity; several times.", metavar="'3=velocity table:+y'")] = (),
              rate: Annotated[float | None, Help("Samples per second, Hz, where the file does not say it.")] = None,
              resolution: Annotated[float, Help("Line spacing, Hz.", above=0)] = 0.5,
              band: Band = None,
              machine: Annotated[SourceFile | None, Help("The machine file (YAML): the damping of the axis's joint is judged "
                                                         "by its strain energies.", needs="--joint")] = None,
              joint: Annotated[str | None, Help("Joint of the axis in the machine file.", needs="--machine")] = None,
              pose: Pose = None) -> None:
    """Modes and damping of an axis that shook itself: set-point noise or a chirp is the excitation.

    FILE is a record (any format of `toolpoint frf`) with the set point that was sent, the motor's force or current, and
    motions. The controller and loads besides the set point do not bias the responses. With --moving the axis that stands is
    compared with the one that moves.
    """
    columns = io.AxisColumns(set_point, force, newtons, at_force)
    records = {name: io.read_driven_axis(path, columns, channel, rate=rate)
               for name, path in (("standing", file), ("moving", moving)) if path is not None}
    built = None if machine is None else io.read_machine_at(machine, pose)
    run.step("identification")
    tests = {name: signals.driven_axis_test(noise, record, resolution, band=band) for name, (noise, record) in records.items()}
    result = studies.study_driven_axis(tests, machine=built, joint=joint, pose=pose)
    run.step("page")
    run.save(pages.driven_axis_page, result, file.name, warnings=run.warnings)
    run.show(result, [*result.doubts])
