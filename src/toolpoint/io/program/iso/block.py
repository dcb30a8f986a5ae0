"""Block of a program as moves: modal words are kept, cycles and reference moves carried out, others are notes or faults."""

from __future__ import annotations

import re
from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass, field

from toolpoint.io.program.control.drilling_cycles import CYCLES, Cycle, begin_cycle, drill, dwell_of
from toolpoint.io.program.control.frame import AXES
from toolpoint.io.program.control.modes import CENTER, ControlModes, Places
from toolpoint.io.program.control.polar_places import POLAR_WORDS, question_polar_words
from toolpoint.io.program.control.splines import follow_spline
from toolpoint.io.program.control.tool_centre import ROTARY_AXES, begin_control, end_control
from toolpoint.io.program.iso.fanuc_frames import FanucFrames
from toolpoint.io.program.iso.siemens_blocks import SiemensBlocks
from toolpoint.io.program.language.interpreter import Request
from toolpoint.io.program.language.words import Word, split_words
from toolpoint.io.program.path.rounded_corners import CHAMFER, LEG, ROUND, take_corner_words

_GROUPS: dict[float, str] = {
    0: "motion", 1: "motion", 2: "motion", 3: "motion", 80: "cycle", 17: "plane", 18: "plane", 19: "plane", 90: "distance",
    91: "distance", 60: "exact", 61: "exact", 61.1: "exact", 64: "exact", 9: "once", 20: "unit", 21: "unit", 70: "unit",
    71: "unit", 700: "unit", 710: "unit", 93: "feed", 94: "feed", 95: "feed", 96: "speed", 97: "speed", 98: "return",
    99: "return", **dict.fromkeys((28, 30, 4, 10, 92, 52, 5, 5.1), "action"), 53: "machine",
    153: "machine", 500: "system", **dict.fromkeys(range(54, 60), "system"), 59.1: "system", 59.2: "system", 59.3: "system",
    **dict.fromkeys(range(505, 600), "system"), 65: "action", 68: "frame", 69: "frame", 50.1: "frame", 51.1: "frame",
    50: "frame", 51: "frame", 15: "polar", 16: "polar",
    68.2: "frame", 53.1: "frame", 43.4: "length", 43.5: "length", 43: "length", 44: "length", 49: "length",
    40: "radius", 41: "radius", 42: "radius", 41.1: "radius", 42.1: "radius", 450: "corner", 451: "corner",
    **dict.fromkeys(CYCLES, "motion")}
# Words of G that move nothing here.
_CODES_WITHOUT_MOTION = {43.1, 62, 63, 13.1, 54.1, 8, 8.1, 11, 40.1, 54.2, 67, 92.1,
          601, 602, 603, 641, 642, 643, 644, 645, 25, 26, 22, 23, 460, 461, 462, 91.1, 90.1}
_REFUSED_CODES = {6.2: "a spline", 7: "a diameter in X",
            33.1: "rigid tapping", 5.2: "a spline", 5.3: "a spline", **dict.fromkeys((38.2, 38.3, 38.4, 38.5), "probing"),
            33: "thread cutting", 34: "thread cutting", 32: "thread cutting", 331: "tapping", 332: "tapping",
            12.1: "polar interpolation", 7.1: "cylinder interpolation", 110: "polar coordinates", 111: "polar coordinates",
            112: "polar coordinates"}
# Siemens words that choose how a contour is reached; only NORM is computed, the others are said.
_CONTOUR_WAYS = re.compile(r"\b(?:NORM|KONT[CT]?|CDON|CDOF2?)\b")
_LETTERS_WITHOUT_MOTION = set("NSTMDOH")
_VECTOR_WORDS = {"A3": 0, "B3": 1, "C3": 2}
# Words that belong to a cycle, a dwell, a call or a turned part.
_TAKEN = "PQEUVW"


