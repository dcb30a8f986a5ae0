"""Meaning of a number in a description: its quantity, SI unit and limits; written once, beside the field, and checked by it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

Key = tuple[str | int, ...]


@dataclass(frozen=True)
class Quantity:
    """Meaning of a number: ``length: Annotated[float, Quantity("length", "m", above=0)]``.

    `name` and `unit` (SI) say what a file may hold; a value lies above `above`, is at least `least` and at most `most`.
    """

    name: str
    unit: str
    above: float | None = None
    least: float | None = None
    most: float | None = None

    @property
    def limits(self) -> dict[str, float]:
        """The limits that are set, by the names of comparisons: gt, ge, le."""
        named = {"gt": self.above, "ge": self.least, "le": self.most}
        return {name: value for name, value in named.items() if value is not None}

    def fault(self, value: float) -> str:
        """Return what is wrong with a value, or nothing: ``-1 m; must be above 0 m``."""
        if self.above is not None and not value > self.above:
            return f"{value:g} {self.unit}; must be above {self.above:g} {self.unit}"
        if self.least is not None and not value >= self.least:
            return f"{value:g} {self.unit}; must be at least {self.least:g} {self.unit}"
        if self.most is not None and not value <= self.most:
            return f"{value:g} {self.unit}; must be at most {self.most:g} {self.unit}"
        return ""


def limit_faults(part: Any, key: Key = ()) -> Iterator[tuple[Key, str]]:
    """Yield place and text of every number outside its limits, and every word that is no choice, in a description."""
    if isinstance(part, Mapping):
        for name, entry in part.items():
            yield from limit_faults(entry, (*key, name))
    elif isinstance(part, tuple):
        for number, entry in enumerate(part):
            yield from limit_faults(entry, (*key, number))
    elif is_dataclass(part):
        description: Any = type(part)
        for field in fields(part):
            value, (quantity, choices) = getattr(part, field.name), _meanings(description)[field.name]
            if choices and value not in choices:
                yield (*key, field.name), f"{value!r}; must be one of {', '.join(choices)}"
            numbers = value if isinstance(value, tuple) else value.values() if isinstance(value, Mapping) else (value,)
            texts = [quantity.fault(v) for v in numbers if v is not None] if quantity else []
            yield from (((*key, field.name), text) for text in texts if text)
            yield from limit_faults(value, (*key, field.name))


@cache
def _meanings(description: Any) -> dict[str, tuple[Quantity | None, tuple[str, ...]]]:
    hints = get_type_hints(description, include_extras=True)
    return {name: (_quantity_in(hint), get_args(hint) if get_origin(hint) is Literal else ()) for name, hint in hints.items()}


def _quantity_in(hint: Any) -> Quantity | None:
    """Return the quantity of a number, an optional number or a tuple of them."""
    if get_origin(hint) is Annotated:
        return next((mark for mark in get_args(hint) if isinstance(mark, Quantity)), None)
    return next((quantity for part in get_args(hint) if (quantity := _quantity_in(part))), None)
