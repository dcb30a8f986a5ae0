"""Cycles of Klartext: drilling 200, 201 and 203 as moves; others that cut are grave doubts where they are called, as they are
left out; what turns or stretches the program (8, 10, 11, 19, 26) is refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from toolpoint._doubt import Doubt
from toolpoint.io.program.control.drilling_cycles import Cycle, drill
from toolpoint.io.program.language.expressions import ExpressionFault

if TYPE_CHECKING:
    from toolpoint.io.program.control.modes import ControlModes

_DEFINITION = re.compile(r"CYCL DEF\s+(\d+)")
_BENDING = {8: "mirroring", 10: "rotation", 11: "scaling", 19: "a tilted plane", 26: "scaling of single axes"}
# Of the control's own state: datum shift and dwell are read elsewhere, the others move nothing.
_WITHOUT_MOTION = frozenset({7, 9, 13, 32, 239, 247})
_DRILLING = {200: 83, 201: 85, 203: 83}  # and the cycles of ISO that do the same
_DRILLING_WORDS = ("Q200", "Q201", "Q203")


@dataclass
class KlartextCycles:
    """Cycle defined last, whether it follows every block (M89), and lines that call cycles that are not computed."""

    number: int = 0
    is_modal: bool = False
    left_out: dict[int, list[int]] = field(default_factory=dict)

    def define(self, line: str) -> None:
        """Take a line CYCL DEF; raises ExpressionFault for cycles that turn or stretch the program."""
        match = _DEFINITION.match(line)
        number = int(match[1]) if match else 0
        if number in _BENDING:
            raise ExpressionFault(f"CYCL DEF {number}: {_BENDING[number]} is not computed; post the program without it")
        if number not in _WITHOUT_MOTION:
            self.number = number

    def call(self, state: ControlModes, line: int, variables: Mapping[str, float]) -> None:
        """Carry out the cycle where the tool stands."""
        if not self.number:
            raise ExpressionFault("a cycle is called and none is defined before")
        if self.number not in _DRILLING:
            self.left_out.setdefault(self.number, []).append(line)
            return
        absent = [name for name in _DRILLING_WORDS if name not in variables]
        if absent:
            raise ExpressionFault(f"CYCL DEF {self.number} without {' and '.join(absent)}")
        q = {name: variables.get(name, 0.0) for name in ("Q200", "Q201", "Q202", "Q203", "Q204", "Q206", "Q211")}
        surface = state.scale * q["Q203"] + state.origin[2]
        level = surface + state.scale * q["Q200"]
        depth = surface + state.scale * q["Q201"]
        if depth >= level:
            raise ExpressionFault(f"CYCL DEF {self.number}: the depth Q201 {q['Q201']:g} is above the set-up clearance; "
                                  "downwards it is negative")
        cycle = Cycle(_DRILLING[self.number], level=level, depth=depth, initial=max(surface + state.scale * q["Q204"], level),
                      dwell=q["Q211"], ready=True, surface=surface,
                      peck=state.scale * abs(q["Q202"]) if self.number != 201 else 0.0)
        feed, word = state.feed, state.feed_word
        if q["Q206"] > 0:
            state.set_feed(q["Q206"])
        drill(state, cycle, line, places={})
        state.feed, state.feed_word = feed, word

    def doubts(self) -> list[Doubt]:
        """Return a grave doubt for every cycle whose cuts are left out."""
        doubts = []
        for number, lines in self.left_out.items():
            others = f" and {len(lines) - 1} more" if len(lines) > 1 else ""
            doubts.append(Doubt("cycle", f"CYCL DEF {number} is called in line {lines[0]}{others}: it is not computed and left "
                                "out, with what it cuts", "post single moves in its place", grave=True))
        return doubts
