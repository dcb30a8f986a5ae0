"""Modal state of a control: units, feeds, coordinate systems; and the segments that a block makes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from toolpoint.io.program.control.frame import AXES, PLANES, ProgramFrame
from toolpoint.io.program.control.polar_places import from_pole
from toolpoint.io.program.control.splines import SPLINE_MOTION
from toolpoint.io.program.control.tilted_planes import TiltedPlane
from toolpoint.io.program.control.tool_centre import CentreControl, part_of_turn
from toolpoint.io.program.language.remarks import Remarks
from toolpoint.io.program.path.radius_compensation import CompensationMode
from toolpoint.io.program.path.rounded_corners import Corner
from toolpoint.io.program.path.segments import MOST_SEGMENTS, Segments

CENTER = {"I": 0, "J": 1, "K": 2}
Places = dict[str, tuple[str, float]]
# Speed (rev/min) of a turned part near its axis where the program holds no limit of its own.
_TOP_SPEED = 3000.0
_ARC_CHORD_ERROR = 1e-6  # m, of arcs under tool centre control


@dataclass
class ControlModes:
    """Modal state while blocks are taken; positions in m, in machine coordinates."""

    rapid_feed: float
    tolerance: float
    position: list[float]
    remarks: Remarks
    segments: Segments = field(default_factory=Segments)
    feed: float = 0.0
    motion: int = 0
    plane: int = 17
    incremental: bool = False
    exact: bool = False
    scale: float = 1e-3
    feed_scale: float = 1e-3
    feed_word: float = 0.0
    feed_mode: int = 94
    speed: float = 0.0
    surface_speed: float = 0.0
    top_speed: float = _TOP_SPEED
    turning: bool = False
    feed_missed: bool = False
    offsets: dict[float, list[float]] = field(default_factory=dict)
    system: float = 54
    shift: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    frame: ProgramFrame = field(default_factory=ProgramFrame)
    tilted: TiltedPlane = field(default_factory=TiltedPlane)
    centre: CentreControl = field(default_factory=CentreControl)
    compensation: CompensationMode = field(default_factory=CompensationMode)
    polar: list[float] | None = None  # radius (in programmed units) and angle (degrees) last programmed under G16
    spline_end: tuple[list[float], complex] | None = None  # of the last spline: place, and last control point from there
    modal_rounding: float = 0.0  # m, of every corner of the contour (RNDM)
    programmed_axes: set[int] = field(default_factory=set)
    _unprogrammed: str = ""

    @property
    def origin(self) -> list[float]:
        """Origin of the program's coordinates, m."""
        offset = self.offsets.get(self.system, [0.0, 0.0, 0.0])
        place = self.tilted.into([a + b + c for a, b, c in zip(offset, self.shift, self.tilted.origin, strict=True)])
        return [a + b for a, b in zip(place, self.frame.shift, strict=True)]

    @property
    def programmed(self) -> list[float]:
        """Position in the program's coordinates, m."""
        return self.frame.turned_back([a - b for a, b in zip(self.position, self.origin, strict=True)])

    def length(self, axis: int, value: float) -> float:
        """Return a programmed length along an axis, m; X of a turned part is a diameter."""
        return value * self.scale * (0.5 if self.turning and axis == 0 else 1.0)

    def target(self, places: Places, *, machine: bool = False) -> list[float]:
        """Return the position after a block, m."""
        places = places if self.polar is None or machine else self._from_polar(places)
        places = from_pole(places, self.programmed, scale=self.scale, incremental=self.incremental)
        self._unprogrammed = "".join(letter for letter, i in AXES.items() if i not in self.programmed_axes)
        self.programmed_axes |= {i for letter, i in AXES.items() if letter in places}
        if not self.frame.is_identity and not machine:
            return self._target_in_frame(places)
        end, origin = list(self.position), [0.0, 0.0, 0.0] if machine else self.origin
        for letter, i in AXES.items():
            if letter in places:
                mode, value = places[letter]
                relative = mode == "IC" or (self.incremental and mode != "AC" and not machine)
                end[i] = self.length(i, value) + (end[i] if relative else origin[i])
        for letter, i in (("U", 0), ("V", 1), ("W", 2)):
            if letter in places and self.turning:
                end[i] += self.length(i, places[letter][1])
        return end

    def _from_polar(self, places: Places) -> Places:
        """Return the places of a block under G16: the plane's first axis is a radius, its second one an angle."""
        assert self.polar is not None
        first, second = ("XYZ"[i] for i in PLANES[self.plane])
        if first not in places and second not in places:
            return places
        for k, letter in enumerate((first, second)):
            mode, value = places.get(letter, ("AC", self.polar[k]))
            relative = k == 1 and (mode == "IC" or (self.incremental and mode != "AC"))
            self.polar[k] = value + (self.polar[k] if relative else 0.0)
        about = "IC" if self.incremental else "AC"  # about where the tool is, or about the program's zero
        radius, angle = self.polar[0], math.radians(self.polar[1])
        return {**places, first: (about, radius * math.cos(angle)), second: (about, radius * math.sin(angle))}

    def _target_in_frame(self, places: Places) -> list[float]:
        """Return the position after a block where the program's axes are turned, mirrored or stretched, m."""
        end = self.programmed
        for letter, i in AXES.items():
            if letter in places:
                mode, value = places[letter]
                relative = mode == "IC" or (self.incremental and mode != "AC")
                end[i] = self.length(i, value) + (end[i] if relative else 0.0)
        return [a + b for a, b in zip(self.frame.turned(end), self.origin, strict=True)]

    def set_feed(self, word: float) -> None:
        """Keep a word F."""
        self.feed_word = word
        self.feed = word * (self.feed_scale if self.feed_mode == 94 else self.scale) / 60

    def speed_for(self, number: int, end: list[float], length: float) -> float:
        """Return the feed of a cut to a point, m/s."""
        if self.feed_mode == 93:
            return length * self.feed_word / 60
        if self.feed_mode == 94:
            return self.feed
        speed = self.speed
        if self.surface_speed > 0:
            across = max(abs(end[0] + self.position[0]), 1e-6)  # mean diameter of the cut
            speed = min(self.surface_speed / (math.pi * across), self.top_speed)
        if speed <= 0:
            self.remarks.fault(number, 1, "feed per revolution without a speed; program S before it")
        return self.feed_word * self.scale * speed / 60

    def rapid(self, number: int, end: list[float]) -> None:
        """Move to a point in rapid."""
        self._line(number, end, self.rapid_feed, rapid=True, stop=True)

    def cut(self, number: int, end: list[float], *, stop: bool = False) -> None:
        """Move to a point in a straight cut."""
        self._check_tool_axis(number)
        if self._has_feed(number):
            feed = self.speed_for(number, end, math.dist(self.position, end))
            self._line(number, end, feed, rapid=False, stop=stop or self.exact)
        self.position = end

    def _check_tool_axis(self, number: int) -> None:
        if not self.tilted.is_reached:
            self.remarks.fault(number, 1, "a cut under G68.2 before G53.1: the tool is not turned to the plane; program G53.1")

    def _has_feed(self, number: int) -> bool:
        if self.feed_word > 0 or self.feed > 0:
            return True
        if not self.feed_missed:
            self.remarks.fault(number, 1, "no feed yet; program F in this or an earlier block, or give `feed`")
        self.feed_missed = True
        return False

    def _compensate(self, number: int) -> None:
        """Keep the radius compensation of the segment that follows."""
        mode = self.compensation
        factor = self.frame.plane_factor(PLANES[self.plane]) if mode.side else 1.0
        if mode.side and (factor is None or self.centre.word):
            self.remarks.fault(number, 1, "radius compensation in a plane that is tilted or stretched by the frame, or under "
                               "tool centre control, is not computed")
        self.segments.compensation = mode.of_block(is_mirrored=(factor or 1.0) < 0)

    def _line(self, number: int, end: list[float], feed: float, *, rapid: bool, stop: bool) -> None:
        if len(self.segments.rows) >= MOST_SEGMENTS:
            raise OverflowError
        self.segments.speed = self.speed
        self._compensate(number)
        is_turned = self.centre.is_turned
        directions = self.centre.arrive()
        self.segments.line(self.position, end, feed=feed, rapid=rapid, stop=stop, number=number, plane=PLANES[self.plane])
        if self.centre.word:
            self.segments.keep_directions(directions)
        elif is_turned or self.centre.is_turned:
            self._pass_unseen(number, rapid=rapid)
        self.position = end

    def _pass_unseen(self, number: int, *, rapid: bool) -> None:
        """Keep a move with the tool turned and no tool centre control: where its tip goes is not known."""
        if rapid:
            self.segments.keep_unseen()
            self.remarks.note(number, "rapids with turned axes and without tool centre control: their way is not looked at")
        else:
            self.segments.rotary.add(number)

    def swing(self, number: int) -> None:
        """Turn the tool about its tip, which stands; without tool centre control only the axes turn."""
        if not self.centre.word:
            self.centre.arrive()
            if self.motion:
                self.segments.rotary.add(number)
            return
        rapid = self.motion == 0
        if self.motion > 1:
            self.remarks.fault(number, 1, f"a turn in an arc under {self.centre.word} is not computed")
        elif rapid or self._has_feed(number):
            # F is degrees a minute there, rad/s of the segment; under G93 it is the inverse of the block's time.
            rate = self.feed_word * self.centre.turn / 60 if self.feed_mode == 93 else math.radians(self.feed_word) / 60
            self._line(number, list(self.position), self.rapid_feed if rapid else rate, rapid=rapid, stop=True)

    def keep_corner(self, number: int, kind: str, size: float, *, feed: float = 0.0, is_modal: bool = False) -> None:
        """Round or break (m) the corner behind the last row."""
        if size < 0 or not self.segments.rows:
            self.remarks.fault(number, 1, f"a {kind} of {1e3 * size:g} mm with no block before it, or below zero")
        elif size > 0:
            self.segments.corners[len(self.segments.rows) - 1] = Corner(kind, size, number, feed, is_modal)

    def move(self, number: int, places: Places, *, once: bool, machine: bool) -> None:
        """Add the segment of a block of motion."""
        if machine and self.centre.word and not self.motion:
            self.rapid(number, self.target(places, machine=True))
            self.segments.keep_unseen()
            self.remarks.note(number, f"rapids in machine coordinates under {self.centre.word}: their way is not looked at")
            return
        if machine and self.centre.word:
            self.remarks.fault(number, 1, f"a cut in machine coordinates under {self.centre.word} is not computed")
        if machine and self.tilted.matrix is not None:
            self.remarks.note(number, "a move in machine coordinates in a tilted plane is taken along the axes of the plane")
        end = self.target(places, machine=machine)
        if self.motion == SPLINE_MOTION:
            self.remarks.fault(number, 1, "a place without G0, G1 or G5 behind a spline")
            self.position = end
        elif self.motion >= 2:
            self._arc(number, places, end, once)
        elif any(k in CENTER or k == "CR" for k in places):
            self.remarks.fault(number, 1, "I, J, K or CR on a straight line; program G2 or G3")
            self.position = end
        elif self.motion:
            self.cut(number, end, stop=once)
        else:
            self.rapid(number, end)

    def _arc(self, number: int, places: Places, end: list[float], once: bool) -> None:
        start = self.position
        self._check_tool_axis(number)
        if self.centre.is_turned and not self.centre.word:
            self.segments.rotary.add(number)
        geometry = self._has_feed(number) and self._arc_geometry(number, places, start, end)
        if geometry:
            if missing_axes := self._missing_start():
                self.remarks.note(number, missing_axes)
            self._sweep(number, geometry, end, stop=self.exact or once)
        self.position = end

    def follow_arc(self, number: int, center: list[float], sweep: float, *, end: list[float]) -> None:
        """Add an arc of known centre (m) and sweep (rad), that may be several turns."""
        self._check_tool_axis(number)
        if self._has_feed(number):
            self._sweep(number, (center, sweep), end, stop=self.exact)
        self.position = end

    def _sweep(self, number: int, geometry: tuple[list[float], float], end: list[float], *, stop: bool) -> None:
        (center, sweep), (a, b), start = geometry, PLANES[self.plane], self.position
        radius = math.hypot(start[a] - center[a], start[b] - center[b])
        feed = self.speed_for(number, end, abs(sweep) * radius)
        self.segments.speed = self.speed
        self._compensate(number)
        if self.centre.word:
            self._chords(number, end, (center, sweep), feed=feed)
            return
        self.segments.arc(start, end, center, sweep=sweep, plane=(a, b), feed=feed, stop=stop, number=number)

    def _chords(self, number: int, end: list[float], arc: tuple[list[float], float], *, feed: float) -> None:
        """Follow an arc under tool centre control by chords, along which the tool turns evenly."""
        (center, sweep), (a, b) = arc, PLANES[self.plane]
        start, directions = list(self.position), self.centre.arrive()
        u, v = start[a] - center[a], start[b] - center[b]
        radius = math.hypot(u, v)
        count = max(1, math.ceil(abs(sweep) / (2 * math.acos(max(1 - _ARC_CHORD_ERROR / radius, 0.0)))))
        if any(math.isnan(x) != math.isnan(y) for x, y in zip(directions[3:6], directions[9:], strict=True)):
            self.remarks.fault(number, 1, "an arc whose ends have a vector and angles of the tool is not computed")
        for k in range(1, count + 1):
            share, turn = k / count, sweep * k / count
            place = [x + share * (y - x) for x, y in zip(start, end, strict=True)]
            place[a] = center[a] + math.cos(turn) * u - math.sin(turn) * v
            place[b] = center[b] + math.sin(turn) * u + math.cos(turn) * v
            place = end if k == count else place
            self.segments.line(self.position, place, feed=feed, rapid=False, stop=self.exact and k == count, number=number,
                               plane=(a, b))
            self.segments.keep_directions(part_of_turn(directions, (k - 1) / count, share))
            self.position = place

    def _arc_geometry(self, number: int, places: Places, start: list[float], end: list[float]
                      ) -> tuple[list[float], float] | None:
        """Return centre and sweep of an arc, or nothing after a fault."""
        a, b = PLANES[self.plane]
        factor = self.frame.plane_factor((a, b))
        if factor is None:
            self.remarks.fault(number, 1, "an arc that a rotation tilts out of its plane, or a scale makes an ellipse, is not "
                               "computed")
            return None
        turn = math.copysign(1.0, factor) * (-1.0 if self.motion == 2 else 1.0)
        center = self._center(number, places, start, end, turn=turn)
        if center is None:
            return None
        r0 = math.hypot(start[a] - center[a], start[b] - center[b])
        r1 = math.hypot(end[a] - center[a], end[b] - center[b])
        # What rounding to the digits of the program makes: some units of its last digit, more where it is in inches.
        if r0 == 0 or abs(r0 - r1) > max(self.tolerance * self.scale / 1e-3, 1e-4 * r0):
            self.remarks.fault(number, 1, f"arc with radius {1e3 * r0:.6g} mm at its start and {1e3 * r1:.6g} mm at its end; "
                               + (self._missing_start() or "correct I, J, K or the end point"))
            return None
        first = math.atan2(start[b] - center[b], start[a] - center[a])
        last = math.atan2(end[b] - center[b], end[a] - center[a])
        sweep = (turn * (last - first)) % (2 * math.pi)
        # Ends that agree but for rounding are a full circle, never an arc of nothing: so ISO 6983 and all controls read
        # them.
        if sweep < 1e-9 or 2 * math.pi - sweep < 1e-9:
            sweep = 2 * math.pi
        return center, turn * sweep

    def _missing_start(self) -> str:
        """Return the axes of an arc's start that no block before it has programmed, in words; empty where all were."""
        missing_axes = [letter for letter, i in AXES.items() if letter in self._unprogrammed and i in PLANES[self.plane]]
        if not missing_axes or self.incremental:
            return ""
        place = ", ".join(f"{1e3 * self.position[AXES[letter]]:g} mm" for letter in missing_axes)
        return (f"no block before this arc programs {' and '.join(missing_axes)}, so that its start is taken at {place}; "
                f"position "
                f"{' and '.join(missing_axes)} before it")

    def _center(self, number: int, places: Places, start: list[float], end: list[float], *, turn: float) -> list[float] | None:
        if "CR" in places:
            size = abs(self.frame.plane_factor(PLANES[self.plane]) or 1.0)
            return self._from_radius(number, places["CR"][1] * self.scale * size, start, end, turn=turn)
        if not any(k in places for k in CENTER):
            self.remarks.fault(number, 1, "an arc needs I, J, K or CR=")
            return None
        # In the program's coordinates, then as these lie.
        current = self.frame.turned_back([a - b for a, b in zip(start, self.origin, strict=True)])
        center = list(current)
        for letter, i in CENTER.items():
            if letter not in places:
                continue
            if i not in PLANES[self.plane]:
                self.remarks.fault(number, 1, f"{letter} is not in the plane of G{self.plane}")
                return None
            mode, value = places[letter]
            center[i] = value * self.scale + (0.0 if mode == "AC" else current[i])
        return [a + b for a, b in zip(self.frame.turned(center), self.origin, strict=True)]

    def _from_radius(self, number: int, radius: float, start: list[float], end: list[float], *, turn: float
                     ) -> list[float] | None:
        """Return the centre for a radius; a negative radius means the longer arc."""
        a, b = PLANES[self.plane]
        da, db = end[a] - start[a], end[b] - start[b]
        chord = math.hypot(da, db)
        if chord == 0:
            self.remarks.fault(number, 1, "a full circle needs I, J, K instead of CR=")
            return None
        squared_height = radius * radius - chord * chord / 4
        if squared_height < -2 * self.tolerance * abs(radius):
            missing_axes = self._missing_start()
            self.remarks.fault(number, 1, f"radius {1e3 * abs(radius):.6g} mm is below half the chord, {500 * chord:.6g} mm"
                               + (f"; {missing_axes}" if missing_axes else ""))
            return None
        offset = turn * math.copysign(math.sqrt(max(squared_height, 0.0)), radius) / chord
        center = list(start)
        center[a] = (start[a] + end[a]) / 2 - offset * db
        center[b] = (start[b] + end[b]) / 2 + offset * da
        return center

    def wait(self, number: int, duration: float) -> None:
        """Wait, s; before the first motion that is only a note."""
        if duration > 0 and not self.segments.wait(duration):
            self.remarks.note(number, "a dwell before the first motion is left out")
