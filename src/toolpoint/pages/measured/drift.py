"""The page of a drift: whether the machine changed, which modes moved, and which part is likeliest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._rounding import NORMAL_QUANTILE_95, probability_text
from toolpoint.plot import Cell, Chart, Notes, Report, Table
from toolpoint.plot.figures.measured.drift import course_of_modes, mode_changes
from toolpoint.studies.drift.drift_study import DriftStudy
from toolpoint.studies.drift.evidence import MODEL_ERROR_FRACTION
from toolpoint.studies.drift.mode_changes import ModeChanges


def drift_page(study: DriftStudy, machine_name: str = "", *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of later tests beside a baseline.

    Examples
    --------
    Runs in ``examples/tell_which_joint_loosened.py``.
    """
    report = Report("Has the machine changed?", study.status, subtitle=machine_name).with_doubts(*study.doubts, *warnings)
    if study.explanations:
        report = report.with_section(
            "What could have changed", "Each line is one change alone. Its probability is its share of all that were looked "
            "at, "
            "if one of them happened; its factor is what the tests say if it is the one.", _part_table(study))
    report = report.with_section(
        "Modes", Chart(mode_changes(study), "Change of every frequency from the baseline to the last test. Grey: what two "
                       "tests "
                       "of an unchanged machine differ by.", "changes"), _mode_table(study.last, study.false_alarms))
    if len(study.history) > 1:
        report = report.with_section("History", Chart(course_of_modes(study), "Frequencies over the tests, relative to the "
                                                      "baseline; "
                                                      "bars: 95 % of an unchanged machine.", "history"))
    if study.notes:
        report = report.with_section("What was done", Notes(study.notes, "note", "What was done"))
    repeat = study.last.repeatability
    return report.with_assumptions(
        f"Two tests of an unchanged machine differ by {100 * repeat.frequency:.2g} % (standard deviation) of every frequency "
        f"besides "
        f"their noise, and by {100 * repeat.shape:.2g} % of every shape's largest motion. A machine that is warm in one test "
        f"and "
        "cold in the other differs by more.",
        f"An unchanged machine is called changed in {100 * study.false_alarms:.2g} % of tests.",
        "The pose and what is clamped are the same in all tests.",
        *([f"One part changed. What it does to the modes is as the machine file says, within {100 * MODEL_ERROR_FRACTION:.2g} "
           f"% of "
           "the change."] if study.explanations else []))


def _part_table(study: DriftStudy) -> Table:
    rows: list[list[object]] = [
        [e.part, e.direction or ("all" if e.part.startswith("joint") else ""), probability_text(e.probability),
         e.change_text, e.interval_text,
         Cell("yes", "good") if e.fits else Cell("no", "doubtful")] for e in study.explanations]
    return Table(["part", "direction", "probability", "change", "95 % interval", "explains all"], rows,
                 "Change: of stiffness, of mass, or of all frequencies.")


def _mode_table(changes: ModeChanges, false_alarms: float) -> Table:
    moved = set(changes.significant(false_alarms).tolist())
    rows: list[list[object]] = []
    for i in range(changes.baseline.count):
        j = int(changes.partner[i])
        if j < 0:
            rows.append([f"{changes.baseline.frequency[i]:.4f}", "not seen", "", "", Cell("not judged", "doubtful")])
            continue
        rows.append([f"{changes.baseline.frequency[i]:.4f}", f"{changes.current.frequency[j]:.4f}",
                     f"{100 * np.expm1(changes.change[i]):+.3f}", f"{100 * NORMAL_QUANTILE_95 * changes.deviation[i]:.3f}",
                     Cell("moved", "doubtful") if i in moved else "within it"])
    return Table(["baseline, Hz", "last test, Hz", "change, %", "unchanged: ± %", ""], rows,
                 "Unchanged: 95 % of the differences between two tests of one machine.")
