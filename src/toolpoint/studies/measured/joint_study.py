"""Joints of a machine from its measured mode shapes, and the machine of these joints beside the measurement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification import JointIdentification, identify_joints
from toolpoint.joint_identification.machine.law_choice import name_of
from toolpoint.machine import Machine, MachineDescription, build
from toolpoint.machine.assembly.joint_terms import joint_matrices
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.components import Components
from toolpoint.machine.pose.placement import place_machine
from toolpoint.studies.measured.bisector_steps import BisectorSteps, retrace_steps
from toolpoint.studies.measured.component_places import place_test
from toolpoint.studies.measured.doubled_modes import leave_doubled_out
from toolpoint.studies.measured.joint_machine import component_masses, describe_fit, layouts_of, machine_of
from toolpoint.studies.measured.law_spread import cover_rivals
from toolpoint.studies.measured.machine_check import HEADER, MachineCheck, check_machine
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Modes
from toolpoint.vibration.geometry import Geometry

_MIN_ENERGY_FRACTION = 0.5  # of a mode's strain energy, from which it is a joint's own


@dataclass(frozen=True, eq=False)
class JointStudy(NotebookText):
    """Joints, the modes, points and components that they came from, and the machine where masses were known.

    machine : its description, None for the reason in `no_machine_reason`; checked : the machine as it runs beside the measured
    modes; channel_doubts : of the responses that the modes were identified from; law_doubts : differences between laws of
    damping that the test does not separate.
    """

    joints: JointIdentification
    modes: Modes
    geometry: Geometry
    components: Components
    machine: MachineDescription | None
    no_machine_reason: str = ""
    checked: MachineCheck | None = None
    channel_doubts: tuple[Doubt, ...] = ()
    law_doubts: tuple[Doubt, ...] = ()

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the result, each once: of the channels, the joints, the whole, the machine that was run."""
        # One turned sensor is in doubt at every joint of its component: it is said once, with all of them.
        joints_of: dict[Doubt, list[str]] = {}
        for joint in self.joints.joints:
            for doubt in joint.doubts:
                joints_of.setdefault(doubt, []).append(f"{joint.parent} - {joint.child}")
        lines = [doubt.within(", ".join(names)) for doubt, names in joints_of.items()]
        checked = self.checked.doubts if self.checked else ()
        fitted_machine = self.joints.machine
        if self.checked is not None and fitted_machine is not None and set(self.checked.single) <= set(fitted_machine.lonely):
            # The fit has said of the same modes that it left them out.
            checked = tuple(doubt for doubt in checked if doubt not in self.checked.partnerless)
        return tuple(dict.fromkeys([*self.channel_doubts, *self.joints.doubts, *self.law_doubts, *lines, *checked]))

    def steps(self) -> tuple[BisectorSteps, ...]:
        """Return the steps of the method's first source at every joint, beside these joints."""
        return retrace_steps(self.joints, self.modes, self.geometry, components=self.components)

    def compared(self, machine: Machine) -> JointStudy:
        """Return the study with this machine, as it was read back from its file, run and set beside the measured modes."""
        checked = check_machine(machine, self.modes)
        return replace(self, checked=checked, joints=_doubted_by_modes(self.joints, machine, checked))

    @property
    def softest(self) -> tuple[str, float] | None:
        """Joint with the largest share in the strain energy of the lowest mode, and that share; None without a machine."""
        if self.machine is None:
            return None
        shares = _energy_shares(build(self.machine), 0)
        body = max(shares, key=lambda name: shares[name])
        words = next((f"{joint.parent} - {joint.child}" for joint in self.joints.joints if joint.child == body), body)
        return words, shares[body]

    @property
    def status(self) -> str:
        """Reliability of the result: established only without doubts about the joints and their machine."""
        if self.doubts and self.joints.certain:
            return f"doubtful: {len(self.doubts)} doubt{'s' if len(self.doubts) > 1 else ''} on the test or the machine of it"
        return self.joints.status

    def table(self) -> str:
        """Return doubts first, the joints, then the modes of their machine beside the measured ones, as text."""
        # The table of the joints repeats the doubts where they belong.
        lines = [*mark_notes(text for text in self.doubts if text not in self.joints.doubts), self.joints.table()]
        if self.checked is not None:
            lines.append(text_table("The machine of these joints", HEADER, self.checked.rows()))
            lines.append(self.checked.status)
        elif self.no_machine_reason:
            lines.append(f"no machine: {self.no_machine_reason}")
        lines.append(self.status.split(";")[0])
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return all that the page shows as plain data, SI: joints with covariance, doubts, modes, the machine or why not."""
        whole_machine = self.joints.machine
        return {"joints": [joint.as_dict() for joint in self.joints.joints], "status": self.status,
                "doubts": list(self.doubts), "notes": list(self.joints.notes),
                "damping": None if whole_machine is None or whole_machine.law is None else whole_machine.law.to_dict(),
                "machine": None if self.machine is None else "described",
                "missing": self.no_machine_reason, "modes": None if self.checked is None else self.checked.to_dict()}


def study_joints(modes: Modes, geometry: Geometry, components: Components, *, coordinate_deviation: float | None = None,
                 channel_doubts: Sequence[Doubt] = ()) -> JointStudy:
    """Identify the joints between components from measured modes; with the components' masses also the machine of them.

    Parameters
    ----------
    modes : Modes
        As measured, complex ones as they are.
    geometry : Geometry
        Where the points are, m.
    components : Components
        Which points ride on which component, the chain or tree, and the bodies where known.
    coordinate_deviation : float, optional
        Standard deviation of the points' coordinates, m; it enters all intervals. That of the components where left out.
    channel_doubts : sequence of Doubt
        Of the responses that the modes were identified from (`identify_modes(...).doubts`), to be shown first.

    Raises
    ------
    ToolpointError
        For points in another unit, and a frame that the bodies do not fix, see `place_test`.

    Examples
    --------
    Runs in ``examples/find_joints_of_a_machine.py``.
    """
    placement = place_test(geometry.points, components)
    geometry = replace(geometry, points=placement.places(geometry.points))
    modes, doubled = leave_doubled_out(placement.turned(modes))
    bodies = components.bodies
    deviation = components.coordinate_deviation if coordinate_deviation is None else coordinate_deviation
    joints = identify_joints(modes, geometry.points, components.points, chain=components.chain,
                             masses=component_masses(components) if bodies else None, coordinate_deviation=deviation,
                             calibration_deviation=components.calibration_deviation)
    # The machine has a wrong point where the other points put it: it may be the one that was struck.
    if joints.wrong_points is not None:
        geometry = replace(geometry, points={**geometry.points, **joints.wrong_points.places})
    study = JointStudy(joints, modes, geometry, components, None, channel_doubts=(*placement.doubts, *channel_doubts, *doubled))
    if not bodies:
        return replace(study, no_machine_reason="no mass properties; a machine needs the body of every component")
    try:
        machine = machine_of(joints, components, modes=modes, points=geometry.points)
        machine, law_doubts = _with_rival_laws(machine, joints, components)
        study = replace(study, law_doubts=law_doubts)
        built = build(machine)
    # Joints are worth having without a machine: the reason goes beside them.
    except (ToolpointError, np.linalg.LinAlgError) as error:
        return replace(study, no_machine_reason=str(error))
    study = replace(study, machine=machine).compared(built)
    # What is doubted goes with the machine, so that every use of its file repeats it.
    return replace(study, machine=replace(machine, doubts=study.doubts))


def _with_rival_laws(machine: MachineDescription, joints: JointIdentification, components: Components
                     ) -> tuple[MachineDescription, tuple[Doubt, ...]]:
    """Return the machine with intervals that cover rival laws of damping, and a doubt where their answers differ.

    Rivals are the laws that the test does not separate from the machine's own.
    """
    whole_machine = joints.machine
    if whole_machine is None or whole_machine.law is None or not whole_machine.law.rivals:
        return machine, ()
    rivals = []
    for fit in whole_machine.law.rivals:
        other = replace(whole_machine, fit=fit)
        described = describe_fit(other, fit.x, components, layouts=layouts_of(other, components))
        rivals.append((name_of(fit.model), replace(described, points=machine.points)))
    covered, spread = cover_rivals(machine, rivals)
    return covered, spread.doubts


def _energy_shares(machine: Machine, mode: int) -> dict[str, float]:
    """Return the share of the joint that carries each body in the strain energy of a mode, by the body's name."""
    stiffness, vector = joint_matrices(place_machine(machine))[0][0], body_shapes(machine).vectors[:, mode]
    work = vector * (stiffness @ vector)  # by coordinate: a joint's share is the sum over its own
    return {name: float(work[list(columns)].sum() / work.sum())
            for name, columns in zip(machine.body_names, machine.joint_columns, strict=True)}


def _doubted_by_modes(joints: JointIdentification, machine: Machine, checked: MachineCheck) -> JointIdentification:
    """Return the joints with a doubt on those that hold most of the strain energy of modes which the test should have shown.

    Where one of several close modes was found, its shape is a mixture of them, and a stiffness matrix can follow that.
    """
    if not len(checked.unseen):
        return joints
    held: dict[str, list[str]] = {}
    for mode in checked.unseen:
        for name, share in _energy_shares(machine, mode).items():
            if share > _MIN_ENERGY_FRACTION:
                held.setdefault(name, []).append(f"{checked.frequency[mode]:.4g} Hz")
    changed = []
    for joint in joints.joints:
        if joint.child in held:
            doubt = Doubt("stiffness", f"the test does not show the modes at {', '.join(held[joint.child])} that it holds most "
                          "of the energy of; what was measured near them may be their mixture",
                          "excite where they move, with finer lines")
            changed.append(replace(joint, doubts=tuple(dict.fromkeys((*joint.doubts, doubt)))))
        else:
            changed.append(joint)
    return replace(joints, joints=tuple(changed))
