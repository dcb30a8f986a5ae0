"""Sensitivities of hammers and sensors in files: ``2.25 mV/N``, ``100 mV/g``, ``1.02 mV/(m/s^2)``; read as V per SI unit."""

from __future__ import annotations

import re

GRAVITY = 9.80665
# What a channel can measure: quantity and SI units in one of the unit.
MEASURED = {"n": ("force", 1.0), "newton": ("force", 1.0), "newtons": ("force", 1.0), "kn": ("force", 1e3),
            "mn": ("force", 1e-3), "lbf": ("force", 4.4482216152605),
            "g": ("acceleration", GRAVITY), "gn": ("acceleration", GRAVITY), "m/s^2": ("acceleration", 1.0),
            "m/s²": ("acceleration", 1.0), "m/s2": ("acceleration", 1.0), "m/s/s": ("acceleration", 1.0),
            "ms-2": ("acceleration", 1.0), "mm/s^2": ("acceleration", 1e-3), "m/s": ("velocity", 1.0),
            "mm/s": ("velocity", 1e-3), "um/s": ("velocity", 1e-6), "in/s": ("velocity", 0.0254),
            "m": ("displacement", 1.0), "mm": ("displacement", 1e-3), "um": ("displacement", 1e-6),
            "µm": ("displacement", 1e-6), "nm": ("displacement", 1e-9)}
VOLTS = {"v": 1.0, "mv": 1e-3, "uv": 1e-6, "µv": 1e-6, "volt": 1.0, "volts": 1.0}
_FORM = re.compile(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Zµ]+)\s*/\s*\(?(.+?)\)?\s*$")
EXAMPLE = "write for example 2.25 mV/N or 100 mV/g"


def parse_sensitivity(text: str) -> tuple[float, str]:
    """Return V per SI unit of a sensitivity, and the quantity that it is of; ValueError where it is none."""
    match = _FORM.match(text)
    if match is None:
        raise ValueError(f"{text!r} is no sensitivity; {EXAMPLE}")
    if match[2].lower() not in VOLTS:
        raise ValueError(f"{text!r}: {match[2]} is no voltage; must be V or mV over a unit ({EXAMPLE}); charge sensors need "
                         "the "
                         "sensitivity of sensor and amplifier together")
    if match[3].strip().lower() not in MEASURED:
        raise ValueError(f"{text!r}: unit {match[3]!r} is not known; must be one of N, kN, lbf, g, m/s^2, m/s, mm/s, m, mm, um")
    quantity, scale = MEASURED[match[3].strip().lower()]
    return float(match[1]) * VOLTS[match[2].lower()] / scale, quantity
