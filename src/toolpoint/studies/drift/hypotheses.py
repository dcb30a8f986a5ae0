r"""Changes of a machine that could explain a drift: each adds a known matrix to its equations, times one unknown number.

A joint whose stiffness changes by the factor :math:`e^\theta` adds :math:`(e^\theta - 1) K_j`, one of its directions alone the
part of that direction, a body whose mass changes :math:`(e^\theta - 1) M_b`. A change that moves all frequencies alike
(temperature, the scale of a clock) needs no matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.linalg

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine, assemble
from toolpoint.machine.assembly.joint_terms import stiffness_of_joint
from toolpoint.machine.assembly.system import loop_basis
from toolpoint.machine.pose.placement import Placement, body_coordinates, place_machine
from toolpoint.vibration import Dof, Modes, eigen

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
# Weights before a test: joints loosen more often than masses change unnoticed.
_JOINT_WEIGHT, _MASS_WEIGHT, _COMMON_WEIGHT = 0.75, 0.2, 0.05
# Standard deviations, before a test, of the logarithm of a factor.
STIFFNESS_DEVIATION, MASS_DEVIATION, COMMON_DEVIATION = 0.3, 0.2, 0.01

MAX_MODE_FREQUENCY_RATIO = 1.5  # of the model's modes over the highest frequency that is asked about
MAX_BASIS_MODES = 150  # of the unchanged machine that changed ones are made of


@dataclass(frozen=True, eq=False)
class Hypothesis(NotebookText):
    """One change that could explain a drift.

    part : what changes; direction : of a joint, empty for all of them together; term : the matrix that changes, or
    ``frequency`` for all frequencies alike; slope : (n, n) per unit of
    factor - 1, in modal coordinates of the unchanged machine, None with ``frequency``; deviation : of the
    logarithm of the factor before the test; weight : its share before the test.
    """

    part: str
    direction: str
    term: Literal["stiffness", "mass", "frequency"]
    slope: FloatArray | None
    deviation: float
    weight: float

    def __repr__(self) -> str:
        return f"Hypothesis({self.part}{' ' * bool(self.direction)}{self.direction}, {self.term})"


@dataclass(frozen=True, eq=False)
class DriftModel(NotebookText):
    """A machine at the pose of a test in its own modal coordinates, without damping, and what could change in it.

    nominal : its undamped modes, of unit modal mass, at the Dofs of the tests, all that carry the changed ones; hypotheses;
    count : of the lowest modes, those that a test can show.
    """

    nominal: Modes
    hypotheses: tuple[Hypothesis, ...]
    count: int

    @cached_property
    def _unchanged(self) -> Modes:
        """The lowest modes of the unchanged machine: each of thousands of trials begins with them."""
        return self.nominal.selected(range(self.count))

    def modes(self, *changes: tuple[Hypothesis, float]) -> Modes:
        """Return the lowest modes with the factor exp(theta) of each change (hypothesis, theta)."""
        scale, changes_made = 1.0, False
        stiffness, mass = np.diag(self.nominal.omega**2), np.eye(self.nominal.count)
        for hypothesis, theta in changes:
            if hypothesis.slope is None:
                scale *= float(np.exp(theta))
            elif theta != 0:
                changes_made = True
                target = stiffness if hypothesis.term == "stiffness" else mass
                target += (np.exp(theta) - 1) * hypothesis.slope
        unchanged = self._unchanged
        if not changes_made:
            return replace(unchanged, frequency=unchanged.frequency * scale)
        squares, vectors = scipy.linalg.eigh(stiffness, mass, subset_by_index=[0, self.count - 1])
        frequency = scale * np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)
        return replace(unchanged, frequency=frequency, shape=self.nominal.shape @ vectors)

    def __repr__(self) -> str:
        return f"DriftModel({self.nominal.count} modes, {len(self.hypotheses)} hypotheses)"


def model_drift(machine: Machine, dofs: Sequence[Dof], pose: Pose | None = None, *, highest: float = np.inf) -> DriftModel:
    """Return the machine seen at these Dofs, with the change of every joint and body, and of all frequencies alike.

    highest : of the frequencies that are asked about, Hz.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine import description as d
    >>> head = d.BodyDescription(100.0, inertia=d.InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = d.JointDescription("ground", "head", stiffness={"x": 1e7})
    >>> tip = d.PointDescription("head")
    >>> machine = build(d.MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": tip}))
    >>> [hypothesis.part for hypothesis in model_drift(machine, [Dof("tip", "+x")]).hypotheses]
    ['joint slide', 'mass of head', 'all frequencies']
    """
    place = place_machine(machine, pose)
    system = replace(assemble(machine, pose, dofs, modal_damping=False, joint_damping=True), damping=None,
                     structural_damping=None)
    basis = loop_basis(place) if machine.loops else None
    nominal = eigen.solve_undamped(system)
    count = min(int((nominal.frequency <= MAX_MODE_FREQUENCY_RATIO * highest).sum()) + 1, nominal.count)
    # Softer joints bring modes from above the band into it. An elastic machine has far more than take part.
    kept = range(min(nominal.count, max(MAX_BASIS_MODES, 2 * count)))
    _, vectors = eigen.mass_normalised(system.mass, system.stiffness)
    motion = (np.eye(system.mass.shape[-1]) if basis is None else basis[0]) @ vectors[:, list(kept)]
    common = Hypothesis("all frequencies", "", "frequency", None, COMMON_DEVIATION, _COMMON_WEIGHT)
    # Shapes and slopes have the same signs: both are of these vectors.
    nominal = replace(nominal.selected(kept), shape=system.output_map @ vectors[:, list(kept)])
    return DriftModel(nominal, (*_joint_changes(place, motion), *_mass_changes(place, motion), common), count)


def _joint_changes(place: Placement, motion: FloatArray) -> list[Hypothesis]:
    machine = place.machine
    names = (*machine.joint_names, *(loop.name for loop in machine.loops))
    slopes = {name: _projected(stiffness_of_joint(place, name), motion) for name in names}
    elastic_joints = [name for name in names if slopes[name].any()]
    result = []
    for name in elastic_joints:
        single = {letter: _projected(stiffness_of_joint(place, name, i), motion) for i, letter in enumerate(DIRECTIONS)}
        single = {letter: slope for letter, slope in single.items() if slope.any()}
        # A matrix with coupling terms has no direction that could change alone.
        is_diagonal = np.allclose(sum(single.values()), slopes[name], atol=1e-9 * float(np.abs(slopes[name]).max()))
        weight, part = _JOINT_WEIGHT / len(elastic_joints), f"joint {name}"
        if len(single) < 2 or not is_diagonal:
            result.append(Hypothesis(part, "", "stiffness", slopes[name], STIFFNESS_DEVIATION, weight))
            continue
        result.append(Hypothesis(part, "", "stiffness", slopes[name], STIFFNESS_DEVIATION, weight / 2))
        result += [Hypothesis(part, letter, "stiffness", slope, STIFFNESS_DEVIATION, weight / 2 / len(single))
                   for letter, slope in single.items()]
    return result


def _mass_changes(place: Placement, motion: FloatArray) -> list[Hypothesis]:
    machine = place.machine
    weight = _MASS_WEIGHT / len(machine.body_names)
    result = []
    for link, name in enumerate(machine.body_names):
        coordinates = body_coordinates(place, link)[0]
        slope = _projected(coordinates.T @ machine.bodies[link].mass @ coordinates, motion)
        if slope.any():
            result.append(Hypothesis(f"mass of {name}", "", "mass", slope, MASS_DEVIATION, weight))
    return result


def _projected(matrix: FloatArray, motion: FloatArray) -> FloatArray:
    modal = motion.T @ matrix @ motion
    return np.asarray((modal + modal.T) / 2)
