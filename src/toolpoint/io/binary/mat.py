"""Responses and time histories in MATLAB files, version 5 to 7 (scipy) and 7.3 (HDF5); read only."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint._check import Array, ToolpointError
from toolpoint.io.binary.mat_columns import RATES, are_samples, columns_of, in_hertz, pick_variable
from toolpoint.io.binary.mat_variables import texts, variables
from toolpoint.io.door import door
from toolpoint.io.text.columns import Columns
from toolpoint.io.text.record_table import TIMES, of_columns
from toolpoint.vibration import Dof, Frf, Record
from toolpoint.vibration.dof import dofs


@door("MATLAB file")
def read_frf(path: str | Path, frequency: str | None = None, values: str | None = None,
             *, outputs: Iterable[Dof | str] | None = None, inputs: Iterable[Dof | str] | None = None,
             quantity: str | None = None) -> Frf:
    """Return the frequency responses of a MATLAB file.

    Parameters
    ----------
    path : path
    frequency, values : str, optional
        Names of the variables, ``structure.field`` for fields. Where left out: the only increasing real vector and the
        only complex array that has an axis of its length.
    outputs, inputs : labels, optional
        Where left out: the texts of variables of these names (``tip:+x``); points 1 .. n along +x where there are none.
    quantity : str, optional
        ``receptance``, ``mobility`` or ``accelerance``; where left out: the text of a variable of this name, else
        accelerance. SI.

    The axis of lines is arrays by its length; the remaining axes are output, then input.
    """
    arrays, labels = variables(path), texts(path)
    stated = labels.get("quantity", (None,))[0]
    if None not in (stated, quantity) and stated != quantity:
        raise ToolpointError(f"`quantity` {quantity}: {Path(path).name} says that it holds {stated}; leave it out")
    name = frequency or _only(path, arrays, "frequency", _axes(arrays))
    axis, note = in_hertz(name, pick_variable(path, arrays, name))
    if axis.ndim != 1:
        raise ToolpointError(f"{path}: frequency {frequency!r} has shape {axis.shape}; must be a vector of Hz")
    complexes = {name: array for name, array in arrays.items() if np.iscomplexobj(array) and axis.size in array.shape}
    data = pick_variable(path, arrays, values or _only(path, complexes, "values", complexes))
    if axis.size not in data.shape:
        raise ToolpointError(f"{path}: responses of shape {data.shape} beside {axis.size} lines; one axis must be the lines")
    lines = np.moveaxis(data, data.shape.index(axis.size), 0)
    if lines.ndim > 3:
        raise ToolpointError(f"{path}: responses of shape {data.shape}; must be lines, outputs and inputs in any order")
    lines = lines.reshape(axis.size, -1, 1) if lines.ndim < 3 else lines
    rows, columns = ([Dof(i + 1, "+x") for i in range(count)] for count in lines.shape[1:])
    return Frf(axis, lines.astype(complex), dofs(outputs or labels.get("outputs") or rows),
               dofs(inputs or labels.get("inputs") or columns), quantity or stated or "accelerance",
               notes=(f"{Path(path).name}: {note}",) if note else ())


def states_quantity(path: str | Path) -> bool:
    """Return whether a file says what its responses are, in a variable ``quantity``."""
    return "quantity" in texts(path)


def states_labels(path: str | Path) -> bool:
    """Return whether a file names its outputs and inputs, in variables ``outputs`` and ``inputs``."""
    return {"outputs", "inputs"} <= texts(path).keys()


@door("MATLAB file")
def read_record(path: str | Path) -> Record:
    """Return the vectors of a MATLAB file (SI) that are as long as its time vector ``t`` or ``time``, or with ``fs`` (Hz).

    Names as in text (`text.record_table`): Fx, Fy, Fz are forces; of a structure's fields the last name counts.
    """
    path = Path(path)
    arrays = {name.rsplit(".", 1)[-1]: np.real(array) for name, array in variables(path).items()}
    long = {name: array for name, array in arrays.items() if array.ndim == 1 and array.size > 1}
    vectors = {name: array for name, array in long.items() if name.lower() not in TIMES}
    axes = [array for name, array in long.items() if name.lower() in TIMES]
    rates = [float(array.reshape(-1)[0]) for name, array in arrays.items() if name.lower() in RATES and array.size == 1]
    if not axes and (not rates or rates[0] <= 0 or not vectors):
        raise ToolpointError(f"{path}: no time vector 'time' and no sample rate 'fs'; it holds "
                             f"{', '.join(arrays) or 'nothing'}; save one of them with the forces")
    length = axes[0].size if axes else max(array.size for array in vectors.values())
    time = axes[0] if axes else np.arange(length) / rates[0]
    names = [name for name, array in vectors.items() if array.size == length]
    if not names:
        raise ToolpointError(f"{path}: no vector beside the time of {length} samples; it holds {', '.join(arrays)}")
    return of_columns(path, names, time, values=np.stack([vectors[name] for name in names], axis=1))


def holds_samples(path: str | Path) -> bool:
    """Return whether a file has a time or a sample rate among its variables, and nothing complex."""
    return are_samples(variables(path))


@door("MATLAB file")
def read_columns(path: str | Path, named: Mapping[str, str] | None = None) -> Columns:
    """Return the samples of a MATLAB file as columns; `named` says which variables are ``time``, ``rate`` and ``samples``.

    Where left out: the time is ``t`` or ``time``, the rate ``fs`` or ``sample_rate``, and the samples are all vectors as long
    as the time, and the columns of matrices with as many rows.
    """
    columns = columns_of(path, variables(path), dict(named or {}))
    names = texts(path).get("channels", ())
    return replace(columns, names=names) if len(names) == len(columns.names) else columns


def _axes(arrays: dict[str, Array]) -> dict[str, Array]:
    vectors = {name: array for name, array in arrays.items() if array.ndim == 1 and array.size > 1}
    return {name: vector for name, vector in vectors.items()
            if not np.iscomplexobj(vector) and (np.diff(vector) > 0).all() and vector[0] >= 0}


def _only(path: str | Path, arrays: dict[str, Array], what: str, fitting: dict[str, Array]) -> str:
    """Return the name of the only variable that fits."""
    if len(fitting) != 1:
        listed = ", ".join(f"{name} {array.shape}" for name, array in arrays.items()) or "no numbers"
        which = "several fit" if fitting else "none fits"
        raise ToolpointError(f"{path}: {which} as {what} among {listed}; name it with `variables`, for example "
                             "frequency=f,values=H")
    return next(iter(fitting))
