"""The page of a hammer test: the answer, doubts, every hit, force, responses with coherence and estimators, checks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.plot import Cell, Chart, Notes, Report, Table
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.figures.measured.hits import PulseCurve, force_pulses, force_spectra
from toolpoint.plot.figures.measured.response_bands import magnitude_bands
from toolpoint.signals.checks import Reciprocity
from toolpoint.signals.driving_doubts import DrivingPointCheck
from toolpoint.studies.measured.hammer_study import HEADER, HammerStudy, HitVerdict

WIDTHS_BEFORE_PEAK, WIDTHS_AFTER_PEAK = 4, 20  # pulse widths drawn before and after a peak
GROWING_RELOAD_SECONDS = 3  # s between two loadings of the page of a test that is still struck
MAX_DRAWN_RESPONSES = 12  # responses drawn


def hammer_page(result: HammerStudy, warnings: Sequence[str] = (), title: str = "Hammer test", *, is_growing: bool = False
                ) -> Report:
    """Return the page of a hammer test; a browser reloads that of one that is still struck.

    >>> import numpy as np
    >>> from toolpoint.studies import study_hammer_records
    >>> from toolpoint.studies.machines.virtual_test import Hammer, hammer_records
    >>> from toolpoint.vibration import Modes
    >>> hammer = Hammer(contact=1e-3, force=100.0, hits=3, block=0.5, sample_rate=2048.0)
    >>> tip = Modes([200.0], [0.03], [[0.2]], ["tip:+x"])
    >>> record = hammer_records(tip, "tip:+x", ["tip:+x"], rng=np.random.default_rng(1), hammer=hammer)
    >>> hammer_page(study_hammer_records([record])).title
    'Hammer test'
    """
    report = Report(title, result.status, reload_seconds=GROWING_RELOAD_SECONDS if is_growing else 0)
    if result.doubts:
        report = report.with_section("Doubts", Notes(list(result.doubts), "warning", "Look at these first"))
    rows = [[v.name, str(v.struck), float(f"{v.hit.force:.4g}"), Cell(v.verdict, "good" if v.hit.accepted else "doubtful"),
             "; ".join(v.hit.reasons)] for v in result.verdicts]
    pulses = Chart(force_pulses([_pulse(v) for v in result.verdicts]),
                   "Forces about their peaks; refused hits are dashed and red.")
    report = report.with_section("Hits", Table(list(HEADER), rows), pulses)
    report = report.with_section("Force", _spectra(result))
    report = _with_responses(report, result)
    report = with_checks(report, result.driving, result.pairs)
    return with_remarks(report, [*result.notes, *result.band.notes], warnings, doubts=result.doubts)


def with_remarks(report: Report, notes: Sequence[str], warnings: Sequence[str], *, doubts: Sequence[Doubt]) -> Report:
    """Return the report with what was assumed and done, behind the warnings that stand nowhere else."""
    lines = [line for line in dict.fromkeys(warnings) if line not in (*doubts, *notes)]
    parts = [Notes(lines, "warning")] if lines else []
    return report.with_section("What was assumed and done", *parts, Notes(list(notes), "assumed"))


def _pulse(verdict: HitVerdict) -> PulseCurve:
    """Return the force of a hit about its peak."""
    hit, record = verdict.hit, verdict.record
    channel = record.quantities.index("force")
    width = max(hit.pulse - hit.peak, 3)
    first, last = max(hit.peak - WIDTHS_BEFORE_PEAK * width, 0), min(hit.peak + WIDTHS_AFTER_PEAK * width,
                                                                     record.samples.shape[0])
    time = (np.arange(first, last) - hit.peak) / record.sample_rate
    return PulseCurve(verdict.name, 1e3 * time, record.samples[first:last, channel], hit.accepted)


def _spectra(result: HammerStudy) -> Chart:
    spectra = [(f"struck at {test.frf.inputs[0]}", test.force_spectrum) for test in result.tests[:MAX_DRAWN_RESPONSES]]
    return Chart(force_spectra(result.frf.frequency, spectra, result.band.ends),
                 f"Rms over the hits used. Shaded: the band to be believed, {result.band.low:.4g} to {result.band.high:.4g} "
                 "Hz.")


def _with_responses(report: Report, result: HammerStudy) -> Report:
    """Return the report with response, coherence and intervals of every output, up to `MAX_DRAWN_RESPONSES`."""
    count = 0
    for test in result.tests:
        frf, radius = test.frf.between(*result.band.ends), test.radius()
        inside = (test.frf.frequency >= result.band.low) & (test.frf.frequency <= result.band.high)
        for k, output in enumerate(frf.outputs):
            if count == MAX_DRAWN_RESPONSES:
                words = f"The first {MAX_DRAWN_RESPONSES} responses are drawn; all are saved with --save."
                return report.with_section("Further responses", words)
            count += 1
            estimates = {name: test.estimated_by(name).between(*result.band.ends).selected([k]) for name in ("H1", "H2", "Hv")}
            # With one hit H1, H2 and Hv are equal.
            parts = [Chart(bode(estimates if test.used > 1 else {"H1": estimates["H1"]}))]
            if radius is not None:
                size = np.abs(frf.values[:, k, 0])
                part = radius[inside][:, k, 0]
                # The axis is logarithmic: a band that reaches zero would have no lower edge.
                band = {"95 %": (size, np.maximum(size - part, 1e-3 * size), size + part)}
                parts.insert(0, Chart(magnitude_bands(frf.frequency, band, quantity=f"{frf.quantity.capitalize()}, "
                                                                                    f"{frf.unit}"), "With the 95 % interval "
                                                                                                    "from the scatter of the "
                                                                                                    "hits."))
            report = report.with_section(f"{output} struck at {frf.inputs[0]}", *parts)
    return report


def with_checks(report: Report, driving: Sequence[DrivingPointCheck], pairs: Sequence[Reciprocity]) -> Report:
    """Return the report with the checks of driving points and reciprocity."""
    parts = []
    if driving:
        parts.append(Table(["driving point", "power taken in, %", ""],
                           [[str(check.dof), round(100 * check.share, 1), check.doubts[0] if check.doubts else "as it must be"]
                            for check in driving],
                           "Of a passive structure all lines take in power: 100 %. Only lines that can be believed are asked."))
    if pairs:
        parts.append(Table(["pair", "agreement", "ratio", ""],
                           [[f"{pair.first} / {pair.second}", round(pair.agreement, 4), round(pair.ratio, 4),
                             "reciprocal" if pair.holds else "not reciprocal"] for pair in pairs],
                           "H(a, b) beside H(b, a): agreement and ratio are 1 in a linear structure."))
    return report.with_section("Checks", *parts) if parts else report
