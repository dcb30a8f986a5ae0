"""The page of a machine by finite elements: animated modes, a test beside the model, sensitivities, what helps the cut."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._rounding import number_text
from toolpoint.pages.machines.finite_element_parts import (
    alone_parts,
    damper_parts,
    gram_parts,
    hammer_parts,
    option_parts,
    slope_parts,
)
from toolpoint.plot import Chart, Report, ShapeView, Table
from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.plot.shape_view.solid_scene import solid_shapes
from toolpoint.studies.finite_elements.machine_study import FiniteElementStudy

_DRAWN_MODES = 10  # lowest modes that are animated and whose energy is charted


def finite_element_page(study: FiniteElementStudy, *, part: str = "column", warnings: Sequence[str] = ()) -> Report:
    """Return the page of a study; part : name of the part whose elements are coloured and which is looked at alone.

    Examples
    --------
    Runs in ``examples/damp_a_mill_of_finite_elements.py``.
    """
    pairs, machine = study.pairs, study.machine
    labels = tuple(_energy_words(study, i) for i in range(min(_DRAWN_MODES, len(study.modes.frequency))))
    frequency = pairs.frequency[:len(labels)]
    scene, shapes = solid_shapes(machine.parts, lambda name: machine.shape_of(name, pairs)[:, :len(labels)], frequency,
                                 ratio=study.modes.damping_ratio[:len(labels)], labels=labels)
    masses = ", ".join(f"{name} {mass:.0f} kg" for name, mass in machine.part_mass.items())
    size = f"{machine.size} coordinates, {study.mass:.0f} kg: {masses}"
    report = Report("A machine by finite elements", _answer(study), subtitle=size).with_assumptions(*study.notes)
    report = report.with_section("Modes", ShapeView(scene, shapes, "modes", "the machine"), _mode_table(study))
    report = report.with_section("Where the energy sits", Chart(_energies(study)))
    if study.correlation is not None and study.test is not None:
        report = report.with_section("A hammer test beside the model", *hammer_parts(study.correlation, study.test))
    report = report.with_section("What stiffens, and what a test would correct", *slope_parts(study.whole_sensitivity, part))
    report = report.with_section("Which gram buys which hertz", *gram_parts(study, part))
    report = report.with_section(f"The {part} alone", *alone_parts(study.part_sensitivity, part))
    report = report.with_section("What helps the cut", *option_parts(study))
    report = report.with_section("Dampers", *damper_parts(study))
    return report.with_doubts(*study.doubts, *warnings)


def _answer(study: FiniteElementStudy) -> str:
    """Return the first mode, where its energy sits, how the test agrees, and what helps the cut most."""
    text = (f"The lowest mode is at {number_text(float(study.pairs.frequency[0]))} Hz; its strain energy sits in "
            f"{_energy_words(study, 0)}.")
    if study.correlation is not None and study.correlation.correlation.coefficients is not None:
        c = study.correlation.correlation.coefficients
        text += (f" A virtual hammer test of a machine that the model does not know finds {len(c.mac)} modes of it: "
                 f"frequencies differ by at most {100 * (1 - c.frequency.min()):.1f} %, the lowest MAC is {c.mac.min():.2f}.")
    best = max(study.every_option, key=lambda option: option.limit.depth)
    text += (f" The cut is stable at any speed to {1e3 * study.base.limit.depth:.2f} mm; of what was tried, {best.name} brings "
             f"most, {best.limit.depth / study.base.limit.depth:.2f} times that.")
    return text + " Sizes, stiffnesses and damping are chosen: none has an interval."


def _energy_words(study: FiniteElementStudy, mode: int) -> str:
    """Return the two parts or joints with most of a mode's strain energy, in words."""
    shares = {**study.part_shares, **study.joint_shares}
    best = sorted(shares, key=lambda name: -shares[name][mode])[:2]
    return ", ".join(f"{name} {100 * shares[name][mode]:.0f} %" for name in best)


def _mode_table(study: FiniteElementStudy) -> Table:
    """Return frequency, effect of a finer mesh (%) and seat of the energy of every mode."""
    header = ["mode", "Hz", "finer mesh, %", "strain energy in"]
    return Table(header, study.mode_rows(), "Natural frequencies, what a finer mesh changes, and where the energy is")


def _energies(study: FiniteElementStudy) -> object:
    """Return the chart of strain energy by part and joint (%), a stacked bar for each mode; joints are hatched."""
    chart = figure("", 460, barmode="stack")
    shares = {**study.part_shares, **study.joint_shares}
    modes = [f"{i + 1}: {f:.1f} Hz" for i, f in enumerate(study.pairs.frequency[:_DRAWN_MODES])]
    for i, (name, share) in enumerate(shares.items()):
        pattern = "" if name in study.machine.parts else "/"
        marker = {"color": COLOURS[i % len(COLOURS)], "pattern": {"shape": pattern}}
        chart.add_bar(x=modes, y=np.round(100 * share[:_DRAWN_MODES], 3), name=name, marker=marker)
    chart.update_yaxes(title_text="strain energy of the mode, %")
    return chart
