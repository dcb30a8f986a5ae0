"""One call: a record of the spindle's power, torque or current beside a program that was run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, floats
from toolpoint.cutting.build import coefficients_of
from toolpoint.drives.accuracy.axis_record import AxisRecord, AxisSignal, names_of
from toolpoint.studies.machining.recorded.alignment import align_record
from toolpoint.studies.machining.recorded.block_fit import fit_coefficient, gather_windows
from toolpoint.studies.machining.recorded.record_chatter import ChatterInRecord, find_chatter
from toolpoint.studies.machining.recorded.record_comparison import RecordComparison
from toolpoint.studies.machining.recorded.spindle_load import spindle_load
from toolpoint.studies.machining.result import MachiningStudy

MIN_COMPARED_SAMPLES = 50  # of a record
MAX_COMPARED_SAMPLES = 20_000_000  # of a record
_MIN_STEP, _MAX_STEP = 2e-3, 0.1  # s, of the computed load
_GUARD_STEPS = 3.0  # of the record's or the load's time step, left out at both ends of a block
LOAD_UNITS = ("W", "N m")
_SIGNAL_UNITS = (*LOAD_UNITS, "A", "%")


def compare_record(result: MachiningStudy, time: FloatArray, values: FloatArray, *, unit: str = "W", name: str = "",
                   efficiency: float = 1.0) -> MachiningStudy:
    """Return the study of a program with a record of the machine beside it.

    Parameters
    ----------
    result : MachiningStudy
    time, values : (n,) floats
        s, increasing; spindle power (W), its torque (N m), or any signal that grows with it (current, load in %).
    unit : str
        ``W`` and ``N m`` tell the coefficient of the material; others compare blocks alone.
    name : str
        Of the record.
    efficiency : float
        Of the spindle: power at the tool over the recorded one, without the idle load.

    Raises ToolpointError for records that are too short, not finite, or not increasing in time, and a program without cuts.

    Examples
    --------
    A record that is the computed power with 20 % more, and 300 W of idle load:

    >>> from toolpoint import studies
    >>> from toolpoint.cutting.description import CuttingDescription
    >>> from toolpoint.io.program.gcode import parse
    >>> text = "S9000 G1 F1800 X-20 Y25 Z-2\\nX20\\nF900 X60\\nG0 Z9\\nX-20 Y10\\nG1 Z-1\\nX60"
    >>> stock = studies.stock_of("box", (0, 0, -0.01, 0.04, 0.05, 0))
    >>> cut = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8)
    >>> result = studies.run_program(parse(text, start=(-0.02, 0.025, 0.1)), studies.describe_machining(stock, cut))
    >>> from toolpoint.studies.machining.recorded.spindle_load import spindle_load
    >>> load = spindle_load(result.laid, result.removed, result.loads, setup=result.setup, step=0.01)
    >>> noise = np.random.default_rng(0).normal(0, 5, load.time.size)
    >>> record = compare_record(result, load.time, 300 + 1.2 * load.total + noise).record
    >>> 0.97 < record.fit.factor / 1.2 < 1.03
    True
    """
    time, values = floats("time", time, (None,)), floats("values", values, np.shape(time))
    if not MIN_COMPARED_SAMPLES <= time.size <= MAX_COMPARED_SAMPLES:
        fail("record", f"{time.size} samples", f"must be {MIN_COMPARED_SAMPLES} to {MAX_COMPARED_SAMPLES}")
    if (np.diff(time) <= 0).any():
        fail("time", "values that do not increase", "must increase", remedy="remove lines that are there twice")
    if not 0.1 <= efficiency <= 1.0:
        fail("efficiency", f"{efficiency:g}", "must be 0.1 to 1", remedy="power at the tool over that of the motor")
    if result.loads is None or not (result.loads.power > 0).any():
        raise ToolpointError("record: the program cuts nothing; there is no load to compare it with")
    interval = float(np.median(np.diff(time)))
    load = spindle_load(result.laid, result.removed, result.loads, setup=result.setup,
                        step=float(np.clip(interval, _MIN_STEP, _MAX_STEP)), as_torque=unit == "N m")
    slow_time, slow_values = _averaged(time, values, load.step)
    place = align_record(load, slow_time, slow_values)
    course = np.interp(time, slow_time, place.time)
    is_scaled = unit in LOAD_UNITS
    windows = gather_windows(load, course if interval >= load.step else place.time,
                             values if interval >= load.step else slow_values, guard=_GUARD_STEPS * load.step, pace=place.pace)
    fit = fit_coefficient(replace(windows, measured=efficiency * windows.measured, deviation=efficiency * windows.deviation),
                          with_gain=is_scaled)
    fit = replace(fit, expected=fit.expected / efficiency)
    index = np.clip(np.rint(course / load.step).astype(int), 0, load.block.size - 1)
    segment = np.where(load.total[index] > 0, load.block[index], -1)
    chatter, block_count = _chatter(result, segment, values, 1 / interval)
    lines = result.laid.path.line
    comparison = RecordComparison(
        name, unit, slow_time, slow_values, load, place, windows, lines[windows.block], fit, is_scaled,
        float(coefficients_of(result.setup.cut_of(result.laid.numbers[0])).kt), tuple(chatter), block_count,
        tuple(int(lines[c.block]) for c in chatter))
    return replace(result, record=comparison)


def spindle_signal(record: object, name: str = "") -> AxisSignal:
    """Return the signal of a record that stands for the spindle's load: the named one, or the only one that can be.

    record : AxisRecord, as `io.read_servo_data` gives it.

    Raises ToolpointError for a record of another kind, a name that it does not hold, and several signals without a name.

    Examples
    --------
    >>> from toolpoint.drives.accuracy.axis_record import AxisRecord, AxisSignal
    >>> from toolpoint.studies import spindle_signal
    >>> power = AxisSignal("Spindle power", "W", "", "", np.arange(3.0), np.array([300.0, 900.0, 310.0]))
    >>> spindle_signal(AxisRecord((power,))).name
    'Spindle power'
    """
    if not isinstance(record, AxisRecord):
        raise ToolpointError("record: no signals over time; give a table with time and power, torque or current")
    candidates = [s for s in record.signals if s.unit in _SIGNAL_UNITS] if not name else \
        [s for s in record.signals if s.name.lower() == name.lower()]
    if len(candidates) != 1:
        names = ", ".join(names_of(record.signals))
        raise ToolpointError(f"signal: {repr(name) if name else 'not given'}; must be one of {names}", argument="signal")
    return candidates[0]


def _averaged(time: FloatArray, values: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Return a record at about `step` s a sample: means of the samples between."""
    group = int(step / float(np.median(np.diff(time))) + 0.5)
    if group < 2:
        return time, values
    count = time.size // group * group
    return time[:count].reshape(-1, group).mean(axis=1), values[:count].reshape(-1, group).mean(axis=1)


def _chatter(result: MachiningStudy, segment: np.ndarray, values: FloatArray, rate: float
             ) -> tuple[list[ChatterInRecord], int]:
    inside = segment >= 0
    teeth = np.array([result.setup.cut_of(int(number)).tool.teeth for number in result.laid.tool])
    if not inside.any():
        return [], 0
    return find_chatter(np.where(inside, segment, -1), values, rate, speed=np.append(result.laid.speed, 0.0),
                        teeth=np.append(teeth, 1))
