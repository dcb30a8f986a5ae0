"""Records of controllers and metrology by what stands in them: Sinumerik, TNCscope, TwinCAT Scope, ISO 230-2, tables; read."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.drives.accuracy.axis_record import AxisRecord, AxisSignal, PositioningRun, role_of
from toolpoint.drives.simulation.loop_identification import LoopResponse
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.io.servo_data import signal_table, sinumerik

_MAX_RECORD_BYTES = 300_000_000
ServoFile = AxisRecord | PositioningRun | LoopResponse


@door("controller record")
def read(path: str | Path, units: Mapping[str, str] | None = None, sample_time: float | None = None) -> ServoFile:
    """Return the signals of a record, a positioning run, or the loop of a frequency response measurement.

    Parameters
    ----------
    path : path
        Sinumerik trace or servo-tuning XML, TNCscope (.sco), TwinCAT Scope export, ISO 230-2 run (.dat with TGT_DATA), or any
        table with a line of column names.
    units : mapping of column name to unit, optional
        Of a table whose header names none.
    sample_time : float, optional
        s; of a table without a time column.

    >>> import tempfile
    >>> from toolpoint.samples import write_samples
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     record = read(write_samples("servo", Path(folder, "servo")).folder / "trace.csv")
    >>> record
    AxisRecord(3 signals of Z; 3.998 s)
    """
    path = Path(path)
    try:
        if path.stat().st_size > _MAX_RECORD_BYTES:
            raise ToolpointError(f"{path}: {path.stat().st_size / 1e6:.0f} MB; at most {_MAX_RECORD_BYTES / 1e6:.0f} are read; "
                                 "cut it")
        raw = path.read_bytes()
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    head = text[:4000]
    if head.lstrip().startswith("<"):
        return _read_trace(path, raw, text) if "<traceSession" in head else sinumerik.read(path).loop
    if head.startswith("%TNCscope"):
        return signal_table.read_tncscope(path, text)
    if re.search(r"^TGT_DATA\[", text, re.MULTILINE):
        return _read_positioning(path, text)
    if head.startswith("Name\t") and "Starttime of export" in head:
        return signal_table.read_twincat(path, text)
    return signal_table.read(path, text, units, sample_time=sample_time)


def _read_trace(path: Path, raw: bytes, text: str) -> AxisRecord:
    """Return the signals of a Sinumerik trace; a record without a signal's field holds its value."""
    if b"<!DOCTYPE" in raw[:4000] or b"<!ENTITY" in raw:
        raise FileFaults(str(path), text[:4000], [Fault(1, 1, "", "a document type with entities; no trace of a controller")])
    try:
        root = ET.fromstring(raw)
    except ET.ParseError as error:
        line, column = error.position
        raise FileFaults(str(path), text, [Fault(line, column + 1, "", f"broken XML: {error.msg}")]) from None
    frame = root.find(".//dataFrame")
    if frame is None:
        raise FileFaults(str(path), text, [Fault(1, 1, "", "no data frame in the trace")])
    heads = {str(s.get("id")): s for s in frame.iter("dataSignal")}
    series: dict[str, list[tuple[float, float]]] = {key: [] for key in heads}
    for record in frame.iter("rec"):
        time = float(record.get("time", "nan"))
        for key, value in record.items():
            if key in series:
                series[key].append((time, float(value)))
    raw_signals = []
    for key, head in heads.items():
        if len(series[key]) > 1:
            values = np.array(series[key])
            name = f"{head.get('description')} {head.get('name')}"
            axis = re.search(r"\[\s*u\d+\s*,\s*(\d+)\s*\]", name)
            raw_signals.append((name, str(head.get("unitsType")), axis[1] if axis else "", values))
    return _scale_trace(path, text, raw_signals)


