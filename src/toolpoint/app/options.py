"""Options and groups of options that several commands share, each declared once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from toolpoint.app.declare import Argument, Help, Reading
from toolpoint.app.values import Angle, AxisPositions, AxisRange, Direction, KeptFolder, SourceFile, Span, SpindleSpeeds
from toolpoint.io.quantities.written import read_pairs

MachineFile = Annotated[SourceFile, Argument()]
Files = Annotated[tuple[SourceFile, ...], Argument()]
Pose = Annotated[AxisPositions | None, Help("Axis positions; m or rad where no unit is written.", metavar="X=0.1,Y=200mm")]
Poses = Annotated[tuple[AxisPositions, ...], Help("Axis positions of a measurement (m or rad without a unit); several times, "
                                                  "in the order of files.", name="--pose", metavar="X=0.1,Y=200mm")]
Axes = Annotated[tuple[AxisRange, ...], Help("Axis with first position, last position and number of positions (m or rad "
                                             "without a unit); several times.", name="--axis", metavar="X=-300mm:300mm:9")]
Band = Annotated[Span | None, Help("Part of the measured lines to use, Hz.", metavar="LOW:HIGH")]
Quantity = Annotated[Literal["receptance", "mobility", "accelerance"] | None, Help(
    "What FRF files hold that do not say; text: receptance, MATLAB: accelerance where left out.")]
Speeds = Annotated[SpindleSpeeds | None, Help("Spindle speeds, rev/min.", metavar="3000:20000:200")]
Speed = Annotated[float, Help("Spindle speed, rev/min.")]
Depth = Annotated[float, Help("Axial depth of cut, mm.", scale=1e-3)]
Count = Annotated[int, Help("How many of the lowest modes.", minimum=1)]
Workers = Annotated[int, Help("Worker processes (extra 'cluster'); 0 is this process.", minimum=0)]
Folder = Annotated[KeptFolder | None, Help("Keep finished parts here and resume from them.")]
GEOMETRY = "Universal file, CSV (point,x,y,z in m), or machine YAML."
Geometry = Annotated[SourceFile | None, Help(GEOMETRY)]
ToolDirection = Annotated[Direction | None, Help("Where the tool's axis points, away from the work: ±x, ±y, ±z or three "
                                                 "numbers; as at the reference pose where left out.", metavar="-x")]
ToolTurn = Annotated[Angle, Help("Turn about the tool's axis.", default="0deg")]
ArmBranch = Annotated[str, Help("Branch of an arm, as 'front up no flip', 'front, elbow up' or 'front up, wrist turned "
                                "least'; the nearest to rest where left out.")]
Variables = Annotated[Mapping[str, str], Reading(lambda text: read_pairs(
    text, str, "NAME=VARIABLE, several parted by commas, for example frequency=f,values=H"))]


@dataclass(frozen=True)
class Naming:
    """Measurements named by files and variables."""

    name: Annotated[str | None, Help("Where names of text files say what was measured and struck: Point_{output}_*, or "
                                     "P{input}_at_{output}.", metavar="PATTERN")] = None
    struck: Annotated[str | None, Help("With --name: the side (struck or measured) that names of files do not say.",
                                       metavar="POINT:DIRECTION", needs="--name")] = None
    variables: Annotated[Variables | None, Help("Variables of MATLAB and NumPy files that hold lines (Hz) and responses.",
                                                metavar="frequency=f,values=H")] = None

    @property
    def keywords(self) -> dict[str, Any]:
        """Keywords of the reads of `io`."""
        return {"pattern": self.name, "struck": self.struck, "variables": self.variables or {}}
