"""Parts of the page of a machine by finite elements: hammer test, sensitivities, effect of added mass, options, dampers."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.plot import Chart, Notes, ShapeView, Table
from toolpoint.plot.figures.measured.correlation import mac_matrix
from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.plot.shape_view.solid_values import values_on_part
from toolpoint.studies.finite_elements.hammer_test import FiniteElementTest
from toolpoint.studies.finite_elements.machine_options import HEADER as OPTION_HEADER
from toolpoint.studies.finite_elements.machine_options import option_rows
from toolpoint.studies.finite_elements.machine_study import FiniteElementStudy, damper_lines
from toolpoint.studies.finite_elements.nodal_correlation import HEADER as PAIR_HEADER
from toolpoint.studies.finite_elements.nodal_correlation import FiniteElementCorrelation
from toolpoint.studies.finite_elements.part_sensitivity import HEADER as PART_HEADER
from toolpoint.studies.finite_elements.part_sensitivity import PartSensitivity
from toolpoint.studies.finite_elements.shape_sensitivity import accumulate

Parts = list[Chart | Table | Notes | ShapeView | str]


def hammer_parts(correlation: FiniteElementCorrelation, test: FiniteElementTest) -> Parts:
    """Return the pairs with their coefficients, the MAC matrix, the coherence, and what costs MAC."""
    comparison = correlation.correlation
    c = comparison.coefficients
    points = comparison.points
    distance = 1e3 * np.array(list(points.distance.values()))
    parts: Parts = [
        f"Struck: {', '.join(map(str, test.struck))}; {len(points.pairs)} points of three directions in a frame of the test's "
        f"own; nodes were found by registration, {distance.mean():.1f} mm off in the mean. Modes were identified with nobody "
        "choosing.",
        Table(list(PAIR_HEADER), correlation.rows(), "Paired modes: MAC alone, MAC with the best mix of neighbouring shapes of "
              "the model, and the correlation coefficients")]
    if c is not None:
        mean_displacement, mean_mac = float(c.weight @ c.displacement), float(c.weight @ c.mac)
        parts.append(Table(["frequency, mean", "mass", "displacement", "MAC", "total"],
                           [[f"{v:.4f}" for v in (c.mean, c.mass, mean_displacement, mean_mac, c.total)]],
                           "Over all pairs, weighted by mass"))
    matrix = mac_matrix(comparison.mac, comparison.measured, comparison.predicted, row_title="Measured mode",
                        column_title="Mode of the model",
                        pairs=comparison.pairs.pairs, title="MAC")
    parts.append(Chart(matrix, "Paired modes are framed.", narrowest=640))
    parts.append(Chart(_coherence(test), "Median coherence of all responses; it falls where little moves."))
    lines = [*correlation.mixed_modes(), *(f"without {name} the MAC of pair {pair + 1} rises by {gain:.3f}"
                                           for name, pair, gain in correlation.worst_points(3) if gain > 1e-3)]
    return [*parts, Notes(lines, "note", "Where MAC is lost")] if lines else parts


def _coherence(test: FiniteElementTest) -> object:
    """Return the chart of the test's coherence over frequency."""
    chart = figure("", 300)
    chart.add_scatter(x=np.round(test.frf.frequency, 3), y=np.round(test.coherence, 4), line={"color": COLOURS[0]})
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="coherence", range=[0, 1.02])
    return chart


def slope_parts(sensitivity: PartSensitivity, part: str) -> Parts:
    """Return the sensitivities of frequencies, of a motion and of MAC to E and density: by part, and drawn on `part`.

    Mode 1 stands for all modes in the drawings; of the MAC values the lowest is drawn.
    """
    parts: Parts = [Table(list(PART_HEADER), sensitivity.rows(),
                          "Relative change of a frequency per relative change of a part's E "
                          "or density; the share of elements, and of the part's mass, that hold 80 % of its effect on mode 1"),
                    Chart(_accumulated(sensitivity),
                          "Elements from the one with the largest effect of E on mode 1 to the least.")]
    # A large element has a large effect because it is large: a cubic decimetre compares where material counts.
    volumes = _volumes(sensitivity, part)
    for name, values, what in (("stiffness", sensitivity.frequency[part].modulus[0], "E"),
                               ("inertia", sensitivity.frequency[part].density[0], "density")):
        parts.append(values_on_part(sensitivity.machine.parts[part], 100 * values / volumes, name=name, unit="% a dm³",
                                    title=f"Mode 1 by {what}, on the {part}"))
    parts += _motion_parts(sensitivity, part)
    if sensitivity.mac is not None and len(sensitivity.mac.values):
        k = int(np.argmin(sensitivity.mac.values))
        levers = "; ".join(sensitivity.mac_levers(k, 6))
        parts.append(f"{sensitivity.mac.names[k]} is the lowest, {sensitivity.mac.values[k]:.3f}. It moves most with {levers}: "
                     "a list of what to look at, not a proof of what is wrong.")
        parts.append(Chart(_mac_slopes(sensitivity),
                           "All of a part's E, all of its density, or all stiffness of a joint by 1 %."))
        values = sensitivity.mac.parts[part].modulus[k] / _volumes(sensitivity, part)
        parts.append(values_on_part(sensitivity.machine.parts[part], values, name="mac",
                                    unit="per dm³ and relative change of E",
                                    title=f"{sensitivity.mac.names[k]} by E, on the {part}"))
    return parts


