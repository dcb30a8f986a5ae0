"""Subprograms in files of their own, beside the program: found by name in its folder, as controls do."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

# How names of program files end, in capitals; others in the folder are not looked at.
SUFFIXES = frozenset({"", ".NGC", ".NC", ".MPF", ".SPF", ".TXT", ".TAP", ".CNC", ".GCODE", ".SUB", ".EIA", ".ISO", ".PRG"})
MAX_SUBPROGRAM_BYTES = 20_000_000  # a file larger than any subprogram is data that bears its name


@dataclass(frozen=True)
class SubprogramFile:
    """Name and text of a file that holds a subprogram."""

    name: str
    text: str


@dataclass
class FilesBeside:
    """Program files of a folder by the capitals of their stem; the program itself is none of them."""

    program: Path
    _stems: dict[str, Path] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for path in sorted(self.program.parent.iterdir()):
            if path.suffix.upper() in SUFFIXES and path.name != self.program.name and path.is_file():
                self._stems.setdefault(path.stem.upper(), path)

    def find(self, name: str) -> SubprogramFile | None:
        """Return the file of a subprogram: ``<NAME>`` (o-words), a number (O9010), a name; nothing where there is none."""
        name = name.strip("<>\"' ").upper()
        stems = [f"O{int(name):04d}", f"O{name}", name, f"{int(name):04d}"] if name.isdigit() else [name]
        path = next((self._stems[stem] for stem in stems if stem in self._stems), None)
        if path is None or path.stat().st_size > MAX_SUBPROGRAM_BYTES:
            return None
        return SubprogramFile(path.name, path.read_text(encoding="utf-8-sig", errors="replace"))
