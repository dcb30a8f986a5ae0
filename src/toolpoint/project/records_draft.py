"""Draft of the test of records that do not say what their channels are, from their names and columns."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.io.measured.channels import guess_quantity
from toolpoint.io.measured.name_patterns import dof_of
from toolpoint.io.measured.record_files import ROVING, read_columns
from toolpoint.io.suffixes import HDF5, LVM, MATLAB, NUMPY, TDMS, TEXT, WAV
from toolpoint.machine.description.project_plan import ProjectDescription
from toolpoint.project.folder import PROJECT_FILE

RECORDS_FOLDER = "records"  # of a project
UNLABELLED_SUFFIXES = (*TEXT, *LVM, *WAV, *TDMS, *MATLAB, *NUMPY, *HDF5)  # of records; universal ones say what they are
DIRECTIONS = ("+x", "+y", "+z")  # of a sensor's channels, in the order of most of them
MAX_DRAFTED_CHANNELS = 16


@dataclass(frozen=True)
class RecordsDraft:
    """Entry of a test in project.yaml.

    records : files or patterns, from the project's folder; pattern : how their names say Dofs, ``P{output}_*``; struck : Dof
    that was struck where neither names nor channels say it; channels : as for ``toolpoint frf --channel``; of : what was
    struck.

    >>> RecordsDraft("structure", ("records/*.mat",), "P{output}_*", "5:+x", ("1=force", "2=acceleration *:+x")).value
    '{records: ["records/*.mat"], pattern: "P{output}_*", struck: "5:+x", channels: ["1=force", "2=acceleration *:+x"]}'
    """

    name: str
    records: tuple[str, ...]
    pattern: str = ""
    struck: str = ""
    channels: tuple[str, ...] = ()
    of: Literal["structure", "tip x", "tip y"] = "structure"

    @property
    def value(self) -> str:
        """The entry as project.yaml has it."""
        parts: dict[str, Any] = {"of": "" if self.of == "structure" else self.of, "records": list(self.records),
                                 "pattern": self.pattern, "struck": self.struck, "channels": list(self.channels)}
        words = (f"{key}: {part if key == 'of' else json.dumps(part, ensure_ascii=False)}"
                 for key, part in parts.items() if part)
        return "{" + ", ".join(words) + "}"

    def to_dict(self) -> dict[str, Any]:
        """Return the draft as plain data."""
        return {"name": self.name, "of": self.of, "records": list(self.records), "pattern": self.pattern,
                "struck": self.struck, "channels": list(self.channels)}


def draft_test(folder: str | Path, described: ProjectDescription | None = None) -> RecordsDraft | None:
    """Return the test that records of a project make which none of its tests names; None where there are none.

    Places of points (geometry) tell which part of a file's name is a point. Nothing is entered: `entering.enter_test` does.

    >>> import tempfile
    >>> from toolpoint.project import write_folder
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     root = write_folder(Path(folder, "mill")).parent
    ...     _ = (root / "records/blows.csv").write_text("time [s],hammer [N],acc [m/s^2]\\n0,0,0\\n0.001,5,2\\n")
    ...     draft_test(root).channels
    ('1=force 1:+x', '2=acceleration 1:+x')
    """
    root = Path(folder)
    described = described or io.read_project(root / PROJECT_FILE)
    files = _unnamed_records(root, described)
    if not files:
        return None
    places = _pattern_of([file.stem for file in files], _points(root, described))
    name = next(name for name in ("structure", *(f"test {k}" for k in range(2, 1000))) if name not in described.tests)
    return RecordsDraft(name, _patterns_of(root, files, named=_named_records(root, described)), places,
                     channels=_channels_of(files[0], places))


def files_of(root: Path, text: str) -> list[Path]:
    """Return the files of a name or pattern; none for one that leads out of the folder."""
    if not text or "\0" in text or Path(text).is_absolute() or ".." in Path(text).parts:
        return []
    return sorted(file for file in root.glob(text) if file.is_file())


def _named_records(root: Path, described: ProjectDescription) -> set[Path]:
    """Return the records that tests of a project name."""
    named = {file for test in described.tests.values() for text in test.records for file in files_of(root, text)}
    for test in described.tests.values():
        if test.test is not None:
            try:
                description: Any = io.read_kind(root / test.test, "test")[1]
            except (ToolpointError, OSError):
                continue
            folder = Path(test.test).parent
            named |= {file for part in description.records for text in part.files
                      for file in files_of(root, os.path.normpath(folder / text))}
    return named


def _unnamed_records(root: Path, described: ProjectDescription) -> list[Path]:
    """Return the records that no test names and that do not say what they are, of their most frequent ending."""
    named = _named_records(root, described)
    files = [file for file in sorted((root / RECORDS_FOLDER).glob("*")) if file.is_file() and file not in named
             and file.resolve().is_relative_to(root.resolve())  # a page may not show another's columns
             and not file.name.lower().startswith((".", "readme")) and file.suffix.lower() in UNLABELLED_SUFFIXES]
    suffixes = [file.suffix for file in files]
    return [file for file in files if file.suffix == max(suffixes, key=suffixes.count)]


def _patterns_of(root: Path, files: Sequence[Path], *, named: Collection[Path]) -> tuple[str, ...]:
    """Return one pattern for all files of an ending where it takes no other record, else their names."""
    if len(files) == 1:
        return (files[0].relative_to(root).as_posix(),)
    pattern = f"{files[0].parent.relative_to(root).as_posix()}/*{files[0].suffix}"
    others = set(files_of(root, pattern)) & set(named)
    return tuple(file.relative_to(root).as_posix() for file in files) if others else (pattern,)


def _points(root: Path, described: ProjectDescription) -> frozenset[str]:
    """Return the names of the measured points; none where no geometry can be read."""
    if described.geometry is None:
        return frozenset()
    try:
        return frozenset(map(str, io.read_test_geometry(root / described.geometry).points))
    except (ToolpointError, OSError):
        return frozenset()


def _pattern_of(stems: Sequence[str], points: frozenset[str]) -> str:
    """Return how names say what was measured and struck, empty where they do not: parts between underscores that vary, and
    whose varying end is a point, are places; that of most points is where it was measured."""
    rows = [stem.split("_") for stem in stems]
    if len(stems) < 2 or len({len(row) for row in rows}) > 1:
        return ""
    words, places = [], dict[int, int]()
    for k, column in enumerate(zip(*rows, strict=True)):
        start = _common_start(column).rstrip("0123456789+-")
        ends = {part[len(start):] for part in column}
        if len(ends) == 1:
            words.append(column[0])
            continue
        is_place = all(end and str(dof_of(end).point) in points for end in ends)
        words.append(start + ("{}" if is_place else "*"))
        if is_place:
            places[k] = len(ends)
    if not places:
        return ""
    roles = ["{output}", "{input}"]
    for k in sorted(places, key=lambda k: -places[k]):
        words[k] = words[k].replace("{}", roles.pop(0) if roles else "*")
    return "_".join(words)


def _common_start(words: Sequence[str]) -> str:
    """Return the letters with which all words begin."""
    is_common = [len(set(letters)) == 1 for letters in zip(*words, strict=False)]
    return words[0][:is_common.index(False) if False in is_common else len(is_common)]


def _channels_of(file: Path, pattern: str) -> tuple[str, ...]:
    """Return a line on every channel of a file, as far as its names and units say it; the first is the hammer otherwise."""
    try:
        columns = read_columns(file)
    except (ToolpointError, OSError):
        return ()
    quantities = [guess_quantity(name, unit) for name, unit in zip(columns.names, columns.units, strict=True)]
    lines, motions = [], 0
    for k, quantity in enumerate(quantities[:MAX_DRAFTED_CHANNELS], start=1):
        word = quantity or ("force" if k == 1 and "force" not in quantities else "acceleration")
        if word == "force":
            lines.append(f"{k}=force" + ("" if "{input}" in pattern else " 1:+x"))
            continue
        lines.append(f"{k}={word} {ROVING if '{output}' in pattern else '1'}:{DIRECTIONS[motions % len(DIRECTIONS)]}")
        motions += 1
    return tuple(lines)
