"""Yielding of the tool: the share that each spring of a machine has in the static compliance of tool against table."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpoint.machine import Machine, assemble
from toolpoint.machine.derivatives import matrix_derivatives
from toolpoint.vibration import Dof


def compliance_shares(machine: Machine) -> dict[str, float]:
    r"""Return the share that each spring has in the static compliance of tool against table, by the path of the spring.

    With the yielding :math:`u_d = K^{-1} f_d` under unit forces along the three directions the compliance is
    :math:`c = \sum_d f_d^T u_d`, and the share of a spring :math:`-d \ln c / d \ln k = k \sum_d u_d^T (dK/dk) u_d / c`,
    at the reference pose. The shares add up to one where the machine stands on springs alone. Empty for a machine without a
    tool, and for one that is not held.
    """
    if machine.description.tool is None:
        return {}
    description, paths = machine.description, spring_paths(machine)
    point = description.tool if description.table is None else f"{description.tool}-{description.table}"
    labels = [Dof.parse(f"{point}:{way}") for way in ("+x", "+y", "+z")]
    system = assemble(machine, None, labels, modal_damping=False)
    try:
        yielding = np.linalg.solve(system.stiffness, np.asarray(system.input_map))
    except np.linalg.LinAlgError:
        return {}
    compliance = float(np.trace(system.output_map @ yielding))
    slopes = matrix_derivatives(machine, paths).stiffness
    if slopes is None or not np.isfinite(compliance) or compliance <= 0:
        return {}
    energies = np.einsum("nd,pnm,md->p", yielding, slopes, yielding)
    return {path: machine.value(path) * float(energy) / compliance for path, energy in zip(paths, energies, strict=True)}


def softest_joint(shares: Mapping[str, float]) -> tuple[str, float]:
    """Return the joint whose springs together have the largest share, and that share; raises ValueError without springs."""
    joints: dict[str, float] = {}
    for path, share in shares.items():
        joint = path.split(".")[1]
        joints[joint] = joints.get(joint, 0.0) + share
    name = max(joints, key=lambda joint: joints[joint])
    return name, joints[name]


def yielding_sentence(shares: Mapping[str, float]) -> str:
    """Return the softest joint with its share in a sentence, empty without springs.

    Examples
    --------
    >>> yielding_sentence({"joints.foot.stiffness.x": 0.5, "joints.foot.stiffness.z": 0.2, "joints.head.stiffness.x": 0.3})
    "Most of the tool's static compliance, 70 %, comes from the joint foot."
    """
    if not shares:
        return ""
    name, share = softest_joint(shares)
    words = "Most of the tool's static compliance" if share > 1 / 2 else "The largest part of the tool's static compliance"
    return f"{words}, {100 * share:.0f} %, comes from the joint {name}."


def spring_paths(machine: Machine) -> list[str]:
    """Return the paths of the springs of joints that can be changed by one number."""
    return [f"joints.{name}.stiffness.{way}" for name, joint in machine.description.joints.items()
            for way, value in joint.stiffness.items() if value > 0]

