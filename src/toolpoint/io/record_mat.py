"""Time histories in MATLAB files: vectors of equal length by name, with a time vector or a sample rate; read only."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io import mat
from toolpoint.io.text.record_table import TIMES, of_columns
from toolpoint.vibration import Record

RATES = ("fs", "sample_rate", "rate")


def read(path: str | Path) -> Record:
    """Return the vectors of a MATLAB file (SI) that are as long as its time vector ``t`` or ``time``, or with ``fs`` (Hz).

    Names as in `record_text`: Fx, Fy, Fz are forces; of a structure's fields the last name counts.
    """
    path = Path(path)
    found = {name.rsplit(".", 1)[-1]: np.real(one) for name, one in mat.variables(path).items()}
    vectors = {name: one for name, one in found.items() if one.ndim == 1 and one.size > 1 and name.lower() not in TIMES}
    axes = [one for name, one in found.items() if name.lower() in TIMES and one.ndim == 1 and one.size > 1]
    rates = [float(one.reshape(-1)[0]) for name, one in found.items() if name.lower() in RATES and one.size == 1]
    if not axes and (not rates or rates[0] <= 0 or not vectors):
        raise ToolpointError(f"{path}: no time vector 'time' and no sample rate 'fs'; it holds "
                             f"{', '.join(found) or 'nothing'}; save one of them with the forces")
    length = axes[0].size if axes else max(one.size for one in vectors.values())
    time = axes[0] if axes else np.arange(length) / rates[0]
    names = [name for name, one in vectors.items() if one.size == length]
    if not names:
        raise ToolpointError(f"{path}: no vector beside the time of {length} samples; it holds {', '.join(found)}")
    return of_columns(path, names, time, np.stack([vectors[name] for name in names], axis=1))
