"""Time histories from files of any format: the one way in."""

from __future__ import annotations

from pathlib import Path

from toolpoint.io import hdf5, mat, uff
from toolpoint.io.suffixes import HDF5, MATLAB, UNIVERSAL
from toolpoint.io.text import record_table
from toolpoint.vibration import Record


def read(path: str | Path) -> Record:
    """Return the Record of a text, MATLAB, universal or HDF5 file, SI; the ending of its name says the format."""
    kind = Path(path).suffix.lower()
    if kind in MATLAB:
        return mat.read_record(path)
    if kind in UNIVERSAL:
        return uff.read_record(path)
    if kind in HDF5:
        return hdf5.read(path, Record)
    return record_table.read(path)
