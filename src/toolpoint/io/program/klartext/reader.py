"""Klartext of Heidenhain controls, a subset: L, LP, CC, C, CP, CR, CT, RND, CHF, FMAX, M, TOOL CALL, Q parameters, FN, LBL.

Radius compensation is RL, RR and R0 (`path.radius_compensation`), with APPR and DEP on straight lines
(`klartext.contour_ends`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from toolpoint.io.program.control.frame import AXES
from toolpoint.io.program.control.modes import ControlModes
from toolpoint.io.program.control.tilted_planes import tilt_by_plane_function
from toolpoint.io.program.control.tool_centre import begin_control, end_control
from toolpoint.io.program.klartext.contour_ends import leave_contour, split_contour_end
from toolpoint.io.program.klartext.cycles import KlartextCycles
from toolpoint.io.program.klartext.ways import circle_about_pole, polar_end, take_polar_words, tangent_arc
from toolpoint.io.program.language.expressions import ExpressionFault, Reader
from toolpoint.io.program.language.interpreter import LINES_PER_PROGRAM_LINE, MAX_LOOP_CHARACTERS, MAX_LOOP_LINES
from toolpoint.io.program.path.rounded_corners import LEG, ROUND
from toolpoint.io.program.path.segments import Program

# An axis needs a number or Q behind it: X alone is a letter of another word.
_AXIS = re.compile(r"\s*(I?)([XYZABC])\s*(?=[+\-\dQ.])")
_WORDS_WITHOUT_MOTION = re.compile(r"(TOOL (?:CALL|DEF)|CYCL (?:DEF|CALL)|BLK FORM|BEGIN PGM|STOP|TCH PROBE|FN "
                                   r"?1[0-9](?!\d)|FN ?18|"
                    r"FUNCTION|PATTERN|SEL|M\d|\*|Q\d+\s*=)")
_UNKNOWN_RISE = 1e-6  # m, of a move to a height that the program does not hold; `raise_reference_moves` takes it over the stock
_FN_GOTO = re.compile(r"FN\s*(9|10|11|12)\s*:\s*IF\s*(.+?)\s*(EQU|NE|GT|LT)\s*(.+?)\s*GOTO\s*LBL\s*\"?(\w+)")
# R0, RL, RR as words of their own: RND and a radius R+5 begin with the same letter.
_COMPENSATION = re.compile(r"\bR([LR0])(?![\w.])")
_DEFINED_RADIUS = re.compile(r"TOOL DEF\s+(\d+)\b.*\bR\s*([+-]?[\d.]+)")
# Questions for the actual position, which a program that runs without a machine knows from its own moves.
_POSITION = re.compile(r"SYSREAD\s+Q[LRS]?\d+\s*=\s*ID2[47]0\s+NR1\s+IDX([123])\b")
_FN_SET = re.compile(r"FN\s*(\d+)\s*:\s*(?:SYSREAD\s+)?(Q[LRS]?\d+)\s*=\s*(.+)")


def is_klartext(text: str) -> bool:
    """Return whether a text is a Klartext program: it begins with BEGIN PGM."""
    return re.search(r"^\s*\d*\s*BEGIN PGM\b", text[:4000], re.MULTILINE | re.IGNORECASE) is not None


@dataclass
class _Klartext:
    """State of the reader beside the modal one; lengths in the file's unit."""

    state: ControlModes
    variables: dict[str, float] = field(default_factory=dict)
    unset: set[str] = field(default_factory=set)
    center: dict[int, float] = field(default_factory=dict)
    rounding: float = 0.0
    words: list[tuple[int, str, float]] = field(default_factory=list)
    number: int = 1  # of the line that is read
    cycles: KlartextCycles = field(default_factory=KlartextCycles)


