"""The page of a correlation: modes, points, places and bands in which a test and a machine differ."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.machine import Machine
from toolpoint.machine.pose.named_points import point_positions
from toolpoint.plot import AnimatedShapes, Chart, Notes, Report, Scene, ShapeView, Table
from toolpoint.plot.figures.machines.point_views import point_pairs, point_values
from toolpoint.plot.figures.measured.bands import frac_bands
from toolpoint.plot.figures.measured.correlation import mac_matrix
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.shape_view.hulls import HULL_WORDS, with_hulls
from toolpoint.plot.shape_view.shape_pairs import difference_of, turn_alike
from toolpoint.spatial import transform as tf
from toolpoint.studies.measured.measured_comparison import Comparison, MeasuredTest
from toolpoint.studies.measured.model_correlation import ModelCorrelation

Point = str | int
_DRAWN_RESPONSES = 4  # responses drawn, those that agree least


def correlation_page(result: Comparison, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a comparison of a machine with a test.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 4e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.03))
    >>> from toolpoint.machine import assemble
    >>> from toolpoint.studies import compare_with_test
    >>> from toolpoint.studies.measured.measured_comparison import MeasuredTest
    >>> from toolpoint.vibration import eigen
    >>> modes = eigen.solve_undamped(assemble(machine)).with_damping(0.03)
    >>> page = correlation_page(compare_with_test(machine, MeasuredTest(modes)))
    >>> page.summary.split(';')[0]
    '2 of 2 measured modes have a partner in the model'
    """
    now, machine, test = result.correlation, result.machine, result.test
    words = f"{_answer(now)} {len(now.points.pairs)} points are paired ({now.points.status})."
    report = Report(f"Test beside {machine.name}", words, subtitle=_tested(test))
    model = point_positions(machine, result.pose)
    report = report.with_section("Modes", *_mode_parts(result))
    if now.coefficients is not None:
        bodies = _bodies_of(machine, now.comac)
        report = report.with_section("Where they differ", *_place_parts(now, model, test, bodies))
        report = report.with_section("Shapes side by side", _shapes(now, model, test, bodies))
    if now.frac is not None:
        report = report.with_section("Responses", *_response_parts(result))
    report = report.with_section("Points", *_point_parts(now, model, test))
    return report.with_doubts(*now.doubts, *warnings).with_assumptions(
        "The measured modes are taken as they stand: their own intervals are not in MAC, COMAC and coefficients.",
        "Modes are paired by MAC and frequency together; a pair below the limit of MAC is none.",
        "The model's modes are undamped, at the pose named in the test.")


def _answer(now: ModelCorrelation) -> str:
    """Return how many modes agree, how far frequencies and shapes differ, and where the shapes differ most."""
    if now.coefficients is None or not len(now.pairs.pairs):
        return f"None of the {now.measured.count} measured modes has a partner in the model."
    ratio = np.array([now.predicted.frequency[j] / now.measured.frequency[i] - 1 for i, j in now.pairs.pairs])
    macs = np.array([now.mac[i, j] for i, j in now.pairs.pairs])
    place = min(now.comac, key=lambda point: now.comac[point]) if now.comac else None
    where = f"; shapes differ most at {place} (COMAC {now.comac[place]:.2f})" if place is not None else ""
    return (f"{len(macs)} of {now.measured.count} measured modes have a partner in the model; frequencies differ by at most "
            f"{100 * np.abs(ratio).max():.1f} %, the lowest MAC is {macs.min():.2f}{where}. Total correlation "
            f"{now.coefficients.total:.2f} (1 is equal).")


def _tested(test: MeasuredTest) -> str:
    """Return the extent of a test: modes, frequencies, points and responses."""
    f, points = test.modes.frequency, {d.point for d in test.modes.dofs}
    words = f"{test.modes.count} measured modes, {f.min():.4g} to {f.max():.4g} Hz, at {len(points)} points"
    if test.frf is None:
        return words
    return f"{words}; {len(test.frf.outputs) * len(test.frf.inputs)} responses at {test.frf.frequency.size} lines"


