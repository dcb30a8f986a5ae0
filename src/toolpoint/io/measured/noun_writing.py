"""Nouns of a test to files of any format: the ending of the name says which. Responses are written by `frf_writing`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io import uff
from toolpoint.io.binary import hdf5
from toolpoint.io.measured import frf_writing
from toolpoint.io.suffixes import HDF5, MATLAB, UNIVERSAL
from toolpoint.vibration import Frf, Modes, Record, StateSpace

KINDS = (*HDF5, *UNIVERSAL, *MATLAB, ".npz", ".csv")


def check_name(path: str | Path, *, replace: bool = False) -> None:
    """Raise ToolpointError before any work where nothing could be written to a file of this name; `replace` an existing one.

    >>> check_name("no_folder/modes.h5")
    Traceback (most recent call last):
        ...
    toolpoint._check.ToolpointError: no_folder/modes.h5: the folder no_folder does not exist; create it first
    """
    path = Path(path)
    if path.exists() and not replace:
        raise ToolpointError(f"{path}: exists already; nothing was written; choose another name, or add --replace")
    if not path.parent.is_dir():
        raise ToolpointError(f"{path}: the folder {path.parent} does not exist; create it first")
    if path.suffix.lower() not in KINDS:
        raise ToolpointError(f"`to` {path}: the name must end in {', '.join(KINDS)}")


def write(noun: Frf | Modes | Record | StateSpace, path: str | Path) -> None:
    """Write responses, modes, a record or a state space, see `frf_writing.write`, `write_modes` and so on.

    >>> import tempfile
    >>> from toolpoint.io import read_modes
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "modes.h5")
    ...     write(Modes([80.0], [0.02], [[1.0]], ["tip:+x"]), file)
    ...     read_modes(file).frequency.tolist()
    [80.0]
    """
    if isinstance(noun, StateSpace):
        write_state_space(noun, path)
    elif isinstance(noun, Frf):
        frf_writing.write(noun, path)
    elif isinstance(noun, Modes):
        write_modes(noun, path)
    else:
        write_record(noun, path)


def write_modes(modes: Modes, path: str | Path) -> None:
    """Write modes: HDF5 (all of them), universal (set 55), MATLAB and NumPy (arrays by name), CSV (a row a mode and Dof)."""
    path = Path(path)
    kind = path.suffix.lower()
    if modes.frequency.ndim > 1:
        raise ToolpointError(f"modes: of {modes.frequency.shape[0]} poses; must be one pose; use modes.at_pose(i)")
    if kind in HDF5:
        hdf5.write(modes, path)
    elif kind in UNIVERSAL:
        uff.write(path, modes)
    elif kind == ".csv":
        _write_modes_table(modes, path)
    else:
        deviation = np.full((modes.count, 2), np.nan) if modes.covariance is None else np.sqrt(
            np.maximum(np.diagonal(modes.covariance, axis1=1, axis2=2), 0))
        _write_arrays(path, {"frequency": modes.frequency, "damping_ratio": modes.damping_ratio, "shape": modes.shape,
                             "dofs": [dof.text for dof in modes.dofs], "scaling": modes.scaling, "deviation": deviation})


def _write_modes_table(modes: Modes, path: Path) -> None:
    lines = ["mode,frequency [Hz],damping ratio,point,direction,real,imaginary"]
    for k in range(modes.count):
        lines += [f"{k + 1},{float(modes.frequency[k])!r},{float(modes.damping_ratio[k])!r},{dof.point},{dof.direction},"
                  f"{float(np.real(value))!r},{float(np.imag(value))!r}"
                  for dof, value in zip(modes.dofs, modes.shape[:, k].tolist(), strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_record(record: Record, path: str | Path) -> None:
    """Write time histories: HDF5, universal (set 58), MATLAB and NumPy (samples, fs, channels), CSV with labels and units."""
    path = Path(path)
    kind = path.suffix.lower()
    names = [f"{quantity} {dof}" for quantity, dof in zip(record.quantities, record.channels, strict=True)]
    if kind in HDF5:
        hdf5.write(record, path)
    elif kind in UNIVERSAL:
        uff.write(path, record)
    elif kind == ".csv":
        head = ",".join(["time [s]", *(f"{name} [{unit or '-'}]" for name, unit in zip(names, record.units, strict=True))])
        rows = (",".join(map(repr, row)) for row in np.column_stack([record.time, record.samples]).tolist())
        path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    else:
        _write_arrays(path, {"samples": record.samples, "fs": record.sample_rate, "channels": names})


def write_state_space(system: StateSpace, path: str | Path) -> None:
    """Write a state space: HDF5 (all of it), MATLAB and NumPy (A, B, C, D, inputs, outputs, states, Ts: 0 where continuous).

    Raises ToolpointError for another ending.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind in HDF5:
        hdf5.write(system, path)
    elif kind in (*MATLAB, ".npz"):
        names = {name: list(getattr(system, name)) for name in ("inputs", "outputs", "states")}
        _write_arrays(path, {"A": system.a, "B": system.b, "C": system.c, "D": system.d, **names,
                             "Ts": 0.0 if system.sample_time is None else system.sample_time})
    else:
        raise ToolpointError(f"{path}: a state space is written to {', '.join((*HDF5, *MATLAB, '.npz'))}")


def _write_arrays(path: Path, arrays: dict[str, object]) -> None:
    if path.suffix.lower() == ".npz":
        named: dict[str, Any] = {name: np.asarray(value) for name, value in arrays.items()}
        np.savez(path, **named)
        return
    from scipy.io import savemat

    savemat(path, {name: np.array(value, object) if isinstance(value, list) else value for name, value in arrays.items()})
