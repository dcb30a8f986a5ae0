"""The page of a traverse: which modes change over an axis's travel or speed, and which joint that comes from."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.measured.traverse import draw_courses
from toolpoint.studies.moving.moving_joints import OPEN_SHARE
from toolpoint.studies.moving.traverse_study import JOINT_HEADER, MODE_HEADER, TraverseStudy


def traverse_page(study: TraverseStudy, name: str = "", *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of modes over a traverse.

    Examples
    --------
    Runs in ``examples/follow_modes_over_a_traverse.py``.
    """
    report = Report("The machine while it moves", study.status, subtitle=name).with_doubts(*study.doubts, *warnings)
    chart = Chart(draw_courses(study), "Points: windows with 95 % intervals. Bands: the common course through them. Dashed: "
                                       "the machine file. Each against its own mean, so that errors of the file that do not "
                                       "change do not show.", "courses")
    report = report.with_section("Modes", chart, Table(list(MODE_HEADER), study.rows(),
                                                       "Damping in the middle; 95 % intervals."))
    if study.joints:
        report = report.with_section("Joints that could change on the way", "Each line is one joint alone, its stiffness going "
                                     "steadily from end to end.", Table(list(JOINT_HEADER), study.joint_rows()))
    if study.notes:
        report = report.with_section("What was done", Notes(study.notes, "note", "What was done"))
    return report.with_assumptions(
        "The loads are random and alike all along; the machine changes little within a window.",
        "Courses are straight or parabolas over the value; a resonance that comes and goes within a window is not seen.",
        *([f"One joint changes, steadily over the value, and what it does is as the machine file says within "
           f"{100 * OPEN_SHARE:g} % of it. Drives, guides and screws on the way are joints; a mass that is carried along is "
           "in the file."]
          if study.joints else []))
