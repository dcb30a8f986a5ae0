"""The page of a modal identification: the modes, why they are believed, the choice of poles, every response's fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import doubts_among
from toolpoint._rounding import number_text, with_uncertainty
from toolpoint.modal_identification import Identification, Significance, cmif, mean_phase_deviation, mvmif, phase_collinearity
from toolpoint.pages.measured.data_quality import with_phase_collinearity, with_quality_of_data
from toolpoint.pages.measured.pole_shapes import pole_shapes
from toolpoint.plot import AnimatedShapes, Cell, Chart, Notes, PolePicker, Report, ShapeView, Table
from toolpoint.plot.figures.measured.identification import (
    fits_by_name,
    response_residuals,
    sums_and_indicators,
)
from toolpoint.plot.figures.measured.stabilization import stabilization
from toolpoint.plot.shape_view.hulls import drawn_points
from toolpoint.vibration.geometry import Geometry

_MAX_ANSWER_MODES = 5  # modes in the answer
_HEADLINE_SHARE = 5e-4  # of a frequency: an interval that is wider stands in the headline


def identification_page(result: Identification, geometry: Geometry | None = None, names: Sequence[str] = (),
                         *, warnings: Sequence[str] = (), command: str = "",
                         components: Mapping[str, Sequence[str | int]] | None = None) -> Report:
    """Return the page of an identification.

    command : the one that made it, without a choice of poles; components : to the points on each, whose hulls are drawn.

    >>> import numpy as np
    >>> from toolpoint.modal_identification import identify
    >>> from toolpoint.vibration import Modes, frequency_response
    >>> modes = Modes([60.0, 100.0], [0.01, 0.02], [[0.1, 0.05]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(30.0, 150.0, 0.25), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> page = identification_page(identify(frf))
    >>> page.summary.split(":")[0]
    '2 modes, of which 2 stand out'
    """
    report = Report("Modal identification", answer(result), subtitle=", ".join(names))
    report = report.with_doubts(*result.doubts, *warnings, *doubts_among(result.frf.notes))
    report = report.with_section("Modes", _table(result), Notes(mark_lines(result), "note", "What the marks say"),
                                 *([Notes(result.advice, "warning", "What to try next")] if result.advice else []))
    if result.notes:
        words = Notes(list(result.notes), "assumed", "What was left out, corrected or assumed")
        report = report.with_section("Responses", words)
    if result.tool_motion is not None:
        report = report.with_section("Tool against table", result.tool_motion.status, _tool_motion(result.tool_motion))
    if geometry is not None:
        scene = drawn_points(geometry, components)
        report = report.with_section("Mode shapes", ShapeView(scene, AnimatedShapes.from_modes(result.modes, geometry.points),
                                                              "modes", "Identified modes"))
    command = _with_band(command or f"toolpoint identify {' '.join(names)}", result.frf.frequency)
    report = _with_choice(report, result, geometry, command=command, components=components)
    report = report.with_section(
        "Sum of the responses, and mode indicators", Chart(
            sums_and_indicators(result, cmif(result.frf), mvmif(result.frf)),
            "A peak of the sum and of CMIF 1, and a dip of MvMIF 1, is a mode; a second high CMIF or low MvMIF a repeated one. "
            "Dotted: the modes.", name="indicators"))
    report = report.with_section("Fit of every response", fits_by_name(result), Chart(
        response_residuals(result), "The responses that are fitted worst." if result.quality.size > 1 else "",
        name="residuals", narrowest=480))
    report = with_quality_of_data(report, result)
    report = with_phase_collinearity(report, result)
    return report.with_assumptions(
        "The structure is linear and does not change during the test; its modes are common to all responses.",
        "Intervals hold noise, and what moves when the band is cut where the residual is no noise; they do not hold wrong "
        "calibration, sensors that load the structure, or a structure that is not linear.",
        f"Method: {result.method}, {result.frf.frequency[0]:g} to {result.frf.frequency[-1]:g} Hz.")


def answer(result: Identification) -> str:
    """Return the modes with their intervals in a sentence, and how many of them are doubtful."""
    modes, count = result.modes, result.modes.count
    # The answer counts what can be relied on; doubtful modes stand in the table with their marks.
    certain_modes = [i for i in range(count) if not result.doubtful[i]]
    answer_modes = sorted(result.dominant.tolist() or certain_modes, key=lambda i: float(modes.frequency[i]))
    half_width = modes.frequency_interval if modes.covariance is not None else None
    # A headline has four digits; an interval that takes one of them, or is not known, stands beside them.
    widths = np.zeros(count) if half_width is None else np.asarray(half_width)
    is_narrow = widths <= _HEADLINE_SHARE * modes.frequency
    parts = [(f"{number_text(float(modes.frequency[i]))} Hz" if is_narrow[i] else
              with_uncertainty(float(modes.frequency[i]), float(widths[i]), "Hz"))
             + f" ({100 * float(modes.damping_ratio[i]):.2f} %)" for i in answer_modes[:_MAX_ANSWER_MODES]]
    words = f"{count} mode{'s' * (count != 1)}"
    if parts:
        verb = "stand out" if len(answer_modes) != 1 else "stands out"
        further_text = f" and {len(answer_modes) - _MAX_ANSWER_MODES} more" if len(answer_modes) > _MAX_ANSWER_MODES else ""
        verb = verb if result.dominant.size else "are not doubtful"
        words += f", of which {len(answer_modes)} {verb}: {', '.join(parts)}{further_text}"
        words += " (damping in brackets)" if half_width is not None else " (damping in brackets; no intervals)"
    doubtful = int(result.doubtful.sum())
    return words + (f". {doubtful} {'is' if doubtful == 1 else 'are'} doubtful." if doubtful else ".")


def mark_lines(result: Identification) -> list[str]:
    """Return the meaning of the table's marks, and the reasons for the marks of single modes."""
    lines = ["stands out: it moves the responses at its frequency more than all others together; the strongest of those that "
             "overlap and look alike carries the mark",
             "no mark: a mode of its own, but others carry more of the responses at its frequency (see its share)",
             "doubtful: faint, or it does not stand out while the residual is no noise, or it vanishes when the band is cut"]
    strongest = {i: r.strongest for r in result.resonances for i in r.modes if i != r.strongest}
    for i, k in strongest.items():
        lines.append(f"mode {i + 1} ({result.modes.frequency[i]:.4g} Hz) overlaps with mode {k + 1} and looks like it: both "
                     "describe one resonance, and the share is that of both")
    return lines


def _table(result: Identification) -> Table:
    modes = result.modes
    halves = (modes.frequency_interval, 100 * modes.damping_interval) if modes.covariance is not None else (None, None)
    collinear, deviation = phase_collinearity(modes.shape), mean_phase_deviation(modes.shape)
    strongest = set(result.dominant.tolist())
    rows: list[list[object]] = []
    for i in range(modes.count):
        mark = "doubtful" if result.doubtful[i] else "good" if i in strongest else ""
        word = {"doubtful": "doubtful", "good": "stands out", "": "no mark"}[mark]
        cells = [Cell(float(value[i]), uncertainty=None if half is None else float(half[i]))
                 for value, half in zip((modes.frequency, 100 * modes.damping_ratio), halves, strict=True)]
        rows.append([i + 1, *cells, f"{100 * float(result.share[i]):.0f}", f"{100 * float(result.mode_quality[i]):.2f}",
                     f"{collinear[i]:.3f}", f"{deviation[i]:.1f}", Cell(word, mark)])
    interval = " (95 %)" if modes.covariance is not None else ""
    header = ["mode", f"frequency, Hz{interval}", f"damping, %{interval}", "share, %", "fit, %", "MPC", "MPD, °", "mark"]
    caption = ("Share: of the responses at its frequency that a mode moves, with neighbours that overlap and look like it. "
               "MPC: phase collinearity, 1 for a real shape; MPD: mean phase deviation.")
    return Table(header, rows, caption, digits=5)


def _tool_motion(motion: Significance) -> Table:
    return Table(motion.header, motion.rows(), f"Peak of {motion.points[0]} against {motion.points[1]} at the mode's own "
                 "resonance, along every direction in which both were measured. Share: of the highest mode along a direction, "
                 "the largest of the directions; selected from a tenth on.")


def _with_band(command: str, lines: FloatArray) -> str:
    """Return the command with the band that was used where it names none, in the fewest digits that hold the same lines."""
    if "--band" in command or lines.size < 2:
        return command
    # Digits by the spacing of the lines: fewer, and two lines of a narrow chart would get one place.
    digits = max(0, math.ceil(-math.log10(0.4 * float(np.diff(lines).min()))))
    band_start, band_end = math.floor(lines[0] * 10**digits) / 10**digits, math.ceil(lines[-1] * 10**digits) / 10**digits
    return f"{command} --band {band_start:.{digits}f}:{band_end:.{digits}f}"


def _with_choice(report: Report, result: Identification, geometry: Geometry | None, *, command: str,
                 components: Mapping[str, Sequence[str | int]] | None) -> Report:
    """Return the report with the diagram, the shapes of its poles, and the choice of poles."""
    if result.diagram is None:
        return report
    shapes, view = (None, None) if geometry is None else pole_shapes(result, geometry, components)
    chosen = result.choice
    picker = PolePicker("stabilization", list(zip(result.modes.frequency.tolist(), result.modes.damping_ratio.tolist(),
                                                  strict=True)), command,
                        removed=() if chosen is None else chosen.remove)
    if chosen is not None and chosen.add:
        others = [k for k in range(result.modes.count) if k not in _added(result)]
        picker = PolePicker(picker.chart, [picker.modes[k] for k in others], command,
                            [(pole.frequency, pole.damping_ratio) for pole in chosen.add], chosen.remove)
    words = ("A click on a pole adds it; a click on a mode (triangle at the foot), or its tick below, removes it. The command "
             "and the file below then bring the same again.")
    chart = Chart(stabilization(result.diagram, cmif(result.frf), shapes, modes=[f for f, _ in picker.modes]),
                  "A click on a stable pole shows its shape too." if view is not None else "", "stabilization",
                  "poles" if view is not None else "")
    return report.with_section("Stabilization diagram and choice of poles", words, chart, picker,
                               *([view] if view is not None else []))


def _added(result: Identification) -> set[int]:
    """Return the modes that added poles became."""
    poles = () if result.choice is None else result.choice.add
    return {int(np.argmin(np.abs(result.modes.frequency - pole.frequency))) for pole in poles}
