"""Identified joints and known masses -> a machine description that runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.joint_identification import ComponentMass, JointEstimate, JointIdentification
from toolpoint.machine.build import build, mass_properties
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    ReferenceDescription,
)
from toolpoint.studies.measured.model_correlation import correlate, with_measured_points
from toolpoint.vibration import Modes


def component_masses(bodies: Mapping[str, BodyDescription]) -> dict[str, ComponentMass]:
    """Return the mass properties of components, given in the machine frame, as joint identification takes them."""
    masses = {name: mass_properties(body) for name, body in bodies.items()}
    return {name: ComponentMass(properties.mass, properties.centre, properties.inertia) for name, properties in masses.items()}


def machine_of(
    name: str, joints: JointIdentification, bodies: Mapping[str, BodyDescription], *, modes: Modes,
    points: Mapping[str | int, FloatArray] | None = None, owner: Mapping[str, Sequence[str | int]] | None = None,
) -> MachineDescription:
    """Return the machine of identified joints: bodies of known mass, joints where they were found, measured modes beside.

    Parameters
    ----------
    joints : JointIdentification
        With stiffnesses, that is identified with masses.
    bodies : mapping of component to BodyDescription
    modes : Modes
        The measured ones, real, kept as reference; their mean damping ratio becomes that of all modes. With measured points
        those that no mode of the machine looks like (MAC below one half) are left out of both and named in the assumptions.
    points : mapping of name to (3,) position in the machine frame, m, optional
        Measured points; those that `owner` (component to its points) names become points of the bodies, so that the machine
        can be correlated with the test and updated to it as it is.

    Raises
    ------
    ToolpointError
        For a joint without stiffness or one whose freedoms are no directions of a frame (general).
    """
    described = {f"{joint.parent}_{joint.child}": _joint(joint) for joint in joints.joints}
    missing = [joint.child for joint in joints.joints if joint.child not in bodies]
    if missing:
        fail("bodies", f"no mass properties of {missing[0]}", "every component of the chain needs them")
    machine = MachineDescription(
        name, dict(bodies), described, description="Minimal model from measured mode shapes.",
        source="identified from measured modes")
    if owner:
        machine = with_measured_points(build(machine), points or {}, owner).description
    lonely = correlate(build(machine), modes).pairs.single_first if owner else []
    kept = [i for i in range(modes.count) if i not in lonely] or list(range(modes.count))
    ratio = float(np.mean(modes.damping_ratio[kept]))
    measured = ReferenceDescription("measured", tuple(float(f) for f in modes.frequency[kept]),
                                    tuple(float(z) for z in modes.damping_ratio[kept]), "measured")
    left = [f"{modes.frequency[i]:.4g} Hz" for i in range(modes.count) if i not in kept]
    alone = (f"Measured without a partner among the modes of this machine and left out: {', '.join(left)}.",) if left else ()
    return replace(machine, damping_ratio=ratio, reference=(measured,), assumptions=(
        f"A damping ratio of {100 * ratio:.3g} %, the mean of the measured ones, is taken for every mode.", *alone,
        *(f"{joint.parent} - {joint.child}: {joint.status}" for joint in joints.joints)))


def _joint(joint: JointEstimate) -> JointDescription:
    if joint.kind == "general":
        return _general(joint)
    if joint.stiffness is None:
        fail(f"joint {joint.parent} - {joint.child}", "no stiffness", "the masses of the components must be known")
    stiffness = {way: float(k) for way, k in zip(joint.freedoms, joint.stiffness, strict=True)}
    low = [way for way, k in stiffness.items() if k <= 0]
    if low:
        fail(f"joint {joint.parent} - {joint.child}", f"stiffness {stiffness[low[0]]:g} in {low[0]}", "must be above zero",
             "the modes at hand do not determine it; measure a mode that loads it")
    (x, y, z), (a, b, c) = joint.position.tolist(), joint.rotation.tolist()
    frame = FrameDescription((x, y, z), (a, b, c))
    return JointDescription(joint.parent, joint.child, frame, stiffness, source="measured")


def _general(joint: JointEstimate) -> JointDescription:
    matrix, name = joint.spatial_stiffness, f"joint {joint.parent} - {joint.child}"
    if matrix is None:
        fail(name, f"a general joint with {joint.screws.shape[1]} freedoms" + (
            "" if joint.stiffness_matrix is not None else " and no stiffness matrix"),
            "only six freedoms with a stiffness matrix, or directions of one frame, can be written as a machine",
            "measure more modes, or model it by hand")
    if np.linalg.eigvalsh(matrix)[0] <= 0:
        fail(name, "a stiffness matrix that is not positive", "must be positive definite",
             "check the masses; measure more modes")
    rows = tuple(tuple(float(v) for v in row) for row in (matrix + matrix.T) / 2)
    x, y, z = joint.position.tolist()
    return JointDescription(joint.parent, joint.child, FrameDescription((x, y, z)), stiffness_matrix=rows, source="measured")
