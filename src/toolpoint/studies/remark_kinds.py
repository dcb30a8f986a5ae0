"""Remarks of many samples or poses: each kind once, its numbers as a range."""

from __future__ import annotations

import re
from collections.abc import Iterable

from toolpoint._doubt import Doubt

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w])")


def first_of_each_kind(remarks: Iterable[str]) -> tuple[str, ...]:
    """Return the remarks with those that differ in numbers alone merged, in the order of their first: ``3 to 7 %``.

    Doubts stay doubts.
    """
    kinds: dict[str, list[str]] = {}
    for remark in dict.fromkeys(remarks):
        kinds.setdefault(NUMBER.sub("#", remark), []).append(remark)
    return tuple(_merge_kind(kind) for kind in kinds.values())


def _merge_kind(kind: list[str]) -> str:
    columns = list(zip(*(NUMBER.findall(remark) for remark in kind), strict=True))
    ranges = iter([_span(column) for column in columns])
    merged = NUMBER.sub(lambda _: next(ranges), kind[0])
    return Doubt.parsed(merged) if isinstance(kind[0], Doubt) else merged


def _span(numbers: tuple[str, ...]) -> str:
    smallest, largest = min(numbers, key=float), max(numbers, key=float)
    return numbers[0] if float(smallest) == float(largest) else f"{smallest} to {largest}"
