"""Doubts about laws of joints whose stiffness stays constant while the machine moves or spins."""

from __future__ import annotations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.machine.description import JointDescription, MachineDescription
from toolpoint.machine.parts.laws import driven_ways

SPIN_SPEED_TOLERANCE = 0.02  # difference of a bearing's speed from its shaft's, over the latter


def question_laws(machine: Machine) -> list[Doubt]:
    """Return doubts about ball screws whose nut stays while an axis moves, and bearings at another speed than their shaft."""
    description = machine.description
    lines: list[Doubt] = []
    for name, joint in description.joints.items():
        if joint.law is None:
            continue
        screw = joint.law.ball_screw
        if screw is not None and not screw.follows and screw.along in driven_ways(description, name):
            lines.append(Doubt(f"joints.{name}.law.ball_screw", f"an axis drives it along {screw.along}, but its stiffness is "
                               f"that of nut_at {1e3 * screw.nut_at:.4g} mm at every position", "write 'follows: away' (or "
                               "towards) the thrust bearing"))
        bearing, spin = joint.law.bearing, _relative_spin(description, joint)
        if bearing is not None and not bearing.follows and spin and abs(bearing.speed - spin) > SPIN_SPEED_TOLERANCE * spin:
            lines.append(Doubt(f"joints.{name}.law.bearing", f"its shaft spins at {spin:.4g} rev/min, it is computed at "
                               f"{bearing.speed:.4g} rev/min", "write 'follows: spin' in place of its speed"))
    return lines


def _relative_spin(description: MachineDescription, joint: JointDescription) -> float:
    """Return the speed of the child against the parent of a joint, rev/min, not negative; the ground stands still."""
    speeds = [0.0 if (body := description.bodies.get(name)) is None or body.spin is None else body.spin.speed
              for name in (joint.parent, joint.child)]
    return abs(speeds[1] - speeds[0]) * 30 / np.pi
