"""Source of the dynamics of a cut: options, and the reads that they stand for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint.app.declare import Argument, Help, list_given
from toolpoint.app.options import Band, Naming, Pose, Quantity
from toolpoint.app.values import SourceFile
from toolpoint.io.suffixes import HDF5, MATLAB, NUMPY, TEXT, UNIVERSAL
from toolpoint.project.limits.line_draws import read_work_file

if TYPE_CHECKING:
    from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
    from toolpoint.vibration import Frf


@dataclass(frozen=True)
class Dynamics:
    """Source of the dynamics of a cut: a machine file at a pose, FRF files, an FRF for each direction, or saved modes."""

    naming: Naming
    machine: Annotated[SourceFile | None, Argument()] = None
    pose: Pose = None
    frf: Annotated[tuple[SourceFile, ...], Help("Measured tool-tip FRFs (universal, HDF5, MATLAB, NumPy, text); one response "
                                                "serves x and y alike.")] = ()
    frf_x: Annotated[SourceFile | None, Help("Measured FRF along x (the feed), one response; with --frf-y.")] = None
    frf_y: Annotated[SourceFile | None, Help("Measured FRF along y.", needs="--frf-x, give the FRF along x too (for one "
                                             "direction: --frf)")] = None
    frf_xy: Annotated[SourceFile | None, Help("Cross FRF of x and y, taken as symmetric; none where left out.",
                                              needs="--frf-y, the cross FRF needs both directions")] = None
    quantity: Quantity = None
    band: Band = None
    sensor_mass: Annotated[float | None, Help("Mass of the sensor that was on the tip while it was struck, g: a response that "
                                              "it changes is doubted.", above=0, scale=1e-3)] = None
    modes: Annotated[SourceFile | None, Help("Modes saved by identify (HDF5), or of a universal file.")] = None
    work: Annotated[SourceFile | None, Help("Response of a work that gives way too, along the tool's x and y: an FRF "
                                            "file, saved modes, or a machine file (YAML) whose tool is the place cut.")] = None
    x: Annotated[str | None, Help("Label of x where the data hold several points, e.g. 5:+x.",
                                  metavar="POINT:DIRECTION")] = None
    y: Annotated[str | None, Help("Label of y, or same (as along x), or rigid; that of x's point where left out.",
                                  metavar="POINT:DIRECTION")] = None

    def __post_init__(self) -> None:
        """Refuse what contradicts itself before any file is read."""
        options = {"a machine file": self.machine, "--frf": self.frf, "--frf-x": self.frf_x, "--modes": self.modes}
        named_sources = [name for name, value in options.items() if value]
        if not named_sources:
            raise ToolpointError("dynamics: none given; name a machine file, or give --frf, --frf-x and --frf-y, or --modes")
        if len(named_sources) > 1:
            raise ToolpointError(f"dynamics: {' and '.join(named_sources)} given; must be one of them")
        if self.pose and self.machine is None:
            raise ToolpointError("--pose: needs a machine file to be applied to")
        if (self.machine or self.modes) and (of_frf := list_given("band", "quantity", "name", "struck", "variables",
                                                                     "sensor_mass")):
            raise ToolpointError(f"{of_frf[0]}: is for measured FRFs; {named_sources[0]} has none")
        for name, label in (("--x", self.x), ("--y", self.y)):
            if label is not None and (self.machine or self.frf_x) and not (name == "--y" and label in ("same", "rigid")):
                place_words = "its tool point" if self.machine else "--frf-x and --frf-y"
                raise ToolpointError(f"{name}: is for FRFs and modes of several points; {named_sources[0]} tells by "
                                     f"{place_words}")

    def read(self) -> ToolDynamics:
        """Read the dynamics, with those of the work where it gives way; raises ToolpointError where files do not fit."""
        tool = self._read_tool()
        if self.work is None:
            return tool
        return studies.with_work(tool, read_work_file(self.work, quantity=self.quantity, band=self.band))

    def _read_tool(self) -> ToolDynamics:
        if self.machine is not None:
            if self.machine.suffix.lower() in (*UNIVERSAL, *HDF5, *MATLAB, *NUMPY, *TEXT):
                raise ToolpointError(f"{self.machine}: a machine is a YAML file; measured FRFs are given with --frf, saved "
                                     "modes with --modes")
            machine = io.read_machine_at(self.machine, self.pose)
            return studies.machine_dynamics(machine, self.pose, self.y)
        if self.modes is not None:
            with _remedies({"needs one Modes": " (give it with --frf, or identify its modes first: toolpoint identify)"}):
                modes = io.read_modes(self.modes)
            return studies.modal_dynamics(modes, self.x, self.y, what=str(self.modes))
        if self.frf:
            measured = read_responses(self.frf, self.quantity, self.naming)
            return studies.response_dynamics(measured, self.x, self.y, band=self.band,
                                             what=", ".join(file.name for file in self.frf), sensor_mass=self.sensor_mass)
        paths = {way: path for way, path in (("x", self.frf_x), ("y", self.frf_y), ("xy", self.frf_xy)) if path is not None}
        parts = {way: read_responses([path], self.quantity, self.naming) for way, path in paths.items()}
        return studies.separate_dynamics(parts["x"], parts.get("y"), parts.get("xy"), across=self.y, band=self.band,
                                         sensor_mass=self.sensor_mass,
                                         names={way: path.name for way, path in paths.items()})


def read_responses(paths: Sequence[Path], quantity: str | None, naming: Naming | None = None) -> Frf:
    """Return the responses that files hold; a refusal names the option that takes such a file."""
    with _remedies({"needs one Frf": " (give it with --modes)",
                    "its direction": "; the directions apart are given with --frf-x FILE --frf-y FILE"}):
        return io.read_frf(paths, quantity=quantity, **(naming.keywords if naming else {}))


@contextmanager
def _remedies(remedies: Mapping[str, str]) -> Iterator[None]:
    """Add to an error which option would take the file, where the error holds these words."""
    try:
        yield
    except ToolpointError as error:
        remedy_text = next((remedy for words, remedy in remedies.items() if words in str(error)), "")
        raise ToolpointError(f"{error}{remedy_text}") from None
