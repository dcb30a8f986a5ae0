"""Measurements of any kind: which noun files hold, and a hammer test with the description of its records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from toolpoint._check import ToolpointError
from toolpoint.io.measured import frf_files, mode_files, record_files
from toolpoint.io.measured.channels import parse_channel
from toolpoint.io.measured.record_signs import holds_records
from toolpoint.io.yaml.testing import test_file
from toolpoint.signals.record_set import RecordSet
from toolpoint.signals.test_description import HammerTestDescription, RecordsDescription
from toolpoint.vibration import Frf, Modes, Record

Paths = Sequence[str | Path]


def hold_records(paths: Paths) -> bool:
    """Return whether files hold time records, and not responses; ToolpointError where some do and some do not.

    >>> import tempfile
    >>> import numpy as np
    >>> from toolpoint.io import write_noun
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "blow.h5")
    ...     write_noun(Record(np.zeros((8, 1)), 1e3, ["tip:+x"], "acceleration"), file)
    ...     hold_records([file])
    True
    """
    kinds = {holds_records(Path(path)) for path in paths}
    if len(kinds) > 1:
        names = ", ".join(Path(path).name for path in paths[:4])
        raise ToolpointError(f"{names}: some hold time records and some responses; must be one kind")
    return kinds == {True}


def read_measured(paths: Paths, *, quantity: str | None = None, **naming: Any) -> Frf | Modes | Record:
    """Return what files hold: saved modes or a time record (of one file), else the responses of all of them.

    Parameters
    ----------
    paths : sequence of paths
    quantity, naming
        For responses, see `frf_files.read`.

    Raises
    ------
    ToolpointError
        For several files of modes or records, and files that hold none of the three: then with what each reader said.

    >>> import tempfile
    >>> from toolpoint.io import write_noun
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "modes.h5")
    ...     write_noun(Modes([80.0, 130.0], [0.02, 0.01], [[1.0, 0.5]], ["tip:+x"]), file)
    ...     read_measured([file]).frequency.tolist()
    [80.0, 130.0]
    """
    files = [Path(path) for path in paths]
    if len(files) == 1 and mode_files.holds_modes(files[0]):
        return mode_files.read(files[0])
    if all(holds_records(file) for file in files):
        if len(files) > 1:
            raise ToolpointError(f"{files[1]}: a file of time records is converted alone; call once for each")
        return record_files.read(files[0])
    return frf_files.read(files, quantity=quantity, **naming)


def read_test_nouns(paths: Paths, *, quantity: str | None = None, **naming: Any) -> tuple[Modes | None, Frf | None]:
    """Return the saved modes and the responses that the files of a test hold, None where there are none.

    quantity, naming : for responses, see `frf_files.read`.

    Raises
    ------
    ToolpointError
        For several files of modes (which of them counts would be a guess), and what cannot be read.

    >>> import tempfile
    >>> from toolpoint.io import write_noun
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "modes.h5")
    ...     write_noun(Modes([80.0], [0.02], [[1.0]], ["tip:+x"]), file)
    ...     modes, frf = read_test_nouns([file])
    >>> modes.count, frf  # modes alone: there are no responses
    (1, None)
    """
    saved = [path for path in paths if mode_files.holds_modes(path)]
    responses = [path for path in paths if path not in saved]
    if len(saved) > 1:
        raise ToolpointError(f"{saved[1]}: modes beside those of {saved[0]}; must be one file of modes")
    frf = frf_files.read(responses, quantity=quantity, **naming) if responses else None
    return mode_files.read(saved[0]) if saved else None, frf


def read_hammer_test(paths: str | Path | Paths) -> tuple[RecordSet, HammerTestDescription]:
    """Return the records that a test file (YAML) names, with its decisions about hits, and the description of the test.

    paths : of the test file, or a sequence of this one path.

    Raises
    ------
    ToolpointError
        For anything beside the test file, and for its faults.

    >>> from toolpoint.samples import write_samples
    >>> import tempfile
    """
    path, *others = (Path(path) for path in ([paths] if isinstance(paths, (str, Path)) else paths))
    if others:
        raise ToolpointError(f"{others[0]}: beside the test file {path}; a test file names its records itself")
    description = test_file.read(path)
    return record_files.read_test(description, path.parent), description


def read_described_records(
    paths: Paths, channels: Sequence[str] = (), *, struck: str | None = None, pattern: str | None = None,
    rate: float | None = None, variables: Mapping[str, str] | None = None, block: float | None = None,
    window_end: float | None = None, estimator: Literal["H1", "H2", "Hv"] = "H1", folder: str | Path | None = None,
    excitation: Literal["hammer", "random", "burst", "swept", "pseudo-random"] = "hammer", resolution: float | None = None,
    zoom: tuple[float, ...] = (), settle: int = 0,
) -> tuple[RecordSet, HammerTestDescription]:
    """Return records of files, and the description with which a test file would name them.

    Parameters
    ----------
    paths, channels, struck, pattern, rate, variables
        See `record_files.read_all`.
    block, window_end, estimator, excitation, resolution, zoom, settle
        Settings of the test, see `HammerTestDescription`.
    folder : path, optional
        Where the test file will lie: files inside are named from there.
    """
    described = [parse_channel(text) for text in channels]
    files = [Path(path) for path in paths]
    records = record_files.read_all(files, described, struck=struck, pattern=pattern, rate=rate,
                                    variables=None if variables is None else dict(variables))
    base = None if folder is None else Path(folder).resolve()
    names = tuple(str(file.relative_to(base)) if base is not None and file.is_relative_to(base) else str(file)
                  for file in (file.resolve() for file in files))
    title = "Hammer test" if excitation == "hammer" else "Shaker test"
    return records, HammerTestDescription(
        title, (RecordsDescription(names, struck, pattern),), tuple(described), estimator, block, window_end, rate,
        excitation=excitation, resolution=resolution, zoom=zoom, settle=settle)
