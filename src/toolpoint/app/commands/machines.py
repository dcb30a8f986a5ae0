"""Commands about a machine file: report, modes, map, campbell, base."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import click

from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint.app.declare import Argument, Help, Reading, command, list_given
from toolpoint.app.dynamics import read_responses
from toolpoint.app.frame import Frame
from toolpoint.app.options import Axes, Band, Count, Folder, MachineFile, Naming, Pose, Poses, Quantity, Workers
from toolpoint.app.values import Lines, SourceFile, SpeedsFromRest
from toolpoint.io.quantities.written import read_two_names
from toolpoint.io.suffixes import MATRICES


@command(steps=6)
def report(run: Frame, machine: Annotated[SourceFile | None, Argument()] = None, *, pose: Pose = None,
           frf: Annotated[tuple[SourceFile, ...], Help(
               "Measured FRFs: universal, HDF5, MATLAB, NumPy, or text (Hz, real, imaginary); several text files, driving "
               "point first.")] = (), quantity: Quantity = None, naming: Naming, band: Band = None) -> None:
    """The page of your machine (YAML) and of your measured FRFs; either may be left out."""
    if machine is None and not frf:
        raise ToolpointError("report: neither a machine file nor --frf given; needs at least one of them")
    if machine is None and pose:
        raise ToolpointError("--pose: needs a machine file to be applied to")
    built = None if machine is None else io.read_machine_at(machine, pose)
    text = "" if machine is None else machine.read_text(encoding="utf-8-sig")
    responses = read_responses(frf, quantity, naming) if frf else None
    result = studies.study_machine_and_responses(built, responses, pose=pose, band=band, step=run.step)
    run.present(pages.first_look_page, result, source=text, file_name="" if machine is None else machine.name,
                names=[file.name for file in frf], warnings=run.warnings, notes=result.notes)
    if built is not None:
        run.suggest(*_next(built, str(machine)))


def _next(machine: Any, file: str) -> list[str]:
    """Return the commands that look at the machine elsewhere: over its first axis, and at the end of its travel."""
    # An axis without end (a spindle, a table that turns on) has no travel to lay a map over.
    axis = next((axis for axis in machine.chain.axes if abs(axis.lower) + abs(axis.upper) < 1e3), None)
    if axis is None:
        return [f"sensitivity {file}"]
    first_position, last_position = (axis.words(end).replace(" ", "") for end in (axis.lower, axis.upper))
    lobes = [] if machine.description.cutting is None else [f"lobes {file} --pose {axis.name}={last_position}"]
    return [f"map {file} --axis {axis.name}={first_position}:{last_position}:21", *lobes]


# Files of matrices may hold several: which is stiffness and which is mass cannot be told from them.
TwoNames = Annotated[tuple[str, str], Reading(read_two_names, "two names with a comma between them, such as KAA,MAA")]


@command(steps=2, page=False)
def modes(run: Frame, machine: MachineFile, *, pose: Pose = None, count: Count = 12,
          full_mesh: Annotated[bool, Help("All elements of castings and solids too, beside the reduced bodies and their stated "
                                          "error.")] = False,
          mass: Annotated[SourceFile | None, Help("Mass matrix, where MACHINE is a file of a stiffness matrix alone.")] = None,
          names: Annotated[TwoNames | None, Help("Names of stiffness and mass in files that hold several matrices.",
                                                 name="--matrices", metavar="K,M")] = None,
          units: Annotated[Literal["m-kg-s", "mm-t-s"], Help("Of the matrices: newtons a metre and kilograms, or newtons a "
                                                             "millimetre and tonnes.")] = "m-kg-s") -> None:
    """Natural frequencies of a machine file at a pose, or of stiffness and mass matrices (.full, .op4, .pch, .mtx, .hb,
    .mat, .npz)."""
    if mass is not None or machine.suffix.lower() in MATRICES:
        if pose or full_mesh:
            option = "--pose" if pose else "--full-mesh"
            raise ToolpointError(f"{option}: is of machine files; {machine} is a file of matrices, with no axes, not reduced")
        matrices = io.read_matrices(machine, mass, names=names, units=units)
        run.step("modes")
        result = studies.solve_matrix_modes(matrices, count)
        run.show(result, result.notes)
        return
    if of_matrices := list_given("names", "units"):
        raise ToolpointError(f"{of_matrices[0]}: is of files of matrices; {machine} is a machine file")
    built = io.read_machine_at(machine, pose)
    run.step("modes")
    run.show(studies.compare_full_mesh(built, pose, count) if full_mesh else studies.solve_modes(built, pose, count))


@command(page=False)
def base(run: Frame, machine: MachineFile, *, poses: Poses = ()) -> None:
    """Force and moment of the ground on a machine at rest, at one pose or several: what its feet and its floor carry."""
    built = io.read_machine_at(machine, *poses)
    run.show(studies.study_base_reactions(built, poses))


@command("map", page_beside_json=False)
def frequency_map(run: Frame, machine: MachineFile, axes: Axes, *, count: Count = 6,
                  quantity: Annotated[Literal["frequency", "static", "dynamic", "response", "motion"], Help(
                      "Natural frequencies; static or dynamic stiffness, or responses, of tool against work; motion: legs, "
                      "passive joints, parasitic shift, determinant and condition.")] = "frequency",
                  lines: Annotated[Lines | None, Help("Lines of the responses in Hz, for example 5:400:1600; over the lowest "
                                                      "twelve modes where left out.", metavar="LOW:HIGH:NUMBER")] = None,
                  frequency: Annotated[float | None, Help("Responses at this frequency alone, Hz; their greatest over all "
                                                          "lines where left out.", above=0, excludes="--lines")] = None,
                  workers: Workers = 0, folder: Folder = None) -> None:
    """Natural frequencies, or the tool's stiffness or responses, over a grid of axis positions; chatter limits: map-chatter."""
    for option, value in (("--lines", lines), ("--frequency", frequency)):
        if value is not None and quantity != "response":
            raise click.UsageError(f"{option}: is for --quantity response; {quantity} has none")
    response_lines = lines if frequency is None else [frequency]
    built = io.read_machine(machine)
    positions = io.lay_grid(built, axes)
    how: dict[str, Any] = {"engine": studies.choose_engine(workers), "folder": folder,
                           "progress": run.progress("blocks of poses", folder)}
    result: Any = (studies.map_responses(built, positions, response_lines, **how) if quantity == "response" else
                   studies.map_frequencies(built, positions, count, **how) if quantity == "frequency" else
                   studies.map_motion(built, positions, **how) if quantity == "motion" else
                   studies.map_stiffness(built, positions, quantity, **how))
    run.warnings += result.failed()
    run.present(pages.map_page, result, built.name, notes=getattr(result, "notes", ()), has_answer=False)


@command(steps=3)
def campbell(run: Frame, machine: MachineFile, *,
             speeds: Annotated[SpeedsFromRest, Help("Spindle speeds, rev/min.", default="0:24000:25",
                                                    metavar="FIRST:LAST:NUMBER")],
             count: Count = 8,
             orders: Annotated[tuple[float, ...], Help("Excitations per revolution; several times.",
                                                       name="--order")] = (1.0, 2.0), pose: Pose = None) -> None:
    """Natural frequencies of a machine with spinning bodies over the spindle speed, whirl and critical speeds."""
    built = io.read_machine_at(machine, pose)
    run.step("modes at every speed")
    run.present(pages.campbell_page, studies.map_speeds(built, speeds, count, pose=pose, orders=orders), has_answer=False)
