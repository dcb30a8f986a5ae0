"""The page of the sensitivity of a machine to its elements: each meshed body coloured by what a kilogram of wall buys there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.plot import Report, ShapeView, Table
from toolpoint.plot.shape_view.solid_scene import solid_shapes
from toolpoint.plot.shape_view.solid_values import values_on_part
from toolpoint.studies.machines.element_sensitivity import ElementStudy

_MAX_DRAWN_BODIES = 6  # whose elements are coloured: those with the largest effect first
_LISTED_ELEMENTS = 20  # of the table of the best elements of mode 1


def element_page(study: ElementStudy, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a study.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description.elastic import CastingBox, ElasticDescription, PatchDescription
    >>> from toolpoint.studies import study_elements
    >>> foot = PatchDescription((0.1, 0.05, 0), (1, 0, 0), (0, -1, 0), 0.2, 0.1)
    >>> block = ElasticDescription((CastingBox((0, 0, 0), (0.2, 0.1, 0.1)),), {"foot": foot}, band=6000.0, mesh_size=0.1)
    >>> joint = JointDescription("ground", "block", child_interface="foot")
    >>> machine = build(MachineDescription("block", {"block": BodyDescription(elastic=block)}, {"bolts": joint}))
    >>> element_page(study_elements(machine, modes=2)).title
    'Elements of block'
    """
    elements = sum(len(masses) for masses in study.element_masses.values())
    report = Report(f"Elements of {study.machine.name}", _answer(study), subtitle=f"{elements} elements of "
                    f"{', '.join(study.slopes)}, {study.meshes.linked.size} coordinates")
    report = report.with_section("Body by body", Table(
        study.header, study.rows(), "Relative change of a frequency per relative change of all of a body's E or density; the "
        "share of its elements, and of its mass, that hold 80 % of the effect of E on mode 1; Hz of mode 1 a kilogram of wall"))
    views = [values_on_part(study.models[name], study.hertz_a_kilogram(name)[0], name=f"elements-{k + 1}", unit="Hz a kg",
                            title=f"Mode 1 by a kilogram of wall, on {name}") for k, name in enumerate(_drawn_bodies(study))]
    report = report.with_section("Where a kilogram of wall raises mode 1", *views)
    rows = [[name, ", ".join(f"{1e3 * x:.0f}" for x in place), f"{gain:+.3g}"]
            for name, place, gain in study.best_elements(0, _LISTED_ELEMENTS)]
    report = report.with_section("The best elements for mode 1", Table(["body", "centre, mm", "Hz a kg"], rows))
    scene, shapes = solid_shapes(study.models, study.shape_of, study.frequency)
    report = report.with_section("The modes", ShapeView(scene, shapes, "modes", "castings and solids of the machine"))
    doubts = [note for note in study.notes if isinstance(note, Doubt)]
    return report.with_doubts(*doubts, *warnings).with_assumptions(*(note for note in study.notes if note not in doubts))


def _drawn_bodies(study: ElementStudy) -> list[str]:
    """Return the bodies with the largest effect of E on mode 1 or on the others, the largest first."""
    effect = {name: float(np.abs(slopes.modulus.sum(axis=1)).max()) for name, slopes in study.slopes.items()}
    return sorted(effect, key=lambda name: -effect[name])[:_MAX_DRAWN_BODIES]


def _answer(study: ElementStudy) -> str:
    """Return where wall helps mode 1 most, and how much of the mode's stiffness the meshed bodies are."""
    name, place, gain = study.best_elements(0, 1)[0]
    share = {body: 2 * float(slopes.modulus[0].sum()) for body, slopes in study.slopes.items()}
    stiffest = max(share, key=lambda body: share[body])
    where = ", ".join(f"{1e3 * x:.0f}" for x in place)
    words = (f"A kilogram of wall at ({where}) mm of {name} raises mode 1 ({study.frequency[0]:.2f} Hz) most, by {gain:.2g} Hz."
             if gain > 0 else f"No wall raises mode 1 ({study.frequency[0]:.2f} Hz): everywhere its mass costs more than its "
             "stiffness gains.")
    return (f"{words} Of the strain energy of mode 1, {100 * share[stiffest]:.0f} % sit in {stiffest} and "
            f"{100 * (1 - sum(share.values())):.0f} % in joints and bodies without a mesh.")