@dataclass
class BlockReader:
    """Takes blocks one by one and moves the state; `words` collects the auxiliary words."""

    state: ControlModes
    variables: MutableMapping[str, float]
    unset: set[str] = field(default_factory=set)
    words: list[tuple[int, str, float]] = field(default_factory=list)
    cycle: Cycle = field(default_factory=Cycle)
    rotary: set[int] = field(default_factory=set)
    turned: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.siemens = SiemensBlocks(self.state, self.variables, self.unset)
        self.frames = FanucFrames(self.state)

    def take(self, number: int, text: str, column: int) -> Request:
        """Carry out a block; return what it asks of the run."""
        remarks = self.state.remarks
        if re.match(r"@\s*\d{3}\b", text):  # words of the Sinumerik 850; a distance from the pole elsewhere
            remarks.without_motion(number, text.split()[0])
            return None
        fault_count = remarks.count
        if self.siemens.take(number, text):
            self._show_position()
            return None
        text, corner_words = take_corner_words(self._without_ways(number, text), self.variables, self.unset)
        row_count = len(self.state.segments.rows)
        words, assigned = split_words(text, self.variables, self.unset)
        groups, numbers, places = self._sort(number, words, column)
        self._modal(number, groups, numbers)
        request = self._program_end(numbers, groups)
        if remarks.count > fault_count:
            self.state.position = self.state.target(places)  # what follows is read from where the block was meant to end
        else:
            self._carry_out(number, groups, numbers, places, assigned)
            self._keep_corners(number, corner_words, has_moved=len(self.state.segments.rows) > row_count)
        self._show_position()
        return request

    def _keep_corners(self, number: int, words: Mapping[str, float], *, has_moved: bool) -> None:
        """Round or break the corner behind the block, by its own words or by RNDM."""
        state = self.state
        if "RNDM" in words:
            state.modal_rounding = words["RNDM"] * state.scale
        feed = next((state.feed_scale * words[name] / 60 for name in ("FRC", "FRCM") if name in words), 0.0)
        for name, kind in ((",R", ROUND), ("RND", ROUND), (",C", LEG), ("CHR", LEG), ("CHF", CHAMFER)):
            if name in words:
                state.keep_corner(number, kind, words[name] * state.scale, feed=feed)
                return
        if has_moved and state.modal_rounding:
            state.keep_corner(number, ROUND, state.modal_rounding, feed=feed, is_modal=True)

    def _without_ways(self, number: int, text: str) -> str:
        """Return a block without the words for ways to a compensated contour (Siemens), which are taken as NORM."""
        for match in _CONTOUR_WAYS.finditer(text):
            if match[0] in ("KONT", "KONTC", "KONTT"):
                self.state.remarks.note(number, f"{match[0]}: the ways to the contour and from it are taken as NORM")
            else:
                self.state.remarks.without_motion(number, match[0])
            if match[0] == "CDON":
                self.state.remarks.look_ahead = "CDON"
        return _CONTOUR_WAYS.sub(lambda match: " " * len(match[0]), text)

    def _sort(self, number: int, words: list[Word], column: int) -> tuple[dict[str, float], dict[str, float], Places]:
        """Return the G words by their group, the other numbers by letter, and the places."""
        remarks = self.state.remarks
        groups: dict[str, float] = {}
        numbers: dict[str, float] = {}
        places: Places = {}
        turns: dict[str, tuple[str, float]] = {}
        vector: dict[int, float] = {}
        for word in words:
            letter, value, place_column = word.letter, word.value, word.column + column
            if letter == "G":
                self._sort_g(number, round(value, 1), place_column, groups)
            elif letter in AXES or letter in CENTER or letter in ("CR", "R", "@", "^"):
                key = "CR" if letter == "R" else letter
                if key in places:
                    remarks.fault(number, place_column, f"{letter} twice in one block")
                places[key] = word.mode, value
            elif letter in "FS" and letter in numbers:
                remarks.fault(number, place_column, f"{letter} twice in one block")
            elif letter in "NO" and word is not words[0]:
                remarks.fault(number, place_column, f"{letter}{value:g} inside a block, where no number of a block or a "
                              "program stands; is a letter O in place of a zero, or are two blocks in one line?")
            elif letter == "F":
                numbers["F"] = value
            elif letter in _LETTERS_WITHOUT_MOTION:
                self.words.append((number, letter, value))
                if letter in "MTDHS":
                    numbers[letter if letter != "M" else f"M{value:g}"] = value
            elif letter in ROTARY_AXES:
                numbers[letter] = value
                turns[letter] = word.mode, value
            elif letter in _VECTOR_WORDS:
                vector[_VECTOR_WORDS[letter]] = value
            else:
                numbers[letter] = value
                if letter in "UVW":
                    places[letter] = "IC", value
        if any(word.letter == "G" and round(word.value, 1) == 43.1 for word in words):
            places.clear()  # X to Z, I to K of this block are the tool's offset, no place (LinuxCNC)
            remarks.note(number, "G43.1: the offset of the tool is passed over")
        self._take_direction(number, groups, turns, vector, places=places, numbers=numbers)
        self._check_letters(number, groups, numbers, words, column)
        return groups, numbers, places

    def _take_direction(self, number: int, groups: Mapping[str, float], turns: dict[str, tuple[str, float]],
                        vector: dict[int, float], *, places: Places, numbers: Mapping[str, float]) -> None:
        """Begin or end tool centre control, and take the angles or the vector of the tool that the block gives."""
        state, length = self.state, groups.get("length")
        if length in (43.4, 43.5):
            begin_control(state, number, f"G{length:g}", takes_vector_words=length == 43.5)
        elif length is not None:
            if state.centre.word.startswith("G"):
                end_control(state)
            state.remarks.without_motion(number, f"G{length:g}")
        if numbers.keys() & {"M428", "M429"}:  # LinuxCNC's sample machines: with tool centre control, or axis by axis
            begin_control(state, number, "M428") if "M428" in numbers else end_control(state)
        if turns:
            if not state.centre.word:
                cuts = groups.get("motion", state.motion) and places.keys() & AXES.keys()
                (self.turned if cuts else self.rotary).add(number)
            incremental = groups["distance"] == 91 if "distance" in groups else state.incremental
            state.centre.turn_to(turns, incremental=incremental)
        if state.centre.takes_vector_words and groups.get("motion", state.motion) in (0, 1):
            vector |= {i: places.pop(letter)[1] for letter, i in CENTER.items() if letter in places}
        if vector and not state.centre.word:
            state.remarks.fault(number, 1, "a vector of the tool's direction without TRAORI")
        elif vector and (wrong := state.centre.point_along((vector.get(0, 0.0), vector.get(1, 0.0), vector.get(2, 0.0)))):
            state.remarks.fault(number, 1, wrong)

    def _sort_g(self, number: int, value: float, place_column: int, groups: dict[str, float]) -> None:
        remarks = self.state.remarks
        group = _GROUPS.get(value)
        if value in _REFUSED_CODES:
            remarks.fault(number, place_column, f"G{value:g}: {_REFUSED_CODES[value]} is not computed; post the program "
                          f"without it, with the "
                          "path of the tool's centre")
        elif self.state.turning and value in (70, 71, 72, 73, 74, 75, 76, 92):
            remarks.fault(number, place_column, f"G{value:g}: a turning cycle is not computed; post the program with single "
                          f"moves")
        elif group is None and value in _CODES_WITHOUT_MOTION:
            remarks.without_motion(number, f"G{value:g}")
        elif group is None:
            remarks.fault(number, place_column, f"G{value:g} is not in the subset")
        elif group in groups and groups[group] != value:
            remarks.fault(number, place_column, f"G{value:g} and G{groups[group]:g} in one block")
        else:
            groups[group] = value

    def _check_letters(self, number: int, groups: Mapping[str, float], numbers: Mapping[str, float], words: list[Word],
                       column: int) -> None:
        """Fault the words P, Q, ... where nothing takes them; a word L alone calls a subprogram (Sinumerik 850)."""
        taken = groups.get("motion", self.cycle.number) in CYCLES or groups.keys() & {"action", "length", "frame"} or any(
            word.letter == "G" and word.value in _CODES_WITHOUT_MOTION | {64, 96, 97} for word in words)
        if taken or any(key.startswith("M") for key in numbers):
            return
        for word in words:
            if word.letter == "L":
                self.state.remarks.note(number, f"L{word.value:g} beside other words (a tool change of the machine's own) is "
                                        "left out with its motion")
            elif word.letter in _TAKEN and not (word.letter in "UVW" and self.state.turning):
                self.state.remarks.fault(number, word.column + column, f"unknown word {word.letter}{word.value:g}")

    def _modal(self, number: int, groups: Mapping[str, float], numbers: Mapping[str, float]) -> None:
        """Keep the modal words."""
        state = self.state
        if "motion" in groups:
            motion = int(groups["motion"])
            if motion not in CYCLES:
                state.motion, self.cycle = motion, Cycle()
            elif motion != self.cycle.number:
                third = 3 - sum({17: (0, 1), 18: (2, 0), 19: (1, 2)}[int(groups.get("plane", state.plane))])
                self.cycle = Cycle(motion, initial=state.position[third], level=state.position[third],
                                   to_level=self.cycle.to_level)
        if "cycle" in groups:
            self.cycle = Cycle()
        state.plane = int(groups.get("plane", state.plane))
        if "distance" in groups:
            state.incremental = groups["distance"] == 91
        if "polar" in groups:
            state.polar = [0.0, 0.0] if groups["polar"] == 16 else None
        self._radius_words(number, groups, numbers)
        if "exact" in groups:
            state.exact = groups["exact"] != 64
        if "unit" in groups:
            state.scale = 0.0254 if groups["unit"] in (20, 70, 700) else 1e-3
            if groups["unit"] in (20, 21, 700, 710):
                state.feed_scale = state.scale
        if "return" in groups and not state.turning:
            self.cycle.to_level = groups["return"] == 99
        elif "return" in groups:
            state.feed_mode = 94 if groups["return"] == 98 else 95
        if "system" in groups and groups["system"] != state.system:
            state.system = groups["system"]
        if "system" in groups and state.system != 500 and state.system not in state.offsets:
            state.remarks.note(number, f"offset G{state.system:g} is not in the program and is zero")
        if "T" in numbers or "M6" in numbers:
            state.segments.call_tool(numbers.get("T"), change="M6" in numbers)
        self._feeds(number, groups, numbers)

    def _radius_words(self, number: int, groups: Mapping[str, float], numbers: Mapping[str, float]) -> None:
        """Begin or end radius compensation; keep the register D and the kind of outside corners."""
        mode, word = self.state.compensation, groups.get("radius")
        if word in (41, 42) and self.state.turning:
            self.state.remarks.fault(number, 1, f"G{word:g}: radius compensation of a turning tool is not computed; post the "
                                     "program with the path of the tool's centre")
        elif word in (41.1, 42.1):
            if "D" not in numbers:
                self.state.remarks.fault(number, 1, f"G{word:g} without D; program the diameter of the tool in D")
            mode.begin(1 if word == 41.1 else -1, self.state.scale * numbers.get("D", 0.0) / 2)
        elif word == 40 and not mode.side:
            self.state.remarks.without_motion(number, "G40")
        elif word is not None:
            mode.begin({40: 0, 41: 1, 42: -1}[int(word)])
        if "D" in numbers and word not in (41.1, 42.1):
            mode.register = int(numbers["D"])
        if "corner" in groups:
            self.state.remarks.without_motion(number, f"G{groups['corner']:g}")
            mode.is_mitred = groups["corner"] == 451

    def _feeds(self, number: int, groups: Mapping[str, float], numbers: Mapping[str, float]) -> None:
        state = self.state
        state.feed_mode = int(groups.get("feed", state.feed_mode))
        limit = state.turning and state.surface_speed > 0 and not groups.keys() & {"motion", "speed"}
        if groups.get("speed") == 96:
            state.surface_speed = numbers.get("S", 0.0) * (1.0 if state.scale == 1e-3 else 0.3048) or state.surface_speed
        elif groups.get("speed") == 97:
            state.surface_speed = 0.0
        if "S" in numbers and limit:
            state.top_speed = numbers["S"]
        elif "S" in numbers and groups.get("speed") != 96:
            state.speed = numbers["S"]
        if "F" in numbers and groups.get("action") != 4:
            if numbers["F"] <= 0:
                state.remarks.fault(number, 1, f"F{numbers['F']:g}; feed must be above zero")
            else:
                state.set_feed(numbers["F"])
        elif "feed" in groups and state.feed_word > 0:
            state.feed_missed = False

    def _program_end(self, numbers: Mapping[str, float], groups: Mapping[str, float]) -> Request:
        if "M98" in numbers or groups.get("action") == 65:
            repeats = int(numbers.get("L", 1))
            name = int(numbers.get("P", 0))
            if "L" not in numbers and name > 9999:  # the older way: repeats before the number
                repeats, name = divmod(name, 10000)
            return "macro" if groups.get("action") == 65 else "call", str(name), min(repeats, 9999)
        if "M99" in numbers or "M17" in numbers:
            return "return", "", 1
        return ("end", "", 1) if "M2" in numbers or "M30" in numbers else None

    def _carry_out(self, number: int, groups: Mapping[str, float], numbers: Mapping[str, float], places: Places,
                   assigned: Mapping[str, float]) -> None:
        """Move as the block says; radius compensation rests where a block goes to a place of the machine."""
        side, mode = self.state.compensation.side, self.state.compensation
        if groups.get("action") in (28, 30) or "machine" in groups:
            mode.side = 0
        self._move(number, groups, numbers, places, assigned)
        mode.side = side

    def _move(self, number: int, groups: Mapping[str, float], numbers: Mapping[str, float], places: Places,
              assigned: Mapping[str, float]) -> None:
        state, action = self.state, groups.get("action")
        if "frame" in groups and self.frames.take(number, groups["frame"], places, numbers=numbers):
            return
        if action == 4:
            duration = numbers["F"] if "F" in numbers else dwell_of(numbers["P"]) if "P" in numbers else \
                places.get("X", ("", numbers.get("U", 0.0)))[1]
            state.wait(number, duration)
        elif action in (28, 30):
            self._reference(number, places)
        elif action in (5, 5.1) and {"X", "Y"} & places.keys():
            follow_spline(state, number, action, places=places, numbers=numbers)
        elif action in (5, 5.1):  # high-speed modes of Fanuc: G05 P10000, G5.1 Q1
            state.remarks.without_motion(number, f"G{action:g}")
        elif action in (10, 52, 92) and state.tilted.matrix is not None:
            state.remarks.fault(number, 1, f"G{action:g} in a tilted plane is not computed; set the zero before it is tilted")
        elif action == 92 and not state.frame.is_identity:
            state.remarks.fault(number, 1, "G92 where the program's axes are turned or mirrored is not computed")
        elif action == 92 and places and not state.turning:
            for letter, i in AXES.items():
                if letter in places:
                    state.shift[i] = 0.0
                    state.shift[i] = state.position[i] - state.length(i, places[letter][1]) - state.origin[i]
        elif action in (10, 52):
            self._offsets(number, action, numbers, places)
        elif action == 65:
            return
        elif self.cycle.number and (any(k in AXES or k in POLAR_WORDS for k in places) or groups.get("motion") in CYCLES):
            parameters = {key: assigned[key] for key in ("R2", "R3", "R10") if key in assigned}
            if state.centre.word:
                state.remarks.fault(number, 1, f"a drilling cycle under {state.centre.word} is not computed; post single moves")
            if state.compensation.side:
                state.remarks.fault(number, 1, "a drilling cycle under radius compensation; program G40 before it")
            begin_cycle(state, self.cycle, number, places=places, numbers=numbers, parameters=parameters)
            repeats = numbers.get("L", places.get("K", ("", 1.0))[1])
            drill(state, self.cycle, number, places=places, repeats=int(repeats))
        elif wrong := question_polar_words(places, state.programmed, plane=state.plane, incremental=state.incremental):
            state.remarks.fault(number, 1, wrong)
        elif any(k in AXES or k in CENTER or k in POLAR_WORDS or (k in "UVW" and state.turning) for k in places):
            state.move(number, places, once="once" in groups, machine="machine" in groups)
            self.siemens.after_move(number)
        elif state.centre.turns:
            state.swing(number)

    def _reference(self, number: int, places: Places) -> None:
        """Go to the reference point by way of the point of the block."""
        state = self.state
        state.remarks.note(number, "the reference point of G28 and G30 is taken as the machine's zero")
        between = state.target(places)
        if between != state.position:
            state.rapid(number, between)
        axes = {letter for letter in places if letter in AXES} | {"XYZ"["UVW".index(k)] for k in places if k in "UVW"}
        end = [0.0 if "XYZ"[i] in axes or not axes else value for i, value in enumerate(state.position)]
        if end != state.position:
            state.rapid(number, end)

    def _offsets(self, number: int, action: float, numbers: Mapping[str, float], places: Places) -> None:
        """Set work offsets (G10 L2) or the local shift (G52)."""
        state = self.state
        if action == 52:
            for letter, i in AXES.items():
                if letter in places:
                    state.shift[i] = state.length(i, places[letter][1])
        elif numbers.get("L") in (2, 20):
            system = 53 + (numbers.get("P", 0) or state.system - 53)
            offset = state.offsets.setdefault(system, [0.0, 0.0, 0.0])
            for letter, i in AXES.items():
                if letter in places:
                    value = state.length(i, places[letter][1])
                    offset[i] = value if numbers["L"] == 2 else state.position[i] - value
        elif numbers.get("L") in (12, 13) and "CR" in places:  # geometry and wear of a register D (Fanuc)
            registers = state.compensation.geometry if numbers["L"] == 12 else state.compensation.wear
            registers[int(numbers.get("P", 0))] = places["CR"][1] * state.scale
        else:
            state.remarks.without_motion(number, "G10")

    def _show_position(self) -> None:
        """Let the program read where it is: #5021 and #5041 on, and LinuxCNC's names."""
        state, programmed = self.state, self.state.programmed
        for i in range(3):
            machine, programmed_value = state.position[i] / state.scale, programmed[i] / state.scale
            for first, value in ((5001, programmed_value), (5021, machine), (5041, programmed_value), (5061, programmed_value),
                                 (5420, programmed_value)):
                self.variables[f"#{first + i}"] = value
            self.variables[f"#<_{'xyz'[i]}>".upper()] = programmed_value
