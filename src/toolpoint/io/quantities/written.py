"""Values as a person types them in one line: numbers, bands, speeds, positions of axes, places and directions; SI.

A text of a wrong form raises ValueError (who asks knows how to write it), one of impossible numbers ToolpointError.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.quantities import units

Value = TypeVar("Value")
Vector = tuple[float, float, float]
BARE_GOAL_UNITS = {"depth limit": "mm", "position error": "um"}  # unit of a goal that is typed without one, by answer
MAX_TYPED_SPEED, MAX_TYPED_FREQUENCY, MAX_TYPED_LINES = 1e6, 1e7, 100_000  # rev/min, Hz


def read_numbers(text: str, count: int | None = None, *, sign: str = ",") -> tuple[float, ...]:
    """Return the numbers of a text such as ``80,100``, `count` of them where it is given."""
    numbers = tuple(float(part) for part in text.split(sign))
    if (count is not None and len(numbers) != count) or not all(map(math.isfinite, numbers)):
        raise ValueError
    return numbers


def read_pairs(text: str, read: Callable[[str], Value], form: str) -> dict[str, Value]:
    """Return names and values of a text such as ``frequency=f,values=H``; `form` says how to write one."""
    pairs: dict[str, Value] = {}
    for part in filter(str.strip, text.split(",")):
        name, equals, value = (word.strip() for word in part.partition("="))
        if not equals or not name or not value:
            raise ToolpointError(f"{part!r}: write {form}")
        if name in pairs:
            raise ToolpointError(f"{part!r}: {name} is there twice")
        pairs[name] = read(value)
    return pairs


def read_band(text: str) -> tuple[float, float]:
    """Return both ends of ``LOW:HIGH``, Hz."""
    lower, upper = read_numbers(text, 2, sign=":")
    if not 0 <= lower < upper:
        raise ToolpointError(f"{text!r}: the lower end must be below the upper")
    return lower, upper


def read_curve(text: str) -> tuple[tuple[float, float], ...]:
    """Return the points of a curve such as ``1500:60,12000:8`` in the order written."""
    return tuple((x, y) for x, y in (read_numbers(part, 2, sign=":") for part in text.split(",")))


def read_lines(text: str) -> FloatArray:
    """Return the lines of ``LOW:HIGH:NUMBER``, Hz, shape (NUMBER,)."""
    lower, upper, number = _first_last_number(text)
    if not 0 <= lower < upper < MAX_TYPED_FREQUENCY or not 2 <= number <= MAX_TYPED_LINES:
        raise ToolpointError(f"{text!r}: must be 0 <= LOW < HIGH and 2 to {MAX_TYPED_LINES} lines")
    return np.linspace(lower, upper, number)


def read_speeds(text: str, *, from_rest: bool = False) -> FloatArray:
    """Return the spindle speeds of ``FIRST:LAST:NUMBER``, rev/min, shape (NUMBER,); zero is one only `from_rest`."""
    lower, upper, number = _first_last_number(text)
    starts = lower >= 0 if from_rest else lower > 0
    if not starts or (not (lower < upper < MAX_TYPED_SPEED and number >= 2)
                      and not (lower <= upper < MAX_TYPED_SPEED and number == 1)):
        first = "not be negative" if from_rest else "be above zero"
        raise ToolpointError(f"{text!r}: the first speed must {first}, the last above the first, and the number at least 2 "
                             "(or one speed: 9000:9000:1)")
    return np.linspace(lower, upper, number)


def read_angles(text: str) -> FloatArray:
    """Return the angles of ``0,45,90`` or ``FIRST:LAST:NUMBER``, degrees, in rad."""
    numbers = text.replace("deg", "")
    if ":" not in numbers:
        return np.radians(read_numbers(numbers))
    first, last, number = _first_last_number(numbers)
    if number < 1:
        raise ValueError
    return np.radians(np.linspace(first, last, number))


def _first_last_number(text: str) -> tuple[float, float, int]:
    lower, upper, number = text.split(":")
    first, last = read_numbers(f"{lower},{upper}", 2)
    return first, last, int(number)


class WrittenPosition(float):
    """A position in m or rad that remembers as what it was written: ``length``, ``angle``, or nothing for a bare number."""

    written: str = ""


def read_position(text: str) -> WrittenPosition:
    """Return the position of a text like ``0.1``, ``200mm`` or ``30 deg``, m or rad."""
    try:
        value, kind = units.length_or_angle(text)
    except units.UnitError as error:
        raise ToolpointError(f"{text.strip()!r}: {error}") from None
    position = WrittenPosition(value)
    position.written = "" if kind is None else kind.name
    return position


def read_pose(text: str) -> dict[str, float]:
    """Return the positions of axes of a text like ``X=0.1,A=30deg``, m or rad."""
    return read_pairs(text, read_position, "AXIS=VALUE with a decimal point, for example X=0.1,Y=200mm,A=30deg")


class AxisPoints(NamedTuple):
    """Positions along an axis, evenly from the first to the last."""

    name: str
    first: WrittenPosition
    last: WrittenPosition
    number: int

    @property
    def positions(self) -> FloatArray:
        """All positions, m or rad."""
        return np.linspace(float(self.first), float(self.last), self.number)


def read_axis_points(text: str) -> AxisPoints:
    """Return the positions of a text like ``X=-200mm:200mm:5``: first, last, number."""
    name, _, positions = text.partition("=")
    first, last, number = positions.split(":")
    points = AxisPoints(name.strip(), read_position(first), read_position(last), int(number))
    if not points.name or points.number < 1:
        raise ValueError
    if points.number > 1 and not points.last > points.first:
        raise ToolpointError(f"{text!r}: the last position must be above the first, or the number 1")
    if points.first and points.last and bool(points.first.written) != bool(points.last.written):
        raise ToolpointError(f"{text!r}: one end has a unit and the other none; write both, or none (m, rad)")
    return points


def read_length_points(text: str) -> AxisPoints:
    """Return the lengths of a text like ``x=300mm:700mm:9``; angles are refused."""
    points = read_axis_points(text)
    if "angle" in (points.first.written, points.last.written):
        raise ToolpointError(f"{text!r}: must be lengths (m, mm)")
    return points


def read_length(text: str) -> float:
    """Return the length of a text like ``200mm``, m; a bare number is in m."""
    return _quantity(text, units.LENGTH)


def read_angle(text: str) -> float:
    """Return the angle of a text like ``30deg``, rad; a bare number is in rad."""
    return _quantity(text, units.ANGLE)


def read_masses(text: str) -> dict[str, float]:
    """Return masses (kg) by degree of freedom of a text like ``tip:+x=0.5kg``; a bare number is in kg."""
    return read_pairs(text, lambda value: _quantity(value, units.MASS), "POINT:DIRECTION=MASS, for example tip:+x=0.5kg")


def read_mass(text: str) -> float:
    """Return the mass of a text like ``1.25kg`` or ``800 g``, kg; a bare number is in kg."""
    return _quantity(text, units.MASS)


def _quantity(text: str, kind: units.Kind) -> float:
    try:
        return units.quantity(text.strip(), kind)
    except units.UnitError as error:
        raise ToolpointError(str(error)) from None


def read_lengths(text: str, count: int = 3) -> tuple[float, ...]:
    """Return `count` lengths of a text like ``600mm,0,300mm``, m."""
    parts = text.split(",")
    if len(parts) != count:
        raise ToolpointError(f"{text!r}: must be {count} numbers with commas between them")
    return tuple(map(read_length, parts))


def read_direction(text: str) -> Vector:
    """Return the direction of a text like ``-x``, ``0,0.5,1`` or ``30deg`` (from x towards y)."""
    word = text.strip().lower()
    if word.lstrip("+-") in ("x", "y", "z"):
        sign = -1.0 if word[0] == "-" else 1.0
        return sign * (word[-1] == "x"), sign * (word[-1] == "y"), sign * (word[-1] == "z")
    if "," in word:
        x, y, z = read_numbers(word, 3)
        return x, y, z
    angle = math.radians(float(word.removesuffix("deg")))
    return math.cos(angle), math.sin(angle), 0.0


def read_plane(text: str) -> tuple[Vector, Vector]:
    """Return the two directions of a text like ``y,z``."""
    first, second = text.split(",")
    return read_direction(first), read_direction(second)


def read_axis_names(text: str) -> tuple[str, str]:
    """Return the two axes of a text like ``X,Z``."""
    first, second = text.replace(" ", "").upper().split(",")
    if first == second or {first, second} - set("XYZ"):
        raise ValueError("must be two of X, Y, Z")
    return first, second


def read_two_points(text: str) -> tuple[str, str]:
    """Return the two points of a text like ``tool,table``."""
    names = [name.strip() for name in text.split(",")]
    if len(names) != 2 or not all(names) or names[0] == names[1]:
        raise ValueError("must be two points")
    return names[0], names[1]


def read_block(text: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return two corners of a block from ``X1,Y1,X2,Y2``, m."""
    corners = read_lengths(text, 4)
    return corners[:2], corners[2:]


