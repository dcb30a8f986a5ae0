"""Machine description from identified joints and known masses, with the covariance of the identified numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.joint_identification import ComponentMass, JointIdentification
from toolpoint.joint_identification.machine.refined import FIT_OF_MACHINE
from toolpoint.joint_identification.machine.rigid_machine import COUPLED, ENERGY, MEASURED_RATIOS
from toolpoint.joint_identification.machine.whole_machine import WholeMachine
from toolpoint.machine.components import Components
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    IdentifiedDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    ReferenceDescription,
    parameters,
)
from toolpoint.machine.parts.build import build
from toolpoint.machine.parts.mass import mass_properties
from toolpoint.studies.measured.joint_descriptions import JointLayout, describe_axes, describe_joint, plan_layout
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Modes

_MIN_UNSEEN_RATIO_DEVIATION = 0.3  # relative, of the damping ratio of a mode that the test did not show
_COVARIANCE_STEP_DEVIATIONS = 0.05  # step of the slopes of written numbers, in standard deviations
_NUMBERS = ("frame", "stiffness", "stiffness_matrix", "screws", "loss_factor", "damping", "damping_matrix", "mass", "centre",
            "inertia")


def component_masses(components: Components) -> dict[str, ComponentMass]:
    """Return the mass properties of components, given in the machine frame, as joint identification takes them."""
    result = {}
    for name, body in components.bodies.items():
        properties, deviation = mass_properties(body), components.deviations.get(name)
        deviations = (deviation.mass, deviation.inertia, deviation.centre) if deviation is not None else ()
        result[name] = ComponentMass(properties.mass, properties.centre, properties.inertia, *deviations)
    return result


def machine_of(joints: JointIdentification, components: Components, *, modes: Modes,
               points: Mapping[str | int, FloatArray] | None = None) -> MachineDescription:
    """Return the machine of identified joints: bodies, joints, axes, points, and what was identified with its covariance.

    Parameters
    ----------
    joints : JointIdentification
        With the fit of the machine, that is identified with masses.
    components : Components
        Bodies, axes, tool and table, cut.
    modes : Modes
        The measured ones, kept as reference as far as the machine explains them.
    points : mapping of name to (3,) position in the machine frame, m, optional
        Measured points; they become points of the bodies, so that the machine can be correlated with its test as it is.

    Raises
    ------
    ToolpointError
        Where masses were not known.
    """
    whole_machine = joints.machine
    if whole_machine is None:
        broken = next((doubt for doubt in joints.doubts if doubt.what == FIT_OF_MACHINE), None)
        if broken is not None:  # masses were known: the doubt says why there is none
            raise ToolpointError(str(broken))
        fail("joints", "no machine", "the masses of all components must be known", remedy="give every component its body")
    layouts = layouts_of(whole_machine, components)
    machine = describe_fit(whole_machine, whole_machine.fit.x, components, layouts=layouts)
    measured = ReferenceDescription("measured", tuple(float(modes.frequency[i]) for i in whole_machine.modes),
                                    tuple(float(max(modes.damping_ratio[i], 0.0)) for i in whole_machine.modes), "measured")
    lonely = [f"{modes.frequency[i]:.4g} Hz" for i in whole_machine.lonely]
    lonely_note = (f"Measured without a partner among the modes of this machine and left out: {', '.join(lonely)}.",
                   ) if lonely else ()
    machine = replace(machine, identified=_identified_numbers(whole_machine, components, layouts, machine),
                      reference=(measured,), assumptions=(
        *lonely_note, *(f"{joint.parent} - {joint.child}: established" for joint in joints.joints if joint.certain)))
    if points is not None:
        machine = with_measured_points(build(machine), points, components.points).description
    return machine


def layouts_of(whole_machine: WholeMachine, components: Components) -> dict[str, JointLayout]:
    """Return how the joint of every component is written."""
    result = {}
    for name, form in zip(whole_machine.names, whole_machine.fit.model.forms, strict=True):
        result[name] = plan_layout(form.start, form.ways, {a: x for a, x in components.axes.items() if x.moves == name})
    return result


def describe_fit(whole_machine: WholeMachine, x: FloatArray, components: Components, *, layouts: Mapping[str, JointLayout]
               ) -> MachineDescription:
    """Return the machine of a fit's numbers, damped by its law."""
    model = whole_machine.fit.model
    described: dict[str, JointDescription] = {}
    axes: dict[str, AxisDescription] = {}
    parents = [whole_machine.names[i] if i >= 0 else "ground" for i in model.parents]
    is_viscous = any(form.viscous for form in model.forms)
    for name, parent, joint in zip(whole_machine.names, parents, model.joints(x), strict=True):
        driven = {a: v for a, v in components.axes.items() if v.moves == name}
        side = next((axis.elastic_at for axis in driven.values()), "child")
        title = f"{parent}_{name}"
        described[title] = describe_joint(parent, name, joint, layout=layouts[name], elastic_at=side,
                                          is_viscous=is_viscous)
        axes |= describe_axes(title, driven, layouts[name])
    masses = dict(zip(whole_machine.names, model.changed_masses(x), strict=True))
    bodies = {name: _body(components.bodies[name], masses[name]) for name in whole_machine.names}
    law = model.law if whole_machine.law is not None else COUPLED
    damped = "energy" if law == ENERGY else _mode_ratios(whole_machine)[0] if law == MEASURED_RATIOS else ""
    # A machine without any damping has no responses: then a ratio of 1 % stands in.
    lossless = not damped and not any(j.loss_factor or j.damping or j.damping_matrix for j in described.values())
    return MachineDescription(
        components.name, bodies, described, axes, dict(components.places), tool=components.tool, table=components.table,
        cutting=components.cutting, tool_axis=components.tool_axis, damping_ratio=0.01 if lossless else None,
        modal_damping=damped, description="Minimal model from measured mode shapes.", source="identified from measured modes")


