"""Modes from files of any format: the one way in."""

from __future__ import annotations

from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io import uff
from toolpoint.io.binary import hdf5
from toolpoint.io.suffixes import HDF5, UNIVERSAL
from toolpoint.vibration import Modes


def read(path: str | Path) -> Modes:
    """Return the modes of toolpoint's HDF5 file (.h5) or of a universal file (sets 55 or 2414).

    >>> import tempfile
    >>> from toolpoint.io import write_noun
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "modes.h5")
    ...     write_noun(Modes([80.0], [0.02], [[1.0]], ["tip:+x"]), file)
    ...     read(file).damping_ratio.tolist()
    [0.02]
    """
    kind = Path(path).suffix.lower()
    if kind in UNIVERSAL:
        return uff.read_modes(path)
    if kind not in HDF5 and Path(path).is_file():
        raise ToolpointError(f"{path}: saved modes are HDF5 files (.h5) or universal files; of measured responses the modes "
                             "are identified first")
    return hdf5.read(path, Modes)


def holds_modes(path: str | Path) -> bool:
    """Return whether a file is toolpoint's HDF5 file, or a universal file, with modes in it and no responses."""
    if Path(path).suffix.lower() in UNIVERSAL and Path(path).is_file():
        numbers = {dataset.number for dataset in uff.UniversalFile(Path(path)).sets}
        return bool(numbers & {55, 2414}) and 58 not in numbers
    if Path(path).suffix.lower() not in HDF5:
        return False
    kinds = [type(noun).__name__ for noun in hdf5.read_all(path).values()]
    return "Modes" in kinds and "Frf" not in kinds
