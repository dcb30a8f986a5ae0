"""Key of a description in a memory cache: descriptions hold mappings, so their text identifies them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Generic, TypeVar

Described = TypeVar("Described")


@dataclass(frozen=True)
class ContentKey(Generic[Described]):
    """Equal to another key where the texts of both descriptions are."""

    text: str
    description: Described = field(compare=False)

    @classmethod
    def of(cls, description: Described) -> ContentKey[Described]:
        """Return the key of a description."""
        return cls(repr(description), description)