def _motion_parts(sensitivity: PartSensitivity, part: str) -> Parts:
    """Return the effect of each part on the motion of the studied Dof, and that of each element of `part` in one mode.

    The modes are the first six that move the Dof by more than a tenth of the largest motion; the elements are those of the
    first of them.
    """
    # The change is relative: where a mode hardly moves the Dof it would be that of nearly nothing.
    moving_modes = np.flatnonzero(np.abs(sensitivity.motion.values) > 0.1 * np.abs(sensitivity.motion.values).max())[:6]
    share = 100 / sensitivity.motion.values[moving_modes]
    rows = [[name, *(f"{v:+.1f}" for v in e[moving_modes] * share), *(f"{v:+.1f}" for v in rho[moving_modes] * share)]
            for name, (e, rho) in sensitivity.motion.by_part().items()]
    numbers = [str(sensitivity.motion.modes[i] + 1) for i in moving_modes]
    place = sensitivity.motion.names[0].split(" in mode")[0]
    first = int(moving_modes[0])
    values = (100 * sensitivity.motion.parts[part].modulus[first] / sensitivity.motion.values[first]
              / _volumes(sensitivity, part))
    return [Table(["part", *(f"E, mode {n}" for n in numbers), *(f"density, mode {n}" for n in numbers)], rows,
                  f"Shapes at unit modal mass: change of the motion of the top ({place}), % for all of a part's E or density"),
            values_on_part(sensitivity.machine.parts[part], values, name="shape", unit="% a dm³",
                           title=f"{sensitivity.motion.names[first]} by E, on the {part}")]


def _volumes(sensitivity: PartSensitivity, part: str) -> FloatArray:
    """Return the volume of each element of a part, (e,), dm^3, in the order of blocks."""
    model = sensitivity.machine.parts[part]
    # Castings of cuboids have box elements along the axes, so the span of corners is their size; it is wrong for others.
    corners = [model.nodes[block.nodes[:, :block.kind.corner_count]] for block in model.blocks]
    return np.concatenate([np.prod(np.ptp(c, axis=1), axis=1) for c in corners]) * 1e3


