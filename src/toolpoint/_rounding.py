"""The one rule of how many digits a number is shown with: as many as its uncertainty carries, else four."""

from __future__ import annotations

import math
import re

NORMAL_QUANTILE_95 = 1.959964  # half width of a two-sided 95 % interval of a normal error, in standard deviations
DEFAULT_DIGITS = 4  # significant ones, where no uncertainty says how many
MIN_PRINTED_ERROR_RATIO = 5e-3  # of a limit: numerical errors below it move none of its three digits by more than one
PLAIN_EXPONENTS = range(-4, 6)  # powers of ten that a person reads as digits: 14000, not 1.4e+04
_POWER = re.compile(r"(?<![\w.])(\d(?:\.\d+)?)e([+-]\d\d)(?![\w.]\w)")
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number_text(value: float, uncertainty: float | None = None, digits: int = DEFAULT_DIGITS) -> str:
    """Return a number as text: to the last digit of its uncertainty, or to significant digits where none is known.

    An uncertainty has two significant digits where they begin with 1 or 2, else one (so 6 Hz leaves no decimals):
    rounding then changes it by at most a tenth and a half. Never an exponent between 1e-4 and 1e6.
    """
    if not math.isfinite(value):
        return "none" if math.isnan(value) else "unlimited" if value > 0 else "-unlimited"
    if uncertainty is None or not math.isfinite(uncertainty) or uncertainty <= 0:
        return _plain(value, digits)
    return _fixed(value, _decimals(uncertainty))


def text_below(value: float, digits: int = 3) -> str:
    """Return the greatest number of so many significant digits that is not above a limit: what is stable stays stable."""
    if not math.isfinite(value) or value <= 0:
        return number_text(value, digits=digits)
    step = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    return number_text(math.floor(value / step * (1 + 1e-12)) * step, digits=digits)


def limit_text(value: float, error: float = 0.0, digits: int = 3) -> str:
    """Return a limit with its numerical error: rounded down where the error is below 5 in a thousand, else both."""
    return text_below(value - error, digits) if error < MIN_PRINTED_ERROR_RATIO * value else with_uncertainty(value, error)


def plain_numbers(sentence: str) -> str:
    """Return a sentence whose numbers stand as digits where their power of ten is small: ``1.4e+04 times`` as 14000 times."""
    def spell(match: re.Match[str]) -> str:
        power, digits = int(match[2]), len(match[1].replace(".", ""))
        return f"{float(match[0]):.{max(digits - 1 - power, 0)}f}" if power in PLAIN_EXPONENTS else match[0]
    return _POWER.sub(spell, sentence) if "e" in sentence else sentence


def with_uncertainty(value: float, uncertainty: float | None, unit: str = "") -> str:
    """Return ``922.4 ± 0.6 Hz``, both to the same decimal; an uncertainty that is not finite is said to be unknown."""
    tail = f" {unit}" if unit else ""
    if uncertainty is None or uncertainty <= 0 or not math.isfinite(value):
        return number_text(value) + tail
    if not math.isfinite(uncertainty):
        return f"{number_text(value)}{tail} (± unknown)"
    size = max(abs(value), uncertainty)
    if size and not 1e-3 <= size < 1e6:  # one power of ten for both
        power = 3 * math.floor(math.log10(size) / 3)
        scale = 10.0**power
        both = f"{number_text(value / scale, uncertainty / scale)} ± {uncertainty_text(uncertainty / scale)}"
        return f"({both})×10{str(power).translate(SUPERSCRIPT)}{tail}"
    return f"{number_text(value, uncertainty)} ± {uncertainty_text(uncertainty)}{tail}"


def probability_text(share: float, resolution: float = 0.005) -> str:
    """Return a probability in per cent, never nearer to certainty than its resolution: ``97 %``, ``above 99.5 %``."""
    if share > 1 - resolution:
        return f"above {100 * (1 - resolution):g} %"
    if share < resolution:
        return f"below {100 * resolution:g} %"
    return f"{100 * share:.2g} %"


def uncertainty_text(uncertainty: float) -> str:
    """Return an uncertainty alone by the rule: ``0.12``, ``6``, ``unknown``."""
    if not math.isfinite(uncertainty):
        return "unknown"
    return "0" if uncertainty <= 0 else _fixed(uncertainty, _decimals(uncertainty))


def _decimals(uncertainty: float) -> int:
    """Return the decimals that an uncertainty leaves; below zero: tens, hundreds."""
    two = float(f"{uncertainty:.1e}")  # rounded first, so that 0.098 counts as 0.10
    power = math.floor(math.log10(two) + 1e-12)
    return (1 if two / 10.0**power < 3 - 1e-9 else 0) - power


def _fixed(value: float, decimals: int) -> str:
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def _plain(value: float, digits: int) -> str:
    if value == 0:
        return "0"
    size = abs(value)
    if not 1e-4 <= size < 1e6:
        return f"{value:.{digits}g}"
    decimals = digits - 1 - math.floor(math.log10(float(f"{size:.{digits - 1}e}")))
    return _fixed(value, max(decimals, 0))
