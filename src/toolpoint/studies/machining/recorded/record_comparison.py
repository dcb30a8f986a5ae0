"""RecordComparison: a record beside the program that was computed: its place, blocks that differ, the coefficient, chatter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.studies.machining.recorded.alignment import RecordAlignment
from toolpoint.studies.machining.recorded.block_fit import CoefficientFit, RecordWindows
from toolpoint.studies.machining.recorded.record_chatter import ChatterInRecord
from toolpoint.studies.machining.recorded.spindle_load import SpindleLoad
from toolpoint.studies.text_table import text_table

UNEXPECTED_HEADER = ("line", "recorded", "expected", "ratio", "deviations")
MAX_LISTED_WINDOWS = 12  # of blocks that differ
MIN_TRUSTED_CORRELATION = 0.8  # of record and load; a wrong record of on and off reaches 0.7
MIN_WITHIN_CORRELATION = 0.4  # where the spindle cuts
MIN_RIVAL_MISFIT = 1.5  # of the next best place over the best, below which two places are as likely
MIN_FACTOR_DOUBT = 0.15  # of the factor from 1, from which on the coefficient of the setup is named as wrong


@dataclass(frozen=True, eq=False)
class RecordComparison(NotebookText):
    """A record compared with a program.

    unit : of the means; line : of every window; is_scaled : whether the record's unit is that of the load, so that its
    coefficient can be told; coefficient : K_t of the setup, Pa.
    """

    name: str
    unit: str
    time: FloatArray
    values: FloatArray
    load: SpindleLoad
    alignment: RecordAlignment
    windows: RecordWindows
    line: np.ndarray
    fit: CoefficientFit
    is_scaled: bool
    coefficient: float
    chatter: tuple[ChatterInRecord, ...]
    heard_count: int
    chatter_lines: tuple[int, ...]

    @property
    def is_placed(self) -> bool:
        """Whether the record was found in the program: else nothing else holds."""
        return not any(doubt.grave for doubt in self.doubts)

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the coefficient K_t, Pa."""
        f = self.fit
        return self.coefficient * (f.factor - f.half_width), self.coefficient * (f.factor + f.half_width)

    @property
    def unexpected(self) -> np.ndarray:
        """Windows that differ from what is expected, the most first."""
        order = np.argsort(-np.abs(self.fit.score), kind="stable")
        return order[self.fit.is_unexpected[order]]

    @property
    def doubts(self) -> list[Doubt]:
        """Doubts of the place of the record, and of its coefficient."""
        place, doubts = self.alignment, list[Doubt]()
        if place.correlation < MIN_TRUSTED_CORRELATION:
            doubts.append(Doubt("record", f"it does not follow the computed load (correlation {place.correlation:.2f}): "
                                "another program, part or signal?", "nothing below holds; see that program, stock and "
                                "record belong together", grave=True, figure=place.correlation))
        elif (1 - place.rival**2) < MIN_RIVAL_MISFIT * (1 - place.correlation**2):
            doubts.append(Doubt("record", f"it fits another place of the program as well (correlation {place.rival:.3f}, here "
                                f"{place.correlation:.3f})", "record from before the first cut to after the last", grave=True,
                                figure=place.rival))
        elif place.within < MIN_WITHIN_CORRELATION:
            doubts.append(Doubt("record", f"only the beginnings and ends of cuts agree: within cuts the correlation is "
                                f"{place.within:.2f}", "the blocks cut about alike, or something else was cut",
                                figure=place.within))
        if self.is_scaled and np.isfinite(self.fit.half_width) and not doubts:
            lower, upper = self.fit.factor - self.fit.half_width, self.fit.factor + self.fit.half_width
            if lower > 1 + MIN_FACTOR_DOUBT or upper < 1 - MIN_FACTOR_DOUBT:
                doubts.append(Doubt("coefficient", f"the record tells {self.fit.factor:.2f} times the K_t of this run",
                                    "run again with it: forces, limits and errors follow it", figure=self.fit.factor - 1))
        return doubts

    @property
    def answer(self) -> str:
        """Sentence on the record."""
        if not self.is_placed:
            return f"The record {self.name} could not be placed in the program with certainty."
        place = f"The record {self.name} begins {self.alignment.start:+.2f} s from the program's start and runs at " \
             f"{100 / self.alignment.pace:.1f} % of the computed time"
        lower, upper = (1e-6 * value for value in self.interval)
        coefficient = f"; K_t is {1e-6 * self.coefficient * self.fit.factor:.0f} MPa ({lower:.0f} to {upper:.0f}, of this " \
               f"run {1e-6 * self.coefficient:.0f})" if self.is_scaled else ""
        bad = self.unexpected
        differing = "; no block differs from what is expected" if not bad.size else \
            f"; {len(set(self.line[bad].tolist()))} lines differ from what is expected, most line {self.line[bad[0]]}"
        sound = f"; chatter at {self.chatter[0].frequency:.0f} Hz in line {self.chatter_lines[0]}" if self.chatter else ""
        return f"{place}{coefficient}{differing}{sound}."

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions of the comparison."""
        notes = ["Blocks of the record are compared in their means; a coefficient from a motor's power holds the losses that "
                 "grow with the load, unless the efficiency is given. The edge coefficient is taken as known to 50 %. A pace "
                 "other than 1 is taken as the feed's override."] \
            if self.is_scaled else [f"The unit {self.unit or 'of the record'} is not that of a power or a torque: blocks are "
                                    "compared with each other, and no coefficient is told."]
        if not self.heard_count:
            notes += ["The record is too slow, or its blocks too short, to hold lines of chatter: none was looked for."]
        return tuple(notes)

    def rows(self) -> list[list[str]]:
        """Return the cells of the windows that differ most, one a line of the program."""
        rows, lines = list[list[str]](), set[int]()
        for k in self.unexpected.tolist():
            if int(self.line[k]) in lines or len(rows) == MAX_LISTED_WINDOWS:
                continue
            lines.add(int(self.line[k]))
            measured, expected = self.windows.measured[k], self.fit.expected[k]
            rows.append([str(self.line[k]), f"{measured:.4g}", f"{expected:.4g}",
                         f"{measured / expected:.2f}" if expected else "-", f"{self.fit.score[k]:+.1f}"])
        return rows

    def table(self) -> str:
        """Return doubts, answer and the blocks that differ as text."""
        lines = [*mark_notes(self.doubts), self.answer]
        if self.is_placed and self.unexpected.size:
            lines += [text_table(f"Lines that differ, in {self.unit or 'the record'}", UNEXPECTED_HEADER, self.rows())]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, SI; the coefficient None where the record does not tell it."""
        is_told = self.is_scaled and self.is_placed
        return {"answer": self.answer, "doubts": list(self.doubts), "start_s": self.alignment.start,
                "pace": self.alignment.pace, "correlation": self.alignment.correlation,
                "rival_correlation": self.alignment.rival, "unit": self.unit,
                "tangential_pa": self.coefficient * self.fit.factor if is_told else None,
                "tangential_interval_pa": list(self.interval) if is_told else None, "scatter": self.fit.scatter,
                "unexpected": [{"line": int(self.line[k]), "recorded": float(self.windows.measured[k]),
                                "expected": float(self.fit.expected[k]), "deviations": float(self.fit.score[k])}
                               for k in self.unexpected.tolist()] if self.is_placed else [],
                "chatter": [{"line": n, "frequency_hz": c.frequency, "ratio": c.ratio}
                            for n, c in zip(self.chatter_lines, self.chatter, strict=True)],
                "blocks_heard": self.heard_count, "notes": list(self.notes)}

    def __repr__(self) -> str:
        return (f"RecordComparison({self.name!r}, correlation {self.alignment.correlation:.3f}, "
                f"{self.unexpected.size} unexpected)")

