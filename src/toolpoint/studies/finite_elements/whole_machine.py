"""Whole machine of solid bodies: finite elements of every part, joined by patches with springs, solved unreduced."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import block_diag, csc_array, diags_array, vstack

from toolpoint._check import FloatArray, fail, floats, nonnegative
from toolpoint.bodies.solid import Patch, SolidModel
from toolpoint.bodies.solid.sensitivity import ElementSensitivity, frequency_sensitivity
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.sparse import EigenPairs, Factorisation, factorise, modes

GROUND = "ground"  # name of the parent of joints that hold a part to the floor
# Patches of one joint may be apart by a gasket or by rounding, no more, m.
_MAX_PATCH_GAP = 2e-3
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
        Along and about x, y, z of the machine at the patch's centre, N/m and N m/rad; not negative.
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
            if gap > _MAX_PATCH_GAP:
                fail(f"PatchJoint {self.name}", f"patches {1e3 * gap:.3g} mm apart",
                     f"must be within {1e3 * _MAX_PATCH_GAP:g} mm",
                     remedy="give both in the machine frame, where the parts touch")


@dataclass(frozen=True, eq=False)
class FiniteElementMachine:
    """Parts (solid models in the machine frame) joined by patches.

    Its coordinates are three displacements a node, part after part. `points` are places that move rigidly with a patch: part,
    patch and offset from its centre (m), ``{"tool": ("head", patch, (0, 0, -0.2))}``.
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
        """Part to its first row in the coordinates of the machine."""
        ends = np.cumsum([0, *(model.size for model in self.parts.values())])
        return dict(zip(self.parts, ends[:-1].tolist(), strict=True))

    @property
    def part_mass(self) -> dict[str, float]:
        """Mass of every part, kg."""
        return {name: model.mass_properties.mass for name, model in self.parts.items()}

    @cached_property
    def nodes(self) -> FloatArray:
        """Places of all nodes (n, 3), part after part, m; node number 1 is the first row."""
        return np.vstack([model.nodes for model in self.parts.values()])

    @cached_property
    def part_of_node(self) -> tuple[str, ...]:
        """Part that every node belongs to."""
        return tuple(name for name, model in self.parts.items() for _ in range(len(model.nodes)))

    def scaled(self, *, modulus: Mapping[str, float] | None = None, density: Mapping[str, float] | None = None,
               joints: Mapping[str, float] | None = None) -> FiniteElementMachine:
        """Return the machine with Young's modulus and density of parts, and stiffness of joints, times these factors.

        A name is a part, or a set of a part as ``column.layer``.
        """
        set_names = {name for part, model in self.parts.items() for name in (part, *(f"{part}.{s}" for s in model.set_names))}
        for what, factors, names in (("modulus", modulus, set_names), ("density", density, set_names),
                                     ("joints", joints, {joint.name for joint in self.joints})):
            unknown = sorted(set(factors or {}) - names)
            if unknown:
                fail(what, repr(unknown[0]), f"must be of {', '.join(sorted(names))}")
        parts = {name: _scale_part(name, model, modulus or {}, density or {}) for name, model in self.parts.items()}
        held = tuple(replace(joint, stiffness=joint.stiffness * (joints or {}).get(joint.name, 1.0)) for joint in self.joints)
        return FiniteElementMachine(parts, held, self.points)

    def part_alone(self, part: str) -> FiniteElementMachine:
        """Return one part by itself, its carrying joints on the ground; the parts that it carries are left out."""
        joints = tuple(replace(joint, parent=GROUND, parent_patch=None) for joint in self.joints if joint.child == part)
        if not joints:
            fail("part", repr(part), "must be carried by a joint as its child",
                 remedy=f"one of {', '.join(dict.fromkeys(joint.child for joint in self.joints))}")
        points = {name: place for name, place in self.points.items() if place[0] == part}
        return FiniteElementMachine({part: self.parts[part]}, joints, points)

    def spread(self, part: str, patch: Patch) -> csc_array:
        """Return the weights of a patch of a part in the rows of the machine, (size, 6)."""
        return csc_array(vstack([patch.averages(model) if name == part else csc_array((model.size, 6))
                                 for name, model in self.parts.items()]))

    @cached_property
    def matrices(self) -> tuple[csc_array, csc_array]:
        """Stiffness (N/m) and mass (kg) of the whole machine, (size, size) each."""
        stiffness = csc_array(block_diag([model.stiffness() for model in self.parts.values()], format="csc"))
        mass = csc_array(block_diag([model.mass() for model in self.parts.values()], format="csc"))
        for joint in self.joints:
            motion = self.joint_motions[joint.name]
            # A joint adds no coordinates: its springs act between the mean motions of its two patches.
            stiffness = csc_array(stiffness + motion @ diags_array(joint.stiffness) @ motion.T)
        return stiffness, mass

    @cached_property
    def inverse(self) -> Factorisation:
        """Factors of the stiffness, kept; of a machine whose joints hold every part."""
        return factorise(self.matrices[0], coordinates=self.dof_places)

    @property
    def dof_places(self) -> FloatArray:
        """Coordinates of the node of every row, (size, 3), m."""
        return np.vstack([model.dof_places for model in self.parts.values()])

    def solve(self, number: int, *, is_counted: bool = True) -> EigenPairs:
        """Return the `number` lowest modes.

        is_counted : whether a count of eigenvalues, by one more factorisation, confirms that none is missing. Raises
        ToolpointError where the machine is left free to move: the part that moves most is named.
        """
        stiffness, mass = self.matrices
        pairs = modes(stiffness, mass, number, coordinates=self.dof_places, is_counted=is_counted)
        if pairs.rigid_count:
            # The part that moves most in the first motion without stiffness is the one that lacks a joint.
            part = max(self.parts, key=lambda name: float(np.abs(self.shape_of(name, pairs)[:, 0]).max()))
            fail("joints", f"{pairs.rigid_count} motions without stiffness, of {part} most of all", "must hold every part",
                 remedy="a drive that is missing, or a joint with a zero?")
        return pairs

    def shape_of(self, part: str, pairs: EigenPairs) -> FloatArray:
        """Return the rows of a part in all modes, (part size, n_modes)."""
        start = self.starts[part]
        return pairs.vectors[start:start + self.parts[part].size]

    def motion_of(self, dofs: Sequence[Dof]) -> csc_array:
        """Return the map from all coordinates to Dofs at nodes (numbers from 1, over all parts), shape (size, n_dofs)."""
        rows, columns, values = [], [], []
        for k, dof in enumerate(dofs):
            if not isinstance(dof.point, int) or not 1 <= dof.point <= len(self.nodes) or dof.is_rotation:
                fail("dofs", str(dof), f"must be a translation of a node, a number from 1 to {len(self.nodes)}")
            # Three rows a node (x, y, z); numbers of nodes begin at 1.
            rows += [3 * (dof.point - 1) + i for i in range(3)]
            columns += [k] * 3
            values += dof.unit[:3].tolist()
        return csc_array((values, (rows, columns)), shape=(self.size, len(dofs)))

    def modes_at(self, pairs: EigenPairs, dofs: Sequence[Dof], damping_ratio: float | FloatArray) -> Modes:
        """Return the modes at Dofs of nodes (numbers from 1, over all parts), with one damping ratio or (n_modes,)."""
        damping = np.broadcast_to(damping_ratio, (pairs.count,))
        return Modes(pairs.frequency, damping, self.motion_of(dofs).T @ pairs.vectors, tuple(dofs), notes=(pairs.status,))

    def node_modes(self, pairs: EigenPairs, nodes: Sequence[int], damping_ratio: float | FloatArray) -> Modes:
        """Return the modes at nodes (numbers from 1) along x, y and z, with one damping ratio or (n_modes,)."""
        return self.modes_at(pairs, [Dof(int(node), way) for node in nodes for way in _DIRECTIONS[:3]], damping_ratio)

    def effective_mass(self, pairs: EigenPairs) -> FloatArray:
        """Return the effective modal mass in translation, all three directions together, (n_modes,), kg."""
        # Modes have unit modal mass: the squared momentum in a direction is the effective mass.
        momentum = (self.matrices[1] @ pairs.vectors).reshape(-1, 3, pairs.count).sum(axis=0)
        return np.asarray((momentum**2).sum(axis=0))

    def material_damping(self, pairs: EigenPairs) -> FloatArray:
        """Return the materials' part of the damping ratio, (n_modes,).

        Half the loss factors of all sets by their shares in the strain energy (modal strain energy; Johnson, Kienholz, AIAA J.
        20 (1982)). First order: a layer that carries most of a mode's energy and turns its shape needs a complex solution.
        """
        total = np.zeros(pairs.count)
        for name, slopes in self.sensitivities(pairs).items():
            for group, (modulus, _) in slopes.by_set().items():
                total += self.parts[name].materials[group].loss_factor * modulus
        return total

    def point_modes(self, pairs: EigenPairs, damping_ratio: float | FloatArray) -> Modes:
        """Return the modes at the named points, in all six directions, with one damping ratio or (n_modes,).

        Where points are named tool and work, also of the tool against the work, ``tool-work:+x`` and so on.
        """
        rows, labels = self.point_rows(pairs.vectors)
        damping = np.broadcast_to(damping_ratio, (pairs.count,))
        return Modes(pairs.frequency, damping, rows, labels, notes=(pairs.status,))

    def point_rows(self, vectors: FloatArray) -> tuple[FloatArray, tuple[Dof, ...]]:
        """Return the motions (size, m) at the points of `point_modes`, (n_dofs, m), and the labels."""
        rows, labels = [], []
        for name, (part, patch, offset) in self.points.items():
            twist = self.spread(part, patch).T @ vectors
            # The mean twist of the patch is carried to the point, whose offset counts as rigid.
            arm = np.array(offset)
            rows.append(np.vstack([twist[:3] + np.cross(twist[3:].T, arm).T, twist[3:]]))
            labels += [Dof(name, direction) for direction in _DIRECTIONS]
        if {"tool", "work"} <= set(self.points):
            names = list(self.points)
            rows.append((rows[names.index("tool")] - rows[names.index("work")])[:3])
            labels += [Dof("tool-work", direction) for direction in _DIRECTIONS[:3]]
        return np.vstack(rows), tuple(labels)

    def sensitivities(self, pairs: EigenPairs) -> dict[str, ElementSensitivity]:
        """Return part to the relative sensitivities of the frequencies to E and density of each of its elements."""
        return {name: frequency_sensitivity(model, pairs.squares, self.shape_of(name, pairs))
                for name, model in self.parts.items()}

    @cached_property
    def joint_motions(self) -> dict[str, csc_array]:
        """Joint to W (size, 6): W^T u is the twist (m, rad) of the child's patch against the parent's."""
        motions = {}
        for joint in self.joints:
            motion = self.spread(joint.child, joint.child_patch)
            if joint.parent_patch is not None:
                motion = csc_array(motion - self.spread(joint.parent, joint.parent_patch))
            motions[joint.name] = motion
        return motions

    def joint_shares(self, pairs: EigenPairs) -> dict[str, FloatArray]:
        """Return joint to its share in the strain energy of every mode, (n_modes,)."""
        shares = {}
        for joint in self.joints:
            motion = self.joint_motions[joint.name]
            # Of modes of unit modal mass twice the strain energy is the squared circular frequency.
            shares[joint.name] = (joint.stiffness[:, None] * (motion.T @ pairs.vectors) ** 2).sum(axis=0) / pairs.squares
        return shares


def _scale_part(part: str, model: SolidModel, modulus: Mapping[str, float], density: Mapping[str, float]) -> SolidModel:
    """Return a part with moduli and densities of its sets times the factors of the part, and of the set."""
    def factor(factors: Mapping[str, float], name: str) -> float:
        return factors.get(part, 1.0) * factors.get(f"{part}.{name}", 1.0)

    materials = {name: replace(model.materials[name], modulus=model.materials[name].modulus * factor(modulus, name),
                               density=model.materials[name].density * factor(density, name)) for name in model.set_names}
    return replace(model, materials=materials)
