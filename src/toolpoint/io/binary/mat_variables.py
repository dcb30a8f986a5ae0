"""Variables of MATLAB files, version 5 to 7 (scipy) and 7.3 (HDF5), by name: numbers and texts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array, issparse

from toolpoint._check import Array, ToolpointError
from toolpoint.io.binary import reader_process
from toolpoint.io.door import door

# MATLAB's version 7.3 is HDF5 behind a header of its own: only these bytes tell it from older files.
SIGNATURE = b"\x89HDF\r\n\x1a\n"


@door("MATLAB file")
def variables(path: str | Path) -> dict[str, Array]:
    """Return all numeric arrays of a file by name; fields of structures as ``structure.field``.

    Vectors come as one axis, complex parts joined, and axes in MATLAB's order for every version of the format.
    """
    path = Path(path)
    arrays: dict[str, Array] = {}
    if _is_version_73(path):
        for name, (attributes, value) in reader_process.load(path, "hdf5").items():
            _collect(name.replace("/", "."), attributes, value, arrays)
        return {name: value for name, value in arrays.items() if not name.startswith("#")}
    for name, value in reader_process.load(path, "mat").items():
        _unpacked(name, value, arrays)
    return arrays


@door("MATLAB file")
def texts(path: str | Path) -> dict[str, tuple[str, ...]]:
    """Return all texts of a file by name: a character array as one line each row, a cell array of them as its cells."""
    path = Path(path)
    lines: dict[str, tuple[str, ...]] = {}
    if _is_version_73(path):
        for name, (attributes, value) in reader_process.load(path, "hdf5").items():
            cells: list[Any] = value if isinstance(value, list) else [(attributes, value)]
            if not name.startswith("#") and "/" not in name and value is not None and all(
                    isinstance(cell, tuple) and cell[0].get("MATLAB_class") == "char" for cell in cells):
                lines[name] = tuple("".join(map(chr, row)) for _, cell in cells for row in np.atleast_2d(np.asarray(cell).T))
        return lines
    for name, value in reader_process.load(path, "mat").items():
        array = np.asarray(value)
        parts = [np.asarray(cell) for cell in array.reshape(-1)] if array.dtype.kind == "O" else [array]
        if parts and all(part.dtype.kind == "U" for part in parts):
            lines[name] = tuple(str(line).strip() for part in parts for line in part.reshape(-1))
    return lines


@door("MATLAB file")
def square_matrices(path: str | Path) -> dict[str, csc_array]:
    """Return all square matrices of a file by name, full and sparse ones; those of one row are numbers and left out."""
    path = Path(path)
    matrices: dict[str, Any] = {}
    if not _is_version_73(path):
        for name, value in reader_process.load(path, "mat").items():
            if issparse(value) or (isinstance(value, np.ndarray) and value.dtype.kind in "fiuc"):
                matrices[name] = value
    else:
        tree = reader_process.load(path, "hdf5")
        for name, (attributes, value) in tree.items():
            if "MATLAB_sparse" in attributes:
                parts: list[Any] = [np.asarray(tree[f"{name}/{part}"][1]) if f"{name}/{part}" in tree else np.zeros(0)
                         for part in ("data", "ir", "jc")]
                rows = int(attributes["MATLAB_sparse"])
                entries = parts[0]["real"] + 1j * parts[0]["imag"] if parts[0].dtype.names else parts[0]
                matrices[name] = csc_array((entries, *(part.astype(int) for part in parts[1:])),
                                           shape=(rows, parts[2].size - 1))
            elif isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and "/" not in name:
                matrices[name] = value.T  # MATLAB counts columns first
    return {name: csc_array(matrix) for name, matrix in matrices.items()
            if matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1] > 1}


def _is_version_73(path: Path) -> bool:
    """Return whether a file is HDF5 (signature at 0, or behind a user block of 512 bytes and its doubles)."""
    try:
        with path.open("rb") as file:
            start = file.read(128)
            for offset in (0, 512, 1024, 2048, 4096):
                file.seek(offset)
                if file.read(8) == SIGNATURE:
                    return True
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    if not start.startswith(b"MATLAB"):
        raise ToolpointError(f"{path}: not a MATLAB file of version 5 or later; save it with save('-v7') or ('-v7.3')")
    return False


def _collect(name: str, attributes: dict[str, Any], value: Any, arrays: dict[str, Array]) -> None:
    if not isinstance(value, (np.ndarray, np.generic)) or attributes.get("MATLAB_empty", 0):
        return
    raw = np.asarray(value)
    if raw.dtype.names and set(raw.dtype.names) == {"real", "imag"}:
        arrays[name] = _flat((raw["real"] + 1j * raw["imag"]).T)
    elif raw.dtype.kind in "fiu" and attributes.get("MATLAB_class", "double") != "char":
        arrays[name] = _flat(raw.astype(float).T)


def _unpacked(name: str, value: Any, arrays: dict[str, Array]) -> None:
    array = np.asarray(value)
    if array.dtype.names and array.size == 1:
        for field in array.dtype.names:
            _unpacked(f"{name}.{field}", array.reshape(-1)[0][field], arrays)
    elif array.dtype.kind in "fiu":
        arrays[name] = _flat(array.astype(float))
    elif array.dtype.kind == "c":
        arrays[name] = _flat(array.astype(complex))


def _flat(array: Array) -> Array:
    return array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array
