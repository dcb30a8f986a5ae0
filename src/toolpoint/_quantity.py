"""What a number in a description is: its quantity, SI unit and limits; written once, beside the field that holds it."""

from __future__ import annotations

from dataclasses import dataclass


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