@dataclass
class _Labels:
    """Lines of the labels, lines to return to, and repeats that are left."""

    labels: dict[str, int]
    calls: list[int] = field(default_factory=list)
    repeats: dict[int, int] = field(default_factory=dict)

    def follow(self, index: int, label: str, count: int | None, *, returns: bool) -> int:
        """Return the line after a jump or a call (count None; LBL 0 ends a call), or after a repeat."""
        if label not in self.labels:
            raise ExpressionFault(f"LBL {label}: no such label")
        if count is None:
            if returns:
                self.calls.append(index + 1)
            return self.labels[label]
        self.repeats[index] = self.repeats.get(index, count) - 1
        if self.repeats[index] >= 0:
            return self.labels[label]
        del self.repeats[index]
        return index + 1


def run(text: str, state: ControlModes, name: str) -> Program:
    """Return the segments of a Klartext program."""
    # Blocks are numbered, also those that hold a comment alone.
    lines = [(number, re.sub(r"^\s*\d+(?:\s+(?=\D)|\s*$)", "", line.split(";", 1)[0]).strip().upper().rstrip("~ "))
             for number, line in enumerate(text.splitlines(), 1)]
    lines = [(number, re.sub(r"(?<=\d),(?=\d|\s|$)", ".", line)) for number, line in lines if line]  # decimal commas
    labels: dict[str, int] = {}
    for k, (_, line) in enumerate(lines):
        if match := re.match(r"LBL\s+\"?(\w+)", line):
            labels.setdefault(match[1], k)
    if re.match(r"BEGIN PGM\s+.*\bINCH\b", lines[0][1]):
        state.scale = state.feed_scale = 0.0254
    reader, places = _Klartext(state), _Labels(labels)
    index, steps, characters = 0, 0, 0
    max_characters = MAX_LOOP_CHARACTERS + LINES_PER_PROGRAM_LINE * sum(len(line) for _, line in lines)
    while index < len(lines):
        number, line = lines[index]
        steps, characters = steps + 1, characters + len(line)
        if characters > max_characters:
            state.remarks.fault(number, 1, f"lines of more than {max_characters} characters are run: a loop without end?")
            break
        if steps > MAX_LOOP_LINES + LINES_PER_PROGRAM_LINE * len(lines) or len(places.calls) > 20:
            state.remarks.fault(number, 1, "a loop without end, or labels nested too deeply")
            break
        following = index + 1
        try:
            if line.startswith("END PGM"):
                break
            following = _step(reader, places, index, line=line, number=number)
        except ExpressionFault as fault:
            state.remarks.fault(number, 1, str(fault))
        except OverflowError:
            state.remarks.fault(number, 1, "too many moves, or a number that is too large")
            break
        if following == index + 1 and re.search(r"\bM(?:2|02|30)\b", line):
            break
        index = following
    if reader.unset:
        state.remarks.note(1, f"parameters that the program reads from outside are zero: {', '.join(sorted(reader.unset)[:8])}")
    state.segments.doubts += reader.cycles.doubts()
    return state.segments.program(name, text, words=reader.words, remarks=state.remarks)


def _step(reader: _Klartext, places: _Labels, index: int, *, line: str, number: int) -> int:
    """Run one line; return the index of the line that follows it."""
    jump = _flow(reader, line)
    if jump is not None:
        return places.follow(index, *jump, returns=line.startswith("CALL"))
    if line.startswith("LBL 0") and places.calls:
        return places.calls.pop()
    if not line.startswith("LBL"):
        _line(reader, number, line)
    return index + 1


def _flow(reader: _Klartext, line: str) -> tuple[str, int | None] | None:
    """Return label and repeats (None for a jump or a call) where a line goes elsewhere."""
    if match := re.match(r"CALL LBL\s+\"?(\w+)\"?(?:\s+REP\s*(\d+))?", line):
        return match[1], int(match[2]) if match[2] else None
    if match := _FN_GOTO.match(line):
        left, right = _value(reader, match[2]), _value(reader, match[4])
        holds = {"EQU": left == right, "NE": left != right, "GT": left > right, "LT": left < right}[match[3]]
        return (match[5], None) if holds else None
    return None


def _value(reader: _Klartext, text: str) -> float:
    return Reader(text, reader.variables, unset=reader.unset).value()


