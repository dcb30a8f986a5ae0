"""Sensitivities of hammers and sensors in files: ``2.25 mV/N``, ``100 mV/g``, ``1.02 mV/(m/s^2)``; read as V per SI unit."""

from __future__ import annotations

import re

GRAVITY_UNIT = 9.80665  # m/s^2, the unit g
# What a channel can measure: quantity and SI units in one of the unit.
QUANTITY_BY_UNIT = {
    **dict.fromkeys(("n", "newton", "newtons"), ("force", 1.0)), "kn": ("force", 1e3), "mn": ("force", 1e-3),
    "lbf": ("force", 4.4482216152605),
    **dict.fromkeys(("g", "gn", "g's", "gs"), ("acceleration", GRAVITY_UNIT)),
    **dict.fromkeys(("m/s^2", "m/s²", "m/s2", "m/s/s", "m/sec^2", "m/sec2", "ms-2"), ("acceleration", 1.0)),
    **dict.fromkeys(("mm/s^2", "mm/s²", "mm/s2"), ("acceleration", 1e-3)),
    **dict.fromkeys(("in/s^2", "in/s2"), ("acceleration", 0.0254)),
    "m/s": ("velocity", 1.0), "mm/s": ("velocity", 1e-3), "um/s": ("velocity", 1e-6), "in/s": ("velocity", 0.0254),
    "m": ("displacement", 1.0), "mm": ("displacement", 1e-3), "um": ("displacement", 1e-6), "µm": ("displacement", 1e-6),
    "\u03bcm": ("displacement", 1e-6), "nm": ("displacement", 1e-9), "in": ("displacement", 0.0254),
    "inch": ("displacement", 0.0254), "mil": ("displacement", 2.54e-5)}
VOLTS = {"v": 1.0, "mv": 1e-3, "uv": 1e-6, "µv": 1e-6, "volt": 1.0, "volts": 1.0}
# Volts over a unit with brackets or without, 100 mV/(m/s^2), as calibration sheets print it.
_FORM = re.compile(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Zµ]+)\s*/\s*\(?(.+?)\)?\s*$")
MOTIONS_OVER_FORCE = "m/N, mm/N, um/N, (m/s)/N, (m/s^2)/N, g/N or 1/kg"
EXAMPLE = "write for example 2.25 mV/N or 100 mV/g"


def parse_sensitivity(text: str) -> tuple[float, str]:
    """Return V per SI unit of a sensitivity, and the quantity that it is of; ValueError where it is none."""
    match = _FORM.match(text)
    if match is None:
        raise ValueError(f"{text!r} is no sensitivity; {EXAMPLE}")
    if match[2].lower() not in VOLTS:
        raise ValueError(f"{text!r}: {match[2]} is no voltage; must be V or mV over a unit ({EXAMPLE}); charge sensors need "
                         "the sensitivity of sensor and amplifier together")
    if match[3].strip().lower() not in QUANTITY_BY_UNIT:
        raise ValueError(f"{text!r}: unit {match[3]!r} is not known; must be one of N, kN, lbf, g, m/s^2, m/s, mm/s, m, mm, um")
    quantity, scale = QUANTITY_BY_UNIT[match[3].strip().lower()]
    return float(match[1]) * VOLTS[match[2].lower()] / scale, quantity


def motion_over_force(unit: str) -> tuple[float, str]:
    """Return SI units in a unit such as um/N, (m/s^2)/N or 1/kg, and the quantity of motion; ValueError where it is none."""
    compact = unit.replace(" ", "").replace("·", "*")
    if compact.lower() in ("1/kg", "kg^-1", "kg-1"):
        return 1.0, "acceleration"
    numerator, slash, denominator = compact.rpartition("/")
    motion = QUANTITY_BY_UNIT.get(numerator.strip("()").lower())
    force = QUANTITY_BY_UNIT.get(denominator.strip("()").lower())
    if not slash or motion is None or force is None or motion[0] == "force" or force[0] != "force":
        raise ValueError(f"unit {unit!r} is no motion over force; must be {MOTIONS_OVER_FORCE}")
    return motion[1] / force[1], motion[0]
