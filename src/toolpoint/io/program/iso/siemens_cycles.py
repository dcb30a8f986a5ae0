"""Drilling cycles of Siemens controls as moves: CYCLE81 to CYCLE89 and CYCLE840, once or after every move (MCALL), and their
patterns HOLES1, HOLES2 and CYCLE801.

Their parameters, by place: RTP retraction level, RFP reference level, SDIS safety distance, DP depth or DPR depth below RFP;
then what each kind adds (Sinumerik 840D, programming manual of cycles).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from toolpoint.io.program.control.frame import PLANES
from toolpoint.io.program.control.modes import ControlModes

CALL = re.compile(r"(MCALL)?\s*\b(CYCLE\d+|HOLES\d)\s*\((.*)\)\s*$", re.DOTALL)
CALL_END = re.compile(r"MCALL\s*$")
_COMMON_PARAMETERS = ("RTP", "RFP", "SDIS", "DP", "DPR")
_PARAMETERS_OF_CYCLE = {
    "CYCLE81": (), "CYCLE82": ("DTB",),
    "CYCLE83": ("FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI", "", "MDEP", "VRT", "DTD", "DIS1"),
    "CYCLE84": ("DTB", "SDAC", "MPIT", "PIT", "POSS", "SST", "SST1"),
    "CYCLE840": ("DTB", "SDR", "SDAC", "ENC", "MPIT", "PIT"), "CYCLE85": ("DTB", "FFR", "RFF"),
    "CYCLE86": ("DTB", "SDIR", "RPA", "RPO", "RPAP", "POSS"), "CYCLE87": ("SDIR",), "CYCLE88": ("DTB", "SDIR"),
    "CYCLE89": ("DTB",)}
_PATTERNS = {"HOLES1": ("SPCA", "SPCO", "STA1", "FDIS", "DBH", "NUM"), "HOLES2": ("CPA", "CPO", "RAD", "STA1", "INDA", "NUM"),
             "CYCLE801": ("SPCA", "SPCO", "STA1", "DIS1", "DIS2", "NUM1", "NUM2")}
# Coarse pitches of ISO 261 by nominal diameter, mm.
_PITCH = {3: 0.5, 4: 0.7, 5: 0.8, 6: 1.0, 8: 1.25, 10: 1.5, 12: 1.75, 14: 2.0, 16: 2.0, 18: 2.5, 20: 2.5, 22: 2.5, 24: 3.0,
          27: 3.0, 30: 3.5, 33: 3.5, 36: 4.0, 39: 4.0, 42: 4.5, 45: 4.5, 48: 5.0}
# Way that chip breaking goes back; distance kept when a hole is entered again, 1/50 of the depth of deep ones, m.
_CHIP_BREAK_RETRACT_M, _REENTRY_DISTANCE_M, _SHALLOW_HOLE_DEPTH_M, _MAX_REENTRY_DISTANCE_M = 1e-3, 0.6e-3, 30e-3, 7e-3
# A pattern with a count in the wrong parameter must end as a fault, not as millions of moves.
_MAX_HOLES = 10_000


@dataclass(frozen=True)
class CycleCall:
    """A cycle with its parameters by name; those left out are missing."""

    name: str
    values: dict[str, float]

    def get(self, name: str, default: float = 0.0) -> float:
        """Return a parameter, or the default where it was left out."""
        return self.values.get(name, default)


def assign_parameters(name: str, values: list[float | None]) -> CycleCall | None:
    """Return the call of a cycle, None for one that is not drilling."""
    names = _PATTERNS.get(name) or ((*_COMMON_PARAMETERS,
                                     *_PARAMETERS_OF_CYCLE[name]) if name in _PARAMETERS_OF_CYCLE else None)
    if names is None:
        return None
    # What stands behind the known places chooses screens and units of newer controls; it moves nothing.
    return CycleCall(name, {key: value for key, value in zip(names, values, strict=False) if key and value is not None})


def is_pattern(call: CycleCall) -> bool:
    """Whether a call only says where holes are."""
    return call.name in _PATTERNS


def pattern_places(call: CycleCall) -> Iterator[tuple[float, float]]:
    """Yield the places of a pattern in the plane, in programmed units."""
    turn = math.radians(call.get("STA1"))
    if call.name == "HOLES2":
        count = min(int(call.get("NUM")), _MAX_HOLES)
        step = math.radians(call.get("INDA")) or 2 * math.pi / max(count, 1)
        for k in range(count):
            yield (call.get("CPA") + call.get("RAD") * math.cos(turn + k * step),
                   call.get("CPO") + call.get("RAD") * math.sin(turn + k * step))
        return
    if call.name == "HOLES1":
        grid = [(call.get("FDIS") + k * call.get("DBH"), 0.0) for k in range(min(int(call.get("NUM")), _MAX_HOLES))]
    else:
        across, up = min(int(call.get("NUM1")), _MAX_HOLES), min(int(call.get("NUM2")), _MAX_HOLES)
        grid = [(i * call.get("DIS1"), j * call.get("DIS2")) for j in range(up)
                for i in (range(across) if j % 2 == 0 else reversed(range(across)))][:_MAX_HOLES]
    for u, v in grid:
        yield (call.get("SPCA") + u * math.cos(turn) - v * math.sin(turn),
               call.get("SPCO") + u * math.sin(turn) + v * math.cos(turn))


def peck_depths(first: float, degression: float, total: float, *, least_stroke: float = 0.0) -> list[float]:
    """Return the depths (from the reference level) to which CYCLE83 drills one after the other.

    The first stroke is given; each next one is shorter by the degression, or by that factor where it is negative, and never
    shorter than the degression (or `least_stroke`); what is left below two last strokes is shared between two.
    """
    first = min(first, total) if first > 0 else total
    depths, stroke = [first], first
    floor = max(least_stroke, degression if degression > 0 else 0.0)
    # Degressive pecks get ever smaller: rounding would add a last one of nothing, and a small minimum pecks without end.
    while total - depths[-1] > 1e-9 * total and len(depths) < _MAX_HOLES:
        if degression > 0:
            stroke = max(stroke - degression, min(floor, stroke))
        elif degression < 0:
            stroke = max(stroke * -degression, min(least_stroke, stroke))
        left = total - depths[-1]
        if left <= stroke:
            depths.append(total)
        elif left < 2 * stroke:
            depths += [depths[-1] + left / 2, total]
        else:
            depths.append(depths[-1] + stroke)
    return depths


def fault_of(call: CycleCall) -> str:
    """Return what is wrong with a call, empty where it is right."""
    if is_pattern(call):
        count = "NUM1" if call.name == "CYCLE801" else "NUM"
        return "" if call.get(count) >= 1 else f"{call.name} without a number of holes"
    missing_levels = [name for name in ("RTP", "RFP") if name not in call.values]
    if missing_levels or not call.values.keys() & {"DP", "DPR"}:
        return f"{call.name} without {', '.join(missing_levels) or 'a depth (DP or DPR)'}"
    if call.get("RTP") < call.get("RFP"):
        return f"{call.name}: the retraction level {call.get('RTP'):g} is below the reference level {call.get('RFP'):g}"
    if "DPR" not in call.values and call.get("DP") > call.get("RFP"):
        return f"{call.name}: the depth {call.get('DP'):g} is above the reference level {call.get('RFP'):g}"
    if call.name == "CYCLE83" and call.get("DAM") < -1:
        return f"CYCLE83: a degression of {call.get('DAM'):g}; must be an amount, or a factor from -1 to 0"
    return ""


def drill_hole(state: ControlModes, call: CycleCall, number: int) -> None:
    """Add the moves of a drilling cycle where the tool stands."""
    third = 3 - sum(PLANES[state.plane])
    if not state.frame.is_upright(third):
        state.remarks.fault(number, 1, f"{call.name} where the frame tilts, stretches or mirrors the axis of the tool is not "
                            "computed")
        return
    _Hole(state, call, number, third).run()


class _Hole:
    """One hole: levels in machine coordinates, m."""

    def __init__(self, state: ControlModes, call: CycleCall, number: int, third: int) -> None:
        self.state, self.call, self.number, self.third = state, call, number, third
        origin, unit = state.origin[third], state.scale
        reference = call.get("RFP")
        self.total = abs(call.get("DPR")) if "DPR" in call.values else abs(reference - call.get("DP"))
        self.retract_level = origin + unit * call.get("RTP")
        self.start = origin + unit * (reference + abs(call.get("SDIS")))
        self.reference, self.unit = origin + unit * reference, unit

    def run(self) -> None:
        """Go down, do what the cycle does at the bottom, come up."""
        state, name = self.state, self.call.name
        kept = state.feed, state.feed_word, state.feed_mode
        self._rapid(self.start)
        if name == "CYCLE83":
            self._pecks()
        else:
            self._set_feed("FFR")
            if name in ("CYCLE84", "CYCLE840"):
                self._thread_feed(self.call.get("SST"))
            self._cut(self.total)
            state.wait(self.number, max(self.call.get("DTB"), 0.0))
        if name in ("CYCLE84", "CYCLE840", "CYCLE85", "CYCLE89"):
            self._set_feed("RFF")
            if name == "CYCLE84" and self.call.get("SST1") > 0:
                self._thread_feed(self.call.get("SST1"))
            self._cut_to(self.start)
        if name == "CYCLE86":
            self._lift_off()
        self._rapid(self.retract_level)
        if name == "CYCLE86":
            self._lift_off(-1.0)
        state.feed, state.feed_word, state.feed_mode = kept

    def _pecks(self) -> None:
        call, state = self.call, self.state
        first = abs(call.get("FDPR")) if "FDPR" in call.values else abs(call.get("RFP") - call.get("FDEP", call.get("RFP")))
        word, depth_before = state.feed_word, 0.0
        for k, depth in enumerate(peck_depths(first, call.get("DAM"), self.total, least_stroke=abs(call.get("MDEP")))):
            if k and call.get("VARI") == 0:
                retract = abs(call.get("VRT")) or _CHIP_BREAK_RETRACT_M / self.unit
                self._rapid(self._level(depth_before - min(retract, depth_before)))
            elif k:
                self._rapid(self.start)
                state.wait(self.number, max(call.get("DTS"), 0.0))
                self._rapid(self._level(max(depth_before - (call.get("DIS1") or self._ahead()), 0.0)))
            if k == 0 and 0 < call.get("FRF", 1.0) < 1 and word > 0:
                state.set_feed(word * call.get("FRF"))
            self._cut(depth)
            if k == 0 and word > 0:
                state.set_feed(word)
            state.wait(self.number, max(call.get("DTB"), 0.0))
            depth_before = depth

    def _ahead(self) -> float:
        """Return the distance above the last depth at which the feed begins again, in programmed units."""
        if self.total * self.unit <= _SHALLOW_HOLE_DEPTH_M:
            return _REENTRY_DISTANCE_M / self.unit
        return min(self.total / 50, _MAX_REENTRY_DISTANCE_M / self.unit)

    def _set_feed(self, name: str) -> None:
        if self.call.get(name) > 0:
            self.state.set_feed(self.call.get(name))

    def _thread_feed(self, speed: float) -> None:
        """Feed by the pitch, where one is given: pitch times speed."""
        pitch = abs(self.call.get("PIT")) or _PITCH.get(int(abs(self.call.get("MPIT"))), 0.0)
        speed = speed or self.state.speed
        if pitch > 0 and speed > 0:
            self.state.feed = pitch * 1e-3 * speed / 60
            self.state.feed_word, self.state.feed_mode = pitch * speed, 94
        elif pitch > 0:
            self.state.remarks.fault(self.number, 1, f"{self.call.name} with a pitch but without a speed; program S or SST")

    def _lift_off(self, way: float = 1.0) -> None:
        """Leave the wall of a bored hole, or come back over its centre at the top."""
        state, (a, b) = self.state, PLANES[self.state.plane]
        words = {"XYZ"[a]: ("IC", way * self.call.get("RPA")), "XYZ"[b]: ("IC", way * self.call.get("RPO"))}
        if way > 0:
            words["XYZ"[self.third]] = ("IC", self.call.get("RPAP"))
        end = state.target(words)
        if end != state.position:
            state.rapid(self.number, end)

    def _level(self, depth: float) -> float:
        return self.reference - self.unit * depth

    def _cut(self, depth: float) -> None:
        self._cut_to(self._level(depth))

    def _cut_to(self, level: float) -> None:
        self.state.cut(self.number, self._at(level), stop=True)

    def _rapid(self, level: float) -> None:
        if self.state.position[self.third] != level:
            self.state.rapid(self.number, self._at(level))

    def _at(self, level: float) -> list[float]:
        end = list(self.state.position)
        end[self.third] = level
        return end