def _line(reader: _Klartext, number: int, line: str) -> None:
    """Carry out one line."""
    state, reader.number = reader.state, number
    if re.match(r"(?:APPR|DEP)\b", line):
        _contour_end(reader, number, line)
        return
    if re.match(r"(?:L|C|CR|CT|LN|CP|LP)\b", line):
        line = _take_compensation(state, line)
    if _FN_GOTO.match(line):
        return
    if _control(reader, number, line) and not line.startswith("L"):
        return
    if match := _FN_SET.match(line):
        _assign(reader, number, match)
    elif match := re.match(r"(Q[LRS]?\d+)\s*=\s*(.+)", line):
        reader.variables[match[1]] = _value(reader, match[2])
    elif match := re.match(r"CC\b(.*)", line):
        for i, value in _axes(reader, match[1])[0].items():
            reader.center[i] = value
    elif match := re.match(r"(LP|CP|CT|L|CR|C|LN)\b(.*)", line):
        if re.search(r"\bM(?:91|92|140)\b", line):
            _leave_work(reader, number, line)
            return
        _move(reader, number, match[1], match[2])
        if re.search(r"\bM89\b", line):
            reader.cycles.is_modal = True
        if re.search(r"\bM99\b", line) or (reader.cycles.is_modal and not re.search(r"\bM99\b", line)):
            reader.cycles.call(state, number, reader.variables)
            reader.cycles.is_modal &= not re.search(r"\bM99\b", line)
    elif match := re.match(r"(RND|CHF)\s*R?\s*([+-]?[\d.]+|[+-]?Q[LR]?\d+)(?:\s+F\s*([\d.]+|Q\d+))?", line):
        feed = _value(reader, match[3]) * state.feed_scale / 60 if match[3] else 0.0
        state.keep_corner(number, ROUND if match[1] == "RND" else LEG, _value(reader, match[2]) * state.scale, feed=feed)
    elif re.match(r"CYCL DEF 9\.?[01]?\b.*V\.?ZEIT|CYCL DEF 9\.1", line):
        if match := re.search(r"(?:V\.?ZEIT|DWELL|V)\s*([\d.]+)\s*$", line):
            state.wait(number, float(match[1]))
    elif re.match(r"CYCL DEF 7\.[1-9]", line):
        if state.tilted.matrix is not None:
            raise ExpressionFault("CYCL DEF 7 in a tilted plane is not computed; shift the datum before PLANE")
        for i, value in _axes(reader, re.sub(r"CYCL DEF 7\.\d", "", line))[0].items():
            state.shift[i] = value if f"I{'XYZ'[i]}" not in line else state.shift[i] + value
    elif line.startswith("PLANE"):
        if refused := tilt_by_plane_function(state, number, line):
            raise ExpressionFault(refused)
    elif line.startswith("CYCL CALL"):
        if re.match(r"CYCL CALL\s+PAT", line):
            raise ExpressionFault("CYCL CALL PAT: a pattern of places is not computed; post single calls")
        if match := re.match(r"CYCL CALL\s+POS\b(.*)", line):
            _move(reader, number, "L", f"{match[1]} FMAX")
        reader.cycles.call(state, number, reader.variables)
    elif match := _WORDS_WITHOUT_MOTION.match(line):
        if line.startswith("CYCL DEF"):
            reader.cycles.define(line)
        if call := re.match(r"TOOL CALL\s+(\d+)?(?:.*?\bS\s*([\d.]+))?", line):
            state.segments.call_tool(float(call[1]) if call[1] else None, change=True)
            state.speed = float(call[2]) if call[2] else state.speed
        elif defined := _DEFINED_RADIUS.match(line):
            state.segments.defined_radii[int(defined[1])] = float(defined[2]) * state.scale
        state.remarks.without_motion(number, re.sub(r"\s+", " ", match[1]))
    else:
        raise ExpressionFault(f"{line.split()[0]} is not in the subset of Klartext")


