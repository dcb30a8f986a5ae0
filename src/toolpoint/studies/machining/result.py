"""MachiningStudy: what every block of a program meets, worst first, with the doubts that stand before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.advice import ProgramAdvice
from toolpoint.studies.machining.block_lobes import EngagementLobes
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.errors.block_errors import ERROR_HEADER, BlockErrors
from toolpoint.studies.machining.judged_places import JudgedPlaces
from toolpoint.studies.machining.loads import LOAD_COLUMNS, CutLoads
from toolpoint.studies.machining.margins import PlaceMargins
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.recorded.record_comparison import RecordComparison
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.thin_walls.work_course import STAGE_HEADER, WorkCourse
from toolpoint.studies.text_table import text_table

HEADER = ("line", "verdict", "depth mm", "limit mm", "chatter Hz", "arc °", "force N", "torque N m", "power W", "rev/min",
          "mm/min")
WORST_ROWS = 15  # of the table
VERDICTS = ("air", "stable", "chatters", "not known")
# Doubts of loads, which advice brings below their limits or names as unmet.
CURED_BY_FEED = ("spindle power", "spindle torque", "bending of the tool", "spindle speed")
AIR, STABLE, CHATTERS, UNKNOWN_VERDICT = range(4)  # places in `VERDICTS`


@dataclass(frozen=True, eq=False)
class BlockTable:
    """Quantities of every segment of the program, (n,).

    volume : m^3; depth, arc : largest of its places, m and rad; `loads` by the names of `loads.LOAD_COLUMNS`, the largest;
    limit (m), error, frequency (Hz): of the place with the least limit over its depth, `ratio`; verdict : index of `VERDICTS`.
    """

    line: np.ndarray
    volume: FloatArray
    depth: FloatArray
    arc: FloatArray
    loads: dict[str, FloatArray]
    limit: FloatArray
    error: FloatArray
    frequency: FloatArray
    ratio: FloatArray
    verdict: np.ndarray

    @property
    def order(self) -> np.ndarray:
        """Blocks that cut, the worst first: those that chatter by limit over depth, then those not known, then the others."""
        rank = np.array([3, 2, 0, 1])[self.verdict]
        ratio = np.where(np.isnan(self.ratio), np.inf, self.ratio)
        order = np.lexsort((-self.loads["lateral"], ratio, rank))
        return order[self.verdict[order] > 0]


def refuse_hazards(hazards: Sequence[Doubt]) -> None:
    """Raise ToolpointError for a program with doubts that no speed and feed cures: it is not written anew."""
    if hazards:
        others = f" (and {len(hazards) - 1} more)" if len(hazards) > 1 else ""
        raise ToolpointError(f"the program must not be run, and no speed or feed mends it: {hazards[0]}{others}; nothing was "
                             "written")


@dataclass(frozen=True, eq=False)
class MachiningStudy(NotebookText):
    """Result of a program run over its stock on a machine.

    error_angle : rad, by which arcs differ at twice the spacing (95 % of the places); text : lines of the program.
    """

    name: str
    setup: MachiningSetup
    laid: ProgramPath
    removed: RemovedMaterial
    blocks: BlockTable
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]
    error_angle: float
    classes: int
    solutions: int
    text: tuple[str, ...] = ()
    advice: ProgramAdvice | None = None
    arcs: PlaceArcs | None = None
    margins: PlaceMargins | None = None
    errors: BlockErrors | None = None
    loads: CutLoads | None = None
    record: RecordComparison | None = None
    lobes: tuple[EngagementLobes, ...] = ()
    judged: JudgedPlaces | None = None
    work: WorkCourse | None = None

    @property
    def hazards(self) -> tuple[Doubt, ...]:
        """Grave doubts that no speed and feed cures: contacts, travel, a program that is not whole."""
        return tuple(doubt for doubt in self.doubts if doubt.grave and doubt.what not in CURED_BY_FEED)

    @property
    def advised_words(self) -> tuple[dict[int, float], dict[int, float]]:
        """Factors on the words S and F by line.

        Raises ToolpointError for a program that must not be run at any speed, see `hazards`, and without advice.
        """
        refuse_hazards(self.hazards)
        if self.advice is None:
            raise ToolpointError("advice: none was made")
        return self.advice.speed, self.advice.feed

    @property
    def chatter_blocks(self) -> np.ndarray:
        """Blocks that chatter, the worst first."""
        order = self.blocks.order
        return order[self.blocks.verdict[order] == 2]

    @property
    def answer(self) -> str:
        """Sentence on the whole program: its worst block, and its largest loads."""
        cutting = int((self.blocks.verdict > 0).sum())
        if not cutting:
            return "No block of the program cuts: the tool meets no material."
        grave = [doubt for doubt in self.doubts if doubt.grave]
        begin = f"Do not run it as it is ({grave[0].what}): " if grave else ""
        bad, unknown = self.chatter_blocks, int((self.blocks.verdict == 3).sum())
        if bad.size:
            k = int(bad[0])
            main = (f"{bad.size} of {_counted(cutting, 'cutting block')} chatter, the worst in line {self.blocks.line[k]}: "
                    f"{1e3 * self.blocks.depth[k]:.3g} mm deep where {1e3 * self.blocks.limit[k]:.3g} mm are stable "
                    f"(chatter at {self.blocks.frequency[k]:.0f} Hz)")
        elif unknown == cutting:
            main = f"{_counted(cutting, 'cutting block')} of unknown stability"
        else:
            least_hand = np.nanmin(np.where(self.blocks.verdict == 1, self.blocks.ratio, np.inf))
            margin = f"at least {100 * (least_hand - 1):.0f} % of depth in hand" if np.isfinite(least_hand) else \
                "no limit within four times their depth"
            main = f"{_counted(cutting - unknown, 'cutting block')} judged stable, {margin}" + (
                f", {unknown} not judged" if unknown else "")
        force = self.blocks.loads["lateral"]
        load = f"; largest force {force.max():.0f} N in line {self.blocks.line[int(force.argmax())]}, largest power " \
               f"{self.blocks.loads['power'].max():.0f} W"
        return begin + main + load + "."

    def row(self, k: int) -> list[str]:
        """Return the cells of a block, see `HEADER`."""
        b = self.blocks
        limit = "-" if np.isnan(b.limit[k]) else f"{1e3 * b.limit[k]:.3f}" if np.isfinite(b.limit[k]) else "none near"
        return [str(b.line[k]), VERDICTS[b.verdict[k]], f"{1e3 * b.depth[k]:.3f}", limit,
                f"{b.frequency[k]:.0f}" if np.isfinite(b.frequency[k]) else "-", f"{np.degrees(b.arc[k]):.1f}",
                f"{b.loads['lateral'][k]:.0f}", f"{b.loads['torque'][k]:.2f}", f"{b.loads['power'][k]:.0f}",
                f"{self.laid.speed[k]:.0f}", f"{60e3 * self.laid.feed[k]:.0f}"]

    def worst_rows(self, count: int = WORST_ROWS) -> list[list[str]]:
        """Return the cells of the worst blocks, one a line of the program."""
        rows, lines = [], set[int]()
        for k in self.blocks.order.tolist():
            if self.blocks.line[k] not in lines:
                lines.add(int(self.blocks.line[k]))
                rows.append(self.row(k))
            if len(rows) == count:
                break
        return rows

    def error_rows(self, count: int = WORST_ROWS) -> list[list[str]]:
        """Return the cells of the cutting blocks with the largest errors, see `block_errors.ERROR_HEADER`."""
        return [] if self.errors is None else self.errors.rows(self.blocks.line, self.blocks.verdict > 0, count=count)

    @property
    def figures(self) -> list[tuple[str, str]]:
        """Main figures of the whole program."""
        cutting = self.blocks.verdict > 0
        return [("blocks, cutting of all", f"{int(cutting.sum())} of {cutting.size}"),
                ("time", f"{self.laid.time.sum():.1f} s, cutting {self.laid.time[cutting].sum():.1f} s"),
                ("removed", f"{1e9 * self.removed.total_volume:.6g} mm^3"),
                ("distinct engagements", f"{self.classes} ({self.solutions} solved)"),
                ("arcs known within", f"{np.degrees(self.error_angle):.2g}° (95 %, from two spacings)")]

    def table(self) -> str:
        """Return answer, doubts, figures and the worst blocks as text."""
        lines = [*mark_notes(self.doubts), self.answer, *(f"{name:28s} {value}" for name, value in self.figures)]
        lines += [text_table("Blocks, worst first", HEADER, self.worst_rows())]
        errors = self.error_rows()
        lines += [text_table("Errors, largest first", ERROR_HEADER, errors)] if errors else []
        lines += [text_table("Stages of the work", STAGE_HEADER, [list(row) for row in self.work.rows])] if self.work else []
        lines += [self.record.table()] if self.record is not None else []
        lines += [self.advice.words] if self.advice is not None else []
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, SI: every block that cuts, and what the whole program came to; None where not known."""
        b = self.blocks
        blocks = [{"line": int(b.line[k]), "verdict": VERDICTS[b.verdict[k]], "depth_m": float(b.depth[k]),
                   "limit_m": _number(b.limit[k]), "limit_error_m": _number(b.error[k]),
                   "chatter_frequency_hz": _number(b.frequency[k]),
                   "arc_rad": float(b.arc[k]), "volume_m3": float(b.volume[k]), "speed_rpm": float(self.laid.speed[k]),
                   "feed_m_s": float(self.laid.feed[k]), **{name: float(b.loads[name][k]) for name in LOAD_COLUMNS},
                   **({} if self.errors is None else self.errors.to_dict(int(k)))}
                  for k in np.flatnonzero(b.verdict > 0)]
        return {"answer": self.answer, "doubts": list(self.doubts), "time_s": float(self.laid.time.sum()),
                "removed_m3": self.removed.total_volume, "arc_error_rad": self.error_angle, "engagements": self.classes,
                "collisions": [{"kind": c.kind, "line": int(self.laid.path.line[c.block]), "place_m": list(c.place),
                                "depth_m": c.depth}
                               for c in self.removed.collisions],
                "blocks": blocks, "work": None if self.work is None else self.work.to_dict(),
                "record": None if self.record is None else self.record.to_dict(),
                "advice": None if self.advice is None else self.advice.to_dict(), "notes": list(self.notes)}

    def __repr__(self) -> str:
        return f"MachiningStudy({self.name!r}, {self.blocks.line.size} blocks, {self.chatter_blocks.size} chatter)"


def _counted(count: int, name: str) -> str:
    return f"{count} {name}" + "s" * (count != 1)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
