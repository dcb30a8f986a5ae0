"""Programs in tilted planes (3+2): each run of segments in one plane is a stage over the work that was left before it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.material_removal import RemovedMaterial, Stock
from toolpoint.material_removal.stock import BOX_KIND
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.compare_record import MIN_COMPARED_SAMPLES, compare_record
from toolpoint.studies.machining.program_path import ParsedProgram
from toolpoint.studies.machining.result import MachiningStudy, refuse_hazards
from toolpoint.studies.machining.run_program import run_program
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.measured_work import MeasuredWork
from toolpoint.studies.machining.thin_walls.work_along_program import refuse_turned_work
from toolpoint.studies.machining.tool_tips import ToolTips

_SPEED_WORD_TOLERANCE = 1e-9  # of factors on a spindle speed
TILTED_SPACING_FACTOR = 2.0  # of the spacing that three axes have where none is given


class StagedProgram(ParsedProgram, Protocol):
    """Program that can be parted by its planes, see `io.program.path.segments.Program`."""

    def stages(self) -> tuple[tuple[FloatArray, ParsedProgram], ...]:
        """Return the rotation of every plane and its program, in the plane's axes."""
        ...


@dataclass(frozen=True, eq=False)
class StagedStudy(NotebookText):
    """Result of a program in tilted planes: rotations (3, 3), and the study of every stage in the axes of its plane.

    record_doubts : about the places of a record's stages among each other.
    """

    name: str
    rotations: tuple[FloatArray, ...]
    stages: tuple[MachiningStudy, ...]
    record_doubts: tuple[Doubt, ...] = ()

    @property
    def doubts(self) -> list[Doubt]:
        """Doubts of all stages and of their record, each once."""
        recorded = [doubt for stage in self.stages if stage.record is not None for doubt in stage.record.doubts]
        arisen = [doubt for stage in self.stages for doubt in stage.doubts]
        return list(dict.fromkeys([*self.record_doubts, *recorded, *arisen]))

    @property
    def advised_words(self) -> tuple[dict[int, float], dict[int, float]]:
        """Factors on the words S and F by line, of all stages together.

        Raises ToolpointError where two stages advise different speeds for one word S, without advice, and for a program that
        must not be run: see `MachiningStudy.hazards`.
        """
        refuse_hazards([doubt for stage in self.stages for doubt in stage.hazards])
        speed, feed = dict[int, float](), dict[int, float]()
        advised = [stage.advice for stage in self.stages if stage.advice is not None]
        if not advised:
            raise ToolpointError("advice: none was made")
        for advice in advised:
            feed |= {line: min(factor, feed.get(line, np.inf)) for line, factor in advice.feed.items()}
            for line in {line for other in advised for line in other.speed}:
                factor = advice.speed.get(line, 1.0)
                if abs(speed.setdefault(line, factor) - factor) > _SPEED_WORD_TOLERANCE:
                    raise ToolpointError(f"advice: the word S of line {line} serves stages that want different speeds; "
                                         "program a word S in each plane")
        return speed, feed

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
               name: str = "program", text: str = "", lobes: int = 0, with_advice: bool = False, folder: Path | None = None,
               tips: ToolTips | None = None, work: ClampedPart | MeasuredWork | None = None,
               progress: Callable[..., None] = lambda name, finished, total: None) -> StagedStudy:
    """Return what every block of a program in tilted planes meets.

    Parameters
    ----------
    program : Program
        As `io.read_program` gives it.
    setup, name, text, lobes, with_advice, folder, tips, progress : as in `run_program`; advice is made stage by stage
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

    A record in which the program is not to be seen is told as such:

    >>> noise = np.random.default_rng(0).normal(300, 5, 600)
    >>> any(doubt.grave for doubt in studies.compare_stages(study, 0.1 * np.arange(600), noise).doubts)
    True
    """
    refuse_turned_work(work, "tilted planes")
    from toolpoint.material_removal.cut_stock import CutStock  # brings the compiler

    if setup.drives is not None or len(setup.part):
        raise ToolpointError("drives, part: the program tilts its plane; they are taken upright alone: leave them out")
    if not setup.spacing:  # laying dexels through earlier work takes a look at every cell of space
        shapes = [setup.shape_of(number) for number in (0, *setup.cuts)]
        setup = replace(setup, spacing=TILTED_SPACING_FACTOR * setup.spacing_for(shapes))
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
            stock = _turned_box(setup.stock, turn) if setup.stock.kind == BOX_KIND else CutStock.of(_untouched(setup), turn)
        studies.append(run_program(part, replace(setup, stock=stock), dynamics, name=f"{name}, stage {len(studies) + 1}",
                                   text=text, lobes=lobes, with_advice=with_advice, rotation=rotation, tips=tips,
                                   progress=progress,
                                   folder=None if folder is None else folder / f"stage-{len(studies) + 1}"))
        rotations.append(rotation)
        previous = np.asarray(rotation, float)
    if not studies:
        raise ToolpointError("program: no block moves")
    return StagedStudy(name, tuple(rotations), tuple(studies))


