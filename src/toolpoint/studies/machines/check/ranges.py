"""Doubts about numbers outside the range that machines of this kind have: one wording for all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from toolpoint._doubt import Doubt


def question_range(path: str, value: float | None, bounds: tuple[float, float, str], *, words: str = "") -> Iterator[Doubt]:
    """Doubt a value (SI) outside bounds (least, most, unit); none where it is left out or zero."""
    lower, upper, unit = bounds
    if value is None or value == 0 or lower <= abs(value) <= upper:
        return
    factor = max(lower / abs(value), abs(value) / upper)
    yield Doubt(path, f"{value:.4g} {unit}".strip() + f", {lower:g} to {upper:g} is usual" + (f" {words}" if words else ""),
                "check its unit", figure=factor)


def odd_among(values: Mapping[str, float], max_factor: float, bounds: tuple[float, float, str]) -> Iterator[Doubt]:
    """Doubt the value, by path, that differs from all others by more than a factor.

    Of two values, the one farther from the middle of its bounds is doubted.
    """
    rows = {path: abs(value) for path, value in values.items() if value}
    lower, upper, unit = bounds
    # Of two values alone neither is odd by the other: the middle of the usual range decides.
    middle = (lower * upper) ** 0.5
    for path, value in rows.items():
        others = [other for name, other in rows.items() if name != path]
        if not others:
            continue
        factor = max(min(others) / value, value / max(others))
        stands_out = len(others) > 1 or abs(np.log(value / middle)) > abs(np.log(others[0] / middle))
        if factor > max_factor and stands_out:
            yield Doubt(path, f"{value:.4g} {unit}".strip() + f", {factor:.2g} times apart from {min(others):.4g} to "
                        f"{max(others):.4g} of the other axes", "check its unit", figure=factor)
