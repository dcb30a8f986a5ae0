"""Identified joints and known masses -> a machine description that runs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpoint._check import fail
from toolpoint.joint_identification import JointEstimate, JointIdentification, MassProperties
from toolpoint.machine.build import mass_properties
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ReferenceDescription,
)
from toolpoint.vibration import Modes


def component_masses(bodies: Mapping[str, BodyDescription]) -> dict[str, MassProperties]:
    """Return the mass properties of components, given in the machine frame, as joint identification takes them."""
    found = {name: mass_properties(body) for name, body in bodies.items()}
    return {name: MassProperties(one.mass, one.centre, one.inertia) for name, one in found.items()}


def machine_of(
    name: str, joints: JointIdentification, bodies: Mapping[str, BodyDescription], modes: Modes,
    points: Mapping[str, tuple[str, tuple[float, float, float]]] | None = None,
) -> MachineDescription:
    """Return the machine of identified joints: bodies of known mass, joints where they were found, measured modes beside.

    Parameters
    ----------
    joints : JointIdentification
        With stiffnesses, that is identified with masses.
    bodies : mapping of component to BodyDescription
    modes : Modes
        The measured ones, kept as reference; their mean damping ratio becomes that of all modes.
    points : mapping of name to (body, position in the machine frame, m), optional

    Raises
    ------
    ToolpointError
        For a joint without stiffness or one whose freedoms are no directions of a frame (general).
    """
    described = {f"{one.parent}_{one.child}": _joint(one) for one in joints.joints}
    missing = [one.child for one in joints.joints if one.child not in bodies]
    if missing:
        fail("bodies", f"no mass properties of {missing[0]}", "every component of the chain needs them")
    ratio = float(np.mean(modes.damping_ratio))
    return MachineDescription(
        name, dict(bodies), described, points={key: PointDescription(body, at) for key, (body, at) in (points or {}).items()},
        damping_ratio=ratio, reference=(ReferenceDescription("measured", tuple(float(f) for f in modes.frequency),
                                                             tuple(float(z) for z in modes.damping_ratio), "measured"),),
        description="Minimal model from measured mode shapes.", source="identified from measured modes",
        assumptions=(f"A damping ratio of {100 * ratio:.3g} %, the mean of the measured ones, is taken for every mode.",
                     *(f"{one.parent} - {one.child}: {one.status}" for one in joints.joints)))


def _joint(one: JointEstimate) -> JointDescription:
    if one.kind == "general":
        fail(f"joint {one.parent} - {one.child}", "a general joint", "its freedoms are no directions of one frame",
             "measure more modes, or model it with a full stiffness matrix by hand")
    if one.stiffness is None:
        fail(f"joint {one.parent} - {one.child}", "no stiffness", "the masses of the components must be known")
    stiffness = {way: float(k) for way, k in zip(one.freedoms, one.stiffness, strict=True)}
    low = [way for way, k in stiffness.items() if k <= 0]
    if low:
        fail(f"joint {one.parent} - {one.child}", f"stiffness {stiffness[low[0]]:g} in {low[0]}", "must be above zero",
             "the modes at hand do not determine it; measure a mode that loads it")
    (x, y, z), (a, b, c) = one.position.tolist(), one.rotation.tolist()
    frame = FrameDescription((x, y, z), (a, b, c))
    return JointDescription(one.parent, one.child, frame, stiffness, source="measured")
