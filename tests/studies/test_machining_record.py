"""A record beside a program: place, pace, coefficient with its interval, blocks that differ, chatter, wrong records."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from toolpoint import ToolpointError, studies
from toolpoint._check import FloatArray
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.material_removal import Stock
from toolpoint.studies.machining.recorded.record_comparison import RecordComparison
from toolpoint.studies.machining.recorded.spindle_load import spindle_load
from toolpoint.studies.machining.result import MachiningStudy

MM = 1e-3
CUT = {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8, "edge_tangential": 1.5e4, "flute_length": 0.03}
STOCK = Stock.box(np.array([0, 0, -20]) * MM, np.array([80, 60, 0]) * MM)
FEEDS = (1200, 2400, 900, 1800, 3000, 600)


def _program(seed: int = 0, passes: int = 9) -> str:
    """Passes of random depth, width and feed, with rapids back between them."""
    rng = np.random.default_rng(seed)
    lines, y, z = ["S9000 M3"], 2.0, 0.0
    for _ in range(passes):
        y, z = (y + rng.uniform(2, 9), z) if y < 48 else (2.0, z - 3)
        lines += [f"G0 X-7 Y{y:.3f} Z{z - rng.uniform(1, 4):.3f}", f"G1 X{rng.uniform(30, 50):.2f} F{rng.choice(FEEDS)}",
                  f"X87 F{rng.choice(FEEDS)}", "G0 Z8"]
    return "\n".join(lines)


@cache
def _result(seed: int = 0) -> MachiningStudy:
    setup = studies.describe_machining(STOCK, CuttingDescription.of(**CUT), spacing=0.5 * MM)
    return studies.run_program(parse(_program(seed), start=(0, 0, 0.1)), setup)


def _record(factor: float, *, pace: float = 1.0, noise: float = 20.0, seed: int = 0, program: int = 0, step: float = 0.01,
            edge: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Return times and powers: the load with a hidden factor, an idle load, noise, 1.3 s before the program."""
    result, rng = _result(program), np.random.default_rng(seed)
    assert result.loads is not None
    load = spindle_load(result.laid, result.removed, result.loads, setup=result.setup, step=step)
    time = np.arange(0, load.time[-1] / pace + 3, step)
    at = pace * (time - 1.3)
    parts = factor * pace * np.interp(at, load.time, load.shearing) + edge * np.interp(at, load.time, load.edges)
    return time, 350 + np.where((at > 0) & (at < load.time[-1]), parts, 0) + rng.normal(0, noise, time.size)


def _compared(time: FloatArray, values: FloatArray, unit: str = "W") -> RecordComparison:
    record = studies.compare_record(_result(), time, values, unit=unit).record
    assert record is not None
    return record


@pytest.mark.parametrize("pace", [pytest.param(1.0, marks=pytest.mark.slow), 0.8])
def test_the_hidden_coefficient_start_and_pace_are_told(pace: float) -> None:
    """Start within 0.02 s, pace within 0.1 %, K_t within its interval and that within 5 %."""
    record = _compared(*_record(1.27, pace=pace))
    assert record.is_placed and not record.unexpected.size
    assert -record.alignment.start / pace == pytest.approx(1.3, abs=0.02)
    assert record.alignment.pace == pytest.approx(pace, rel=1e-3)
    lower, upper = record.interval
    assert lower < 1.27 * 8e8 < upper and upper - lower < 0.1 * 8e8
    assert any("1.27 times the K_t" in doubt for doubt in record.doubts)


def test_a_block_with_other_load_is_named_and_left_out_of_the_coefficient() -> None:
    """Half of the load is missing in one line (no material there): that line alone is named, the coefficient stays."""
    time, values = _record(1.1)
    result = _result()
    assert result.loads is not None
    load = spindle_load(result.laid, result.removed, result.loads, setup=result.setup, step=0.01)
    cutting = np.flatnonzero(load.total > 0)
    odd = int(load.block[cutting[cutting.size // 2]])
    span = load.time[load.block == odd] + 1.3
    during = (time > span[0]) & (time < span[-1])
    values = np.where(during, 350 + 0.5 * (values - 350), values)
    record = _compared(time, values)
    assert {int(n) for n in record.line[record.unexpected]} == {int(result.laid.path.line[odd])}
    lower, upper = record.interval
    assert lower < 1.1 * 8e8 < upper


def test_the_record_of_another_program_is_doubted_and_tells_nothing() -> None:
    record = _compared(*_record(1.0, program=7))
    assert not record.is_placed and record.to_dict()["tangential_pa"] is None
    assert "could not be placed" in record.answer


def test_a_record_of_a_part_that_repeats_is_doubted() -> None:
    """Equal passes: a record of one of them fits every one."""
    passes = "\n".join(f"G0 X-7 Y{y} Z-2\nG1 X87 F1800\nG0 Z8" for y in (5, 20, 35, 50))
    setup = studies.describe_machining(STOCK, CuttingDescription.of(**CUT), spacing=0.5 * MM)
    result = studies.run_program(parse("S9000\n" + passes, start=(0, 0, 0.1)), setup)
    assert result.loads is not None
    load = spindle_load(result.laid, result.removed, result.loads, setup=setup, step=0.01)
    middle = load.time.size // 2
    part = slice(middle - 300, middle + 250)
    noise = np.random.default_rng(3).normal(0, 20, 550)
    record = studies.compare_record(result, load.time[part], 300 + load.total[part] + noise).record
    assert record is not None and not record.is_placed


def test_a_current_tells_no_coefficient() -> None:
    """The unit has no scale: blocks are compared, K_t is not told."""
    time, values = _record(1.0)
    record = _compared(time, values / 90, unit="A")
    assert record.is_placed and not record.unexpected.size and record.to_dict()["tangential_pa"] is None


@pytest.mark.slow
def test_chatter_in_a_quick_record_is_found_with_its_frequency() -> None:
    """A line at 1437 Hz in one long block, tooth passings in all: that block is named with it."""
    time, values = _record(1.0, step=2e-4, noise=5)
    result = _result()
    assert result.loads is not None
    load = spindle_load(result.laid, result.removed, result.loads, setup=result.setup, step=2e-3)
    longest = int(np.bincount(load.block[load.total > 0]).argmax())
    span = load.time[(load.block == longest) & (load.total > 0)] + 1.3
    during = (time > span[0]) & (time < span[-1])
    passing = 40 * np.sin(2 * np.pi * 600 * time) * (values > 400)
    record = _compared(time, values + passing + during * 60 * np.sin(2 * np.pi * 1437 * time))
    assert record.heard_count > 2 and [round(c.frequency) for c in record.chatter] == [1437]
    assert record.chatter_lines[0] == result.laid.path.line[longest]
    assert not _compared(time, values + passing).chatter


@pytest.mark.parametrize(("time", "values", "words"), [
    (np.arange(20.0), np.ones(20), "20 samples"), (np.zeros(60), np.ones(60), "increase"),
    (np.arange(60.0), np.full(60, np.nan), "finite")])
def test_records_that_cannot_be_are_refused(time: FloatArray, values: FloatArray, words: str) -> None:
    with pytest.raises(ToolpointError, match=words):
        studies.compare_record(_result(), time, values)
