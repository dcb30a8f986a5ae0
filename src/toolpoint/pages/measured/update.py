"""The page of an update: parameters, modes, responses and shapes before and after, and the posterior where it was sampled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._rounding import NORMAL_QUANTILE_95, with_uncertainty
from toolpoint.machine import Machine, assemble
from toolpoint.plot import Chart, Listing, Report, ShapeView, Table
from toolpoint.plot.figures.measured.correlation import mac_matrix
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.figures.measured.posterior import posterior_corner
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.plot.shape_view.shape_pairs import partners, turn_alike
from toolpoint.studies.measured.machine_update import Agreement, MachineUpdate
from toolpoint.studies.measured.measured_update import MeasuredUpdate, unscale_covariance
from toolpoint.updating.fits.sampler import Samples
from toolpoint.updating.residuals import track_modes
from toolpoint.vibration import Frf, Modes, correlation, eigen, frequency_response

_MAX_DRAWN_UPDATES = 4  # responses drawn


def update_page(result: MeasuredUpdate, warnings: Sequence[str] = ()) -> Report:
    """Return the page of an update of a machine to measurements.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 4e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.03))
    >>> from toolpoint.machine import assemble
    >>> from toolpoint.studies import Measurement, update_machine
    >>> from toolpoint.vibration import eigen
    >>> truth = machine.with_values({"joints.slide.stiffness.x": 1.2e7})
    >>> modes = eigen.solve_undamped(assemble(truth)).with_damping(0.03)
    >>> page = update_page(update_machine(machine, [Measurement(modes)], ["joints.slide.stiffness.x"]))
    >>> "(+20 %)" in page.summary
    True
    """
    original, updated, measured, samples = result.start_machine, result.update, result.measured, result.samples
    free = f"{len(updated.fit.free)} of {len(updated.problem.parameters)} parameters moved"
    status = updated.fit.status[:1].upper() + updated.fit.status[1:] + "."
    report = Report(f"Updated: {original.name}", f"{_answer(original, updated)}\n\n{status}", subtitle=free)
    report = report.with_section("Parameters", _parameters(original, updated),
                                 Listing("Identifiability, fit report and agreement", updated.report()))
    for k, part in enumerate(measured):
        measurement_text = f", measurement {k + 1}{' at ' + part.label if part.label else ''}" if len(measured) > 1 else ""
        b, a = updated.all_before[k], updated.all_after[k]
        if part.modes is not None:
            report = report.with_section(f"Modes before and after{measurement_text}", _agreement(b, a),
                                         *_mac((b, a), part.modes))
        if part.frf is not None:
            report = report.with_section(f"Responses before and after{measurement_text}", *_frac(b, a),
                                         *_responses(original, updated.machine, part.frf, part.pose))
    if samples is not None:
        report = report.with_section("Posterior", *_posterior(updated, samples))
    report = report.with_section("Shapes before and after", _shapes(original, updated, measured[0].pose))
    return report.with_doubts(*result.doubts, *warnings).with_assumptions(
        "Only the parameters of the table may move; everything else of the machine file is taken as exact, so an error there "
        "shows up in what moves.", "Standard errors are of the fit's linearisation at the value found.")


def spring_unit(path: str) -> str:
    """Return the SI unit of a joint's stiffness by its path, nothing for another number.

    >>> spring_unit("joints.foot.stiffness.rx"), spring_unit("bodies.bed.mass")
    ('N m/rad', '')
    """
    parts = path.split(".")
    return ("N m/rad" if parts[-1].startswith("r") else "N/m") if parts[-2:-1] == ["stiffness"] else ""


def _relative_change(original: Machine, updated: MachineUpdate, name: str) -> float:
    old, value = original.value(name), updated.machine.value(name)
    return abs(value / old - 1) if old else np.inf


def _answer(original: Machine, updated: MachineUpdate) -> str:
    """Return what moved by more than its interval, most first, by how much and how surely, and what the agreement became."""
    changes, count = [], len(updated.fit.free)
    for name in sorted(updated.fit.free, key=lambda name: -_relative_change(original, updated, name)):
        old, value = original.value(name), updated.machine.value(name)
        half_width = NORMAL_QUANTILE_95 * updated.fit.standard_error[name]
        change = f" ({100 * (value / old - 1):+.2g} %)" if old else ""
        if not abs(value - old) <= half_width:
            changes.append(f"{name} to {with_uncertainty(value, half_width, spring_unit(name))}{change}")
    change_text = "; ".join(changes[:3]) + (f"; and {len(changes) - 3} more" if len(changes) > 3 else "")
    words = (f"The data move {change_text}, 95 %" if changes else
             "The data move no parameter by more than its 95 % interval" if count else "The data move no parameter")
    if changes and count > len(changes):
        words += (f"; {count - len(changes)} {'others stay' if count - len(changes) > 1 else 'other stays'} within "
                  f"{'their intervals' if count - len(changes) > 1 else 'its interval'}")
    b, a = updated.before, updated.after
    if a.modes.size:
        words += (f". The largest frequency error falls from {100 * np.abs(b.frequency_error).max():.1f} to "
                  f"{100 * np.abs(a.frequency_error).max():.1f} %")
    return words + "."


def _posterior(updated: MachineUpdate, samples: Samples) -> list[Table | Chart | str]:
    rows, fit = [], unscale_covariance(updated.fit)
    for k, name in enumerate(samples.names):
        lower_end, upper_end = samples.interval(name)
        normal_lower, normal_upper = fit.interval(name)
        rows.append([name, f"{np.median(samples.values[:, k]):.6g}", f"{lower_end:.6g} .. {upper_end:.6g}",
                     f"{normal_lower:.6g} .. {normal_upper:.6g}",
                     f"{samples.r_hat[k]:.4f}", f"{samples.effective[k]:.0f}"])
    header = ["parameter", "median", "95 % of the samples", "95 % of the normal posterior", "R-hat", "independent samples"]
    table = Table(header, rows, "SI units; both intervals with the deviations of the data as they are given or assumed")
    best = np.array([fit.values[name] for name in samples.names])
    change = 100 * (samples.values / best - 1)
    sd = 100 * np.array([fit.standard_error[name] for name in samples.names]) / np.abs(best)
    short = [".".join(name.split(".")[1:]).replace(".stiffness", "") + ", %" for name in samples.names]
    chart = posterior_corner(change, short, (np.zeros(len(best)), sd))
    first_text = "" if len(best) <= 6 else f" The first 6 of {len(best)} parameters."
    return [samples.status[:1].upper() + samples.status[1:] + ".", table, Chart(
        chart, "Difference from the value found, per cent. Bars: samples; line: the fit's normal posterior." + first_text)]


def _parameters(original: Machine, updated: MachineUpdate) -> Table:
    rows = []
    for path in (p.name for p in updated.problem.parameters):
        old, new = original.value(path), updated.machine.value(path)
        is_free = path in updated.fit.free
        error = f"± {updated.fit.standard_error[path]:.2g}" if is_free else ""
        verdict = ("moved, at a bound" if path in updated.fit.at_bounds else "moved") if is_free else (
            "left alone: " + updated.fit.left_alone.get(path, ""))
        rows.append([path, f"{old:.6g}", f"{new:.6g}", error, f"{100 * (new / old - 1):+.2f}" if old else "", verdict])
    return Table(["parameter", "before", "after", "standard error", "change, %", "verdict"], rows, "SI units")


def _agreement(b: Agreement, a: Agreement) -> Table:
    rows = [[r + 1, f"{b.measured[r]:.2f}", f"{b.predicted[r]:.2f}", f"{100 * b.frequency_error[r]:+.2f}", f"{b.mac[r]:.3f}",
             f"{a.predicted[r]:.2f}", f"{100 * a.frequency_error[r]:+.2f}", f"{a.mac[r]:.3f}"] for r in range(b.measured.size)]
    return Table(["mode", "measured, Hz", "before, Hz", "before, %", "before MAC", "after, Hz", "after, %", "after MAC"], rows)


def _mac(pair: tuple[Agreement, ...], measured: Modes) -> list[Chart]:
    charts = []
    for words, agreed in zip(("before", "after"), pair, strict=True):
        assert agreed.candidates is not None
        # All modes up to the last paired one, and at least two more than were measured: an exchange of neighbours stays in
        # sight.
        count = max(int(agreed.modes.max()) + 1, min(measured.count + 2, agreed.candidates.count))
        candidates = agreed.candidates.selected(list(range(count)))
        modes = replace(candidates, shape=candidates.shape_at(measured.dofs), dofs=measured.dofs)
        pairs = np.stack([np.arange(agreed.modes.size), agreed.modes], axis=1)
        charts.append(Chart(mac_matrix(
            correlation.mac(measured.shape, modes.shape), measured, modes, row_title="Measured mode",
            column_title="Mode of the model", title=f"MAC {words}", pairs=pairs), "Paired modes are framed."))
    return charts


def _frac(b: Agreement, a: Agreement) -> list[Table]:
    if b.frac is None or a.frac is None:
        return []
    rows = [[name, *agreement.frac_words] for name, agreement in (("before", b), ("after", a))]
    left_out = f"; {a.silent} of {a.frac.size} hold no more than noise and are left out" if a.silent else ""
    return [Table(["FRAC", "lowest", "mean"], rows, f"Over all measured responses and lines{left_out}")]


def _shapes(original: Machine, updated: MachineUpdate, pose: Mapping[str, float] | None) -> ShapeView:
    scene, shapes = machine_shapes(original, pose, original.size)
    updated_scene, updated_shapes = machine_shapes(updated.machine, pose, original.size)
    if updated.before.modes.size:
        shapes = shapes.selected(_undamped(original, updated.before, pose))
        updated_shapes = updated_shapes.selected(_undamped(updated.machine, updated.after, pose))
    else:
        # Without measured modes nothing was paired: the lowest are shown, each beside its nearest shape after the update.
        shapes = shapes.selected(range(min(12, shapes.count)))
        updated_shapes = updated_shapes.selected(partners(shapes, updated_shapes))
    return ShapeView(scene, shapes, "pair", "before", "Shapes that belong to one measured mode, or else look alike.",
                     (updated_scene, turn_alike(updated_shapes, shapes), "after"))


def _undamped(machine: Machine, agreement: Agreement, pose: Mapping[str, float] | None) -> list[int]:
    """Return which undamped modes, whose shapes the view draws, are those that were paired."""
    damped = agreement.partners
    assert damped is not None
    # Pairs are of damped modes, which have no shape that stands still; the view draws the undamped modes nearest to them.
    undamped = eigen.solve_undamped(assemble(machine, pose, damped.dofs, modal_damping=False))
    return [int(i) for i in track_modes(damped, undamped).model]


def _responses(original: Machine, updated: Machine, measured: Frf, pose: Mapping[str, float] | None) -> list[Chart]:
    # A receptance at 0 Hz divides an acceleration by zero.
    lines = measured if measured.frequency[0] > 0 else measured.between(float(measured.frequency[1]), np.inf)
    lines = lines.converted_to("receptance")
    charts = []
    for k in range(min(_MAX_DRAWN_UPDATES, len(lines.outputs))):
        # Three responses are compared; a coherence has the measured one alone.
        single = replace(lines.selected([k], [0]), coherence=None)
        named = {"measured": single}
        for words, machine in (("before", original), ("after", updated)):
            system = assemble(machine, pose, single.outputs, inputs=single.inputs)
            named[words] = frequency_response.direct(system, single.frequency)
        charts.append(Chart(bode(named, title=f"{single.outputs[0]} / {single.inputs[0]}")))
    return charts
