"""The page of an axis that shook itself: modes of both states, its joint's damping, responses."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.studies.moving.driven_axis_study import DrivenAxisStudy


def driven_axis_page(study: DrivenAxisStudy, name: str = "", *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a test by the axis itself.

    Examples
    --------
    Runs in ``examples/shake_an_axis_by_itself.py``.
    """
    report = Report("An axis shakes itself", study.status, subtitle=name).with_doubts(*study.doubts, *warnings)
    report = report.with_section("Modes", Table(study.header, study.rows(), "95 % intervals of noise and loads."))
    for state in study.states:
        frf = state.test.frf.between(*state.test.shaken)
        report = report.with_section(f"Response, {state.name}", Chart(
            bode(frf, modes=state.modes.modes), f"To the motor's force. The set point shakes from {state.test.shaken[0]:.4g} "
                                                f"to {state.test.shaken[1]:.4g} Hz; lines beyond are left out."),
                                     Notes(list(frf.notes), "assumed"))
    return report.with_assumptions(
        "The set point is what was sent, not what was measured back; it is random or a chirp, and independent of the loads.",
        "Force is the motor's: friction between motor and axis is part of the structure here, and differs between standing and "
        "moving.",
        *(["Strain energies are those of the machine file; a loss factor at most so large means that all damping of the mode "
           "that says so would be this joint's."] if study.damping else []))
