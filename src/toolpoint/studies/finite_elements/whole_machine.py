"""A whole machine of solid bodies: finite elements of every part, held together by patches with springs, solved unreduced."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import block_diag, csc_array, diags_array, vstack

from toolpoint._check import FloatArray, fail, floats, nonnegative
from toolpoint.bodies.solid import Patch, SolidModel
from toolpoint.bodies.solid.sensitivity import ElementSensitivity, frequency_sensitivity
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.sparse import EigenPairs, modes

GROUND = "ground"
# Patches of one joint may stand apart by a gasket or by rounding, no more, m.
_GAP = 2e-3
_DIRECTIONS = ("+x", "+y", "+z", "+rx", "+ry", "+rz")


@dataclass(frozen=True, eq=False)
class PatchJoint:
    """Springs between a patch of one part and a patch of another, or the ground.

    Parameters
    ----------
    name : str
    parent, child : str
        Parts; the parent may be ``ground``.
    child_patch, parent_patch : Patch
        In the machine frame; the parent's left out for the ground.
    stiffness : (6,) floats
        Along and about x, y, z of the machine, N/m and N m/rad; not negative.
    """

    name: str
    parent: str
    child: str
    stiffness: FloatArray
    child_patch: Patch
    parent_patch: Patch | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", nonnegative(f"PatchJoint {self.name}.stiffness",
                                                          floats("PatchJoint.stiffness", self.stiffness, (6,))))
        if (self.parent_patch is None) != (self.parent == GROUND):
            fail(f"PatchJoint {self.name}.parent_patch", "given" if self.parent_patch else "none",
                 "must be given for a part, and only then")
        if self.parent_patch is not None:
            gap = float(np.linalg.norm(self.parent_patch.centre - self.child_patch.centre))
            if gap > _GAP:
                fail(f"PatchJoint {self.name}", f"patches {1e3 * gap:.3g} mm apart", f"must be within {1e3 * _GAP:g} mm",
                     "give both in the machine frame, where the parts touch")


@dataclass(frozen=True, eq=False)
class FiniteElementMachine:
    """Parts (solid models in the machine frame) joined by patches.

    `points` are places on parts, a patch with an offset (m) from its centre: ``{"tool": ("head", patch, (0, 0, -0.2))}``.
    """

    parts: dict[str, SolidModel]
    joints: tuple[PatchJoint, ...]
    points: dict[str, tuple[str, Patch, tuple[float, float, float]]]

    def __post_init__(self) -> None:
        for joint in self.joints:
            for end in (joint.parent, joint.child):
                if end != GROUND and end not in self.parts:
                    fail(f"PatchJoint {joint.name}", repr(end), f"must be ground or one of {', '.join(self.parts)}")

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return sum(model.size for model in self.parts.values())

    @cached_property
    def starts(self) -> dict[str, int]:
        """First row of every part."""
        ends = np.cumsum([0, *(model.size for model in self.parts.values())])
        return dict(zip(self.parts, ends[:-1].tolist(), strict=True))

    @property
    def part_mass(self) -> dict[str, float]:
        """Mass of every part, kg."""
        return {name: model.mass_properties.mass for name, model in self.parts.items()}

    def spread(self, part: str, patch: Patch) -> csc_array:
        """Return the weights of a patch of a part in the rows of the machine, (size, 6)."""
        return csc_array(vstack([patch.averages(model) if name == part else csc_array((model.size, 6))
                                 for name, model in self.parts.items()]))

    @cached_property
    def matrices(self) -> tuple[csc_array, csc_array]:
        """Stiffness and mass of the whole machine."""
        stiffness = csc_array(block_diag([model.stiffness() for model in self.parts.values()], format="csc"))
        mass = csc_array(block_diag([model.mass() for model in self.parts.values()], format="csc"))
        for joint in self.joints:
            motion = self.spread(joint.child, joint.child_patch)
            if joint.parent_patch is not None:
                motion = csc_array(motion - self.spread(joint.parent, joint.parent_patch))
            stiffness = csc_array(stiffness + motion @ diags_array(joint.stiffness) @ motion.T)
        return stiffness, mass

    def solve(self, number: int) -> EigenPairs:
        """Return the lowest modes, counted.

        Raises ToolpointError where the machine is left free to move: the part that moves most is named.
        """
        stiffness, mass = self.matrices
        places = np.vstack([model.dof_places for model in self.parts.values()])
        pairs = modes(stiffness, mass, number, coordinates=places)
        if pairs.rigid_count:
            part = max(self.parts, key=lambda name: float(np.abs(self.shape_of(name, pairs)[:, 0]).max()))
            fail("joints", f"{pairs.rigid_count} motions without stiffness, of {part} most of all", "must hold every part",
                 "a drive that is missing, or a joint with a zero?")
        return pairs

    def shape_of(self, part: str, pairs: EigenPairs) -> FloatArray:
        """Return the rows of a part."""
        start = self.starts[part]
        return pairs.vectors[start:start + self.parts[part].size]

    def point_modes(self, pairs: EigenPairs, damping_ratio: float) -> Modes:
        """Return the modes at the named points, in all six directions, with this damping ratio."""
        rows, labels = [], []
        for name, (part, patch, offset) in self.points.items():
            twist = self.spread(part, patch).T @ pairs.vectors
            arm = np.array(offset)
            rows.append(np.vstack([twist[:3] + np.cross(twist[3:].T, arm).T, twist[3:]]))
            labels += [Dof(name, direction) for direction in _DIRECTIONS]
        damping = np.full(pairs.count, damping_ratio)
        return Modes(pairs.frequency, damping, np.vstack(rows), tuple(labels), notes=(pairs.status,))

    def sensitivities(self, pairs: EigenPairs) -> dict[str, ElementSensitivity]:
        """Return what E and density of every element of every part do to the frequencies."""
        return {name: frequency_sensitivity(model, pairs.squares, self.shape_of(name, pairs))
                for name, model in self.parts.items()}

    def joint_shares(self, pairs: EigenPairs) -> dict[str, FloatArray]:
        """Return the share of every joint in the strain energy of every mode."""
        shares = {}
        for joint in self.joints:
            motion = self.spread(joint.child, joint.child_patch)
            if joint.parent_patch is not None:
                motion = csc_array(motion - self.spread(joint.parent, joint.parent_patch))
            shares[joint.name] = (joint.stiffness[:, None] * (motion.T @ pairs.vectors) ** 2).sum(axis=0) / pairs.squares
        return shares