def _mode_ratios(whole_machine: WholeMachine) -> tuple[tuple[float, ...], FloatArray]:
    """Return the damping ratios of all modes of a machine by frequency, and their standard deviations.

    As measured; modes that the test did not show have the mean, as uncertain as the ratios differ.
    """
    fit, count = whole_machine.fit, sum(form.start.twists.shape[1] for form in whole_machine.fit.model.forms)
    mean = float(np.mean(fit.ratio))
    ratio, deviation = np.full(count, mean), np.full(count, max(float(np.std(fit.ratio)), _MIN_UNSEEN_RATIO_DEVIATION * mean))
    ratio[fit.partner], deviation[fit.partner] = fit.ratio, fit.ratio_deviation
    return tuple(float(max(v, 0.0)) for v in ratio), deviation


def _body(body: BodyDescription, mass: ComponentMass) -> BodyDescription:
    """Return a body as it was given where its mass is exact, else with the mass, centre and inertia of the fit."""
    if not mass.deviations.any():
        return body
    inertia = np.asarray(mass.inertia)
    draw = body.draw or body.shape
    x, y, z = np.asarray(mass.centre).tolist()
    return BodyDescription(mass.mass, (x, y, z), InertiaDescription(
        float(inertia[0, 0]), float(inertia[1, 1]), float(inertia[2, 2]), float(inertia[0, 1]), float(inertia[0, 2]),
        float(inertia[1, 2])), draw=draw, draw_at=body.draw_at or body.centre, source="measured")


def _identified_numbers(whole_machine: WholeMachine, components: Components, layouts: Mapping[str, JointLayout],
                        machine: MachineDescription
                        ) -> IdentifiedDescription:
    """Return the numbers of the file that the fit decided, with their covariance: that of the fit's numbers carried over."""
    root = _covariance_root(whole_machine.fit.covariance)
    paths = [path for path in parameters(machine) if path.split(".")[2] in _NUMBERS and not _is_mirrored(path)]
    # Central differences along independent directions of the fit, through everything that writing a file does.
    slopes = np.zeros((len(paths), root.shape[1]))
    for i, direction in enumerate(root.T):
        moved = (whole_machine.fit.x + sign * _COVARIANCE_STEP_DEVIATIONS * direction for sign in (1, -1))
        machine_above, machine_below = (describe_fit(whole_machine, x, components, layouts=layouts) for x in moved)
        slopes[:, i] = [(machine_above.value(path) - machine_below.value(path)) / (2 * _COVARIANCE_STEP_DEVIATIONS)
                        for path in paths]
    scale = np.array([abs(machine.value(path)) for path in paths])
    # Numbers that no direction of the fit moves were given, not identified.
    moving = np.flatnonzero(np.sqrt((slopes**2).sum(axis=1)) > 1e-9 * np.maximum(scale, 1e-6))
    covariance, names = slopes[moving] @ slopes[moving].T, [paths[i] for i in moving]
    if isinstance(machine.modal_damping, tuple) and machine.modal_damping:
        deviation = _mode_ratios(whole_machine)[1]
        covariance = block_diag(covariance, np.diag(deviation**2))
        names += [f"modal_damping.{i}" for i in range(len(deviation))]
    # The lower triangle holds all of a symmetric matrix.
    rows = tuple(tuple(float(f"{v:.9g}") for v in row[:n + 1]) for n, row in enumerate(covariance))
    return IdentifiedDescription(tuple(names), rows, "fit of the machine to measured modes")


def _covariance_root(covariance: FloatArray) -> FloatArray:
    """Return columns whose products add up to a covariance, in the standard deviations of its numbers."""
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(size, size))
    # Directions without variance are left out: their square roots are round-off.
    kept = values > 1e-12
    return np.asarray(size[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


def _is_mirrored(path: str) -> bool:
    """Return whether a path is the upper half of a symmetric matrix, which repeats its lower half."""
    words = path.split(".")
    return words[2].endswith("_matrix") and int(words[-1]) > int(words[-2])
