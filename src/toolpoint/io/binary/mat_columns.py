"""Variables of MATLAB and NumPy files as columns of samples, by their names or by names that a person states."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError, suggestion
from toolpoint.io.text.columns import Columns

TIMES = ("t", "time")
RATES = ("fs", "sample_rate", "rate")
# Names of axes in rad/s: read as Hz, every frequency would be too high by 2 pi and nothing would look wrong.
_ANGULAR = re.compile(r"(?:^|[._])(?:w|om|omega|angular.*|.*rad_?s(?:ec)?|.*rads)$", re.IGNORECASE)


def are_samples(arrays: Mapping[str, Array]) -> bool:
    """Return whether named arrays are those of a record: a time or a sample rate, and nothing complex."""
    last = {name.rsplit(".", 1)[-1].lower() for name in arrays}
    return bool(last & {*TIMES, *RATES}) and not any(np.iscomplexobj(array) for array in arrays.values())


def columns_of(path: str | Path, arrays: Mapping[str, Array], named: Mapping[str, str]) -> Columns:
    """Return named arrays as columns of samples; see `read_columns`."""
    unknown = set(named) - {"time", "rate", "samples"}
    if unknown:
        raise ToolpointError(f"`variables` {unknown.pop()}: records have time, rate and samples")
    last = {name.rsplit(".", 1)[-1].lower(): name for name in arrays}
    time_name = named.get("time") or next((last[name] for name in TIMES if name in last), None)
    rate_name = named.get("rate") or next((last[name] for name in RATES if name in last), None)
    time = None if time_name is None else np.real(pick_variable(path, arrays, time_name)).reshape(-1)
    rate = None if rate_name is None else float(np.real(pick_variable(path, arrays, rate_name)).reshape(-1)[0])
    if time is not None and time.size > 1:
        steps = np.diff(time)
        # A hundredth of a step: rounding of stored times passes, a sample that is left out (a whole step) does not.
        if not steps.mean() > 0 or np.abs(steps - steps.mean()).max() > 0.01 * steps.mean():
            raise ToolpointError(f"{path}: the time {time_name!r} does not run evenly; must have one sample rate")
        rate = 1 / float(steps.mean())
    if "samples" in named:
        chosen = {named["samples"]: pick_variable(path, arrays, named["samples"])}
    else:
        chosen = {name: array for name, array in arrays.items()
                  if name not in (time_name, rate_name) and array.ndim in (1, 2) and not np.iscomplexobj(array)}
    length = time.size if time is not None else max((max(array.shape) for array in chosen.values()), default=0)
    names, parts = [], []
    for name, array in chosen.items():
        table = np.real(array) if array.ndim == 2 else np.real(array)[:, None]
        table = table.T if table.shape[0] != length and table.shape[1] == length else table
        if table.shape[0] == length and length > 1:
            parts.append(table)
            names += [name] if table.shape[1] == 1 else [f"{name} {k + 1}" for k in range(table.shape[1])]
    if not parts:
        raise ToolpointError(f"{path}: no samples; it holds {', '.join(arrays) or 'nothing'}; name them with `variables`, for "
                             "example samples=data,rate=fs")
    return Columns(tuple(names), ("",) * len(names), np.concatenate(parts, axis=1).astype(float), rate,
                   0.0 if time is None else float(time[0]))


def pick_variable(path: str | Path, arrays: Mapping[str, Array], name: str) -> Array:
    """Return the variable of a name; raises ToolpointError where there is none, with what the file holds."""
    if name not in arrays:
        hint = suggestion(name, arrays)
        raise ToolpointError(f"{path}: no variable {name!r}; it holds {', '.join(arrays) or 'none'}"
                             + (f" ({hint})" if hint else ""))
    return arrays[name]


def in_hertz(name: str, lines: Array) -> tuple[FloatArray, str]:
    """Return lines in Hz, with a note where their variable's name (w, omega ..) says that they are in rad/s."""
    if _ANGULAR.search(name):
        return np.real(lines) / (2 * np.pi), f"the lines, {name!r}, are taken in rad/s by their name"
    return np.real(lines), ""
