"""Frequency responses to files of any format: the ending of the name says which."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.io import uff
from toolpoint.io.binary import hdf5, numpy_arrays
from toolpoint.io.suffixes import HDF5, MATLAB, UNIVERSAL
from toolpoint.io.text.column_labels import column_label
from toolpoint.vibration import Frf

KINDS = (*HDF5, *UNIVERSAL, *MATLAB, ".npz", ".csv")


def check_writable(path: str | Path, kinds: tuple[str, ...] = KINDS) -> None:
    """Raise ToolpointError before any work where a file of this name could not be written.

    >>> check_writable("responses.docx")
    Traceback (most recent call last):
        ...
    toolpoint._check.ToolpointError: `save` responses.docx: the name must end in .h5, .hdf5, .uff, .unv, .uf, .mat, .npz, .csv
    """
    path = Path(path)
    if path.suffix.lower() not in kinds:
        raise ToolpointError(f"`save` {path}: the name must end in {', '.join(kinds)}")
    if not path.parent.is_dir():
        raise ToolpointError(f"`save` {path}: the folder {path.parent} does not exist; create it first")


def write(frf: Frf, path: str | Path) -> None:
    """Write responses of one pose: HDF5 (all of it), universal, MATLAB, NumPy, or CSV (Hz, then real and imaginary parts).

    A window's decay, variances and draws are kept in HDF5 alone; elsewhere a warning says what is lost.

    >>> import tempfile
    >>> import numpy as np
    >>> from toolpoint.io import read_frf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "tip.h5")
    ...     write(Frf([10.0, 20.0], np.full((2, 1, 1), 1e-8 - 1e-9j), ["tip:+x"], ["tip:+x"]), file)
    ...     read_frf(file).values[:, 0, 0].tolist()
    [(1e-08-1e-09j), (1e-08-1e-09j)]
    """
    path = Path(path)
    check_writable(path)
    kind = path.suffix.lower()
    if frf.values.ndim != 3:
        raise ToolpointError(f"frf: {frf!r}; must be one pose; use frf.at_pose(i)")
    if frf.decay and kind not in HDF5:
        warnings.warn(f"{path.name}: this format does not hold the decay of the exponential window, {frf.decay:.4g} 1/s; modes "
                      "identified from it have too much damping by it over their angular frequency; save as .h5 to keep it",
                      ToolpointWarning, stacklevel=2)
    if (frf.draws is not None or frf.variance is not None) and kind not in HDF5:
        warnings.warn(f"{path.name}: this format does not hold how uncertain the responses are; limits and modes from it take "
                      "them as exact but for the scatter from line to line; save as .h5 to keep it", ToolpointWarning,
                      stacklevel=2)
    if kind in HDF5:
        hdf5.write(frf, path)
    elif kind in UNIVERSAL:
        uff.write(path, frf)
    elif kind in MATLAB:
        _write_mat(frf, path)
    elif kind == ".npz":
        numpy_arrays.write_frf(frf, path)
    else:
        _write_csv(frf, path)


def _write_mat(frf: Frf, path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"frequency": frf.frequency, "values": frf.values, "quantity": frf.quantity,
                   "outputs": np.array([dof.text for dof in frf.outputs], object),
                   "inputs": np.array([dof.text for dof in frf.inputs], object)})


def _write_csv(frf: Frf, path: Path) -> None:
    pairs = [(i, j) for i in range(len(frf.outputs)) for j in range(len(frf.inputs))]
    head = ["frequency [Hz]"]
    columns = [frf.frequency]
    for i, j in pairs:
        name = f"{column_label(frf.outputs[i])} / {column_label(frf.inputs[j])} [{frf.unit}]"
        head += [f"real {name}", f"imaginary {name}"]
        columns += [frf.values[:, i, j].real, frf.values[:, i, j].imag]
    rows = (",".join(map(repr, row)) for row in np.stack(columns, axis=1).tolist())
    path.write_text("\n".join([",".join(head), *rows]) + "\n", encoding="utf-8")
