"""Origin of the numbers of a part: the first word of its source, before the colon that names the publication."""

from __future__ import annotations

SOURCE_ORIGINS = ("published", "measured", "chosen", "assumed", "computed")


def origin_of(source: str) -> str:
    """Return the origin that a source begins with, empty where it is none: ``published: Machines 2022`` -> ``published``."""
    word = source.split(":")[0].strip()
    return word if word in SOURCE_ORIGINS else ""
