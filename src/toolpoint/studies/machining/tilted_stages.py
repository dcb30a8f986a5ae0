"""Programs in tilted planes (3+2): each run of segments in one plane is a stage over the work that was left before it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.material_removal import RemovedMaterial, Stock
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.program_path import ParsedProgram
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.studies.machining.run_program import run_program
from toolpoint.studies.machining.setup import MachiningSetup


class StagedProgram(ParsedProgram, Protocol):
    """Program that can be parted by its planes, see `io.program.segments.Program`."""

    def stages(self) -> tuple[tuple[FloatArray, ParsedProgram], ...]:
        """Return the rotation of every plane and its program, in the plane's axes."""
        ...


@dataclass(frozen=True, eq=False)
class StagedStudy(NotebookText):
    """Result of a program in tilted planes: rotations (3, 3), and the study of every stage in the axes of its plane."""

    name: str
    rotations: tuple[FloatArray, ...]
    stages: tuple[MachiningStudy, ...]

    @property
    def doubts(self) -> list[Doubt]:
        """Doubts of all stages, each once."""
        return list(dict.fromkeys(doubt for stage in self.stages for doubt in stage.doubts))

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes of all stages, each once."""
        return tuple(dict.fromkeys(note for stage in self.stages for note in stage.notes))

    @property
    def answer(self) -> str:
        """Sentence on every stage."""
        return "\n".join(f"Stage {k + 1} ({tilt_words(rotation)}): {stage.answer}"
                         for k, (rotation, stage) in enumerate(zip(self.rotations, self.stages, strict=True)))

    @property
    def removed_volume(self) -> float:
        """Volume taken away by all stages, m^3."""
        return sum(stage.removed.total_volume for stage in self.stages)

    def table(self) -> str:
        """Return the tables of all stages as text."""
        return "\n\n".join(f"Stage {k + 1}: {tilt_words(rotation)}\n{stage.table()}"
                           for k, (rotation, stage) in enumerate(zip(self.rotations, self.stages, strict=True)))

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers of all stages, SI; places in the axes of each plane."""
        return {"answer": self.answer, "doubts": list(self.doubts), "removed_m3": self.removed_volume,
                "stages": [{"rotation": rotation.tolist(), **stage.to_dict()}
                           for rotation, stage in zip(self.rotations, self.stages, strict=True)]}

    def __repr__(self) -> str:
        return f"StagedStudy({self.name!r}, {len(self.stages)} stages)"


def refuse_in_tilted_planes(options: Sequence[str]) -> None:
    """Refuse what is known upright alone.

    Examples
    --------
    >>> from toolpoint.studies import refuse_in_tilted_planes
    >>> refuse_in_tilted_planes([])
    """
    if options:
        raise ToolpointError(f"{', '.join(options)}: the program tilts its plane; leave out what is known upright alone")


def tilt_words(rotation: FloatArray) -> str:
    """Return a plane in words: the direction of its tool.

    Examples
    --------
    >>> tilt_words(np.eye(3))
    'upright'
    """
    axis = rotation[:, 2]
    if axis[2] > 1 - 1e-12:
        return "upright"
    return f"tool along ({axis[0] + 0.0:.4g}, {axis[1] + 0.0:.4g}, {axis[2] + 0.0:.4g})"


def run_stages(program: StagedProgram, setup: MachiningSetup, dynamics: Machine | ToolDynamics | None = None, *,
               name: str = "program", text: str = "", lobes: int = 0,
               progress: Callable[..., None] = lambda name, finished, total: None) -> StagedStudy:
    """Return what every block of a program in tilted planes meets.

    Parameters
    ----------
    program : Program
        As `io.read_program` gives it.
    setup, name, text, lobes, progress : as in `run_program`
    dynamics : Machine or ToolDynamics, optional
        A machine is posed by its own chain, its tool along the plane's axis; a tip is the same in all planes, along the
        plane's x and y.

    Raises ToolpointError where a machine does not come to a plane, and for drives and a part that must not be cut into, which
    are known upright alone.

    Examples
    --------
    A face of 10 mm milled from the side, 2 mm deep, by a tool of 10 mm:

    >>> from toolpoint import studies
    >>> from toolpoint.cutting.description import CuttingDescription
    >>> from toolpoint.io.program.gcode import parse
    >>> text = "S9000\\nG68.2 X0 Y0 Z0 J90\\nG53.1\\nG0 X-7 Y-5 Z5\\nZ-2\\nG1 X47 F1800\\nG0 Z5\\nG69"
    >>> setup = studies.describe_machining(studies.stock_of("box", (0, 0, -0.01, 0.04, 0.02, 0)),
    ...     CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8), spacing=5e-4)
    >>> study = studies.run_stages(parse(text, start=(0, 0, 0.05)), setup)
    >>> study.rotations[0][:, 2].round(9).tolist(), bool(study.removed_volume < 1e-9)
    ([0.0, -1.0, 0.0], False)
    """
    from toolpoint.material_removal.cut_stock import CutStock  # brings the compiler

    if setup.drives is not None or len(setup.part):
        raise ToolpointError("drives, part: the program tilts its plane; they are taken upright alone: leave them out")
    studies, rotations = list[MachiningStudy](), list[FloatArray]()
    stock: Stock = setup.stock
    previous: FloatArray = np.eye(3)
    for rotation, part in program.stages():
        if not (np.linalg.norm(part.path.end - part.path.start, axis=1) > 0).any():
            continue
        turn = previous.T @ rotation
        if studies:
            stock = CutStock.of(studies[-1].removed, turn)
        elif not np.allclose(turn, np.eye(3)):
            stock = CutStock.of(_untouched(setup), turn)
        studies.append(run_program(part, replace(setup, stock=stock), dynamics, name=f"{name}, stage {len(studies) + 1}",
                                   text=text, lobes=lobes, rotation=rotation, progress=progress))
        rotations.append(rotation)
        previous = np.asarray(rotation, float)
    if not studies:
        raise ToolpointError("program: no block moves")
    return StagedStudy(name, tuple(rotations), tuple(studies))


def _untouched(setup: MachiningSetup) -> RemovedMaterial:
    """Return the removal of a path that stays above the stock."""
    from toolpoint.material_removal import RemovalSettings, remove_material, split_moves

    place = setup.stock.upper + 0.1
    path = split_moves(place[None], place[None] + [[1e-3, 0.0, 0.0]], 1.0, rapid=np.array([True]))
    shapes = [setup.shape_of(0)]
    return remove_material(path, setup.stock, shapes, RemovalSettings(setup.spacing_for(shapes), setup.slices))