def _scale_trace(path: Path, text: str, raw: list[tuple[str, str, str, np.ndarray]]) -> AxisRecord:
    """Return the signals in SI: a trace names no units, but the speed in rev/min or mm/min tells which the positions have."""
    notes: list[str] = []
    turning = {axis: _is_rotary(axis, raw, notes) for axis in dict.fromkeys(axis for _, _, axis, _ in raw)}
    signals = []
    for name, kind, axis, values in raw:
        rotary = turning[axis]
        unit, factor = {"posn": ("rad", np.pi / 180) if rotary else ("m", 1e-3),
                        "velo": ("rad/s", np.pi / 30) if rotary else ("m/s", 1e-3 / 60),
                        "current": ("A", 1.0)}.get(kind, ("", 1.0))
        role = role_of(name, unit) if unit else ""
        signals.append(AxisSignal(name, unit, role, axis, values[:, 0], factor * values[:, 1]))
    if not signals:
        raise FileFaults(str(path), text[:4000], [Fault(1, 1, "", "no signal with two values")])
    return AxisRecord(tuple(signals), str(path), tuple(notes))


def _is_rotary(axis: str, raw: list[tuple[str, str, str, np.ndarray]], notes: list[str]) -> bool:
    position = next((v for n, k, a, v in raw if a == axis and k == "posn" and "CmdPos" in n), None)
    speed = next((v for n, k, a, v in raw if a == axis and k == "velo"), None)
    if position is None or speed is None:
        notes.append(f"axis {axis}: units are not in the file; positions are taken as mm, speeds as mm/min")
        return False
    rate = np.diff(position[:, 1]) / np.diff(position[:, 0])
    held = np.interp(position[1:, 0], speed[:, 0], speed[:, 1])
    fast = np.abs(held) > 0.5 * np.abs(held).max()
    ratio = float(np.median(rate[fast] / held[fast])) if fast.any() else 0.0
    # 1 rev/min is 6 deg/s; 1 mm/min is 1/60 mm/s.
    if abs(ratio / 6 - 1) < 0.1:
        notes.append(f"axis {axis}: positions in deg and speeds in rev/min, as their ratio says")
        return True
    if abs(ratio * 60 - 1) >= 0.1:
        notes.append(f"axis {axis}: units are not in the file and the ratio of speeds and positions ({ratio:.3g}) fits neither "
                     "mm, mm/min nor deg, rev/min; mm and mm/min are taken")
    return False


def _read_positioning(path: Path, text: str) -> PositioningRun:
    """Return a run of ISO 230-2 from shell assignments TGT_DATA[i], REF_DATA_FWD[i,j], REF_DATA_BWD[i,j]."""
    unit = re.search(r"^UNIT=(\S+)", text, re.MULTILINE)
    si = signal_table.unit_of(unit[1] if unit else "mm")
    if si is None or si[0] != "m":
        raise FileFaults(str(path), text, [Fault(1, 1, "UNIT", f"unit {unit[1] if unit else ''!r}; must be a length")])
    targets = {int(i): float(v) for i, v in re.findall(r"^TGT_DATA\[(\d+)\]=(\S+)", text, re.MULTILINE)}
    tables = []
    for direction in ("FWD", "BWD"):
        cells = {(int(i), int(j)): float(v) for i, j, v in
                 re.findall(rf"^REF_DATA_{direction}\[(\d+),(\d+)\]=(\S+)", text, re.MULTILINE)}
        cycles = max((j for _, j in cells), default=0)
        if cycles > 1000 or len(targets) > 10000:
            raise FileFaults(str(path), text[:4000], [Fault(1, 1, direction, f"{cycles} cycles; at most 1000 are read")])
        absent_cells = [(i, j) for i in targets for j in range(1, cycles + 1) if (i, j) not in cells]
        if absent_cells or cycles == 0:
            raise FileFaults(str(path), text,
                             [Fault(1, 1, direction, f"{len(absent_cells)} positions are missing: {absent_cells[:3]}")])
        tables.append(si[1] * np.array([[cells[i, j] for j in range(1, cycles + 1)] for i in sorted(targets)]))
    return PositioningRun(si[1] * np.array([targets[i] for i in sorted(targets)]), tables[0], tables[1], str(path),
                          () if unit else ("the file names no unit; its positions are read as mm",))
