r"""Columns of decimal numbers to floats and back, all at once and rounded correctly, as Python's own float and % do.

Lines that all share the layout of the first are a matrix of bytes: one comparison tells whether every byte is what its
column must hold, one matrix product gives every mantissa M (at most fifteen digits, exact) and decimal exponent q. Then
:math:`M \cdot 10^q` is formed with a power of ten in two floats and the exact rounding error of the product; the sum is
rounded correctly unless it lies next to the middle between two floats (Ziv's test), where Python's float decides. Writing
is the same product with the opposite power, rounded to an integer of thirteen digits.

Source: Dekker, Numerische Mathematik 18 (1971) 224 (exact product); Ziv, ACM Trans. Math. Software 17 (1991) 410.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache

import numpy as np

from toolpoint._check import FloatArray

FEWEST_LINES = 2
MOST_DIGITS = 15  # of a number: as a whole number it is below 2^53, and so exact in a float
WRITTEN_DECIMALS = 12  # of the mantissa: as the format's E20.12 has them
# Within these powers of ten no product or rounding error leaves the normal floats.
LARGEST_POWER = 250
_DEKKER_SPLITTER = 134217729.0  # 2^27 + 1: halves of a float of 53 bits, whose products are exact
# Ziv's test: a sum that rounds alike with and without this factor is rounded correctly; the others go the slow way.
_ZIV_FACTOR = 1 + 2.0**-40
_PLUS, _MINUS = ord("+") - ord(" "), ord("-") - ord(" ")
# Lines that differ only in digits and signs have one layout.
_LAYOUT_BYTES = bytes.maketrans(b"023456789-", b"111111111+")
_LEADING_PLUS = re.compile(rb"(?<= )\+|^\+")
_FIELD = re.compile(rb"( *)([-+]?)(\d*)\.(\d*)([EeDd])[-+](\d{2,3})")


@dataclass(frozen=True, eq=False)
class _Layout:
    """Layout of a line: what every column must hold, and where its numbers stand.

    A byte less `low` (wrapped to 0 .. 255) must be at most `span`; `weights` (n_columns, 2 n_numbers) turn what is left
    into mantissas and exponents; `decimals` is what the exponents are lowered by. A sign column is -1 where there is none.
    """

    lowest: np.ndarray
    span: np.ndarray
    weights: FloatArray
    sign: np.ndarray
    exponent_sign: np.ndarray
    decimals: FloatArray
    stops: tuple[int, ...]


def regular(data: bytes) -> tuple[FloatArray, bytes]:
    """Return the numbers of the lines that share the layout of the first line, and the bytes behind them.

    Parameters
    ----------
    data : bytes
        Lines of numbers with exponents (E or D), blanks between them, line ends LF or CRLF.

    Returns
    -------
    floats, bytes
        No numbers and all the bytes where any whole line differs in layout; a shorter last line is left behind.
    """
    length = data.find(b"\n") + 1
    lines = len(data) // length if length else 0
    layout = _layout(_LEADING_PLUS.sub(b" ", data[:length].translate(_LAYOUT_BYTES))) if lines >= FEWEST_LINES else None
    if layout is None:
        return np.empty(0), data
    table = np.frombuffer(data, np.uint8, lines * length).reshape(lines, length) - layout.lowest
    sign, direction = table[:, layout.sign], table[:, layout.exponent_sign]
    sign[:, layout.sign < 0] = 0
    minus = sign == _MINUS
    if not ((table <= layout.span).all() and (minus | (sign == 0) | (sign == _PLUS)).all() and (direction != 1).all()):
        return np.empty(0), data
    parts = table.astype(float) @ layout.weights
    count = layout.sign.size
    power = parts[:, count:] * (1.0 - direction) - layout.decimals
    inside = np.abs(power) <= LARGEST_POWER
    values, left = _product(parts[:, :count].ravel(), np.where(inside, power, 0.0).ravel())
    certain = inside.ravel() & (values + left * _ZIV_FACTOR == values)
    values *= 1.0 - 2.0 * minus.ravel()
    for i in np.flatnonzero(~certain).tolist():
        row, column = divmod(i, count)
        start = layout.stops[column - 1] if column else 0
        word = data[row * length + start:row * length + layout.stops[column]]
        values[i] = float(word.upper().replace(b"D", b"E"))
    return values, data[lines * length:]


@lru_cache(maxsize=16)
def _layout(line: bytes) -> _Layout | None:
    """Return the layout of a line, digits given as 1 and signs as blanks; None unless it holds such numbers, parted."""
    body = line.rstrip(b"\r\n")
    fields = list(_FIELD.finditer(body))
    if not fields or body[fields[-1].end():].strip(b" ") or [0, *(field.end() for field in fields[:-1])] != [
            field.start() for field in fields]:
        return None
    lowest = np.frombuffer(line, np.uint8).copy()
    span = np.zeros(len(line), np.uint8)
    weights = np.zeros((len(line), 2 * len(fields)))
    signs, decimals = [], []
    for i, field in enumerate(fields):
        lead = field.end(2) - field.start()
        digits = [*range(*field.span(3)), *range(*field.span(4))]
        if not 0 < len(digits) <= MOST_DIGITS or (i and (not field[1] or (field[2] and lead < 2))):
            return None
        for columns, column in ((digits, i), ([*range(*field.span(6))], len(fields) + i)):
            lowest[columns], span[columns] = ord("0"), 9
            weights[columns, column] = 10.0 ** np.arange(len(columns))[::-1]
        # A lone blank between two numbers parts them and cannot hold a sign.
        signs.append(field.end(2) - 1 if lead > (1 if i else 0) else -1)
        lowest[field.end(5)], span[field.end(5)] = ord("+"), 2
        decimals.append(float(field.end(4) - field.start(4)))
    some = [column for column in signs if column >= 0]
    lowest[some], span[some] = ord(" "), _MINUS
    return _Layout(lowest, span, weights, np.array(signs), np.array([field.end(5) for field in fields]), np.array(decimals),
                   tuple(field.end() for field in fields))


@cache
def _powers() -> FloatArray:
    """Return 10^q, q = -LARGEST_POWER .. LARGEST_POWER, as rows: nearest float, its upper and lower half, the rest."""
    exact = [Fraction(10) ** q for q in range(-LARGEST_POWER, LARGEST_POWER + 1)]
    power_float = np.array([float(number) for number in exact])
    remainder = np.array([float(number - Fraction(number_float)) for number,
                          number_float in zip(exact, power_float.tolist(), strict=True)])
    upper = power_float * _DEKKER_SPLITTER - (power_float * _DEKKER_SPLITTER - power_float)
    return np.stack([power_float, upper, power_float - upper, remainder])


def _product(factor: FloatArray, power: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return factor times ten to the power, rounded to floats, and what is left (both together good to 100 bits)."""
    power_float, upper, lower, remainder = (row.take(power.astype(np.intp) + LARGEST_POWER) for row in _powers())
    product = factor * power_float
    scaled = factor * _DEKKER_SPLITTER
    first = scaled - (scaled - factor)
    second = factor - first
    error = ((first * upper - product) + first * lower + second * upper) + second * lower
    error += factor * remainder
    total = product + error
    return total, error - (total - product)


