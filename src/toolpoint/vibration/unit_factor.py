"""Names of unit mix-ups by the factor that they leave in measured values."""

from __future__ import annotations

SCALES = {9.80665: "g instead of m/s2", 1e3: "mm instead of m", 25.4e-3: "inches instead of m", 4.448: "lbf instead of N"}
UNIT_FACTOR_TOLERANCE = 0.03  # relative distance within which a factor is that of a unit


def scale_words(factor: float) -> str:
    """Return the unit mix-up, in words, that a factor of measured over true value indicates; empty where none is near."""
    size = max(abs(factor), 1 / abs(factor))
    for scale, words in SCALES.items():
        if abs(size / max(scale, 1 / scale) - 1) < UNIT_FACTOR_TOLERANCE:
            is_large = (abs(factor) > 1) == (scale > 1)
            return f", as {words if is_large else ' for '.join(reversed(words.split(' instead of ')))} makes it"
    return ""
