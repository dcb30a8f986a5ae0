"""Bodies and paths of a machine as plain arrays for the compiled kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolpoint._check import BoolArray, FloatArray
from toolpoint.machine.parts.model import Machine

POSE_BLOCK_SIZE = 64  # poses that the compiled kernels take side by side


class JointTree(NamedTuple):
    """Joints of a tree: parents, frames at the reference pose, the joint and twist (n_steps, 6) of every step, and whether the
    springs travel with the child."""

    parents: np.ndarray
    rotation: FloatArray
    place: FloatArray
    joint_of_step: np.ndarray
    twists: FloatArray
    at_child: np.ndarray


class BodyMoments(NamedTuple):
    """Mass (nb,), first (nb, 3) and second moment (nb, 3, 3) about the machine's origin at the reference pose."""

    mass: FloatArray
    first: FloatArray
    second: FloatArray


class JointMotions(NamedTuple):
    """Unit twists (n, 6) in joint frames, their joints, and whether link i is on the path to link j."""

    columns: FloatArray
    joint: np.ndarray
    on_path: np.ndarray


def body_moments(machine: Machine) -> BodyMoments:
    """Return masses (n,), first (n, 3) and second moments (n, 3, 3) about the machine's origin at the reference pose."""
    links = len(machine.bodies)
    mass, first, second = np.empty(links), np.empty((links, 3)), np.empty((links, 3, 3))
    for i, body in enumerate(machine.bodies):
        r, t = machine.body_frames[i, :3, :3], machine.body_frames[i, :3, 3]
        m = body.mass[0, 0]
        h = np.array([body.mass[5, 1], body.mass[3, 2], body.mass[4, 0]])
        inertia = body.mass[3:, 3:]
        s = r @ (0.5 * np.trace(inertia) * np.eye(3) - inertia) @ r.T
        h = r @ h
        mass[i], first[i], second[i] = m, h + m * t, s + np.outer(h, t) + np.outer(t, h) + m * np.outer(t, t)
    return BodyMoments(mass, first, second)


def paths_of(machine: Machine) -> BoolArray:
    """Return whether link i is on the path to link j, shape (n_links, n_links)."""
    links = len(machine.bodies)
    on_path = np.zeros((links, links), bool)
    for i in range(links):
        on_path[list(machine.chain.path(i)), i] = True
    return on_path


def tree_arrays(machine: Machine) -> tuple[JointTree, BodyMoments, JointMotions]:
    """Return joints, bodies and motions of a tree as the kernels take them."""
    chain = machine.chain
    columns = np.concatenate([law.basis.T for law in machine.joints])
    column_link = np.concatenate([[i] * len(law.freedoms) for i, law in enumerate(machine.joints)]).astype(np.int64)
    axis_of = np.array([step.joint for step in chain.steps], np.int64)
    twists = np.eye(6)[[step.way for step in chain.steps]]
    tree = JointTree(np.array(chain.parents, np.int64), np.ascontiguousarray(chain.frames[:, :3, :3]),
                     np.ascontiguousarray(chain.frames[:, :3, 3]), axis_of, twists, np.array(machine.elastic_at_child))
    return (tree, body_moments(machine),
            JointMotions(np.ascontiguousarray(columns), column_link, paths_of(machine)))
