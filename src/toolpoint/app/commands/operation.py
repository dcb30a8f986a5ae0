"""Commands about a machine at work: operational."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from toolpoint import io, pages, studies
from toolpoint.app.declare import Help, Reading, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import Band, Files, Geometry, Pose, Variables
from toolpoint.app.values import NewFile, SourceFile
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
