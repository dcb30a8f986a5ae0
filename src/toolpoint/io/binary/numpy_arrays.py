"""Frequency responses in NumPy files: arrays by stated names (.npz), or one table of three columns (.npy); read and write."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array, load_npz

from toolpoint._check import Array, FloatArray, ToolpointError
from toolpoint.io.binary.mat_columns import are_samples, columns_of, in_hertz, pick_variable
from toolpoint.io.door import door
from toolpoint.io.text.columns import Columns
from toolpoint.vibration import Frf
from toolpoint.vibration.dof import dofs

KEYS = ("frequency", "values", "outputs", "inputs", "quantity")


@door("NumPy file")
def read_frf(path: str | Path, quantity: str | None = None) -> Frf:
    """Return the responses of an .npz file, SI.

    Its keys: ``frequency`` (n_f,) Hz; ``values`` (n_f, n_outputs, n_inputs) complex; ``outputs`` and ``inputs``, labels like
    ``tip:+x``; ``quantity`` (``receptance``, ``mobility`` or ``accelerance``), where left out the argument, else receptance.

    Raises ToolpointError for a file that is none or lacks a key, and for a stated quantity that is not the one given.
    """
    arrays = _load(Path(path))
    if not isinstance(arrays, dict):
        raise ToolpointError(f"{path}: one array without names; must be an .npz file with {', '.join(KEYS)}")
    absent_keys = [key for key in KEYS[:4] if key not in arrays]
    if absent_keys:
        raise ToolpointError(f"{path}: no array {', '.join(absent_keys)}; it holds {', '.join(arrays) or 'nothing'}; save it "
                             "with numpy.savez(path, frequency=..., values=..., outputs=[...], inputs=[...], quantity=...), or "
                             "name them with `variables`, for example frequency=f,values=H")
    stated = str(arrays["quantity"]) if "quantity" in arrays else None
    if None not in (stated, quantity) and stated != quantity:
        raise ToolpointError(f"`quantity` {quantity}: {Path(path).name} says that it holds {stated}; leave it out")
    outputs, inputs = (dofs([str(label) for label in arrays[key].reshape(-1)]) for key in ("outputs", "inputs"))
    return Frf(arrays["frequency"], arrays["values"], outputs, inputs, stated or quantity or "receptance")


@door("NumPy file")
def read_named(path: str | Path, frequency: str | None, values: str | None, *, quantity: str | None = None) -> Frf:
    """Return the responses of an .npz file whose arrays have other names: of `frequency` (Hz) and of `values`."""
    arrays = _load(Path(path))
    if not isinstance(arrays, dict):
        raise ToolpointError(f"{path}: one array without names; must be an .npz file")
    lines, note = in_hertz(frequency or "frequency", pick_variable(path, arrays, frequency or "frequency"))
    data = pick_variable(path, arrays, values or "values")
    if lines.ndim != 1 or lines.size not in data.shape or data.ndim > 3:
        raise ToolpointError(f"{path}: responses of shape {data.shape} beside lines of shape {lines.shape}; one axis must be "
                             "the lines, the others outputs and inputs")
    moved = np.moveaxis(data, data.shape.index(lines.size), 0)
    moved = moved.reshape(lines.size, -1, 1) if moved.ndim < 3 else moved
    rows, columns = ([f"{i + 1}:+x" for i in range(count)] for count in moved.shape[1:])
    return Frf(lines, moved, dofs(rows), dofs(columns), quantity or "receptance",
               notes=(f"{Path(path).name}: {note}",) if note else ())


@door("NumPy file")
def states_quantity(path: str | Path) -> bool:
    """Return whether a file says what its responses are."""
    arrays = _load(Path(path))
    return isinstance(arrays, dict) and "quantity" in arrays


@door("NumPy file")
def read_table(path: str | Path) -> FloatArray:
    """Return the table (n_f, 3) of an .npy file: Hz, real part, imaginary part."""
    table = _load(Path(path))
    if isinstance(table, dict) or table.ndim != 2 or table.shape[1] != 3 or np.iscomplexobj(table):
        held = "named arrays" if isinstance(table, dict) else f"shape {table.shape}"
        raise ToolpointError(f"{path}: {held}; an .npy file must hold three columns: Hz, real, imaginary; several responses go "
                             f"into an .npz file with {', '.join(KEYS)}")
    return table.astype(float)


def holds_samples(path: str | Path) -> bool:
    """Return whether a file has a time or a sample rate among its arrays, and nothing complex."""
    arrays = _load(Path(path))
    return isinstance(arrays, dict) and are_samples(arrays)


@door("NumPy file")
def read_columns(path: str | Path, named: Mapping[str, str] | None = None) -> Columns:
    """Return the samples of an .npy table (n, n_channels), or of an .npz file by the names of `mat.read_columns`; an array of
    text ``channels`` names the columns."""
    arrays = _load(Path(path))
    if not isinstance(arrays, dict):
        arrays = {"samples": arrays}
    numbers = {name: array for name, array in arrays.items() if array.dtype.kind in "fiu"}
    columns = columns_of(path, numbers, dict(named or {}))
    texts = [str(name) for name in arrays["channels"].reshape(-1)] if "channels" in arrays else []
    return replace(columns, names=tuple(texts)) if len(texts) == len(columns.names) else columns


@door("NumPy file")
def square_matrices(path: str | Path) -> dict[str, csc_array]:
    """Return all square matrices of a file by name; also the one that ``scipy.sparse.save_npz`` has written, by the file's."""
    path = Path(path)
    content = _load(path)
    arrays = content if isinstance(content, dict) else {path.stem: content}
    if {"format", "shape", "data"} <= arrays.keys():
        arrays = {path.stem: load_npz(path)}
    return {name: csc_array(matrix) for name, matrix in arrays.items()
            if matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1] > 1 and matrix.dtype.kind in "fiuc"}


def write_frf(frf: Frf, path: str | Path) -> None:
    """Write the responses of one pose to an .npz file that reads back to the same values and labels."""
    if frf.values.ndim != 3:
        raise ToolpointError(f"frf: {frf!r}; must be one pose; use frf.at_pose(i)")
    np.savez(path, frequency=frf.frequency, values=frf.values, outputs=np.array([dof.text for dof in frf.outputs]),
             inputs=np.array([dof.text for dof in frf.inputs]), quantity=np.array(frf.quantity))


def _load(path: Path) -> Array | dict[str, Array]:
    try:
        content: Any = np.load(path, allow_pickle=False)
        return dict(content) if hasattr(content, "files") else content
    except OSError as error:
        if not path.is_file():
            raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
        raise ToolpointError(f"{path}: not a NumPy file; save it with numpy.savez or numpy.save") from None
    except Exception as error:  # a damaged archive shows itself in many ways; pickled objects are refused
        raise ToolpointError(f"{path}: not a NumPy file of numbers and text ({error}); save it again") from None
