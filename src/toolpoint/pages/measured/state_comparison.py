"""The page of two states of a machine: what moved in frequencies, shapes, responses and numbers, beside its noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.measured.correlation import mac_matrix
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.studies.measured.state_comparison import StateComparison
from toolpoint.vibration import correlation

_SHOWN_NUMBERS = 12  # numbers of machine files that are listed


def state_comparison_page(result: StateComparison, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a comparison of two states.

    >>> import numpy as np
    >>> from toolpoint.studies import compare_two_states
    >>> from toolpoint.vibration import Modes
    >>> may, june = (Modes([f, 120.0], 0.02, [[0.1, 0.05], [0.02, -0.1]], ["tool:+x", "tool:+y"]) for f in (80.0, 78.0))
    >>> result = compare_two_states(("May", (may, None)), ("June", (june, None)), rng=np.random.default_rng(1))
    >>> state_comparison_page(result).title
    'May and June: what moved'
    """
    older, newer = result.older, result.newer
    report = Report(f"{older.name} and {newer.name}: what moved", result.answer(),
                    subtitle=f"{older.modes.count} modes before, {newer.modes.count} after")
    header = ["mode", f"before: {older.name}, Hz", f"after: {newer.name}, Hz", "change, %", "95 %", "MAC",
              "MAC that noise leaves", "verdict"]
    table = Table(header, result.rows(), "Paired modes: a verdict only where an interval or a variance is known")
    single = result.single_lines()
    without_partner = [Notes(single, "warning", "Without partner")] if single else []
    report = report.with_section("Modes", table, *without_partner, _matrix(result))
    if result.points:
        rows = [[str(p.point), f"{100 * p.size:.3g}", "not known" if np.isnan(p.noise) else f"{100 * p.noise:.2g}",
                 "yes" if p.stands_out else ""] for p in result.points[:12]]
        report = report.with_section("Where shapes differ", Table(
            ["point", "difference, %", "noise gives, %", "stands out"], rows,
            "Rms over the paired modes, in per cent of each shape's largest entry; the second scaled to the first"))
    if result.frac is not None and older.frf is not None and newer.frf is not None:
        report = report.with_section("Responses", Notes([result.frac_line()], "note", "FRAC"), _responses(result))
    if result.numbers is not None:
        lines = [number.line(result.change) for number in result.numbers[:_SHOWN_NUMBERS]] or ["no number of a body or joint"]
        report = report.with_section("Numbers that differ", Notes(lines, "note", "Bodies and joints, SI"))
    return report.with_doubts(*result.doubts, *warnings).with_assumptions(
        "Modes are paired by MAC alone; a pair below the limit is none.",
        "Noise of points and lines is taken as independent of each other.",
        "Limits are those of 95 %: of twenty frequencies or shapes that did not change, one is said to have.")


def _matrix(result: StateComparison) -> Chart:
    """Return the MAC of all modes of both states at the points that both have."""
    older, newer = result.older.modes, result.newer.modes
    shared = [dof for dof in older.dofs if dof in newer.dofs]
    values = correlation.mac(older.shape_at(shared), newer.shape_at(shared))
    return Chart(mac_matrix(values, older, newer, row_title=f"Mode, {result.older.name}",
                            column_title=f"Mode, {result.newer.name}", pairs=result.pairs.pairs), "Paired modes are framed.")


def _responses(result: StateComparison) -> Chart:
    """Return the response that differs most in both states."""
    first, second = result.older.frf, result.newer.frf
    assert first is not None and second is not None and result.frac is not None
    outputs = [dof for dof in first.outputs if dof in second.outputs]
    inputs = [dof for dof in first.inputs if dof in second.inputs]
    i, j = np.unravel_index(int(result.frac.argmin()), result.frac.shape)
    drawn = {state.name: frf.selected([outputs[i]], [inputs[j]]).converted_to(first.quantity)
             for state, frf in ((result.older, first), (result.newer, second))}
    return Chart(bode(drawn), f"The response that differs most: {outputs[i]} to {inputs[j]}.")