def _leave_work(reader: _Klartext, number: int, line: str) -> None:
    """Rise by a block M140, or go to places of the machine (M91, M92), which are not known in the work: X and Y stay."""
    state, end = reader.state, list(reader.state.position)
    lift = re.search(r"\bMB\s*([\d.]+)", line)
    if "M140" in line and lift is not None:
        end[2] += float(lift[1]) * state.scale
    elif "M140" in line or re.search(r"\bZ\s*[+\-\dQ.]", line):
        end[2] += _UNKNOWN_RISE
        state.remarks.note(number, "M91, M92 and M140 MB MAX leave the work: the tool is taken to stand over the stock then")
    for word in re.findall(r"\bM(\d+)", line):
        reader.words.append((number, "M", float(word)))
    if end != state.position:
        state.rapid(number, end)


def _contour_end(reader: _Klartext, number: int, line: str) -> None:
    """Go to a contour (APPR) or away from it (DEP)."""
    state = reader.state
    verb, is_polar, way, remainder = split_contour_end(line, lambda text: _value(reader, text), state.scale)
    if verb == "DEP":
        if feed := re.search(r"\bF\s*([\d.]+|Q\d+)", remainder):
            state.set_feed(_value(reader, feed[1]))
        goal = None
        if way.kind == "LCT":
            polar, remainder = take_polar_words(remainder, lambda part: _value(reader, part)) if is_polar else ({}, remainder)
            ends = _axes(reader, remainder)[0] | (polar_end(state, reader.center, polar) if is_polar else {})
            goal = [ends.get(i, state.position[i]) for i in range(3)]
        leave_contour(state, number, way, goal=goal)
        return
    _move(reader, number, "LP" if is_polar else "L", _take_compensation(state, remainder))
    if not state.compensation.side:
        raise ExpressionFault(f"APPR {way.kind} without RL or RR")
    state.segments.contour_ends[len(state.segments.rows) - 1] = way
    if way.kind in ("CT", "LCT"):
        state.remarks.note(number, "APPR and DEP on circles: their radius is that of the tool centre's path")


def _take_compensation(state: ControlModes, line: str) -> str:
    """Begin or end radius compensation by RL, RR or R0; return the line without them."""
    if match := _COMPENSATION.search(line):
        side = {"L": 1, "R": -1, "0": 0}[match[1]]
        if side * state.compensation.side < 0:
            raise ExpressionFault("RL and RR follow each other without a block R0 between")
        state.compensation.begin(side)
    return _COMPENSATION.sub(" ", line)


def _assign(reader: _Klartext, number: int, match: re.Match[str]) -> None:
    kind, name, text = int(match[1]), match[2], match[3]
    if kind == 18:
        _read_control(reader, number, name, match[0])
        return
    text = text.replace(" DIV ", " / ").replace(",", ".")
    if kind not in (0, 1, 2, 3, 4, 5, 6, 7):
        raise ExpressionFault(f"FN{kind} is not in the subset of Klartext")
    reader.variables[name] = _value(reader, text)


def _read_control(reader: _Klartext, number: int, name: str, text: str) -> None:
    """Set a parameter to what a control knows: the position is where this program brought it, all else is zero."""
    state, remarks = reader.state, reader.state.remarks
    if place := _POSITION.search(text):
        i = int(place[1]) - 1
        reader.variables[name] = (state.position[i] - state.origin[i]) / state.scale
        remarks.note(number, "SYSREAD of a position: where this program brought it, an operator moves nothing")
        return
    reader.variables[name] = 0.0
    remarks.note(number, "SYSREAD (what the control knows at the machine) is zero")


def _axes(reader: _Klartext, text: str) -> tuple[dict[int, float], str]:
    """Return the positions (m, machine coordinates) of the axes of a line, and what is left of it."""
    state, ends, remainder, index = reader.state, {}, [], 0
    while index < len(text):
        match = _AXIS.match(text, index)
        if match is None:
            remainder.append(text[index])
            index += 1
            continue
        value = Reader(text, reader.variables, match.end(), reader.unset)
        length = value.value(5) * state.scale
        index = value.position
        if match[2] in AXES:
            i = AXES[match[2]]
            ends[i] = length + (state.position[i] if match[1] else state.origin[i])
        else:
            if not state.centre.word:
                state.remarks.note(1, "rotary words (A, B, C) without M128 or TCPM are passed over: the path is that of X, Y, "
                                   "Z")
            state.centre.turn_to({match[2]: ("IC" if match[1] else "AC", length / state.scale)}, incremental=False)
    return ends, "".join(remainder)


