"""Numbers outside the range that machines of this kind have: the wording that all such doubts share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from toolpoint._doubt import Doubt


def question_range(path: str, value: float | None, bounds: tuple[float, float, str], *, words: str = "") -> Iterator[Doubt]:
    """Doubt a value (SI) outside bounds (least, most, unit); none where it is left out or zero."""
    low, high, unit = bounds
    if value is None or value == 0 or low <= abs(value) <= high:
        return
    away = max(low / abs(value), abs(value) / high)
    yield Doubt(path, f"{value:.4g} {unit}".strip() + f", {low:g} to {high:g} is usual" + (f" {words}" if words else ""),
                "check its unit", figure=away)


def odd_among(values: Mapping[str, float], far: float, bounds: tuple[float, float, str]) -> Iterator[Doubt]:
    """Doubt the value, by path, that is so many times apart from all others; of two, that farther from the middle of its
    bounds."""
    rows = {path: abs(value) for path, value in values.items() if value}
    low, high, unit = bounds
    middle = (low * high) ** 0.5
    for path, value in rows.items():
        others = [other for name, other in rows.items() if name != path]
        if not others:
            continue
        away = max(min(others) / value, value / max(others))
        alone = len(others) > 1 or abs(np.log(value / middle)) > abs(np.log(others[0] / middle))
        if away > far and alone:
            yield Doubt(path, f"{value:.4g} {unit}".strip() + f", {away:.2g} times apart from {min(others):.4g} to "
                        f"{max(others):.4g} of the other axes", "check its unit", figure=away)