def _accumulated(sensitivity: PartSensitivity) -> object:
    """Return the chart of the accumulated effect of E on mode 1 over the share of elements, a line for each part."""
    chart = figure("", 360)
    for i, (name, slopes) in enumerate(sensitivity.frequency.items()):
        values = accumulate(slopes.modulus[0])
        share = 100 * np.arange(1, len(values) + 1) / len(values)
        step = max(len(values) // 80, 1)  # some 80 points a line are enough for a screen
        chart.add_scatter(x=np.round(share[::step], 2), y=np.round(values[::step], 6), name=name, line={"color": COLOURS[i]})
    chart.update_xaxes(title_text="share of the part's elements, %")
    chart.update_yaxes(title_text="relative change of f1 per that of E")
    return chart


def _mac_slopes(sensitivity: PartSensitivity) -> object:
    """Return the chart of the change of MAC by +1 % of E, density or joint stiffness: the seven largest."""
    assert sensitivity.mac is not None
    chart = figure("", 420, barmode="group")
    modes = [f"mode {i + 1}" for i in sensitivity.mac.modes]
    rows = {f"E of {p}": m for p, (m, _) in sensitivity.mac.by_part().items()}
    rows |= {f"density of {p}": d for p, (_, d) in sensitivity.mac.by_part().items()}
    rows |= {f"stiffness of {j}": v for j, v in sensitivity.mac.joints.items()}
    # More than seven bars a mode cannot be told apart, on paper not at all.
    largest = sorted(rows, key=lambda name: -float(np.abs(rows[name]).max()))[:7]
    for i, name in enumerate(largest):
        chart.add_bar(x=modes, y=np.round(0.01 * rows[name], 6), name=name, marker={"color": COLOURS[i % len(COLOURS)]})
    chart.update_yaxes(title_text="change of MAC for +1 %")
    return chart


def gram_parts(study: FiniteElementStudy, part: str) -> Parts:
    """Return the change of the first frequency by thickening a wall, mHz/kg: best and worst of every part, and on `part`."""
    gains = 1e3 * study.whole_sensitivity.hertz_a_kilogram(part)[0]
    rows = [[name, f"{1e3 * best_gain:+.1f}", f"{1e3 * worst_gain:+.1f}"]
            for name, best_gain, worst_gain in study.whole_sensitivity.best_grams(0, len(study.machine.parts))]
    return [Table(["part", "best element, mHz/kg", "worst element, mHz/kg"], rows,
                  "Mode 1 for a kilogram that makes a wall thicker there: stiffness and mass together"),
            values_on_part(study.machine.parts[part], gains, name="grams", unit="mHz/kg", title=f"Mode 1, on the {part}")]


def alone_parts(sensitivity: PartSensitivity, part: str) -> Parts:
    """Return the modes of a part alone on its joints, with the effect of its E and density on frequency, motion and MAC."""
    e, rho = sensitivity.motion.by_part()[part]
    motion = 100 * np.array([e, rho]) / np.where(sensitivity.motion.values == 0, np.inf, sensitivity.motion.values)
    is_moving = np.abs(sensitivity.motion.values) > 0.05 * np.abs(sensitivity.motion.values).max()
    rows = []
    for i in range(len(sensitivity.motion.values)):
        slopes = sensitivity.frequency[part]
        modulus_effect, density_effect = slopes.modulus[i].sum(), slopes.density[i].sum()
        row = [str(i + 1), f"{sensitivity.pairs.frequency[i]:.2f}", f"{modulus_effect:+.3f}", f"{density_effect:+.3f}",
               *((f"{motion[0, i]:+.1f}", f"{motion[1, i]:+.1f}") if is_moving[i] else ("", ""))]
        if sensitivity.mac is not None:
            k = sensitivity.mac.modes.tolist().index(i) if i in sensitivity.mac.modes else None
            row += ["", ""] if k is None else [f"{sensitivity.mac.values[k]:.4f}",
                                               f"{sensitivity.mac.by_part()[part][0][k]:+.4f}"]
        rows.append(row)
    header = ["mode", "Hz", "f by E", "f by density", f"{sensitivity.motion.names[0].split(' in mode')[0]} by E, %",
              "by density, %"]
    header += ["MAC", "MAC by E"] if sensitivity.mac is not None else []
    share = sensitivity.holders(part, 0)
    slopes = 100 * sensitivity.frequency[part].modulus[0] / _volumes(sensitivity, part)
    note_parts: Parts = [Notes(list(sensitivity.motion.notes), "note")] if sensitivity.motion.notes else []
    return [f"On the springs of its foot, the rest of the machine gone; {100 * share[0]:.0f} % of its elements, "
            f"{100 * share[1]:.0f} % of its mass, hold 80 % of what E does to its first mode.",
            Table(header, rows, "Per relative change of all E or all density of the part; the motion is at unit modal mass, "
                  "left out where a mode hardly moves there"),
            values_on_part(sensitivity.machine.parts[part], slopes, name="alone", unit="% a dm³", title="Its mode 1 by E"),
            *note_parts]


def option_parts(study: FiniteElementStudy) -> Parts:
    """Return the options with their depths, and the lobes of the machine as it is and of the three best by mean depth."""
    cut = study.cut
    words = (f"{1e3 * cut.tool.diameter:.0f} mm, {cut.tool.teeth} teeth, {cut.engagement.direction}-milling at "
             f"{cut.engagement.immersion:g} of the diameter, feed {cut.feed}")
    rows = option_rows(study.base, study.every_option)
    return [f"Judged by the lobes of a face mill ({words}; {cut.coefficients.tangential or 0:.3g} N/m²).",
            Table(list(OPTION_HEADER), rows, "Changes against the machine as it is; least depth: stable at any speed; mean "
                  "depth: over the charted speeds"), Chart(_lobes(study))]


def _lobes(study: FiniteElementStudy) -> object:
    """Return the chart of stable depth (mm) over speed: the machine as it is, and the three best options."""
    chart = figure("Stable depth", 440)
    best = sorted(study.every_option, key=lambda option: -option.limit.mean)[:3]
    for i, option in enumerate((study.base, *best)):
        limit = option.limit.chart
        depth = 1e3 * np.minimum(limit.limit, limit.depth_max)
        chart.add_scatter(x=np.round(limit.speeds, 2), y=np.round(depth, 4), name=option.name, line={"color": COLOURS[i]})
    chart.update_xaxes(title_text="Spindle speed, rev/min")
    chart.update_yaxes(title_text="depth of cut, mm", rangemode="tozero")
    return chart


def damper_parts(study: FiniteElementStudy) -> Parts:
    """Return the chart of responses with the tuned and with the active damper, and a line of numbers for each."""
    return [Chart(_responses(study), "Both are tuned for the least depth of the cut, not for the peak."),
            Notes(damper_lines(study.dampers), "note")]


def _responses(study: FiniteElementStudy) -> object:
    """Return the chart of the response of the tool against the work along x, µm/N, without and with the dampers."""
    chart = figure("Tool against work along x", 420)
    for i, option in enumerate((study.base, *study.dampers.options)):
        values = 1e6 * np.abs(option.response.values[::2, 0, 0])
        chart.add_scatter(x=option.response.frequency[::2], y=values, name=option.name, line={"color": COLOURS[i]})
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="response, µm/N", type="log")
    return chart
