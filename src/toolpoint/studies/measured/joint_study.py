"""Joints of a machine from its measured mode shapes, and the machine of these joints beside the measurement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from toolpoint.joint_identification import JointIdentification, identify_joints
from toolpoint.machine import MachineDescription, build
from toolpoint.machine.components import Components
from toolpoint.machine.shapes import body_shapes
from toolpoint.modal_identification import real_modes
from toolpoint.studies.measured.joint_machine import component_masses, machine_of
from toolpoint.studies.measured.model_correlation import correlate
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Modes
from toolpoint.vibration.geometry import Geometry

HEADER = ("mode", "computed Hz", "measured Hz", "difference %", "MAC")


@dataclass(frozen=True, eq=False)
class JointStudy:
    """Joints, the modes, points and components that they came from, and the machine where masses were known."""

    joints: JointIdentification
    modes: Modes
    geometry: Geometry
    components: Components
    machine: MachineDescription | None

    def rows(self) -> list[list[str]]:
        """Return the computed modes beside the measured ones that look like them, then the measured ones without a partner."""
        if self.machine is None:
            return []
        machine = build(self.machine)
        correlation = correlate(machine, real_modes(self.modes))
        partner = {int(j): int(i) for i, j in correlation.pairs.pairs}
        rows = []
        for j, computed in enumerate(body_shapes(machine).frequency):
            row = [str(j + 1), f"{computed:.3f}", "", "", ""]
            if j in partner:
                measured = self.modes.frequency[partner[j]]
                row[2:] = (f"{measured:.3f}", f"{100 * (computed / measured - 1):+.2f}",
                           f"{correlation.mac[partner[j], j]:.3f}")
            rows.append(row)
        return rows + [["no partner", "", f"{self.modes.frequency[i]:.3f}", "", ""] for i in correlation.pairs.single_first]

    def table(self) -> str:
        """Return the joints, and the modes of their machine beside the measured ones, as text."""
        lines = [self.joints.table(), self.joints.status]
        if self.machine is not None:
            lines.append(text_table("The machine of these joints", HEADER, self.rows()))
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the joints as plain data, SI."""
        return {"joints": [joint.as_dict() for joint in self.joints.joints], "status": self.joints.status}


def study_joints(modes: Modes, geometry: Geometry, components: Components, *, coordinate_deviation: float = 0.0) -> JointStudy:
    """Identify the joints between components from measured modes; with the components' masses also the machine of them.

    Parameters
    ----------
    modes : Modes
        As measured; complex ones are turned into the real ones nearest to them.
    geometry : Geometry
        Where the points are, m.
    components : Components
        Which points ride on which component, the chain, and the bodies where known.
    coordinate_deviation : float
        Standard deviation of the points' coordinates, m; it enters all intervals.
    """
    real, owner, bodies = real_modes(modes), components.points, components.bodies
    joints = identify_joints(real, geometry.points, owner, chain=components.chain,
                             masses=component_masses(bodies) if bodies else None, coordinate_deviation=coordinate_deviation)
    machine = machine_of(components.name, joints, bodies, modes=real, points=geometry.points, owner=owner) if bodies else None
    return JointStudy(joints, modes, geometry, components, machine)
