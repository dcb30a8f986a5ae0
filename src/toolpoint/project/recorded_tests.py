"""Files of a project's tests: names and patterns resolved, records that a test file names, files that two tests name."""

from __future__ import annotations

import glob
import posixpath
from collections.abc import Mapping, Sequence
from pathlib import Path

from toolpoint import io
from toolpoint._check import ToolpointError, fail
from toolpoint.machine.description.project_plan import ProjectTest


def find_files(root: Path, key: str, patterns: Sequence[str]) -> tuple[str, ...]:
    """Return the files of names and patterns, relative to the project, sorted within each; a pattern without one is refused."""
    files: list[str] = []
    for pattern in patterns:
        if not set(pattern) & set("*?["):
            files.append(pattern)
            continue
        matches = sorted(glob.glob(pattern, root_dir=root))
        if not matches:
            raise ToolpointError(f"{key}: no file fits {pattern!r} in {root}; check the pattern and the folder")
        files += [Path(match).as_posix() for match in matches]
    return tuple(dict.fromkeys(files))


def find_records(root: Path, name: str, test: ProjectTest) -> tuple[str, ...]:
    """Return the records of a test: its own, or those that its test file names."""
    if test.test is None:
        return find_files(root, f"tests.{name}.records", test.records)
    description = io.read_kind(root / test.test, "test")[1]
    folder = Path(test.test).parent
    patterns = [(folder / text).as_posix() for part in description.records for text in part.files]
    return find_files(root, f"tests.{name}.test", patterns)


def refuse_repeated_files(root: Path, tests: Mapping[str, ProjectTest]) -> None:
    """Refuse a file of two tests of one thing: its blows would count as two tests."""
    owners: dict[tuple[str, str], str] = {}
    for name, test in tests.items():
        files: tuple[str, ...] = () if test.modes is None else (test.modes,)
        if test.test or test.records:
            files = find_records(root, name, test)
        elif test.responses:
            files = find_files(root, f"tests.{name}.responses", test.responses)
        for file in map(posixpath.normpath, files):
            owner = owners.setdefault((test.of, file), name)
            if owner != name:
                fail(f"tests.{name}", f"{file} is also in tests.{owner}", "must be in one test, as its blows are those of one",
                     remedy="take one of the two out of project.yaml")