def twenty_wide(numbers: FloatArray) -> np.ndarray:
    """Return numbers in the format %20.12E, (n, 20) bytes."""
    size = np.abs(numbers)
    # Exponents of three digits move the columns of a number: such values are left to the slow way.
    usual = (size >= 1e-98) & (size < 1e98)
    power = np.floor(np.log10(np.where(usual, size, 1.0)))
    product, left = _product(np.where(usual, size, 0.0), WRITTEN_DECIMALS - power)
    digits = np.rint(product)
    certain = usual & (product >= 10.0**WRITTEN_DECIMALS) & (digits < 10.0 ** (WRITTEN_DECIMALS + 1))
    certain &= np.abs((product - digits) + left) < 0.5 - 1e-6
    certain |= numbers == 0
    lead, groups, exponents = _words()
    mantissa = digits.astype(np.int64)
    first, fraction = mantissa // 10**12, mantissa % 10**12
    words = np.empty((numbers.size, 5), np.uint32)
    words[:, 0] = lead.take(first + 10 * np.signbit(numbers), mode="clip")
    words[:, 1] = groups.take(fraction // 10**8)
    words[:, 2] = groups.take(fraction // 10**4 % 10**4)
    words[:, 3] = groups.take(fraction % 10**4)
    words[:, 4] = exponents.take(power.astype(np.intp) + 99)
    text = words.view(np.uint8)
    for i in np.flatnonzero(~certain).tolist():
        text[i] = np.frombuffer(b"%20.12E" % float(numbers[i]), np.uint8)
    return text


@cache
def _words() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the four bytes of sign, first digit and point; of four digits; and of an exponent from -99."""
    lead = "".join(f" {sign}{digit}." for sign in " -" for digit in range(10))
    groups = "".join(f"{number:04d}" for number in range(10**4))
    exponents = "".join(f"E{power:+03d}" for power in range(-99, 100))
    first, second, third = (np.frombuffer(text.encode(), np.uint32) for text in (lead, groups, exponents))
    return first, second, third
