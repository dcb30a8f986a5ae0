"""Whether a file holds time records, told before anybody reads it as responses."""

from __future__ import annotations

import re
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io import uff
from toolpoint.io.binary import hdf5, mat, numpy_arrays
from toolpoint.io.decoding import decode
from toolpoint.io.suffixes import HDF5, LVM, MATLAB, TDMS, TEXT, UNIVERSAL, WAV
from toolpoint.io.text.columns import TIMES, is_count
from toolpoint.io.uff.functions import TIME_RECORD_TYPE
from toolpoint.vibration import Frf, Record

INSPECTED_BYTES = 20_000  # bytes of a text that are looked at
_CELLS = re.compile(r"[,;\t]|\s+")


def check_responses(path: Path) -> None:
    """Raise ToolpointError where a file holds time records and no responses, with the command that forms responses of them."""
    try:
        are_records = holds_records(path)
    except ToolpointError:
        return  # the reader has the words for what is wrong with it
    if are_records:
        raise ToolpointError(f"{path}: holds time records, no frequency responses; form them first:\n  toolpoint frf {path} "
                             "--save responses.h5\nand then use responses.h5")


def holds_records(path: Path) -> bool:
    """Return whether a file holds time records and no frequency responses."""
    kind = path.suffix.lower()
    if not path.is_file():
        return False
    if kind in (*LVM, *WAV, *TDMS):
        return True
    if kind in UNIVERSAL:
        kinds = {head.kind for head in uff.headers(path)}
        return kinds == {TIME_RECORD_TYPE}
    if kind in HDF5:
        nouns = {type(noun) for noun in hdf5.read_all(path).values()}
        return Record in nouns and Frf not in nouns
    if kind in MATLAB:
        return mat.holds_samples(path)
    if kind == ".npz":
        return numpy_arrays.holds_samples(path)
    return kind in TEXT and _is_timed(path)


def _is_timed(path: Path) -> bool:
    """Return whether a line of names before the numbers of a text begins with a column of time.

    Only lines with as many cells as the numbers are names of columns: a date or a time of day above them is a remark.
    """
    with path.open("rb") as file:
        lines = decode(file.read(INSPECTED_BYTES)).splitlines()
    first = next((k for k, line in enumerate(lines) if re.match(r'\s*"?[-+.]?\d', line)), None)
    if first is None:
        return False
    # Between semicolons or tabs a comma is that of a decimal and parts nothing.
    separator = next((re.compile(mark) for mark in ";\t" if mark in lines[first].strip()), _CELLS)
    cells = len(separator.split(lines[first].strip()))
    names = [line.strip().lstrip("#%\" ").lower() for line in lines[max(first - 2, 0):first]]
    words = [word if not is_count(first_cell) else word[len(first_cell):].lstrip(",;\t \"'")
             for word in names if len(separator.split(word)) >= cells for first_cell in [separator.split(word)[0]]]
    return any(word.startswith(name) and not word[len(name):len(name) + 1].isalpha() for word in words for name in TIMES)