def compare_stages(result: StagedStudy, time: FloatArray, values: FloatArray, **options: Any) -> StagedStudy:
    """Return the study of a program in tilted planes with a record of the machine beside every stage that cuts.

    How long the planes take to turn is not known: the stage that agrees best with the record is placed first, those before and
    after it in what is left of the record before and after. Options are those of `compare_record`. A stage without a place has
    no record, and is doubted.
    """
    cutting = [k for k, stage in enumerate(result.stages) if stage.loads is not None and (stage.loads.power > 0).any()]
    compared = _place_stages(result.stages, cutting, np.asarray(time, float), np.asarray(values, float), options=options)
    absent = [k + 1 for k in cutting if k not in compared]
    doubts = (Doubt("record", f"it has no room for stages {', '.join(map(str, absent))} between the others", "record the whole "
                    "program", grave=True),) if absent else ()
    stages = tuple(compared.get(k, stage) for k, stage in enumerate(result.stages))
    return replace(result, stages=stages, record_doubts=doubts)


def _place_stages(stages: Sequence[MachiningStudy], numbers: Sequence[int], time: FloatArray, values: FloatArray, *,
                  options: Mapping[str, Any]) -> dict[int, MachiningStudy]:
    """Return the stages of these numbers with a part of a record beside them, in their order."""
    if not numbers or time.size < MIN_COMPARED_SAMPLES:
        return {}
    compared = {k: compare_record(stages[k], time, values, **options) for k in numbers}
    best = max(numbers, key=lambda k: _agreement(compared[k]))
    record = compared[best].record
    assert record is not None
    place = record.alignment
    begin = time[0] - place.start / place.pace
    is_earlier = time < begin
    is_later = time > begin + float(stages[best].laid.time.sum()) / place.pace
    left = _place_stages(stages, [k for k in numbers if k < best], time[is_earlier], values[is_earlier], options=options)
    right = _place_stages(stages, [k for k in numbers if k > best], time[is_later], values[is_later], options=options)
    return {best: compared[best], **left, **right}


def _agreement(study: MachiningStudy) -> float:
    return -np.inf if study.record is None else study.record.alignment.within


def _turned_box(stock: Stock, turn: FloatArray) -> Stock:
    """Return a box in the axes of another plane, as a closed mesh."""
    corners = np.array([[(stock.lower, stock.upper)[i >> k & 1][k] for k in range(3)] for i in range(8)]) @ turn
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return Stock.mesh(corners[[triangle for a, b, c, d in faces for triangle in ((a, b, c), (a, c, d))]])


def _untouched(setup: MachiningSetup) -> RemovedMaterial:
    """Return the removal of a path that stays above the stock."""
    from toolpoint.material_removal import RemovalSettings, remove_material, split_moves

    place = setup.stock.upper + 0.1
    path = split_moves(place[None], place[None] + [[1e-3, 0.0, 0.0]], 1.0, rapid=np.array([True]))
    shapes = [setup.shape_of(0)]
    return remove_material(path, setup.stock, shapes, settings=RemovalSettings(setup.spacing_for(shapes), setup.slices))
