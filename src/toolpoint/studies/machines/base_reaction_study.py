"""Base reactions: force and moment of the ground on a machine at rest, at one pose or several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.kinematics.chain import check_poses
from toolpoint.machine import Machine
from toolpoint.machine.assembly.inverse_dynamics import base_reaction
from toolpoint.machine.description.gravity import STANDARD_GRAVITY, gravity_of
from toolpoint.studies.machines.pose_words import direction_words, pose_words
from toolpoint.studies.text_table import text_table

HEADER = ("pose", "Fx N", "Fy N", "Fz N", "Mx N m", "My N m", "Mz N m")


@dataclass(frozen=True, eq=False)
class BaseReactions(NotebookText):
    """Force (N) and moment (N m, about the machine's origin) of the ground on a machine at rest, (n_poses, 6); its mass, kg."""

    machine: Machine
    poses: tuple[Mapping[str, float], ...]
    wrench: FloatArray
    mass: float
    notes: tuple[str, ...] = ()

    def table(self) -> str:
        """Return a row for every pose, and the mass, as text."""
        rows = [[pose_words(self.machine, pose), *(f"{v:.6g}" for v in row)]
                for pose, row in zip(self.poses, self.wrench, strict=True)]
        title = f"The ground on {self.machine.name} at rest, moments about the machine's origin; mass {self.mass:.6g} kg"
        return "\n".join([text_table(title, HEADER, rows), *mark_notes(self.notes, "note: ")])

    def to_dict(self) -> dict[str, Any]:
        """Return poses (m, rad), force (N), moment (N m) and mass (kg) as plain data."""
        return {"mass_kg": self.mass, "notes": list(self.notes), "reactions": [
            {"pose": dict(pose), "force_n": row[:3].tolist(), "moment_nm": row[3:].tolist()}
            for pose, row in zip(self.poses, self.wrench, strict=True)]}


def study_base_reactions(machine: Machine, poses: Sequence[Mapping[str, float]] = ()) -> BaseReactions:
    """Return the force and moment by which the ground holds a machine at rest: its weight and the moments of its bodies.

    Gravity is that of the machine; where it states none, 9.80665 m/s^2 against the `up` of the machine, which a note says.

    Parameters
    ----------
    machine : Machine
        Springs are taken as rigid: what they give under the weight moves no mass to speak of.
    poses : sequence of mappings of axis name to m or rad
        Those of the description, or the reference pose, where left out.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 4e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.03))
    >>> float(study_base_reactions(machine).wrench[0, 2])  # N, 100 kg of standard gravity
    980.665
    """
    chosen = tuple(check_poses(poses) if poses else machine.description.poses) or ({},)
    gravity = gravity_of(machine.description)
    notes: tuple[str, ...] = ()
    if machine.description.gravity is None:
        down = direction_words(-np.asarray(machine.description.up))
        notes = (f"the file states no gravity: {STANDARD_GRAVITY} m/s^2 along {down} of the machine is taken; write gravity: "
                 "9.81 and up: y where y is up",)
    wrench = np.concatenate([base_reaction(machine, pose, gravity=gravity) for pose in chosen])
    # Components of rounding would be read as forces of the ground.
    wrench = np.where(np.abs(wrench) < 1e-9 * np.abs(wrench).max(initial=1.0), 0.0, wrench)
    mass = float(sum(body.mass[0, 0] for body in machine.bodies))
    loads = ("its loads (section loads) are not in it",) if machine.description.loads else ()
    return BaseReactions(machine, chosen, wrench, mass, (*notes, *loads))