def _mode_parts(result: Comparison) -> list[Table | Chart | Notes]:
    now, rows = result.correlation, []
    parts: list[Table | Chart | Notes] = []
    for r, (i, j) in enumerate(now.pairs.pairs):
        f, g, c = float(now.measured.frequency[i]), float(now.predicted.frequency[j]), now.coefficients
        assert c is not None
        rows.append([int(i) + 1, f"{f:.2f}", int(j) + 1, f"{g:.2f}", f"{100 * (g / f - 1):+.2f}", f"{now.mac[i, j]:.3f}",
                     f"{c.frequency[r]:.3f}", f"{c.displacement[r]:.3f}", f"{c.weight[r]:.3f}"])
    header = ["measured mode", "Hz", "model mode", "Hz ", "difference, %", "MAC", "frequency", "displacement", "mass share"]
    parts.append(Table(header, rows, "Paired modes and their correlation coefficients (0 nothing in common, 1 equal)"))
    if now.coefficients is not None:
        named = [("model", now.coefficients)]
        if result.earlier is not None and result.earlier.coefficients is not None:
            named.insert(0, ("model before", result.earlier.coefficients))
        parts.append(Table(["", "mean of frequencies", "weighted by mass", "total"],
                           [[name, f"{c.mean:.4f}", f"{c.mass:.4f}", f"{c.total:.4f}"] for name, c in named],
                           "Over all pairs; total: frequency x displacement x MAC, weighted by mass"))
    for name, state in (("before", result.earlier), ("now", now)):
        if state is not None:
            parts.append(Chart(mac_matrix(state.mac, state.measured, state.predicted, row_title="Measured mode",
                                          column_title="Mode of the model", pairs=state.pairs.pairs,
                                          title="MAC" if result.earlier is None else f"MAC {name}"),
                               "Paired modes are framed."))
    single = [f"measured mode {i + 1} ({now.measured.frequency[i]:.2f} Hz) has no partner" for i in now.pairs.single_first]
    return [*parts, Notes(single, "warning", "Without partner")] if single else parts


def _place_parts(now: ModelCorrelation, model: Mapping[Point, FloatArray], test: MeasuredTest,
                 bodies: Mapping[str, Sequence[Point]]) -> list[Chart | Table]:
    positions = {point: model[point] for point in now.comac}
    lines = _lines(now, test)
    # A chart of good agreement must not blow its noise up to its full height.
    ecomac_top = max(0.05, max(now.ecomac.values()))
    worst_points = sorted(now.comac, key=lambda p: now.comac[p])[:8]
    comac_bottom = min(0.9, np.floor(10 * min(now.comac.values())) / 10)
    return [Chart(point_values(positions, now.comac, quantity="COMAC", limits=(comac_bottom, 1.0), lines=lines,
                               components=bodies),
                  "COMAC of every point: 1 where all paired modes agree."),
            Chart(point_values(positions, now.ecomac, quantity="ECOMAC", limits=(0.0, ecomac_top), good_is_high=False,
                               lines=lines, components=bodies),
                  "ECOMAC: mean difference of the shapes over twice their largest entry. Where little moves, noise alone "
                  "lowers COMAC but does not raise ECOMAC."),
            Table(["point", "COMAC", "ECOMAC"], [[str(p), f"{now.comac[p]:.3f}", f"{now.ecomac[p]:.3f}"] for p in worst_points],
                  "Points that agree least")]


def _lines(now: ModelCorrelation, test: MeasuredTest) -> list[tuple[Point, Point]]:
    """Return the lines of the test's geometry between the paired points of the model."""
    pairs = now.points.pairs
    test_lines = [] if test.geometry is None else test.geometry.lines
    return [(pairs[a], pairs[b]) for a, b in test_lines if a in pairs and b in pairs]


