"""Units in files: the field's own table, converted to SI at the door; Hz, rpm and rad/s are kept apart.

General unit libraries read "10 Nm" as a textile unit and 1 Hz as 1 rad/s, so the table is our own and refuses what it
does not know.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from toolpoint._check import suggestion

# Dimensions: metre, kilogram, second, radian, cycle (Hz), revolution (rpm).
Dimension = tuple[int, int, int, int, int, int]
NO_DIMENSION: Dimension = (0, 0, 0, 0, 0, 0)

_BASE: dict[str, tuple[float, Dimension]] = {
    "m": (1.0, (1, 0, 0, 0, 0, 0)), "g": (1e-3, (0, 1, 0, 0, 0, 0)), "t": (1e3, (0, 1, 0, 0, 0, 0)),
    "s": (1.0, (0, 0, 1, 0, 0, 0)), "rad": (1.0, (0, 0, 0, 1, 0, 0)), "N": (1.0, (1, 1, -2, 0, 0, 0)),
    "Pa": (1.0, (-1, 1, -2, 0, 0, 0)), "Hz": (1.0, (0, 0, 0, 0, 1, 0)),
    "W": (1.0, (2, 1, -3, 0, 0, 0)),
}
_UNPREFIXED_UNITS: dict[str, tuple[float, Dimension]] = {
    "min": (60.0, (0, 0, 1, 0, 0, 0)), "deg": (math.pi / 180, (0, 0, 0, 1, 0, 0)), "°": (math.pi / 180, (0, 0, 0, 1, 0, 0)),
    "rpm": (1.0, (0, 0, 0, 0, 0, 1)), "%": (0.01, NO_DIMENSION), "1": (1.0, NO_DIMENSION), "bar": (1e5, (-1, 1, -2, 0, 0, 0)),
}
# Both signs for micro: the letter mu and the micro sign look alike and differ as characters.
_PREFIX = {"": 1.0, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "\u03bc": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6, "G": 1e9}
# What machine files are written in, for suggestions.
LENGTHS, ANGLES = ("m", "mm", "um", "cm"), ("rad", "mrad", "urad", "deg")
COMMON_UNITS = (*LENGTHS, *ANGLES, "kg", "g", "t", "s", "ms", "min", "N", "kN", "MN", "Nm", "kNm", "Pa", "MPa", "GPa", "bar",
                "Hz",
                "kHz", "rpm", "%")
_WRITTEN = {"kg": "kg", "kilog": "kg", "mm": "mm", "millim": "mm", "micro": "um", "met": "m", "sec": "s", "newton": "N",
            "deg": "deg", "grad": "deg", "rad": "rad", "gram": "g", "ton": "t", "hertz": "Hz", "rev": "rpm"}
_POSITIONS = "known: " + ", ".join((*LENGTHS, *ANGLES))
_IMPERIAL_SIZES = {"in": "25.4 mm", "inch": "25.4 mm", "ft": "304.8 mm", "lb": "0.45359 kg", "lbs": "0.45359 kg",
                   "lbf": "4.4482 N", "psi": "6894.8 Pa"}
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?")
# Numbers parted by blanks, then a unit.
_ROW = re.compile(rf"((?:{_NUMBER.pattern}\s+)+{_NUMBER.pattern})\s*([^\s\d,;.+-][^,;]*)?")
_COMMA = re.compile(r"^[-+]?\d+,\d+")


class UnitError(ValueError):
    """A quantity that cannot be read; the message says what was expected."""


@dataclass(frozen=True)
class Kind:
    """A kind of quantity: its name, SI unit, dimension, and the magnitudes between which a value is believed."""

    name: str
    unit: str
    dimension: Dimension
    largest: float
    smallest: float = 0.0


def _kind(name: str, unit: str, largest: float, smallest: float = 0.0) -> Kind:
    return Kind(name, unit, _unit(unit)[1], largest, smallest)


def _symbols() -> dict[str, tuple[float, Dimension]]:
    table = {prefix + symbol: (factor * scale, dimension)
             for symbol, (scale, dimension) in _BASE.items() for prefix, factor in _PREFIX.items()}
    # Nm and its multiples, because every engineer writes them.
    moment = {f"{p}Nm": (f, (2, 1, -2, 0, 0, 0)) for p, f in (("", 1.0), ("m", 1e-3), ("k", 1e3), ("M", 1e6))}
    # Grad is the German word for degree, and nobody's billion of radians.
    return {symbol: entry for symbol, entry in (table | moment | _UNPREFIXED_UNITS).items() if symbol != "Grad"}


def _unit(text: str) -> tuple[float, Dimension]:
    factor, dimension, sign = 1.0, NO_DIMENSION, 1
    for token in re.split(r"([*/·\s]+)", text.strip()):
        if not token:
            continue
        if not token.strip() or set(token.strip()) <= set("*/·"):
            sign = -1 if "/" in token else 1
            if token.strip() not in ("", "*", "/", "·"):
                raise UnitError(f"unit {text!r} is not understood; write factors with * and one /, for example N*m/rad")
            continue
        symbol, power = _power(token, text)
        if symbol not in SYMBOLS:
            hint = nearest(symbol)
            raise UnitError(f"unknown unit {symbol!r}" + (f" in {text!r}" if symbol != text else "")
                            + (f"; {hint}" if hint else "; known: m, kg, s, N, Nm, Pa, rad, deg, Hz, rpm, % with prefixes"))
        scale, kind_of_symbol = SYMBOLS[symbol]
        factor *= scale ** (sign * power)
        dimension = tuple(a + sign * power * b for a, b in zip(dimension, kind_of_symbol, strict=True))  # type: ignore[assignment]
    return factor, dimension


def nearest(word: str, units: Iterable[str] = COMMON_UNITS) -> str:
    """Return 'did you mean ...?' for the unit that a word was meant to be, or nothing where none is near.

    Words that begin as one written out (kgs, meters, degrees), then other case (KG), then the most similar; rare but possible
    symbols (ks, Mg) are never proposed. Imperial units are answered with their size.
    """
    words, lowered = list(units), word.lower()
    if lowered in _IMPERIAL_SIZES:
        return f"write SI units: 1 {lowered} is {_IMPERIAL_SIZES[lowered]}"
    begun = [unit for start, unit in _WRITTEN.items() if lowered.startswith(start) and unit in words]
    begun += [unit for unit in words if unit.lower() == lowered]
    return f"did you mean {begun[0]!r}?" if begun else suggestion(word, words)


def _power(token: str, text: str) -> tuple[str, int]:
    match = re.fullmatch(r"(.+?)(?:\^|\*\*)?([-+]?\d+|[²³])", token)
    if match is None or token in SYMBOLS:
        return token, 1
    raised = {"²": 2, "³": 3}.get(match[2])
    try:
        return match[1], raised if raised is not None else int(match[2])
    except ValueError:
        raise UnitError(f"unit {text!r}: power {match[2]!r} is not a whole number") from None


SYMBOLS = _symbols()
# Limits are what no machine reaches: they catch units (mm read as m), and never refuse a machine that exists.
LENGTH = _kind("length", "m", 200)
AREA_MOMENT = _kind("moment of inertia", "kg*m^2", 1e9)
MASS = _kind("mass", "kg", 1e7, 1e-9)
DENSITY = _kind("density", "kg/m^3", 25000, 1)
ANGLE = _kind("angle", "rad", 100)
STIFFNESS = _kind("stiffness", "N/m", 1e14, 1e-3)
COMPLIANCE = _kind("compliance", "m/N", 1e3, 1e-14)
TURNING_STIFFNESS = _kind("rotational stiffness", "N*m/rad", 1e14, 1e-6)
DAMPING = _kind("damping", "N*s/m", 1e12)
TURNING_DAMPING = _kind("rotational damping", "N*m*s/rad", 1e12)
FORCE = _kind("force", "N", 1e8)
MOMENT = _kind("moment", "N*m", 1e8)
ACCELERATION = _kind("acceleration", "m/s^2", 1000)
PRESSURE = _kind("pressure", "Pa", 1e12, 1)
FREQUENCY = _kind("frequency", "Hz", 1e6)
SPEED = _kind("spindle speed", "rpm", 1e6)
RATIO = _kind("ratio", "1", 10)
GEAR_RATIO = _kind("gear ratio", "1", 1e4)
TIME = _kind("time", "s", 1e6)
RATE = _kind("gain", "1/s", 1e6)
ANGULAR_SPEED = _kind("angular speed", "rad/s", 1e6)
ANGULAR_ACCELERATION = _kind("angular acceleration", "rad/s^2", 1e8)
FEED = _kind("speed", "m/s", 100)
JERK = _kind("jerk", "m/s^3", 1e7)
POWER = _kind("power", "W", 1e7)


def quantity(value: object, kind: Kind) -> float:
    """Return a value in SI: a bare number is SI already, a text is a number and a unit, e.g. ``"902.78 GN*mm/rad"``.

    Raises UnitError for a decimal comma, an unknown or wrong unit, a number that is not finite, or a magnitude that no
    machine has.
    """
    if isinstance(value, bool) or value is None:
        raise UnitError(f"{_shown(value)} is not a {kind.name}; write a number with a unit, for example 1.5 {kind.unit}")
    if isinstance(value, (int, float)):
        return _believed(float(value), kind, "")
    if not isinstance(value, str):
        raise UnitError(f"{_shown(value)} is not a {kind.name}; write a number with a unit, for example 1.5 {kind.unit}")
    text = value.strip()
    match = _NUMBER.match(text)
    if _COMMA.match(text):
        raise UnitError(f"decimal comma in {value!r}; write a decimal point: {text.replace(',', '.', 1)!r}")
    if match is None:
        raise UnitError(f"{value!r} does not begin with a number; write for example 1.5 {kind.unit}")
    unit = text[match.end():].strip()
    factor, dimension = _unit(unit) if unit else (1.0, kind.dimension)
    if dimension != kind.dimension:
        raise UnitError(_wrong(value, unit, kind, dimension))
    return _believed(float(match[0]) * factor, kind, unit)


def length_or_angle(text: str) -> tuple[float, Kind | None]:
    """Return a position in m or rad and what its unit says it is, None for a bare number: ``200 mm``, ``30deg``, ``0.2``."""
    word = text.strip()
    match = _NUMBER.match(word)
    if match is None:
        raise UnitError(f"{word!r} does not begin with a number; write for example 200mm, 30deg, or 0.2 in m or rad")
    unit = word[match.end():].strip()
    if not unit:
        return float(match[0]), None
    if unit not in SYMBOLS:
        raise UnitError(f"unknown unit {unit!r}; {nearest(unit, (*LENGTHS, *ANGLES)) or _POSITIONS}")
    for kind in (LENGTH, ANGLE):
        if SYMBOLS[unit][1] == kind.dimension:
            return quantity(word, kind), kind
    raise UnitError(f"{word!r}: {unit!r} is no unit of length or angle; {_POSITIONS}")


def _wrong(value: str, unit: str, kind: Kind, dimension: Dimension) -> str:
    message = f"{value!r}: unit {unit!r} is not one of {kind.name}; expected something like {kind.unit}"
    if kind in (TURNING_STIFFNESS, TURNING_DAMPING) and dimension[3] == 0:
        return message + " (write the rad: N*m/rad)"
    if kind in (FREQUENCY, SPEED) or dimension[4] or dimension[5]:
        return message + " (Hz, rpm and rad/s are kept apart)"
    return message


def _believed(number: float, kind: Kind, unit: str) -> float:
    if not math.isfinite(number):
        raise UnitError(f"{number} is not a finite {kind.name}; write a number")
    size = abs(number)
    if size > kind.largest or (kind.smallest and 0 < size < kind.smallest):
        limit = f"{kind.smallest:g} to {kind.largest:g}" if kind.smallest else f"at most {kind.largest:g}"
        raise UnitError(f"{number:g} {kind.unit} is no {kind.name} of a machine tool; believed are {limit} {kind.unit}; "
                        + ("check the unit" if unit else "a number without a unit is in SI"))
    return number


def _shown(value: object) -> str:
    return "nothing" if value is None else repr(value)


def quantities(value: object, kind: Kind, length: int) -> tuple[float, ...]:
    """Return `length` values in SI: a list of numbers or quantities, or one text ``"0, 1063, -1500 mm"``."""
    if isinstance(value, str):
        items: list[object] = list(split_list(value))
    elif isinstance(value, (list, tuple)):
        items = list(value)
    else:
        raise UnitError(f"{_shown(value)} is not a list of {length} {kind.name}s; write for example {_example(kind, length)}")
    if len(items) != length:
        comma = "; a comma parts values: write decimal points (1.5, not 1,5)" if len(items) > length else ""
        raise UnitError(f"{len(items)} value{'s' if len(items) != 1 else ''} in {_shown(value)}; must be {length}, for example "
                        f"{_example(kind, length)}{comma}")
    return tuple(quantity(item, kind) for item in items)


def split_list(text: str) -> tuple[str, ...]:
    """Return the values of a text parted by commas or semicolons, or by blanks where there are none: ``0 1063 -1500 mm``.

    A unit behind the last value is that of all bare numbers before it.
    """
    bare = text.strip().strip("[]").strip()
    mark = ";" if ";" in bare else ","
    parts = [part.strip() for part in bare.split(mark)]
    if len(parts) == 1 and (row := _ROW.fullmatch(bare)):
        numbers = row[1].split()
        parts = [*numbers[:-1], f"{numbers[-1]} {row[2] or ''}".strip()]
    unit = _NUMBER.sub("", parts[-1], count=1).strip()
    return tuple(f"{part} {unit}" if unit and k < len(parts) - 1 and _NUMBER.fullmatch(part) else part
                 for k, part in enumerate(parts))


def _example(kind: Kind, length: int) -> str:
    zeros = ", ".join(["0"] * length)
    return f'[{zeros}] or "{zeros} {kind.unit}"'
