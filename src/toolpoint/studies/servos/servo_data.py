"""Findings of controller records: friction, K_v, following error, loop margins, positioning."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.drives.accuracy.axis_record import AxisRecord, PositioningRun, names_of
from toolpoint.drives.accuracy.metrology import Positioning, positioning
from toolpoint.drives.controller.loops import coherent_lines
from toolpoint.drives.simulation.loop_identification import LoopResponse
from toolpoint.studies.servos.axis_findings import AxisFindings, judge_axis
from toolpoint.studies.text_table import text_table

_NAMES = {"A": "A, accuracy of both directions", "A+": "A+, forward", "A-": "A-, backward",
          "E": "E, systematic deviation of both directions", "E+": "E+, forward", "E-": "E-, backward",
          "R": "R, repeatability of both directions", "R+": "R+, forward", "R-": "R-, backward",
          "B": "B, largest reversal error", "mean B": "mean reversal error", "M": "M, range of the mean deviation"}
_MIN_APPROACHES = 5  # to every target each way, by the standard
# A closed loop follows its set point at low frequencies: |T| there within these.
_FOLLOWING_GAIN_RANGE = (0.7, 1.4)


@dataclass(frozen=True, eq=False)
class ServoData(NotebookText):
    """Findings of a file: axes of a record, or the positioning of a run, or the margins of a measured loop."""

    source: str
    axes: tuple[AxisFindings, ...] = ()
    positioning: Positioning | None = None
    loop: LoopResponse | None = None
    notes: tuple[str, ...] = ()
    signals: tuple[str, ...] = field(default=())
    run_doubts: tuple[Doubt, ...] = ()

    @property
    def status(self) -> str:
        """Doubts in one line, the first of them first."""
        return "; ".join(self.doubts()) or "no doubt"

    def doubts(self) -> list[Doubt]:
        """Return the doubts, axis by axis."""
        loop = [] if self.loop is None else _loop_doubts(self.loop)
        return [doubt.within(f"axis {a.axis}") for a in self.axes for doubt in a.doubts] + loop + list(self.run_doubts)

    def rows(self) -> list[list[str]]:
        """Return axis, quantity and value as words."""
        rows = [row for axis in self.axes for row in axis.rows()]
        if self.positioning is not None:
            rows += [["", _NAMES.get(line[:8].strip(), line[:8].strip()), line[8:].strip()]
                     for line in self.positioning.table().splitlines()]
        if self.loop is not None:
            m = self.loop.margins
            rows += [["", "gain margin", f"{m.gain_db:.1f} dB at {m.phase_crossover:.4g} Hz"],
                     ["", "phase margin", f"{m.phase:.1f} deg at {m.gain_crossover:.4g} Hz"],
                     ["", "bandwidth (-3 dB)", f"{self.loop.bandwidth:.4g} Hz"]]
        return rows

    def table(self) -> str:
        """Return doubts and notes, then the quantities."""
        first = mark_notes(self.doubts()) + [f"note: {words}" for words in self.notes]
        return "\n".join([*first, text_table(self.source, ["axis", "quantity", "value"], self.rows())])

    def to_dict(self) -> dict[str, Any]:
        """Return the findings as plain values, SI."""
        axes = {a.axis: a.to_dict() for a in self.axes}
        p, m = self.positioning, None if self.loop is None else self.loop.margins
        return {"axes": axes, "notes": list(self.notes), "status": self.status,
                "positioning_m": None if p is None else {"A": p.accuracy, "E": p.systematic, "R": p.repeatability,
                                                        "B": p.reversal},
                "margins": None if m is None else {"gain_db": m.gain_db, "gain_hz": m.phase_crossover, "phase_deg": m.phase,
                                                   "phase_hz": m.gain_crossover}}


def judge_servo_data(data: AxisRecord | PositioningRun | LoopResponse, *, source: str = "") -> ServoData:
    """Return the findings of a record of a controller, a positioning run or a measured loop.

    Raises
    ------
    ToolpointError
        For a record in which no signal of an axis is known, with the signals that it holds.

    >>> import tempfile
    >>> from pathlib import Path
    >>> from toolpoint.io import read_servo_data
    >>> from toolpoint.samples import write_samples
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     trace = write_samples("servo", Path(folder, "servo")).folder / "trace.csv"
    ...     result = judge_servo_data(read_servo_data(trace))
    >>> round(result.axes[0].velocity_gain, 2)  # 1/s, as put in
    25.0
    """
    if isinstance(data, PositioningRun):
        targets = data.targets[:, None]
        return ServoData(source or data.source, positioning=positioning(data.forward - targets, data.backward - targets),
                         notes=data.notes, run_doubts=_run_doubts(data))
    if isinstance(data, LoopResponse):
        return ServoData(source, loop=data, notes=(
            "the input of the measurement is taken as the set point of a closed loop, its output as the actual value "
            "(L = T/(1 - T)); neither says which axis and which loop it is",))
    axes = [judge_axis(data, axis) for axis in data.axes]
    axes = [axis for axis in axes if axis is not None]
    if not axes:
        names = "; ".join(names_of(data.signals))
        raise ToolpointError(f"record: no axis with a velocity or a position; its signals are {names}; "
                             "name columns like 'v set', 'pos', 'current' and give their units")
    kept = tuple(a for a in axes if a is not None)
    notes = (*data.notes, *(f"axis {a.axis}: {note}" for a in kept for note in a.notes))
    return ServoData(source or data.source, kept, notes=notes, signals=tuple(names_of(data.signals)))


def _run_doubts(data: PositioningRun) -> tuple[Doubt, ...]:
    """Return the doubt of a run with fewer approaches than its quantities need."""
    approaches = data.forward.shape[1]
    if approaches >= _MIN_APPROACHES:
        return ()
    return (Doubt("positioning", f"{approaches} approaches to every target each way; the standard asks for {_MIN_APPROACHES}",
                  "A and R rest on standard deviations of so few: repeat the run"),)


def _loop_doubts(loop: LoopResponse) -> list[Doubt]:
    """Return doubts about margins, and about a response that is no closed loop from a set point to its actual value.

    A closed loop follows slow set points.
    """
    doubts = [loop.margins.doubt] if loop.margins.doubt else []
    trusted = np.flatnonzero(coherent_lines(loop.coherence))[:5]
    if not trusted.size:
        return [*doubts, Doubt("margins", "no line of the measurement is coherent", "measure with a larger excitation")]
    level = float(np.median(np.abs(loop.closed[trusted])))
    if _FOLLOWING_GAIN_RANGE[0] < level < _FOLLOWING_GAIN_RANGE[1]:
        return doubts
    why = f"at its lowest lines the output is {level:.3g} times the input: no closed loop that follows"
    return [*doubts, Doubt("margins", why, "input and output are exchanged, of another unit, or of an open loop")]
