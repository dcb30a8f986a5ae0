"""Commands about tools that are joined to a spindle on paper: rcsa."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint.app.cut_options import CutValues
from toolpoint.app.declare import Argument, Help, Printed, command
from toolpoint.app.dynamics import read_responses
from toolpoint.app.frame import Frame
from toolpoint.app.options import Pose, Quantity, Speeds
from toolpoint.app.values import LengthRange, Lines, NewFile, SourceFile
from toolpoint.cutting.description import PARAMETERS

if TYPE_CHECKING:
    from toolpoint.substructuring import PlaneReceptance

CHARTED = np.linspace(3000, 20000, 60)  # rev/min


@dataclass(frozen=True)
class Spindle:
    """Where the spindle comes from: a gauge that was struck in it, responses with rotations, or a machine file."""

    frf: Annotated[tuple[SourceFile, ...], Help("Measured responses: of a gauge's stations (with --gauge), or of the spindle "
                                                "with its rotations (with --at).")] = ()
    gauge: Annotated[SourceFile | None, Help("Shaft file of the gauge that was in the spindle, with its stations.")] = None
    machine: Annotated[SourceFile | None, Help("Machine file: the spindle is computed, at the point --at.")] = None
    point: Annotated[str | None, Help("Point where the tool begins.", name="--at", metavar="POINT")] = None
    pose: Pose = None
    lines: Annotated[Lines | None, Help("Lines (Hz) of a computed spindle; 20:6000:5981 where left out.",
                                        metavar="LOW:HIGH:NUMBER")] = None
    noise: Annotated[float | None, Help("Standard deviation of measured responses, percent of each, where the files state "
                                        "none.", metavar="PERCENT")] = None

    def __post_init__(self) -> None:
        """Refuse none and several."""
        if bool(self.frf) == (self.machine is not None):
            raise ToolpointError("spindle: neither or both of --frf and --machine given; give --frf FILES --gauge GAUGE.yaml, "
                                 "--frf FILES --at POINT, or --machine FILE --at POINT")
        if (self.gauge is None) == (self.point is None):
            raise ToolpointError("--gauge, --at: one of them must be there: a gauge whose stations were struck, or the point "
                                 "where rotations are known")
        if self.machine is not None and self.point is None:
            raise ToolpointError("--at: missing; a computed spindle needs the point where the tool begins")

    def read(self, quantity: str | None, draws: int, generator: np.random.Generator) -> list[PlaneReceptance]:
        """Return the spindle's receptances, the likeliest and the draws."""
        if self.machine is not None and self.point is not None:
            built = io.read_machine_at(self.machine, self.pose)
            return studies.bases_of_machine(built, self.point, self.lines, pose=self.pose)
        measured = read_responses(self.frf, quantity)
        if self.gauge is None:
            assert self.point is not None
            return studies.bases_of_responses(measured, self.point, draws=draws, generator=generator)
        gauge = io.read_shaft(self.gauge)
        return studies.bases_from_gauge(measured, gauge, draws=draws, generator=generator,
                                        noise=None if self.noise is None else self.noise / 100)


@command(replace=True, printed=Printed("--schema", "Print the JSON schema of shaft files, for editors, and end.",
                                       lambda: json.dumps(io.json_schema("shaft"), indent=2)))
def rcsa(run: Frame, tool: Annotated[SourceFile, Argument()], spindle: Spindle, *,
         stick_out: Annotated[LengthRange | None, Help("Also at other lengths of a segment: first, last, number.",
                                                       metavar="SEGMENT=30mm:80mm:6")] = None,
         lobes: Annotated[bool, Help("Also stability lobes; the cut is given by the options below.")] = False,
         speeds: Speeds = None, draws: Annotated[int, Help("Equally likely spindles and tools.", least=20)] = 200,
         seed: Annotated[int, Help("Of the random draws.")] = 1, quantity: Quantity = None, cut: CutValues,
         save: Annotated[NewFile | None, Help("Save the tool-point responses here: universal (.uff) or HDF5 (.h5) "
                                              "file.")] = None) -> None:
    """Receptance coupling: the tool-point response of a tool that was never measured, with its 95 % interval.

    TOOL is a shaft file: segments from the spindle to the tip. The spindle comes from a gauge that was struck in it, from
    responses with rotations, or from a machine file.
    """
    if cut and not lobes:
        raise ToolpointError(f"--{PARAMETERS[next(iter(cut))].option} is of a cut: add --lobes")
    shaft, generator = io.read_shaft(tool), np.random.default_rng(seed)
    bases = spindle.read(quantity, draws, generator)
    result = studies.study_tool(bases, shaft, cut=cut if lobes else None,
                                stick_out=None if stick_out is None else (stick_out.name, stick_out.positions),
                                speeds=CHARTED if speeds is None else speeds, generator=generator,
                                progress=run.progress_of_parts())
    run.save(pages.tool_coupling_page, result, run.warnings)
    if save is not None:
        io.write_frf(result.frf, save)
    run.show(result, result.notes, {"Responses": save})
