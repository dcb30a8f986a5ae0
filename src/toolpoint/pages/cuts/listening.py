"""The page of a listened cut: the answer, speeds to try, spectrogram, named lines, growth, once-per-turn samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.cuts.listening import draw_spectrum, growth_chart, spectrogram, turn_samples
from toolpoint.signals.orders.growth import sample_each_turn
from toolpoint.studies.listening.listened_cut import CHATTER, NO_CHATTER, ListenedCut

MIN_SHOWN_HARMONICS = 6  # tooth passings that the charts show at least
MAX_MARKED_LINES = 12  # chatter lines marked in the spectrogram, the strongest
LINES_MARGIN = 1.3  # of the highest strong line


def listening_page(result: ListenedCut, warnings: Sequence[str] = (), name: str = "") -> Report:
    """Return the page of a listened cut.

    >>> import numpy as np
    >>> from toolpoint.studies import listen
    >>> from toolpoint.vibration import Record
    >>> time = np.arange(12_000) / 16_000
    >>> cut = sum(np.cos(2 * np.pi * 533.6 * k * time + k) / k for k in range(1, 9))
    >>> sound = cut + 0.05 * np.random.default_rng(0).standard_normal(time.size)
    >>> page = listening_page(listen(Record(sound[:, None], 16_000.0, ["microphone:+x"], ("",)), teeth=4, speed=8004.0))
    >>> page.summary[:26]
    'No chatter at 8004 rev/min'
    """
    e = result.evidence
    report = Report("Chatter by ear", result.answer(), subtitle=f"{name}{': ' if name else ''}{e.teeth} teeth, "
                                                                f"{e.speed.speed:.0f} rev/min, {e.duration:.2g} s of cut")
    if result.speeds:
        rows = [[f"{s.speed:.0f}", f"{s.lower:.0f} to {s.upper:.0f}", s.lobe] for s in result.speeds]
        report = report.with_section("Speeds to try", Table(["rev/min", "interval", "lobe"], rows,
                                                            "Tooth passing at a whole fraction of the mode's frequency; the "
                                                            "interval is that of damping ratios from 1 to 5 %. The fastest has "
                                                            "the widest pocket."))
    report = report.with_section("Result", Table(["quantity", "value"], result.numbers()), f"Because {result.reason}.")
    highest, start = _highest(result), e.part.first / e.rate
    family = result.evidence.family if result.verdict != NO_CHATTER else None
    lines = None if family is None else family.lines
    marked = np.zeros(0) if lines is None else lines.frequency[:MAX_MARKED_LINES]
    sound = Chart(spectrogram(e.samples, e.rate, e.tooth, chatter=marked, highest=highest, start=start),
                  "The cut over time; tooth passings and chatter lines are marked at the right edge.")
    report = report.with_section("Spectrogram", sound)
    named = draw_spectrum(e.spectrum, e.tooth, lines, background=e.background, highest=highest)
    report = report.with_section("Spectrum", Chart(named), Table(["Hz", "order", "dB", "what"], result.line_rows(),
                                                                 "The strongest lines; order is over the spindle's frequency."))
    if result.course is not None and result.verdict == CHATTER:
        report = report.with_section("Growth", Chart(growth_chart(result.course, start, result.onset_time)))
    points = sample_each_turn(e.samples, e.rate, e.speed.frequency)
    report = report.with_section("Once-per-revolution samples", Chart(
        turn_samples(points), "A cluster where the cut repeats, a closed curve or a cloud in Hopf chatter, two clusters in a "
                              "flip; noise blurs each."))
    return with_remarks(report, [*result.doubts, *result.notes], warnings)


def _highest(result: ListenedCut) -> float:
    """End of the frequencies shown, Hz."""
    e, lines = result.evidence, result.evidence.spectrum.lines()
    strong = lines.frequency[lines.power > 1e-3 * lines.power.max()] if lines.power.size else np.zeros(0)
    limit = max(float(strong.max(initial=0.0)) * LINES_MARGIN, MIN_SHOWN_HARMONICS * e.tooth)
    return float(min(limit, e.spectrum.frequency[-1]))
