"""Pages of step tests and of tuned gains: the answer, the figures, responses, and loops before and after."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint._rounding import number_text
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.servos.drives import loop_bode
from toolpoint.plot.figures.servos.steps import plot_step
from toolpoint.studies.servos.drive_tuning import TUNING_HEADER, TunedDrives
from toolpoint.studies.servos.step_test import STEP_HEADER, StepStudy


def step_page(result: StepStudy, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of step tests; `warnings` are those of the run.

    >>> from toolpoint.drives.description import DriveAxisDescription, DriveDescription, MechanicsDescription
    >>> from toolpoint.drives.description import PositionDescription, VelocityDescription
    >>> from toolpoint.studies import StepSetting, step_drives
    >>> axis = DriveAxisDescription(mechanics=MechanicsDescription("rigid", lead=0.01, inertia=0.01),
    ...                             position=PositionDescription(20.0), velocity=VelocityDescription(1.0))
    >>> page = step_page(step_drives(DriveDescription("slide", {"X": axis}), [StepSetting("X", "velocity", 0.01)]))
    >>> page.summary
    'The X, velocity step of 600 mm/min, settles within 2 % after 38.8 ms, 0 % over.'
    """
    slowest = max(result.tests, key=lambda test: test.figures.settling_time if test.figures else float("inf"))
    answer = (f"{slowest.name}: the response does not reach the step." if slowest.figures is None else
              f"The slowest of {len(result.tests)} steps settles within 2 % after "
              f"{number_text(1e3 * slowest.figures.settling_time, digits=3)} ms ({slowest.name})." if len(result.tests) > 1 else
              f"The {slowest.name}, settles within 2 % after {number_text(1e3 * slowest.figures.settling_time, digits=3)} ms, "
              f"{100 * slowest.figures.overshoot:.2g} % over.")
    report = Report(f"Step tests: {result.drives.name}", answer, subtitle=result.drives.source)
    report = report.with_doubts(*result.doubts)
    report = report.with_section("Figures", Table(list(STEP_HEADER), [test.row() for test in result.tests]))
    charts = [Chart(plot_step(test), test.name, name=f"step{k}") for k, test in enumerate(result.tests)]
    report = report.with_section("Responses", *charts)
    return with_remarks(report, [*result.notes, *result.drives.assumptions], warnings)


def tuning_page(result: TunedDrives, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of tuned gains; `warnings` are those of the run.

    >>> from toolpoint.drives.description import DriveAxisDescription, DriveDescription, MechanicsDescription
    >>> from toolpoint.drives.description import PositionDescription, VelocityDescription
    >>> from toolpoint.studies import tune_drives
    >>> axis = DriveAxisDescription(mechanics=MechanicsDescription("two-mass", lead=0.01, inertia=0.006, table_mass=300.0,
    ...                                                           stiffness=1e8), position=PositionDescription(20.0),
    ...                             velocity=VelocityDescription(1.0))
    >>> page = tuning_page(tune_drives(DriveDescription("slide", {"X": axis})))
    >>> "45° and a gain margin of 8 dB" in page.summary
    True
    """
    target = result.target
    words = [f"{name} K_v {result.base.axes[name].position.gain:.4g} to {axis.position.gain:.4g} 1/s"
             for name, axis in result.drives.axes.items()]
    answer = (f"With a phase margin of {target.phase_margin:g}° and a gain margin of {target.gain_margin_db:g} dB the gains "
              f"can be: {'; '.join(words)}.")
    report = Report(f"Gains: {result.base.name}", answer, subtitle=result.base.source).with_doubts(*result.doubts)
    report = report.with_section("Gains", Table(list(TUNING_HEADER), result.rows()))
    header = ["loop", "axis", "gain margin, dB", "phase margin, °", "bandwidth, Hz"]
    bodes = [Chart(loop_bode(level, k, name), name=f"loop{k}{level.name}") for k, name in enumerate(result.drives.axes)
             for level in (result.loops_after.velocity, result.loops_after.position)]
    report = report.with_section("Loops before and after", Table(header, result.loop_rows()), *bodes)
    return with_remarks(report, [*result.notes, *result.base.assumptions], warnings)