def read_circle(text: str) -> tuple[float, float]:
    """Return radius (m) and feed (m/s) of ``RADIUS,FEED`` in mm and mm/min."""
    radius, feed = read_numbers(text, 2)
    if radius <= 0 or feed <= 0:
        raise ToolpointError(f"{text!r}: radius and feed must be above zero")
    return 1e-3 * radius, feed / 60e3


def read_pole(text: str) -> tuple[float, float]:
    """Return frequency (Hz) and damping ratio of ``HZ,PERCENT``."""
    frequency, percent = read_numbers(text, 2)
    if not frequency > 0 or not 0 < percent <= 50:
        raise ToolpointError(f"{text!r}: the frequency must be above 0 Hz, the damping above 0 and at most 50 %")
    return frequency, percent / 100


def read_servo_step(text: str) -> tuple[str, str, float, bool]:
    """Return axis, level, height (A, m/s, m or their rotary forms) and whether it is a share of the current limit.

    ``X:velocity=500 mm/min``, ``X:position=0.5mm``, ``X:current=2 A`` or ``X:current=3%``.
    """
    place, equals, value = text.partition("=")
    axis, colon, level = (word.strip() for word in place.partition(":"))
    kinds = {"velocity": (units.FEED, units.ANGULAR_SPEED), "position": (units.LENGTH, units.ANGLE)}
    if not (equals and colon and axis) or level not in ("current", *kinds):
        raise ValueError
    value = value.strip()
    if level == "current":
        is_share = value.endswith("%")
        number = float(value.removesuffix("%")) / 100 if is_share else float(value.removesuffix("A"))
        return axis, level, number, is_share
    straight, turning = kinds[level]
    try:
        return axis, level, units.quantity(value, straight), False
    except units.UnitError as error:
        try:
            return axis, level, units.quantity(value, turning), False
        except units.UnitError:
            raise ToolpointError(str(error)) from None


