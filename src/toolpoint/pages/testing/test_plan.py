"""The page of a planned hammer test: the answer, the picture, the check list, what to expect, how it was chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.machines.planned_points import point_views
from toolpoint.plot.figures.measured.correlation import mac_matrix
from toolpoint.studies.testing.modal_test_plan import EXPECTED_COLUMNS, STEP_COLUMNS, ModalTestPlan
from toolpoint.vibration.correlation import auto_mac


def plan_page(result: ModalTestPlan, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a planned hammer test.

    Examples
    --------
    Runs in ``examples/plan_a_hammer_test.py``.
    """
    report = Report("Plan of a hammer test", result.status, subtitle=result.machine.name)
    places = result.candidates.coordinates
    rows = [[str(name), *(f"{1e3 * value:.0f}" for value in places[name]), result.candidates.places[name][0],
             ", ".join(dof.direction for dof in result.struck if dof.point == name)] for name in result.points]
    report = report.with_section("Where", Chart(point_views(places, result.points, result.struck)),
                                 Table(["point", "x mm", "y mm", "z mm", "on", "struck along"], rows))
    report = report.with_section("Check list", Table(list(STEP_COLUMNS), result.steps()))
    report = report.with_section("Expected", Table(list(EXPECTED_COLUMNS), result.mode_rows(),
                                                   f"By a virtual test with {100 * result.noise:g} % noise; shapes expanded to "
                                                   f"all {len(places)} points by those of the model."), _beside(result))
    chosen = set(result.points)
    shape = result.modes.shape[[k for k, dof in enumerate(result.modes.dofs) if dof.point in chosen]]
    report = report.with_section("AutoMAC at these points", Chart(mac_matrix(auto_mac(np.asarray(shape)), result.modes,
                                                                             result.modes)))
    doubts = [note for note in result.notes if any(word in note for word in ("moved by only", "look alike", "does not find"))]
    parts = [Notes([*doubts, *warnings], "warning")] if doubts or warnings else []
    assumed = [note for note in result.notes if note not in doubts]
    return report.with_section("What was assumed", *parts, Notes(assumed, "assumed"))


def _beside(result: ModalTestPlan) -> Table:
    """Return the chosen points beside random ones, by the modes found in virtual tests."""
    outcomes = [("chosen", result.expected), *((f"random {k}", outcome) for k, outcome in enumerate(result.random, 1))]
    errors = [float(np.nanmax(np.abs(outcome.frequency_error), initial=0.0)) for _, outcome in outcomes]
    return Table(["points", "modes found", "least MAC", "largest frequency error %"],
                 [[name, f"{outcome.seen} of {result.modes.count}", f"{outcome.least_mac:.4f}", f"{100 * error:.2g}"]
                  for (name, outcome), error in zip(outcomes, errors, strict=True)],
                 "Random points of the same number, with the best of them struck.")
