"""The page of a sensitivity study: what every parameter does to frequencies, damping and shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.machine import Machine
from toolpoint.plot import Chart, Report, ShapeView, Table
from toolpoint.plot.figures.machines.sensitivity import cumulative_bars, sensitivity_map
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies.machines.sensitivity_study import SensitivityStudy

_MAX_MAP_PARAMETERS = 40  # parameters of a map: more do not fit a page
_MIN_DRAWN_SENSITIVITY = 5e-4  # relative sensitivity, or loss of MAC: smaller ones would read 0.000 on a map
# Kinds of parameters in the order in which they are drawn.
_PARAMETER_KINDS = ("stiffness", "modulus", "mass", "density", "damping", "loss_factor", "diameter", "bore", "width", "height")


def sensitivity_page(result: SensitivityStudy, machine: Machine, change: float = 0.1, *,
                     pose: Mapping[str, float] | None = None,
                     warnings: Sequence[str] = ()) -> Report:
    """Return the page of a study; change : relative change of a parameter for which shapes are extrapolated.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 4e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.03))
    >>> from toolpoint.studies import study_sensitivity
    >>> page = sensitivity_page(study_sensitivity(machine, None, 2), machine)
    >>> "50.33 Hz by slide (+0.50)" in page.summary  # frequencies go with the root of the stiffness
    True
    """
    report = Report(f"Sensitivities of {machine.name}", _summary(result), subtitle=f"{len(result.paths)} parameters")
    order = _largest(np.abs(result.frequency).max(axis=1))
    names = [result.paths[k] for k in order]
    some = (f" The {len(order)} largest of {len(result.paths)} are shown; the others move no frequency by more than "
            f"{np.sort(np.abs(result.frequency).max(axis=1))[-len(order) - 1]:.2g}." if len(order) < len(result.paths) else "")
    report = report.with_section(
        "Frequencies, parameter by parameter",
        Chart(sensitivity_map(result.frequency[order], names, result.frequencies, quantity="(p/f) df/dp"),
              "Per cent of frequency per per cent of the parameter; a sole spring would have 0.5, a sole mass -0.5." + some))
    report = report.with_section("Frequencies, part by part", *_cumulated(result))
    report = report.with_section("Shapes", *_shapes(result, change))
    if np.any(result.damping):
        damped = np.argsort(-np.abs(result.damping).max(axis=1), kind="stable")[:_MAX_MAP_PARAMETERS]
        damped = damped[np.abs(result.damping[damped]).max(axis=1) > 0]
        report = report.with_section("Damping", Chart(
            sensitivity_map(100 * result.damping[damped], [result.paths[k] for k in damped], result.frequencies,
                            quantity="p dζ/dp, %"), "Change of the damping ratio in points of per cent per unit of dp/p."))
    scene, shapes = machine_shapes(machine, pose, result.frequencies.size)
    report = report.with_section("The modes", ShapeView(scene, shapes, "modes"))
    rows = [[path, float(value), *map(float, row)] for path, value, row in zip(
        result.paths, result.values, result.frequency, strict=True)]
    report = report.with_section("All numbers", Table(
        ["parameter", "value (SI)", *(f"{f:.3f} Hz" for f in result.frequencies)], rows, "Relative sensitivity of frequency"))
    return report.with_doubts(*warnings).with_assumptions(
        "First-order sensitivities of undamped modes at this pose: they hold for small changes.",
        f"Shapes and frequencies after a change of {100 * change:g} % of a parameter are extrapolated from them.")


def _largest(size: FloatArray) -> np.ndarray:
    """Return the indices of the parameters to draw, the one of largest `size` (n,) first; empty rows are left out."""
    order = np.argsort(-size, kind="stable")[:_MAX_MAP_PARAMETERS]
    visible = order[size[order] >= _MIN_DRAWN_SENSITIVITY]
    return visible if visible.size else order


def _summary(result: SensitivityStudy) -> str:
    """Return for each mode the part that moves its frequency most, in a sentence.

    Stiffness is looked at; where no parameter is a stiffness, parameters of all kinds.
    """
    stiffness = result.cumulative("stiffness")
    parts = stiffness or result.cumulative()
    words = []
    for k, f in enumerate(result.frequencies):
        best = max(parts, key=lambda part: abs(float(parts[part][k])))
        words.append(f"{f:.2f} Hz by {best.split('.')[1]} ({parts[best][k]:+.2f})")
    question = "Which part's stiffness moves each frequency most: " if stiffness else "Which part moves each frequency most: "
    return question + ", ".join(words) + "."


def _cumulated(result: SensitivityStudy) -> list[Chart]:
    """Return a chart of bars for each kind of parameter that moves a frequency: the sum over the parameters of each part."""
    charts = []
    for kind in (k for k in _PARAMETER_KINDS if k in result.kinds):
        parts = {name.split(".")[1]: row for name, row in result.cumulative(kind).items()}
        if any(np.any(row) for row in parts.values()):
            title = kind.replace("_", " ")
            charts.append(Chart(cumulative_bars(parts, result.frequencies, quantity="(p/f) df/dp", title=title)))
    return charts


def _shapes(result: SensitivityStudy, change: float) -> list[Chart | Table]:
    """Return the loss of MAC by a relative `change` of each parameter, and the MAC after that of all of a part together."""
    mac_loss = 1 - result.mac_after(change)
    order = _largest(mac_loss.max(axis=1)) if mac_loss.max() > 1e-9 else np.zeros(0, int)
    words = f"1 - MAC between each shape and itself after {100 * change:+.3g} % of the parameter, to second order."
    charts: list[Chart | Table] = []
    if len(order):
        names = [result.paths[k] for k in order]
        charts.append(Chart(sensitivity_map(mac_loss[order], names, result.frequencies, quantity="1 - MAC", diverging=False),
                            words))
    kinds = [k for k in _PARAMETER_KINDS if k in result.kinds]
    rows = [[part, kind, *(f"{v:.4f}" for v in 1 - (row * change) ** 2)] for kind in kinds
            for part, row in result.cumulative_shape(kind).items() if np.any(row > 1e-6)]
    return [*charts, Table(["part", "kind", *(f"MAC, {f:.2f} Hz" for f in result.frequencies)], rows,
                           f"All parameters of a part and kind changed together by {100 * change:+.3g} %")]
