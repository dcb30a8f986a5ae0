"""Whether a file holds time records, told before anybody reads it as responses."""

from __future__ import annotations

from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io import uff
from toolpoint.io.binary import hdf5, mat, numpy_arrays
from toolpoint.io.suffixes import HDF5, LVM, MATLAB, TDMS, TEXT, UNIVERSAL, WAV
from toolpoint.io.text.columns import TIMES
from toolpoint.io.uff.functions import TIME
from toolpoint.vibration import Frf, Record

HEAD = 4000  # bytes of a text that are looked at


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
        return kinds == {TIME}
    if kind in HDF5:
        nouns = {type(noun) for noun in hdf5.read_all(path).values()}
        return Record in nouns and Frf not in nouns
    if kind in MATLAB:
        return mat.holds_samples(path)
    if kind == ".npz":
        return numpy_arrays.holds_samples(path)
    return kind in TEXT and _is_timed(path)


def _is_timed(path: Path) -> bool:
    """Return whether the line before the numbers of a text begins with a column of time."""
    with path.open("rb") as file:
        lines = file.read(HEAD).decode("utf-8-sig", errors="replace").splitlines()
    for line in lines:
        word = line.strip().lstrip("#%\" ").lower()
        if word[:1].isdigit() or word[:1] in "+-.":
            return False
        if any(word.startswith(name) and not word[len(name):len(name) + 1].isalpha() for name in TIMES):
            return True
    return False
