"""Universal files (UNV, UFF): sets 15, 55, 58, 58b, 82, 151, 164, 2411 read and written, 2412 and 2414 read; SI inside.

Files are opened lazily (`UniversalFile` reads delimiters and headers only), read tolerantly with every repair reported,
and written in one pass.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.door import door
from toolpoint.io.uff import functions, geometry, modes
from toolpoint.io.uff.functions import COHERENCE_TYPE, KINDS, RESPONSE_TYPE, TIME_RECORD_TYPE, FunctionHeader
from toolpoint.io.uff.geometry import MeasuredGeometry
from toolpoint.io.uff.labels import NumberedLabels
from toolpoint.io.uff.responses import NUMERATOR, read_frf
from toolpoint.io.uff.sets import UniversalFile
from toolpoint.io.uff.spectra import UniversalFunction, read_functions
from toolpoint.io.uff.units import Units, factor_to_si, report, second_channel, units
from toolpoint.vibration import Dof, Frf, Modes, Record
from toolpoint.vibration.frf import QUANTITIES

__all__ = ["MeasuredGeometry", "Units", "UniversalFile", "UniversalFunction", "headers", "read_frf", "read_functions",
           "read_geometry", "read_modes", "read_record", "units", "write"]

CODES = {"displacement": 8, "velocity": 11, "acceleration": 12, "force": 13}


@door("universal file")
def headers(path: str | Path) -> list[FunctionHeader]:
    """Return the headers of all functions of a file, without reading their values.

    >>> import tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "tip.uff")
    ...     write(path, Frf([10.0, 20.0], np.full((2, 1, 1), 1e-8 + 0j), ["7:+x"], ["7:+x"]))
    ...     len(headers(path))
    1
    """
    file = UniversalFile(path)
    return [functions.header(file, dataset) for dataset in file.sets if dataset.number == 58]


@door("universal file")
def read_record(path: str | Path | UniversalFile) -> Record:
    """Return all time records of a file (function type 1) as one Record; SI.

    >>> import tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "blow.uff")
    ...     write(path, Record(np.arange(8.0)[:, None], 1000.0, ["7:+x"], "acceleration"))
    ...     read_record(path).samples[:, 0].tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    """
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    scale = units(file)
    records = [(dataset, head) for dataset in file.sets if dataset.number == 58
             for head in [functions.header(file, dataset)] if head.kind == TIME_RECORD_TYPE]
    if not records:
        raise ToolpointError(f"{file.path}: no time record (set 58 of function type 1); it holds {file!r}")
    columns, kinds, axes = [], [], []
    for dataset, head in records:
        axis, data = functions.values(file, dataset, head)
        kind = KINDS.get(head.numerator, "unknown")
        columns.append(np.real(data) * (1.0 if kind == "unknown" else factor_to_si(file, head, scale, is_response=False)))
        kinds.append(kind)
        axes.append(axis)
    step = _step(file, axes)
    channels = _channels(file, [head.response for _, head in records], kinds)
    report(file)
    return Record(np.stack(columns, axis=1), 1 / step, channels, tuple(kinds),
                  start=float(axes[0][0]), name=file.path.stem)


def _channels(file: UniversalFile, dofs: list[Dof], kinds: list[str]) -> tuple[Dof, ...]:
    """Return the labels of channels: a force and a motion may share a Dof, two motions of one kind may not."""
    counts: dict[tuple[Dof, str], int] = {}
    names = []
    for key in zip(dofs, kinds, strict=True):
        counts[key] = counts.get(key, 0) + 1
        names.append(key[0] if counts[key] == 1 else second_channel(file, key[0], counts[key]))
    return tuple(names)


def _step(file: UniversalFile, axes: list[FloatArray]) -> float:
    first = axes[0]
    # Of text files an axis has six digits or so; a record that began at another time differs by far more.
    if any(axis.size != first.size or not np.allclose(axis, first, rtol=1e-6, atol=1e-9) for axis in axes[1:]):
        raise ToolpointError(f"{file.path}: time records with unequal axes; must share start, step and length")
    step = float((first[-1] - first[0]) / (first.size - 1)) if first.size > 1 else 0.0
    # Axes written with six digits scatter by as much; a sample that is left out doubles a step.
    if step <= 0 or np.abs(np.diff(first) - step).max() > 1e-3 * step:
        raise ToolpointError(f"{file.path}: time step {step:g} s; must be above zero and even")
    return step


@door("universal file")
def read_geometry(path: str | Path | UniversalFile) -> MeasuredGeometry:
    """Return points (m) and lines of a file.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "points.uff")
    ...     write(path, MeasuredGeometry((1, 2), [[0, 0, 0], [0.5, 0, 0]]))
    ...     read_geometry(path).coordinates.tolist()
    [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]
    """
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    shape = geometry.geometry(file, units(file).length)
    report(file)
    return shape


@door("universal file")
def read_modes(path: str | Path | UniversalFile) -> Modes:
    """Return the mode shapes (sets 55 or 2414) of a file; see `modes.modes`.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "modes.uff")
    ...     write(path, Modes([80.0], [0.02], [[1.0]], ["7:+x"]))
    ...     read_modes(path).frequency.round(6).tolist()
    [80.0]
    """
    file = path if isinstance(path, UniversalFile) else UniversalFile(path)
    result = modes.modes(file)
    report(file)
    return result


def write(path: str | Path, *items: Frf | Record | Modes | MeasuredGeometry, text: bool = False,
          append: bool = False) -> None:
    """Write responses, records, modes and geometry to a universal file in SI.

    Parameters
    ----------
    path : path
    items : Frf, Record, Modes or MeasuredGeometry
        Several Frf may share a file if their Dofs differ. Named and relative points and directions off the axes are written at
        numbers of their own, with a table that gives their labels back (`labels`).
    text : bool
        Functions as text (set 58, 13 digits) instead of binary (58b, exact to the last bit).
    append : bool
        Behind what the file holds, instead of in its place.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "test.uff")
    ...     write(path, MeasuredGeometry((7,), [[0, 0, 0.5]]), Modes([80.0], [0.02], [[1.0]], ["7:+x"]))
    ...     read_geometry(path).points, read_modes(path).count
    ((7,), 1)
    """
    parts = [] if append else [_title(), _si()]
    labels = NumberedLabels.of([dof for item in items for dof in _dofs(item)], UniversalFile(path).labels if append else None)
    parts.append(labels.written())
    for item in items:
        parts += _parts(item, text, labels)
    with Path(path).open("ab" if append else "wb") as file:
        file.writelines(parts)


def _dofs(item: Frf | Record | Modes | MeasuredGeometry) -> tuple[Dof, ...]:
    if isinstance(item, Frf):
        return (*item.outputs, *item.inputs)
    if isinstance(item, Record):
        return item.channels
    return item.dofs if isinstance(item, Modes) else tuple(Dof(point, "+x") for point in item.points)


def _parts(item: Frf | Record | Modes | MeasuredGeometry, text: bool, labels: NumberedLabels) -> Iterable[bytes]:
    if isinstance(item, Frf):
        return _responses(item, text, labels)
    if isinstance(item, Record):
        return [functions.written(TIME_RECORD_TYPE, dof, None, numerator=CODES.get(kind, 0), denominator=0, abscissa=item.time,
                                  data=item.samples[:, i], text=text,
                                  units=(unit or "NONE", "NONE"), labels=labels)
                for i, (dof, kind, unit) in enumerate(zip(item.channels, item.quantities, item.units, strict=True))]
    if isinstance(item, Modes):
        return [modes.written(item, labels)]
    return [geometry.written(item)]


def _responses(frf: Frf, text: bool, labels: NumberedLabels) -> Iterable[bytes]:
    if frf.values.ndim != 3:
        raise ToolpointError(f"frf: {frf!r}; must be one pose; use frf.at_pose(i)")
    values = np.ascontiguousarray(frf.values.transpose(1, 2, 0))
    label = (QUANTITIES[frf.quantity].split("/N")[0], "N")
    for i, output in enumerate(frf.outputs):
        for j, source in enumerate(frf.inputs):
            yield functions.written(RESPONSE_TYPE, output, source, numerator=NUMERATOR[frf.quantity], denominator=13,
                                    abscissa=frf.frequency, data=values[i, j], text=text, units=label, labels=labels)
            if frf.coherence is not None:
                yield functions.written(COHERENCE_TYPE, output, source, numerator=0, denominator=0, abscissa=frf.frequency,
                                        data=frf.coherence[:, i, j], text=text, labels=labels)


def _title() -> bytes:
    # A fixed date: files of the same numbers are the same bytes, so that they can be compared and kept in a repository.
    lines = ["toolpoint", "NONE", "toolpoint", f"{'01-Jan-00':10s}{'00:00:00':10s}{0:10d}{0:10d}{0:10d}",
             f"{'01-Jan-00':10s}{'00:00:00':10s}", "toolpoint", f"{'01-Jan-00':10s}{'00:00:00':10s}"]
    return ("    -1\n   151\n" + "".join(f"{line:80s}\n" for line in lines) + "    -1\n").encode("ascii")


def _si() -> bytes:
    return (f"    -1\n   164\n{1:10d}{'SI: m, N':20s}{2:10d}\n"
            f"{1.0:25.16E}{1.0:25.16E}{1.0:25.16E}\n{273.15:25.16E}\n".replace("E+", "D+") + "    -1\n").encode("ascii")