def _shapes(now: ModelCorrelation, places: Mapping[Point, FloatArray], test: MeasuredTest,
            bodies: Mapping[str, Sequence[Point]]) -> ShapeView:
    positions = {point: places[point] for point in now.comac}
    scene = with_hulls(Scene.of_points(positions, _lines(now, test), components=bodies))
    first, second = now.pairs.pairs.T
    panes = [AnimatedShapes.from_modes(modes.selected(which), positions)
             for modes, which in ((now.measured, first), (now.predicted, second))]
    model = turn_alike(panes[1], panes[0])
    words = "Paired modes; the panes move together. The difference is drawn on the scale of the measured shape."
    return ShapeView(scene, panes[0], "pairs", "measured", f"{words} {HULL_WORDS}", (scene, model, "model"),
                     difference_of(panes[0], model))


def _bodies_of(machine: Machine, points: Iterable[Point]) -> dict[str, list[Point]]:
    """Return the points by the body of the machine that they ride on."""
    bodies: dict[str, list[Point]] = {}
    for point in points:
        bodies.setdefault(machine.description.points[str(point)].body, []).append(point)
    return bodies


def _response_parts(result: Comparison) -> list[Chart]:
    now = result.correlation
    assert now.frac is not None and now.measured_frf is not None and now.predicted_frf is not None
    frf = now.measured_frf
    names = [f"{o} / {i}" for o in frf.outputs for i in frf.inputs]
    flat = now.frac.reshape(len(now.bands), -1)
    worst_responses = np.argsort(flat.mean(axis=0))[:24]
    parts = [Chart(frac_bands(flat[:, worst_responses], now.bands, [names[k] for k in worst_responses]),
                   "FRAC of measured and computed response over bands, the worst responses first"
                   + (f" ({len(worst_responses)} of {len(names)})." if len(worst_responses) < len(names) else "."))]
    for k in worst_responses[:_DRAWN_RESPONSES]:
        o, i = divmod(int(k), len(frf.inputs))
        curves = {"measured": frf.selected([o], [i])}
        if result.earlier is not None and result.earlier.predicted_frf is not None:
            curves["before"] = result.earlier.predicted_frf.selected([o], [i])
        curves["model"] = now.predicted_frf.selected([o], [i])
        parts.append(Chart(bode(curves, title=names[int(k)])))
    return parts


def _point_parts(now: ModelCorrelation, model: Mapping[Point, FloatArray], test: MeasuredTest
                 ) -> list[Chart | Table | Notes | str]:
    pairing = now.points
    distance = np.array(list(pairing.distance.values()))
    single = f", {len(pairing.single)} measured ones are not" if pairing.single else ", all that were measured"
    distance_text = (f" Distance between the two of a pair: mean {1e3 * distance.mean():.2f} mm, largest "
                     f"{1e3 * distance.max():.2f} mm."
                     if distance.any() else "")
    parts: list[Chart | Table | Notes | str] = [
        f"{len(pairing.pairs)} points are paired{single}: {pairing.status}.{distance_text}"]
    if test.geometry is not None and test.owner is None:
        moved = {p: tf.move(pairing.transform, np.asarray(xyz)[None])[0] for p, xyz in test.geometry.points.items()
                 if p in pairing.pairs or p in pairing.single}
        parts.append(Chart(point_pairs(moved, model, pairing.pairs), "Measured points carried into the frame of the model."))
        # Adding zero takes the sign off -0, which would be printed.
        rows = [[way, *(f"{round(v, 6) + 0.0:.6f}" for v in row[:3]), f"{1e3 * row[3]:.2f}"]
                for way, row in zip("xyz", pairing.transform, strict=False)]
        parts.append(Table(["model", "test x", "test y", "test z", "shift mm"], rows,
                           "From the frame of the test to that of the model"))
    if pairing.single:
        words = f"points {', '.join(map(str, pairing.single[:12]))} have no partner"
        parts.append(Notes([words], "warning", "Without partner"))
    return parts