SHAKER_KEYS = {"body": units.MASS, "armature": units.MASS, "suspension": units.STIFFNESS, "suspension_damping": units.DAMPING,
               "stinger": units.STIFFNESS, "stand": units.STIFFNESS, "stand_damping": units.DAMPING, "coil": None,
               "resistance": None, "inductance": None}


def read_shaker(text: str) -> tuple[str, dict[str, float]]:
    """Return the point that a shaker stands on and its numbers by name, SI, of ``stands=table,body=20kg,armature=0.4kg,...``.

    coil (N/A), resistance (ohm) and inductance (H) are bare numbers.
    """
    form = "NAME=VALUE, for example stands=table,body=20kg,armature=0.4kg,suspension=5N/mm"
    pairs = read_pairs(text, str, form)
    stand = pairs.pop("stands", "")
    if not stand:
        raise ToolpointError("stands: missing; the point of the machine that the shaker stands on")
    for name in pairs:
        if name not in SHAKER_KEYS:
            raise ToolpointError(f"{name!r}: must be one of stands, {', '.join(SHAKER_KEYS)}")
    numbers = {}
    for name, value in pairs.items():
        kind = SHAKER_KEYS[name]
        numbers[name] = float(value) if kind is None else _quantity(value, kind)
    for name in ("body", "armature", "suspension"):
        if name not in numbers:
            raise ToolpointError(f"{name}: missing; write {form}")
    if ("coil" in numbers) != ("resistance" in numbers):
        raise ToolpointError("coil and resistance belong together: N/A and ohm")
    return stand, numbers


