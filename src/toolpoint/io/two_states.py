"""Two states of one machine from two files: two machine files, or two files of saved modes or responses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.io.machine_poses import read_machine_at
from toolpoint.io.measured.test_nouns import read_test_nouns
from toolpoint.machine import Machine
from toolpoint.vibration import Frf, Modes

_MACHINE_SUFFIXES = (".yaml", ".yml")
NamedMachine = tuple[str, Machine]
NamedTest = tuple[str, tuple[Modes | None, Frf | None]]


def read_two_states(older: Path, newer: Path, *, pose: Mapping[str, float] | None = None, quantity: str | None = None,
                    **naming: Any) -> tuple[NamedMachine, NamedMachine] | tuple[NamedTest, NamedTest]:
    """Return both states with their names: machines at a pose that they can take, or tests as saved modes or responses.

    Raises ToolpointError where one is a machine file and the other a test, and for the faults of either.

    >>> import tempfile
    >>> from toolpoint.io import write_noun
    >>> from toolpoint.vibration import Modes
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     files = [Path(folder, f"{name}.h5") for name in ("spring", "autumn")]
    ...     for file, frequency in zip(files, (80.0, 78.0)):
    ...         write_noun(Modes([frequency], [0.02], [[1.0]], ["tip:+x"]), file)
    ...     older, newer = read_two_states(*files)
    >>> [name for name, _ in (older, newer)], newer[1][0].frequency.tolist()
    (['spring', 'autumn'], [78.0])
    """
    kinds = [path.suffix.lower() in _MACHINE_SUFFIXES for path in (older, newer)]
    if kinds[0] != kinds[1]:
        raise ToolpointError(f"{older.name}, {newer.name}: a machine file and a test; must be two of a kind "
                             "(the command correlate puts a test beside a machine)")
    first, second = _names(older, newer)
    if kinds[0]:
        return (first, read_machine_at(older, pose)), (second, read_machine_at(newer, pose))
    if pose:
        raise ToolpointError("pose: given for two tests; must be left out: a test is of the pose that it was made at")
    tests = [read_test_nouns([path], quantity=quantity, **naming) for path in (older, newer)]
    return (first, tests[0]), (second, tests[1])


def _names(older: Path, newer: Path) -> tuple[str, str]:
    """Return the files' names, with their folders where they are alike, and numbered where these are too."""
    if older.stem != newer.stem:
        return older.stem, newer.stem
    folders = older.resolve().parent.name, newer.resolve().parent.name
    if folders[0] != folders[1]:
        return f"{folders[0]}/{older.stem}", f"{folders[1]}/{newer.stem}"
    return f"{older.stem} 1", f"{newer.stem} 2"
