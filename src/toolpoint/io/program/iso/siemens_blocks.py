"""Blocks that are not words of letters: frames (TRANS, ROT, SCALE, MIRROR) and calls of drilling cycles, modal ones too."""

from __future__ import annotations

import re
from collections.abc import MutableMapping
from dataclasses import dataclass, field

from toolpoint.io.program.control.frame import PLANES, change_frame
from toolpoint.io.program.control.modes import ControlModes
from toolpoint.io.program.control.tilted_planes import tilt_by_swivel_cycle
from toolpoint.io.program.control.tool_centre import begin_control, end_control
from toolpoint.io.program.iso.siemens_cycles import (
    CALL,
    CALL_END,
    CycleCall,
    assign_parameters,
    drill_hole,
    fault_of,
    is_pattern,
    pattern_places,
)
from toolpoint.io.program.language.expressions import ExpressionFault, Reader
from toolpoint.io.program.language.words import WordFault

_FRAME = re.compile(r"(A?(?:TRANS|ROT|SCALE|MIRROR))\b(.*)$", re.DOTALL)
_SWIVEL = re.compile(r"CYCLE800\s*\((.*)\)\s*$", re.DOTALL)
_ORIENTATION = re.compile(r"(TRAORI|TRAFOOF)(?:\s*\([^)]*\))?\s*$")
_WORD = re.compile(r"\s*(RPL|[XYZ])\s*=?\s*")


@dataclass
class SiemensBlocks:
    """Carries them out; `modal` is the cycle that follows every move, None without one."""

    state: ControlModes
    variables: MutableMapping[str, float]
    unset: set[str]
    modal: CycleCall | None = field(default=None)

    def take(self, number: int, text: str) -> bool:
        """Carry out a block if it is one of these."""
        if match := _FRAME.match(text):
            self._frame(number, match[1], match[2], match.start(2))
        elif CALL_END.match(text):
            self.modal = None
        elif match := _ORIENTATION.match(text):
            if match[1] == "TRAORI":
                begin_control(self.state, number, "TRAORI")
            else:
                end_control(self.state)
        elif match := _SWIVEL.match(text):
            tilt_by_swivel_cycle(self.state, number, [self._value(part, match.start(1)) for part in _split(match[1])])
        elif match := CALL.match(text):
            self._call(number, match)
        else:
            return False
        return True

    def after_move(self, number: int) -> None:
        """Drill with the modal cycle where the tool has come to."""
        if self.modal is not None:
            drill_hole(self.state, self.modal, number)

    def _frame(self, number: int, verb: str, text: str, column: int) -> None:
        reader, words = Reader(text, self.variables, unset=self.unset), {}
        while reader.skip():
            position = reader.position
            word = _WORD.match(text, position)
            if word is None:
                raise WordFault(column + position + 1, f"{text[position:].split()[0]!r} is not a word of {verb}")
            reader.position = word.end()
            words[word[1]] = reader.sum()
        state = self.state
        if fault := change_frame(state.frame, verb, words, plane=state.plane, unit=state.scale):
            state.remarks.fault(number, 1, fault)

    def _call(self, number: int, match: re.Match[str]) -> None:
        values = [self._value(text, match.start(3)) for text in _split(match[3])]
        call = assign_parameters(match[2], values)
        if call is None:
            self.state.remarks.fault(number, 1, f"{match[2]}: this cycle is not computed; post the program with single moves")
        elif fault := fault_of(call):
            self.state.remarks.fault(number, 1, fault)
        elif is_pattern(call):
            self._pattern(number, call)
        elif match[1]:
            self.modal = call
        else:
            drill_hole(self.state, call, number)

    def _pattern(self, number: int, call: CycleCall) -> None:
        state = self.state
        if self.modal is None:
            state.remarks.fault(number, 1, f"{call.name} without a modal cycle; program MCALL with a drilling cycle before it")
            return
        a, b = PLANES[state.plane]
        for u, v in pattern_places(call):
            state.rapid(number, state.target({"XYZ"[a]: ("AC", u), "XYZ"[b]: ("AC", v)}))
            self.after_move(number)

    def _value(self, text: str, column: int) -> float | None:
        if not text.strip() or text.strip().startswith('"'):
            return None
        reader = Reader(text, self.variables, unset=self.unset)
        try:
            value = reader.value()
        except ExpressionFault as fault:
            raise WordFault(column + 1, str(fault)) from None
        if reader.skip():
            raise WordFault(column + 1, f"{text.strip()!r} is no number")
        return value


def _split(text: str) -> list[str]:
    """Return the parameters between commas that stand in no bracket and no string."""
    parts, depth, quoted = [""], 0, False
    for letter in text:
        quoted ^= letter == '"'
        depth += 0 if quoted else (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += letter
    return parts
