"""The page of a shaker test: the answer, doubts, set-ups, responses with intervals and coherence, checks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.pages.measured.hammer_records import MAX_DRAWN_RESPONSES, hammer_page, with_checks, with_remarks
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.figures.measured.response_bands import magnitude_bands
from toolpoint.studies.measured.hammer_study import HammerStudy
from toolpoint.studies.measured.shaker_study import SHAKER_HEADER, ShakerStudy


def shaker_page(result: ShakerStudy, warnings: Sequence[str] = (), title: str = "Shaker test") -> Report:
    """Return the page of a shaker test.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import ShakerSettings
    >>> from toolpoint.studies import study_shaker_records
    >>> from toolpoint.vibration import Record
    >>> force = np.random.default_rng(3).standard_normal((20000, 1))
    >>> record = Record(np.hstack([force, 2e-6 * force]), 1000.0, ["1:+x", "1:+x"], ["force", "displacement"])
    >>> shaker_page(study_shaker_records([record], ShakerSettings(2.0))).title
    'Shaker test'
    """
    report = Report(title, result.status)
    if result.doubts:
        report = report.with_section("Doubts", Notes(list(result.doubts), "warning", "Look at these first"))
    report = report.with_section("Set-ups", Table(list(SHAKER_HEADER), [list(row) for row in result.rows()],
                                                  "Coherence is the median over lines and responses: 1 without noise."))
    report = _with_responses(report, result)
    report = with_checks(report, result.driving, result.pairs)
    return with_remarks(report, [*result.notes, *result.band.notes], warnings, doubts=result.doubts)


def records_page(result: HammerStudy | ShakerStudy, warnings: Sequence[str] = (), title: str = "Test") -> Report:
    """Return the page of a test by hammer or shaker.

    Examples
    --------
    Runs in ``examples/form_responses_of_hammer_blows.py``.
    """
    if isinstance(result, ShakerStudy):
        return shaker_page(result, warnings, title)
    return hammer_page(result, warnings, title)


def _with_responses(report: Report, result: ShakerStudy) -> Report:
    """Return the report with interval, phase and coherence of every response, up to `MAX_DRAWN_RESPONSES`."""
    frf, radius = result.frf.between(*result.band.ends), result.radius()
    inside = (result.frf.frequency >= result.band.low) & (result.frf.frequency <= result.band.high)
    pairs = [(k, i) for i in range(len(frf.inputs)) for k in range(len(frf.outputs))]
    for k, i in pairs[:MAX_DRAWN_RESPONSES]:
        parts = [Chart(bode({result.settings.estimator: frf.selected([k], [i])}))]
        if radius is not None:
            size, part = np.abs(frf.values[:, k, i]), radius[inside][:, k, i]
            # The axis is logarithmic: a band that reaches zero would have no lower edge.
            band = {"95 %": (size, np.maximum(size - part, 1e-3 * size), size + part)}
            quantity = f"{frf.quantity.capitalize()}, {frf.unit}"
            parts.insert(0, Chart(magnitude_bands(frf.frequency, band, quantity=quantity),
                                  "With the 95 % interval that the coherence leaves; errors of all blocks are not in it."))
        report = report.with_section(f"{frf.outputs[k]} under the force at {frf.inputs[i]}", *parts)
    if len(pairs) > MAX_DRAWN_RESPONSES:
        report = report.with_section("Further responses", f"The first {MAX_DRAWN_RESPONSES} of {len(pairs)} responses are "
                                     "drawn; all are saved with --save.")
    return report
