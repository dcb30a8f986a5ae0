"""The page of a machine by finite elements: animated modes, seats of energy, sensitivities on the part, variants, damper."""

from __future__ import annotations

import numpy as np

from toolpoint._rounding import number_text
from toolpoint.plot import Chart, Notes, Report, ShapeView, Table
from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.plot.shape_view.solid_scene import solid_shapes
from toolpoint.plot.shape_view.solid_values import values_on_part
from toolpoint.studies.finite_elements.machine_study import FiniteElementStudy


def finite_element_page(study: FiniteElementStudy, *, part: str = "column") -> Report:
    """Return the page of a study; `part` is the one whose elements are coloured."""
    pairs, machine = study.pairs, study.machine
    labels = tuple(_seats(study, i) for i in range(pairs.count))
    scene, shapes = solid_shapes(machine.parts, lambda name: machine.shape_of(name, pairs), pairs.frequency,
                                 ratio=study.modes.damping_ratio[0], labels=labels)
    masses = ", ".join(f"{name} {mass:.0f} kg" for name, mass in machine.part_mass.items())
    size = f"{machine.size} coordinates, {study.mass:.0f} kg: {masses}"
    report = Report("A machine by finite elements", _answer(study), subtitle=size).with_assumptions(*study.notes)
    report = report.with_section("Modes", ShapeView(scene, shapes, "modes", "the machine"))
    report = report.with_section("Where the energy sits", Chart(_energies(study)), _sensitivity_table(study))
    density = 100 * study.sensitivities[part].modulus[0] / _volumes(study, part)
    drawn = values_on_part(machine.parts[part], density, title=part, unit="% a dm³")
    report = report.with_section(f"What stiffens mode 1, on the {part}", drawn)
    rows = [[v.name, round(v.mass - study.mass, 2), *np.round(v.frequency - pairs.frequency[:len(v.frequency)], 3).tolist()]
            for v in study.variants]
    if rows:
        header = ["variant", "kg", *(f"f{i + 1} Hz" for i in range(len(rows[0]) - 2))]
        report = report.with_section("Which gram buys which hertz", Table(header, rows, "Changes against the machine"))
    return report.with_section("A tuned mass damper", Chart(_damper(study)), Notes([study.damper.status], "note"))


def _answer(study: FiniteElementStudy) -> str:
    """Return the first mode, where its energy sits, and what a damper would bring."""
    damper = study.damper
    return (f"The lowest mode is at {number_text(float(study.pairs.frequency[0]))} Hz; its strain energy sits in "
            f"{_seats(study, 0)}. A tuned damper of {number_text(damper.mass, digits=3)} kg would bring the largest response "
            f"to {100 * damper.peak_ratio:.0f} %. Sizes, stiffnesses and damping are chosen: none has an "
            "interval.")


def _seats(study: FiniteElementStudy, mode: int) -> str:
    shares = {**study.part_shares, **study.joint_shares}
    best = sorted(shares, key=lambda name: -shares[name][mode])[:2]
    return ", ".join(f"{name} {100 * shares[name][mode]:.0f} %" for name in best)


def _volumes(study: FiniteElementStudy, part: str) -> np.ndarray:
    """Return the volume of each element, dm^3."""
    model = study.machine.parts[part]
    corners = [model.nodes[block.nodes[:, :block.kind.corner_count]] for block in model.blocks]
    return np.concatenate([np.prod(np.ptp(c, axis=1), axis=1) for c in corners]) * 1e3


def _energies(study: FiniteElementStudy) -> object:
    chart = figure("", 460, barmode="stack")
    shares = {**study.part_shares, **study.joint_shares}
    modes = [f"{i + 1}: {f:.1f} Hz" for i, f in enumerate(study.pairs.frequency)]
    for i, (name, share) in enumerate(shares.items()):
        pattern = "" if name in study.machine.parts else "/"
        marker = {"color": COLOURS[i % len(COLOURS)], "pattern": {"shape": pattern}}
        chart.add_bar(x=modes, y=100 * share, name=name, marker=marker)
    chart.update_yaxes(title_text="strain energy of the mode, %")
    return chart


def _sensitivity_table(study: FiniteElementStudy) -> Table:
    rows = [[name, *(round(float(v), 3) for v in (*s.modulus.sum(axis=1)[:3], *s.density.sum(axis=1)[:3]))]
            for name, s in study.sensitivities.items()]
    header = ["part", "E, f1", "E, f2", "E, f3", "density, f1", "density, f2", "density, f3"]
    return Table(header, rows, "Relative change of a frequency per relative change of a part's E or density")


def _damper(study: FiniteElementStudy) -> object:
    damper = study.damper
    chart = figure(f"{damper.mass:.3g} kg at {damper.frequency:.2f} Hz, damping ratio {damper.damping_ratio:.3f}", 420)
    for name, values, colour in (("without", damper.before, COLOURS[6]), ("with the damper", damper.after, COLOURS[0])):
        chart.add_scatter(x=damper.lines, y=np.abs(values) * 1e6, name=name, line={"color": colour})
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="response at the tool, µm/N", type="log")
    return chart
