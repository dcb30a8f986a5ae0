"""The page of a program on a machine: the answer, worst blocks, the program in space with its text, errors, the record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.pages.machining.program_part import program_part
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Cell, Chart, Report, Table
from toolpoint.plot.figures.machining import course_over_time, record_over_time
from toolpoint.studies.machining.errors.block_errors import ERROR_HEADER
from toolpoint.studies.machining.recorded.record_comparison import UNEXPECTED_HEADER, RecordComparison
from toolpoint.studies.machining.result import HEADER, VERDICTS, MachiningStudy
from toolpoint.studies.machining.thin_walls.work_course import STAGE_HEADER
from toolpoint.studies.machining.tilted_stages import StagedStudy, tilt_words

LISTED_BLOCKS = 40  # worst ones, with their lines
ERROR_KEY = "Total: along the normal of wall or floor, the larger, positive where material is left. Wall, floor: of the forced \
vibration. Cusp: between neighbouring tracks of a ball. \
Contour: of the tables from the path. Push: of the servo by the mean cutting force"
WORK_KEY = "The part at each stage: natural frequencies, their change since the stage before, the thinnest wall behind a cut, \
and the largest static compliance that a cut meets, along the normal of its wall"
MARK_OF_VERDICT = {"chatters": "doubtful", "stable": "good"}


def machining_page(result: MachiningStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a program.

    Examples
    --------
    Runs in ``examples/run_a_program_on_a_machine.py``.
    """
    report = Report(f"Program on a machine: {result.name}", result.answer,
                    subtitle=f"{result.setup.stock.words}; tool {', '.join(map(str, result.laid.numbers))}")
    cutting = np.flatnonzero(result.blocks.verdict > 0)
    if cutting.size:
        report = report.with_section("Blocks, worst first", _worst(result), *_advice(result))
        report = report.with_section("The program in space", program_part(result))
        errors = result.error_rows(LISTED_BLOCKS)
        if errors:
            report = report.with_section("Errors of blocks, largest first", Table(list(ERROR_HEADER), errors, ERROR_KEY))
        if result.work is not None:
            rows = [list(row) for row in result.work.rows]
            report = report.with_section("Stages of the work", Table(list(STAGE_HEADER), rows, WORK_KEY))
        if result.record is not None:
            report = report.with_section("Against the record", *_record(result.record))
        report = report.with_section("Over the time of the program", *_course(result))
    report = report.with_section("The whole program", Table(["quantity", "value"], result.figures))
    recorded = [] if result.record is None else result.record.doubts
    return with_remarks(report.with_doubts(*recorded, *result.doubts), result.notes, warnings)


def stages_page(result: StagedStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a program in tilted planes, a section for every stage in the axes of its plane.

    Examples
    --------
    Runs in ``examples/mill_in_a_tilted_plane.py``.
    """
    report = Report(f"Program in tilted planes: {result.name}", result.answer.replace("\n", "\n\n"),
                    subtitle=f"{len(result.stages)} stages; each over the work that the stage before has left")
    for k, (rotation, stage) in enumerate(zip(result.rotations, result.stages, strict=True), 1):
        figures = Table(["quantity", "value"], stage.figures)
        title = f"Stage {k}: {tilt_words(rotation)}"
        if (stage.blocks.verdict > 0).any():
            recorded = [] if stage.record is None else _record(stage.record, f"record-stage-{k}")
            report = report.with_section(title, _worst(stage), *_advice(stage), program_part(stage, f"stage-{k}"), *recorded,
                                         figures)
        else:
            report = report.with_section(title, figures)
    return with_remarks(report.with_doubts(*result.doubts), result.notes, warnings)


def _worst(result: MachiningStudy) -> Table:
    """Return the worst blocks, each with its line of the program."""
    rows: list[list[object]] = []
    for cells in result.worst_rows(LISTED_BLOCKS):
        line = int(cells[0])
        text = result.text[line - 1].strip() if 0 < line <= len(result.text) else ""
        rows.append([cells[0], Cell(cells[1], MARK_OF_VERDICT.get(cells[1], "")), *cells[2:], text[:60]])
    return Table([*HEADER, "block"], rows, "The first line is the most doubtful; depth and limit are axial depths at the "
                                           "block's own arc")


def _advice(result: MachiningStudy) -> list[str]:
    return [] if result.advice is None else result.advice.words.split("\n")


def _record(record: RecordComparison, name: str = "record-course") -> list[Chart | Table | str]:
    """Return what the record says: its answer, the course beside the computed one, lines that differ."""
    parts: list[Chart | Table | str] = [record.answer, Chart(record_over_time(
        record.alignment.time, record.values, expected=_expected(record),
        quantity=f"Load of the spindle, {record.unit or 'as recorded'}"), name=name)]
    if record.is_placed and record.unexpected.size:
        parts.append(Table(list(UNEXPECTED_HEADER), [list(row) for row in record.rows()],
                           "Means of blocks; deviations of what noise and the scatter of blocks leave"))
    return parts


def _expected(record: RecordComparison) -> FloatArray:
    """Return the computed load at the samples of the record, with the factors that the record tells."""
    load, fit = record.load, record.fit
    idle = float(np.median(fit.expected - fit.factor * record.windows.shearing - _edge(record) * record.windows.edges))
    shearing, edges = (np.interp(record.alignment.time, load.time, part, left=0.0, right=0.0)
                       for part in (load.shearing, load.edges))
    return np.asarray(idle + fit.factor * record.alignment.pace * shearing + _edge(record) * edges)


def _edge(record: RecordComparison) -> float:
    return record.fit.edge_factor if np.isfinite(record.fit.edge_factor) else record.fit.factor


def _course(result: MachiningStudy) -> list[Chart]:
    blocks, time = result.blocks, np.cumsum(result.laid.time)
    labels = [f"line {line}, {VERDICTS[v]}" for line, v in zip(blocks.line.tolist(), blocks.verdict.tolist(), strict=True)]
    force = course_over_time(time, {"force, N": blocks.loads["lateral"]}, labels=labels, quantity="Force across the tool, N")
    power = course_over_time(time, {"power, W": blocks.loads["power"]}, labels=labels, quantity="Mean power, W")
    return [Chart(force, name="force-course"), Chart(power, name="power-course")]
