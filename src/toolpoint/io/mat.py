"""Frequency responses in MATLAB files, version 5 to 7 (scipy) and 7.3 (HDF5); read only."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError, suggestion
from toolpoint.vibration import Dof, Frf


def variables(path: str | Path) -> dict[str, Array]:
    """Return all numeric arrays of a file by name; fields of structures as ``structure.field``.

    Vectors come as one axis, complex parts joined, and axes in MATLAB's order for every version of the format.
    """
    path = Path(path)
    try:
        start = path.open("rb").read(128)
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    if h5py.is_hdf5(path):
        with h5py.File(path, "r") as file:
            found: dict[str, Array] = {}
            file.visititems(lambda name, item: _collect(name.replace("/", "."), item, found))
            return {name: value for name, value in found.items() if not name.startswith("#")}
    if not start.startswith(b"MATLAB"):
        raise ToolpointError(f"{path}: not a MATLAB file of version 5 or later; save it with save('-v7') or ('-v7.3')")
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        table = loadmat(path, squeeze_me=False, struct_as_record=True)
    except (MatReadError, ValueError, TypeError) as error:
        raise ToolpointError(f"{path}: a damaged MATLAB file ({error}); save it again") from None
    arrays: dict[str, Array] = {}
    for name, value in table.items():
        if not name.startswith("__"):
            _unpacked(name, value, arrays)
    return arrays


def _collect(name: str, item: Any, found: dict[str, Array]) -> None:
    if not isinstance(item, h5py.Dataset) or item.attrs.get("MATLAB_empty", 0):
        return
    kind = item.dtype
    if kind.names and set(kind.names) == {"real", "imag"}:
        raw = item[()]
        found[name] = _flat((raw["real"] + 1j * raw["imag"]).T)
    elif kind.kind in "fiu" and item.attrs.get("MATLAB_class", b"double") != b"char":
        found[name] = _flat(np.asarray(item[()], float).T)


def _unpacked(name: str, value: Any, found: dict[str, Array]) -> None:
    array = np.asarray(value)
    if array.dtype.names and array.size == 1:
        for field in array.dtype.names:
            _unpacked(f"{name}.{field}", array.reshape(-1)[0][field], found)
    elif array.dtype.kind in "fiu":
        found[name] = _flat(array.astype(float))
    elif array.dtype.kind == "c":
        found[name] = _flat(array.astype(complex))


def _flat(array: Array) -> Array:
    return array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array


def read_frf(path: str | Path, frequency: str | None = None, values: str | None = None,
             outputs: Iterable[Dof | str] | None = None, inputs: Iterable[Dof | str] | None = None,
             quantity: str = "receptance") -> Frf:
    """Return the frequency responses of a MATLAB file.

    Parameters
    ----------
    path : path
    frequency, values : str, optional
        Names of the variables, ``structure.field`` for fields. Where left out: the only increasing real vector and the
        only complex array that has an axis of its length.
    outputs, inputs : labels, optional
        Points 1 .. n with direction +x where left out.
    quantity : str
        ``receptance``, ``mobility`` or ``accelerance``; SI, the file does not say.

    The axis of lines is found by its length; the remaining axes are output, then input.
    """
    found = variables(path)
    axis = _named(path, found, frequency) if frequency else _only(path, found, "frequency", _axes(found))
    if axis.ndim != 1:
        raise ToolpointError(f"{path}: frequency {frequency!r} has shape {axis.shape}; must be a vector of Hz")
    complexes = {name: one for name, one in found.items() if np.iscomplexobj(one) and axis.size in one.shape}
    data = _named(path, found, values) if values else _only(path, complexes, "values", complexes)
    if axis.size not in data.shape:
        raise ToolpointError(f"{path}: responses of shape {data.shape} beside {axis.size} lines; one axis must be the lines")
    lines = np.moveaxis(data, data.shape.index(axis.size), 0)
    if lines.ndim > 3:
        raise ToolpointError(f"{path}: responses of shape {data.shape}; must be lines, outputs and inputs in any order")
    lines = lines.reshape(axis.size, -1, 1) if lines.ndim < 3 else lines
    rows = [Dof(i + 1, "+x") for i in range(lines.shape[1])] if outputs is None else list(outputs)
    columns = [Dof(i + 1, "+x") for i in range(lines.shape[2])] if inputs is None else list(inputs)
    return Frf(np.real(axis), lines.astype(complex), tuple(rows), tuple(columns), quantity)  # type: ignore[arg-type]


def _axes(found: dict[str, Array]) -> dict[str, Array]:
    return {name: one for name, one in found.items()
            if one.ndim == 1 and one.size > 1 and not np.iscomplexobj(one) and (np.diff(one) > 0).all() and one[0] >= 0}


def _named(path: str | Path, found: dict[str, Array], name: str) -> Array:
    if name not in found:
        hint = suggestion(name, found)
        raise ToolpointError(f"{path}: no variable {name!r}; it holds {', '.join(found) or 'none'}"
                             + (f" ({hint})" if hint else ""))
    return found[name]


def _only(path: str | Path, found: dict[str, Array], what: str, fitting: dict[str, Array]) -> FloatArray:
    if len(fitting) != 1:
        listed = ", ".join(f"{name} {one.shape}" for name, one in found.items())
        which = "several fit" if fitting else "none fits"
        raise ToolpointError(f"{path}: {which} as {what} among {listed}; name it: {what}='...'")
    return next(iter(fitting.values()))
