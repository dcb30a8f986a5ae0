"""Values of a machine file that are possible but hardly meant: said by `check`, never refused."""

from __future__ import annotations

from toolpoint.machine import Machine
from toolpoint.machine.description import FrameDescription, JointDescription

HEAVIEST = 2e5  # kg; the bed of a large portal mill
NOWHERE = FrameDescription()


def question_machine(machine: Machine) -> tuple[str, ...]:
    """Return doubts about joints without a place, masses beyond machine tools, and a speed range that runs backwards."""
    description = machine.description
    lines = [f"bodies.{name}: {body.mass[0, 0]:.4g} kg, more than any part of a machine tool ({HEAVIEST:g} kg); check the unit"
             for name, body in zip(description.bodies, machine.bodies, strict=True) if body.mass[0, 0] > HEAVIEST]
    lines += [f"joints.{name}: no place is given, so its springs stand at 0, 0, 0 of the machine; write 'at: [x, y, z]' unless "
              "that is where they are" for name, joint in description.joints.items()
              if _is_out_of_place(joint)]
    cut = description.cutting
    if cut is not None and cut.speeds[0] >= cut.speeds[1]:
        lines.append(f"cutting.speeds: from {cut.speeds[0]:g} to {cut.speeds[1]:g} rev/min runs backwards or is empty; write "
                     "the lower speed first")
    return tuple(lines)


def _is_out_of_place(joint: JointDescription) -> bool:
    """Return whether a joint has springs and the place that stands where none is written."""
    is_elastic = bool(joint.stiffness) or joint.stiffness_matrix is not None
    return is_elastic and joint.parent_interface is None and joint.child_interface is None and joint.frame == NOWHERE
