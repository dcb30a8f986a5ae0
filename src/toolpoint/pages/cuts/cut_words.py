"""Words of a cut on a page: tool, arc, coefficients and dynamics as a shop writes them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint._rounding import number_text, text_below
from toolpoint.cutting import MillingProblem, StabilityChart
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.stability.lowest import LowestLimit
from toolpoint.plot import Chart, Table
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.vibration import Dof, Frf


def problem_words(problem: MillingProblem) -> str:
    """Return tool, arc of cut and coefficients in one line."""
    k = problem.coefficients
    parts = [inside(problem.tool), "engaged " + inside(problem.engagement).replace("..", " to "),
             f"K_t {k.kt / 1e6:g}, K_n {k.kn / 1e6:g}" + (f", K_a {k.ka / 1e6:g}" if k.ka else "") + " N/mm^2"]
    return ", ".join(parts)


def plane_words(plane: PlaneDynamics) -> str:
    """Return the dynamics in words: modes, or lines that were measured."""
    if plane.is_modal:
        f = np.abs(plane.poles) / (2 * np.pi)
        # Modes of both directions with one frequency read as a range of nothing otherwise.
        frequency_text = f"{f.min():.4g}" if np.ptp(f) < 1e-3 * f.max() else f"{f.min():.4g} to {f.max():.4g}"
        return f"{f.size} mode{'s' if f.size > 1 else ''}, {frequency_text} Hz"
    lines = plane.lines[0]
    return f"{lines.size} measured lines, {lines[0]:.4g} to {lines[-1]:.4g} Hz"


def dynamics_parts(plane: PlaneDynamics) -> list[Chart | Table | str]:
    """Return the dynamics that a chart stands on: the response along x and y, and the modes with their stiffness."""
    frequency_min, frequency_max = plane.span
    # Beyond the outer modes, so that their flanks and the static response are seen.
    f = np.linspace(max(0.3 * frequency_min, 1e-3 * frequency_max), 1.4 * frequency_max,
                    1500) if plane.is_modal else np.asarray(plane.frequency)
    values = plane.response(f)
    # A direction that was not given is zero on every line: it has no curve on a logarithmic axis.
    ways = [k for k in range(plane.size) if np.abs(values[:, k, k]).max() > 0]
    responses = {"xyz"[k]: Frf(f, values[:, k:k + 1, k:k + 1], (Dof("tool", f"+{'xyz'[k]}"),), (Dof("tool", f"+{'xyz'[k]}"),))
                 for k in ways}
    parts: list[Chart | Table | str] = [
        f"Response of the tool against the work: {plane_words(plane)}. x is the feed, y normal to it."]
    if responses:
        parts.append(Chart(bode({f"along {way}": frf for way, frf in responses.items()}), name="dynamics"))
    if plane.is_modal:
        parts.append(_mode_table(plane))
    return parts


def limit_sentence(chart: StabilityChart, lowest: LowestLimit | None = None, *, width: bool = False) -> str:
    """Return what is stable at every charted speed, and where it is least, in a sentence.

    The depth is below the limit by the stated error, and rounded down; with the `lowest` limit it holds between the speeds too.
    """
    quantity, speed_min, speed_max = "width" if width else "depth", chart.speeds.min(), chart.speeds.max()
    span = f"from {speed_min:.0f} to {speed_max:.0f} rev/min"
    limit = chart.limit
    if not np.isfinite(limit).any():
        return f"No limit was found {span}: every {quantity} up to {number_text(1e3 * chart.depth_max, digits=3)} mm is stable."
    if lowest is not None and np.isfinite(lowest.depth):
        return (f"A {quantity} of {text_below(1e3 * (lowest.depth - lowest.error))} mm is stable at every speed {span}; the "
                f"limit is least at {lowest.speed:.0f} rev/min; above it chatter begins at {lowest.frequency:.0f} Hz.")
    lowest_index = int(np.argmin(limit))
    point = int(chart.limit_points()[lowest_index])
    above = f"; above it chatter begins at {chart.frequency[point]:.0f} Hz" if point >= 0 else ""
    return (f"A {quantity} of {text_below(1e3 * float(chart.sure_limit.min()))} mm is stable at every charted speed {span}; "
            f"the limit is least at {chart.speeds[lowest_index]:.0f} rev/min{above}.")


def no_cut_words(withheld: Sequence[Doubt]) -> str:
    """Return that no cut is recommended, and why, in a sentence."""
    first = withheld[0]
    return f"No cut is recommended, as the dynamics are doubtful: {first.what}: {first.why}. Do this first: {first.remedy}."


def depth_answers(chart: StabilityChart) -> list[str]:
    """Return for every charted speed how deep a cut may be, and at which frequency chatter begins above."""
    answers = []
    points, limit = chart.limit_points(), chart.limit
    for i, speed in enumerate(chart.speeds):
        if not np.isfinite(limit[i]):
            answers.append(f"{speed:.0f} rev/min: no limit found up to {number_text(1e3 * chart.depth_max, digits=3)} mm.")
            continue
        words = f"{speed:.0f} rev/min: stable up to {text_below(1e3 * float(limit[i]))} mm"
        words += f", chatter above at {chart.frequency[points[i]]:.0f} Hz" if points[i] >= 0 else ""
        bands = [f"{1e3 * a:.3g} to {'the end of the chart' if b >= chart.depth_max else f'{1e3 * b:.3g} mm'}"
                 for a, b in chart.intervals(i) if a > 0]
        answers.append(words + (f"; again stable {', '.join(bands)}" if bands else "") + ".")
    return answers


def _mode_table(plane: PlaneDynamics) -> Table:
    """Return frequency, damping and modal stiffness of every mode of a plane's dynamics."""
    rows = []
    for k, pole in enumerate(plane.poles):
        omega, zeta = abs(pole), -pole.real / abs(pole)
        sizes = np.abs(np.diag(plane.residues[k]))
        # k of a direction: the mode alone has the peak 1/(2 k zeta) there, as its residue is 1/(2 i m w_d).
        smallest = 1e-9 * max(sizes.max(), 1e-300)
        stiffness = ["overdamped" if not pole.imag else "rigid" if r <= smallest else
                     f"{omega**2 / (2 * abs(pole.imag) * r) / 1e6:.4g}" for r in sizes]
        rows.append([k + 1, omega / (2 * np.pi), 100 * zeta, *stiffness])
    ways = "xyz"[:plane.size]
    return Table(["mode", "frequency, Hz", "damping, %", *(f"stiffness {way}, N/µm" for way in ways)], rows,
                 "Modes of the dynamics; stiffness: modal, seen from the tool")


def inside(part: object) -> str:
    """Return the words between the brackets of a noun's repr."""
    text = repr(part)
    return text[text.index("(") + 1:-1]
