"""Time histories from files of any format: the one way in."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io import uff
from toolpoint.io.binary import hdf5, mat, numpy_arrays, tdms, wav
from toolpoint.io.measured.channels import Labels, label_columns, label_record, parse_channel
from toolpoint.io.measured.name_patterns import dof_of, read_names
from toolpoint.io.suffixes import HDF5, LVM, MATLAB, NUMPY, TDMS, UNIVERSAL, WAV
from toolpoint.io.text import columns, lvm, record_table
from toolpoint.io.text.columns import Columns
from toolpoint.signals.record_set import RecordSet
from toolpoint.signals.test_description import ChannelDescription, HammerTestDescription
from toolpoint.vibration import Dof, Record

Channels = Sequence[str | ChannelDescription]
RATE_TOLERANCE = 1e-5  # of a sample rate, between files: what rounded times leave
ROVING = "*"  # point of a sensor whose place the name of every file says


def read(path: str | Path) -> Record:
    r"""Return the Record of a text, LVM, WAV, TDMS, MATLAB, NumPy, universal or HDF5 file, SI; the ending of its name says the
    format. Channels whose labels a file does not say are points 1, 2 ..; `read_all` takes them from descriptions.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "trace.csv")
    ...     _ = file.write_text("time [s],tip:+x [m/s^2]\n" + "".join(f"{k / 1000},{k}\n" for k in range(20)))
    ...     read(file).sample_rate
    1000.0
    """
    kind = Path(path).suffix.lower()
    if kind in MATLAB:
        return mat.read_record(path)
    if kind in UNIVERSAL:
        return uff.read_record(path)
    if kind in HDF5:
        return hdf5.read(path, Record)
    if kind in (*LVM, *WAV, *TDMS, *NUMPY):
        several = _columns(Path(path), None, {})
        if len(several) != 1:
            raise ToolpointError(f"{path}: holds {len(several)} records; must be one; read_all takes several")
        return label_columns(Path(path), several[0], (), labels=Labels())
    return record_table.read(path)


def read_all(paths: str | Path | Sequence[str | Path], channels: Channels = (), *, struck: str | None = None,
             pattern: str | None = None, rate: float | None = None, variables: dict[str, str] | None = None) -> RecordSet:
    """Return all records of files, labelled and in SI, of one hit each or of many.

    Parameters
    ----------
    paths : path or sequence of paths
    channels : sequence of ChannelDescription or text
        What the files do not say, or say wrongly: ``1=force 5:-z 2.25mV/N``; by name or number of the channel.
    struck : label, optional
        Where and in which direction the hammer struck, for all files: ``5:-z``.
    pattern : str, optional
        How names of files say where was struck: ``P{input}_*``; see `name_patterns`. ``{output}`` is the place of the only
        response, or of a sensor of several directions whose channels are labelled ``*:+x``, ``*:+y`` ..
    rate : float, optional
        Samples per second, Hz, for files that do not say it.
    variables : mapping, optional
        Which variables of MATLAB and NumPy files are ``time``, ``rate`` and ``samples``.

    Raises
    ------
    ToolpointError
        For files that cannot be read, volts without sensitivity, rates that differ.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     lines = ["time [s],force 1:+x [N],acceleration 1:+x [m/s^2]", "0,0,0", "0.001,5,2", "0.002,0,1"]
    ...     _ = Path(folder, "blow.csv").write_text("\\n".join(lines), encoding="utf-8")
    ...     (record,) = read_all(Path(folder, "blow.csv")).records
    >>> record.quantities, record.sample_rate
    (('force', 'acceleration'), 1000.0)
    """
    files = [Path(paths)] if isinstance(paths, (str, Path)) else [Path(path) for path in paths]
    if not files:
        raise ToolpointError("paths: no record; must be at least one file")
    described = [parse_channel(channel) if isinstance(channel, str) else channel for channel in channels]
    said = read_names(files, pattern) if pattern else None
    labels, records, names = Labels(), list[Record](), list[str]()
    names_repeat = len({file.name for file in files}) < len(files)
    for k, file in enumerate(files):
        parts = _labelled(file, described, rate, variables or {}, labels)
        for number, part in enumerate(parts, start=1):
            placed = _struck_at(part, None if struck is None else dof_of(struck))
            records.append(placed if said is None else _named(placed, said[k].input, said[k].output))
            name = str(file) if names_repeat else file.name
            names.append(name if len(parts) == 1 else f"{name}#{number}")
    records = _at_one_rate(records, names)
    notes = [note for note in labels.notes
             if "hammer struck" not in note or (struck is None and (said is None or said[0].input is None))]
    return RecordSet(tuple(records), tuple(names), tuple(notes))


def read_test(description: HammerTestDescription, folder: str | Path) -> RecordSet:
    """Return the records of a test file, whose names of files are relative to `folder`, with its decisions about hits."""
    sets = []
    for part in description.records:
        files = [path for text in part.files for path in _matching(Path(folder), text)]
        sets.append(read_all(files, description.channels, struck=part.struck, pattern=part.pattern,
                             rate=description.sample_rate))
    names = tuple(name for some in sets for name in some.names)
    records = _at_one_rate([record for some in sets for record in some.records], names)
    notes = [note for some in sets for note in some.notes]
    if (mass := description.moved_sensor_mass) is not None:
        notes.append(f"the mass of {1e3 * mass:.3g} g of the moved sensor stays in the responses; the identification of modes "
                     "takes it out (`sensor_mass`)")
    return RecordSet(tuple(records), names, tuple(dict.fromkeys(notes)), (),
                     {name: decision == "accepted" for name, decision in description.hits.items()})


def _matching(folder: Path, text: str) -> list[Path]:
    paths = sorted(Path(name) for name in glob.glob(str(folder / text))) if set(text) & set("*?[") else [folder / text]
    if not paths:
        raise ToolpointError(f"records: no file fits {text!r} in {folder}; check the pattern and the folder")
    return paths


def read_columns(path: Path, rate: float | None = None) -> Columns:
    """Return the columns of a file that holds one record, as they are, without labels; for an input that plays or watches
    files."""
    kind = path.suffix.lower()
    if kind in UNIVERSAL or kind in HDF5:
        record = read(path)
        names = tuple(f"{quantity} {dof}" for quantity, dof in zip(record.quantities, record.channels, strict=True))
        return Columns(names, record.units, record.samples, record.sample_rate)
    several = _columns(path, rate, {})
    if len(several) != 1:
        raise ToolpointError(f"{path}: holds {len(several)} records; must be one")
    return several[0]


def _labelled(path: Path, channels: Sequence[ChannelDescription], rate: float | None, variables: dict[str, str],
              labels: Labels) -> list[Record]:
    kind = path.suffix.lower()
    if kind in UNIVERSAL:
        return [label_record(path, uff.read_record(path), channels, labels=labels)]
    if kind in HDF5:
        records = [noun for noun in hdf5.read_all(path).values() if isinstance(noun, Record)]
        if not records:
            raise ToolpointError(f"{path}: holds no time record")
        return [label_record(path, record, channels, labels=labels) for record in records]
    return [label_columns(path, part, channels, labels=labels) for part in _columns(path, rate, variables)]


def _columns(path: Path, rate: float | None, variables: dict[str, str]) -> list[Columns]:
    kind = path.suffix.lower()
    if kind in WAV:
        parts = [wav.read_columns(path)]
    elif kind in TDMS:
        parts = tdms.read_columns(path)
    elif kind in LVM:
        parts = lvm.read_columns(path)
    elif kind in MATLAB:
        parts = [mat.read_columns(path, variables)]
    elif kind in NUMPY:
        parts = [numpy_arrays.read_columns(path, variables)]
    else:
        parts = [columns.read_columns(path)]
    return [replace(part, sample_rate=part.sample_rate or rate) for part in parts]


def _struck_at(record: Record, dof: Dof | None) -> Record:
    if dof is None:
        return record
    return replace(record, channels=tuple(dof if kind == "force" else label
                                          for label, kind in zip(record.channels, record.quantities, strict=True)))


def _named(record: Record, struck: Dof | None, output: Dof | None) -> Record:
    placed = _struck_at(record, struck)
    motions = [k for k, kind in enumerate(record.quantities) if kind != "force"]
    if output is None:
        return placed
    roving = [k for k in motions if record.channels[k].point == ROVING]
    if roving:
        return replace(placed, channels=tuple(Dof(output.point, dof.direction) if k in roving else dof
                                              for k, dof in enumerate(placed.channels)))
    if len(motions) != 1:
        raise ToolpointError(f"`name` {{output}}: {record.name} holds {len(motions)} responses; the name of a file can label "
                             "one")
    return replace(placed, channels=tuple(output if k == motions[0] else dof for k, dof in enumerate(placed.channels)))


def _at_one_rate(records: Sequence[Record], names: Sequence[str]) -> list[Record]:
    """Return the records at the rate of the first: times written with few digits give rates that differ by rounding."""
    first = records[0].sample_rate
    for record, name in zip(records, names, strict=True):
        if not np.isclose(record.sample_rate, first, rtol=RATE_TOLERANCE):
            raise ToolpointError(f"{name}: {record.sample_rate:g} samples a second beside {first:g} of {names[0]}; records "
                                 "that are taken together must share one rate; resample one of them")
    return [replace(record, sample_rate=first) for record in records]
