"""Variables of MATLAB files, version 5 to 7 (scipy) and 7.3 (HDF5), by name: numbers and texts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from toolpoint._check import Array, ToolpointError


def variables(path: str | Path) -> dict[str, Array]:
    """Return all numeric arrays of a file by name; fields of structures as ``structure.field``.

    Vectors come as one axis, complex parts joined, and axes in MATLAB's order for every version of the format.
    """
    path = Path(path)
    arrays: dict[str, Array] = {}
    if _is_version_73(path):
        with h5py.File(path, "r") as file:
            file.visititems(lambda name, item: _collect(name.replace("/", "."), item, arrays))
            return {name: value for name, value in arrays.items() if not name.startswith("#")}
    for name, value in _table(path).items():
        _unpacked(name, value, arrays)
    return arrays


def texts(path: str | Path) -> dict[str, tuple[str, ...]]:
    """Return all texts of a file by name: a character array as one line each row, a cell array of them as its cells."""
    path = Path(path)
    lines: dict[str, tuple[str, ...]] = {}
    if _is_version_73(path):
        with h5py.File(path, "r") as file:
            for name, item in file.items():
                if not name.startswith("#") and isinstance(item, h5py.Dataset):
                    cells = [file[reference] for reference in item[()].reshape(-1)] if item.dtype.kind == "O" else [item]
                    if all(cell.attrs.get("MATLAB_class", b"") == b"char" for cell in cells):
                        lines[name] = tuple("".join(map(chr, row)) for cell in cells for row in np.atleast_2d(cell[()].T))
        return lines
    for name, value in _table(path).items():
        array = np.asarray(value)
        cells = [np.asarray(cell) for cell in array.reshape(-1)] if array.dtype.kind == "O" else [array]
        if cells and all(cell.dtype.kind == "U" for cell in cells):
            lines[name] = tuple(str(line).strip() for cell in cells for line in cell.reshape(-1))
    return lines


def _is_version_73(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            start = file.read(128)
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    if h5py.is_hdf5(path):
        return True
    if not start.startswith(b"MATLAB"):
        raise ToolpointError(f"{path}: not a MATLAB file of version 5 or later; save it with save('-v7') or ('-v7.3')")
    return False


def _table(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        table = loadmat(path, squeeze_me=False, struct_as_record=True)
    except (MatReadError, ValueError, TypeError) as error:
        raise ToolpointError(f"{path}: a damaged MATLAB file ({error}); save it again") from None
    return {name: value for name, value in table.items() if not name.startswith("__")}


def _collect(name: str, item: Any, arrays: dict[str, Array]) -> None:
    if not isinstance(item, h5py.Dataset) or item.attrs.get("MATLAB_empty", 0):
        return
    kind = item.dtype
    if kind.names and set(kind.names) == {"real", "imag"}:
        raw = item[()]
        arrays[name] = _flat((raw["real"] + 1j * raw["imag"]).T)
    elif kind.kind in "fiu" and item.attrs.get("MATLAB_class", b"double") != b"char":
        arrays[name] = _flat(np.asarray(item[()], float).T)


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