def read_tried_cut(text: str) -> tuple[float, float, bool | Path]:
    """Return speed (rev/min), depth (m) and whether the cut was stable of ``SPEED:DEPTH:stable`` (or chatter), depth in mm; in
    place of the outcome the path of a recording of the cut, which has an ending."""
    speed, depth, outcome = text.split(":", 2)
    words = {"stable": True, "chatter": False}
    if outcome not in words and not Path(outcome).suffix:
        raise ValueError
    return float(speed), 1e-3 * float(depth), words.get(outcome, Path(outcome))


def read_shares(text: str, names: Sequence[str]) -> dict[str, float]:
    """Return shares by name from percent with commas between them, ``-`` for those that are not given."""
    shares = {name: float(part) / 100 for name, part in zip(names, text.split(","), strict=True)
              if part.strip() not in ("", "-")}
    if min(shares.values(), default=0.0) < 0:
        raise ValueError
    return shares


def read_goal(text: str, answer: str) -> float:
    """Return the goal of an answer of `studies.improve_by_plan`, SI, of a text as a person types it.

    A response peak or a static compliance needs its unit: ``0.12um/N``, or the stiffness that it belongs to, ``8N/um``. A depth
    limit is in mm and a position error in µm where no unit stands there.

    >>> read_goal("8 N/um", "static compliance") == 1 / 8e6
    True
    >>> round(read_goal("2.5", "depth limit"), 6)
    0.0025
    """
    word = text.strip()
    is_bare = re.fullmatch(r"[-+.\deE]+", word) is not None
    if answer in BARE_GOAL_UNITS:
        value = _quantity(word + BARE_GOAL_UNITS[answer] if is_bare else word, units.LENGTH)
    elif is_bare:
        raise ToolpointError(f"{word!r}: of which unit? Write a compliance, for example 0.12um/N, or the stiffness that it "
                             "belongs to, 8N/um")
    else:
        value = _read_compliance(word)
    if not value > 0:
        raise ToolpointError(f"{word!r}: must be above zero")
    return value


def _read_compliance(word: str) -> float:
    """Return m/N of a compliance or of a stiffness."""
    try:
        return units.quantity(word, units.COMPLIANCE)
    except units.UnitError as error:
        try:
            stiffness = units.quantity(word, units.STIFFNESS)
        except units.UnitError:
            raise ToolpointError(f"{error}; or a stiffness, for example 8N/um") from None
        if not stiffness > 0:
            raise ToolpointError(f"{word!r}: must be above zero") from None
        return 1 / stiffness


def read_two_names(text: str) -> tuple[str, str]:
    """Return both names of ``FIRST,SECOND``."""
    first, second = (word.strip() for word in text.split(","))
    if not first or not second:
        raise ValueError
    return first, second


def read_picture_shape(text: str) -> tuple[int, int]:
    """Return rows and columns of ``ROWSxCOLUMNS``."""
    rows, columns = text.split("x")
    return int(rows), int(columns)


def read_stock(text: str) -> tuple[str, tuple[float, ...]]:
    """Return kind and lengths (m) of ``box=X1,Y1,Z1,X2,Y2,Z2`` or ``cylinder=DIAMETER,BOTTOM,TOP[,X,Y]`` in mm.

    Of the name of a mesh file the kind is its path, and there are no lengths.
    """
    kind, equals, numbers = text.partition("=")
    if not equals:
        return text, ()
    if kind.strip() not in ("box", "cylinder"):
        raise ToolpointError(f"{text!r}: a stock is a box, a cylinder, an STL or a STEP file")
    return kind.strip(), tuple(1e-3 * number for number in read_numbers(numbers))


def read_numbered_length(text: str) -> tuple[int, float]:
    """Return number and length (m) of ``3=45``, mm."""
    number, _, length = text.partition("=")
    value = float(length)
    if not 0 < value < 1e4:
        raise ValueError
    return int(number), 1e-3 * value


def read_numbered_file(text: str) -> tuple[int, Path]:
    """Return number and file of ``3=ball.yaml``."""
    number, _, path = text.partition("=")
    if not path:
        raise ValueError
    return int(number), Path(path)