def _control(reader: _Klartext, number: int, line: str) -> bool:
    """Begin or end tool centre control by M128, M129, FUNCTION TCPM, FUNCTION RESET TCPM; return whether the line did."""
    state = reader.state
    if re.search(r"\bM120\b", line):
        state.remarks.look_ahead = "M120"
    if re.search(r"\bM128\b", line):
        begin_control(state, number, "M128")
    elif line.startswith("FUNCTION TCPM"):
        if "AXIS SPAT" in line:
            raise ExpressionFault("FUNCTION TCPM AXIS SPAT: spatial angles are not computed; program AXIS POS")
        if "F CONT" in line:
            state.remarks.note(number, "FUNCTION TCPM F CONT: feeds are taken at the tip, as under F TCP")
        begin_control(state, number, "FUNCTION TCPM")
    elif line.startswith("FUNCTION RESET TCPM") or re.search(r"\bM129\b", line):
        end_control(state)
    else:
        return False
    return True


def _without_vectors(reader: _Klartext, text: str) -> str:
    """Return a block LN without its vectors: that of the tool (TX TY TZ) is its direction, that of the surface is not used."""
    vector = {match[1]: float(match[2]) for match in re.finditer(r"\bT([XYZ])\s*([+-]?[\d.]+)", text)}
    if vector:
        if not reader.state.centre.word:
            raise ExpressionFault("LN with TX, TY, TZ without M128 or FUNCTION TCPM")
        components = (vector.get("X", 0.0), vector.get("Y", 0.0), vector.get("Z", 0.0))
        if wrong := reader.state.centre.point_along(components):
            raise ExpressionFault(wrong)
    return re.sub(r"\b[NT][XYZ]\s*[+-]?[\d.]+", " ", text)


def _move(reader: _Klartext, number: int, kind: str, text: str) -> None:
    state = reader.state
    polar, text = take_polar_words(text, lambda part: _value(reader, part)) if kind in ("LP", "CP") else ({}, text)
    ends, remainder = _axes(reader, _without_vectors(reader, text) if kind == "LN" else text)
    if feed := re.search(r"\bF\s*(MAX|AUTO|[\d.]+|Q\d+)", remainder):
        rapid = feed[1] == "MAX"
        if not rapid and feed[1] != "AUTO":
            state.set_feed(_value(reader, feed[1]))
    else:
        rapid = False
    for word in re.findall(r"\bM(\d+)", remainder):
        reader.words.append((number, "M", float(word)))
    # A line without an axis still turns the tool, or changes feed and M words: it is no move of the tip.
    if not ends and kind in ("L", "LN"):
        state.motion = 0 if rapid else 1
        if state.centre.turns:
            state.swing(number)
        state.motion = 0
        return
    direction = int(match[1] + "1") if (match := re.search(r"\bDR\s*([+-])", remainder)) else 0
    if kind == "LP":
        ends |= polar_end(state, reader.center, polar)
    end = [ends.get(i, state.position[i]) for i in range(3)]
    if kind == "CP":
        circle_about_pole(state, number, reader.center, words=polar, direction=direction, height=end[2])
        return
    if kind == "CT":
        tangent_arc(state, number, end)
        return
    if kind in ("L", "LN", "LP"):
        state.programmed_axes |= ends.keys()
        (state.rapid if rapid else state.cut)(number, end)
        return
    state.motion = 2 if direction < 0 else 3
    places = {"XYZ"[i]: ("AC", (end[i] - state.origin[i]) / state.scale) for i in range(3)}
    if kind == "CR":
        radius = re.search(r"\bR\s*([+-]?[\d.]+)", remainder)
        if radius is None:
            raise ExpressionFault("CR without its radius R")
        places["CR"] = "", float(radius[1])
    elif not reader.center:
        raise ExpressionFault("C without CC before it")
    else:
        places |= {"IJK"[i]: ("AC", (value - state.origin[i]) / state.scale) for i, value in reader.center.items()
                   if i in (0, 1)}
    state.move(number, places, once=False, machine=False)
    state.motion = 0
