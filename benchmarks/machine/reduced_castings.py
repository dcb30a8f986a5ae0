"""Random machines of two or three elastic castings, some places sliding: the estimated error of their modes against the truth.

Run: python benchmarks/machine/reduced_castings.py [--machines 20]; with --speed poses per second of these machines on one foot.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.linalg import block_diag, eigh

from benchmarks.frame import CommandLine
from toolpoint.bodies.solid import CAST_IRON, STEEL, Casting, Cuboid, Patch, SolidModel
from toolpoint.machine import Machine, build
from toolpoint.machine.assembly.joint_terms import loop_frame
from toolpoint.machine.assembly.reduction_estimate import estimate_reduction
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
)
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.parts.elastic_body import SlidingPatch, reduce_solid
from toolpoint.machine.pose.placement import Placement, place_machine
from toolpoint.spatial import transform as tf

COUNT, BAND = 8, 700.0
WAYS = ("x", "y", "z", "rx", "ry", "rz")
SEEN = 1e-8  # a smaller true error is the truth's own digits


class Castings:
    """A bed on two feet, a column that slides on it along x, and on the column an arm or a rigid head that slides along z."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        draw = self.random.uniform
        self.length, self.height, self.deep = draw(0.8, 1.2), draw(0.6, 0.9), draw(0.08, 0.12)
        self.has_arm = bool(self.random.random() < 0.5)
        self.models: dict[str, SolidModel] = {}
        self.places: dict[str, dict[str, Patch | SlidingPatch]] = {}
        self._bed()
        self._column()
        if self.has_arm:
            self._arm()
        self.machine = self._machine()

    def _bed(self) -> None:
        d = self.deep
        self.models["bed"] = Casting((Cuboid([0, 0, -d], [self.length, d, 0]),), {"body": CAST_IRON}).meshed(0.13)
        way = Patch([self.length / 2, d / 2, 0], [1, 0, 0], [0, 1, 0], 0.12, 0.06)
        self.places["bed"] = {"left": Patch([0.1, d / 2, -d], [1, 0, 0], [0, -1, 0], 0.1, d),
                              "right": Patch([self.length - 0.1, d / 2, -d], [1, 0, 0], [0, -1, 0], 0.1, d),
                              "way": SlidingPatch(way, np.array([1.0, 0, 0]), -0.25, 0.25)}

    def _column(self) -> None:
        d, x = self.deep, self.length / 2
        box = Cuboid([x - d / 2, 0, 0], [x + d / 2, d, self.height])
        self.models["column"] = Casting((box,), {"body": STEEL}).meshed(0.11)
        way = Patch([x, 0, self.height / 2], [0, 0, 1], [1, 0, 0], 0.1, 0.05)
        self.places["column"] = {"base": Patch([x, d / 2, 0], [1, 0, 0], [0, -1, 0], d, d),
                                 "way": SlidingPatch(way, np.array([0, 0, 1.0]), -0.2, 0.2)}

    def _arm(self) -> None:
        x, z = self.length / 2, self.height / 2
        box = Cuboid([x - 0.03, -0.4, z - 0.05], [x + 0.03, 0, z + 0.05])
        self.models["arm"] = Casting((box,), {"body": STEEL}).meshed(0.1)
        self.places["arm"] = {"saddle": Patch([x, 0, z], [0, 0, 1], [1, 0, 0], 0.1, 0.05),
                              "nose": Patch([x, -0.4, z], [1, 0, 0], [0, 0, 1], 0.05, 0.08)}

    def _springs(self, locked: float = 0.0) -> dict[str, float]:
        """Random springs; some direction but the first (of the drive) is locked now and then."""
        values = dict(zip(WAYS, (*10 ** self.random.uniform(7.3, 8.8, 3), *10 ** self.random.uniform(5, 6.5, 3)), strict=True))
        if self.random.random() < locked:
            values.pop(str(self.random.choice(["y", "ry", "rz"])))
        return {way: float(value) for way, value in values.items()}

    def _machine(self) -> Machine:
        d, x, z = self.deep, self.length / 2, self.height / 2
        held = "arm" if self.has_arm else "head"
        joints = {
            "left": JointDescription("ground", "bed", FrameDescription((0.1, d / 2, -d)), self._springs(),
                                     child_interface="left"),
            "right": JointDescription("ground", "bed", FrameDescription((self.length - 0.1, d / 2, -d)), self._springs(0.4),
                                      child_interface="right", closes_loop=True),
            "X": JointDescription("bed", "column", FrameDescription((x, d / 2, 0)), self._springs(0.5),
                                  parent_interface="way", child_interface="base"),
            "Z": JointDescription("column", held, FrameDescription((x, 0, z)), self._springs(0.5), parent_interface="way",
                                  child_interface="saddle" if self.has_arm else None)}
        mass, inertia = self.random.uniform(5, 40), InertiaDescription(0.2, 0.3, 0.25)
        bodies = {name: BodyDescription(mass=1.0, inertia=inertia) for name in self.models}
        bodies["head"] = BodyDescription(mass=mass, inertia=inertia, centre=(x, -0.5 if self.has_arm else -0.1, z))
        if self.has_arm:
            joints["nose"] = JointDescription("arm", "head", FrameDescription((x, -0.4, z)), self._springs(),
                                              parent_interface="nose")
        axes = {"X": AxisDescription("X", "x", (-0.25, 0.25)), "Z": AxisDescription("Z", "z", (-0.2, 0.2))}
        return build(MachineDescription("castings", bodies, joints, axes), self._reduced())

    def _reduced(self) -> dict:
        result = {}
        for name, model in self.models.items():
            body = reduce_solid(model, self.places[name], band=BAND)
            if self.random.random() < 0.7:  # fewer coordinates than there are, so that there is an error to see
                size = int(self.random.integers(body.modal_count // 4, body.modal_count // 2))
                body = reduce_solid(model, self.places[name], band=BAND, size=size)
            result[name] = body
        return result

    def pose(self) -> dict[str, float]:
        """A random pose."""
        return {"X": float(self.random.uniform(-0.25, 0.25)), "Z": float(self.random.uniform(-0.2, 0.2))}


def full(castings: Castings, pose: dict[str, float]) -> np.ndarray:
    """Natural frequencies with every finite element, put together apart from the machine's own equations.

    Unknowns: all coordinates of the castings in their frames, and the head's twist about the machine's origin.
    """
    machine, place = castings.machine, place_machine(castings.machine, pose)
    models, head = castings.models, castings.machine.link("head")
    ends = np.cumsum([0, *(model.size for model in models.values())])
    where = {name: slice(int(a), int(b)) for name, a, b in zip(models, ends[:-1], ends[1:], strict=True)}
    size = int(ends[-1]) + 6
    back = tf.adjoint(tf.inverse(place.frames[0, head]))
    mass = block_diag(*[model.mass().toarray() for model in models.values()], back.T @ machine.bodies[head].mass @ back)
    stiffness = block_diag(*[model.stiffness().toarray() for model in models.values()], np.zeros((6, 6)))

    def motion(name: str, interface: str | None, at: np.ndarray) -> np.ndarray:
        result = np.zeros((6, size))
        if name in models:
            result[:, where[name]] = _patch_motion(castings, name, str(interface), place=place, at=at)
        elif name == "head":
            result[:, -6:] = np.eye(6)
        return result

    locked = []
    for name, joint in machine.description.joints.items():
        frame = (loop_frame(place, machine.loops[0])[0] if joint.closes_loop
                 else place.joint_frames[0, machine.joint_names.index(name)])
        both = [motion(part, interface, frame[:3, 3]) for part, interface in
                ((joint.child, joint.child_interface), (joint.parent, joint.parent_interface))]
        relative = tf.adjoint(tf.inverse(frame)) @ (both[0] - both[1])
        for way, row in zip(WAYS, relative, strict=True):
            if way in joint.stiffness:
                stiffness += joint.stiffness[way] * np.outer(row, row)
            else:
                locked.append(row)
    if locked:
        free = np.linalg.qr(np.array(locked).T, mode="complete")[0][:, len(locked):]
        mass, stiffness = free.T @ mass @ free, free.T @ stiffness @ free
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, COUNT - 1])) / (2 * np.pi)


def _patch_motion(castings: Castings, name: str, interface: str, *, place: Placement, at: np.ndarray) -> np.ndarray:
    """The twist of a place about the machine's origin over the coordinates of its casting."""
    patch = castings.places[name][interface]
    frame = place.frames[0, castings.machine.link(name)]
    if isinstance(patch, SlidingPatch):
        along = np.asarray(patch.along)
        way = float((tf.move(tf.inverse(frame), at[None])[0] - patch.patch.centre) @ along)
        patch = patch.patch.moved(way * along)
    weights = patch.averages(castings.models[name]).toarray()
    return tf.adjoint(frame @ tf.transform(None, patch.centre)) @ weights.T


def compare(castings: Castings, pose: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Estimates, true relative errors and which estimates are sure."""
    estimate = estimate_reduction(castings.machine, pose, COUNT)
    assert estimate is not None
    return estimate.error, estimate.frequency / full(castings, pose) - 1, estimate.is_sure


def time_poses(castings: Castings, count: int = 512) -> str:
    """Poses per second by both paths, with how far apart they are; the second foot is left out: it closes a loop."""
    description, machine = castings.machine.description, castings.machine
    joints = {name: joint for name, joint in description.joints.items() if not joint.closes_loop}
    tree = build(replace(description, joints=joints), {name: machine.bodies[machine.link(name)] for name in castings.models})
    at = {"X": castings.random.uniform(-0.25, 0.25, count), "Z": castings.random.uniform(-0.2, 0.2, count)}
    values, speeds = [], []
    for path in ("numpy", "compiled"):
        natural_frequencies(tree, {name: value[:2] for name, value in at.items()}, 6, path=path)
        start = time.process_time()
        values.append(natural_frequencies(tree, at, 6, path=path))
        speeds.append(f"{path} {count / (time.process_time() - start):.0f}")
    return (f"{tree.size} coordinates: poses a CPU second {', '.join(speeds)}, apart by "
            f"{np.abs(values[0] / values[1] - 1).max():.0e}")


def main() -> None:
    parser = CommandLine(__doc__)
    parser.add_argument("--speed", action="store_true")
    parser.cases("machines", 20)
    parser.add_argument("--poses", type=int, default=4)
    given = parser.parse_args()
    if given.speed:
        for seed in range(given.machines):
            print(time_poses(Castings(seed)), flush=True)
        return
    ratios, below, unsure, total, spent = [], 0, 0, 0, []
    for seed in range(given.machines):
        castings = Castings(seed)
        for _ in range(given.poses):
            pose = castings.pose()
            start = time.process_time()
            estimate_reduction(castings.machine, pose, COUNT)
            spent.append(time.process_time() - start)
            error, truth, sure = compare(castings, pose)
            seen = sure & (np.abs(truth) > SEEN)
            ratios += list(error[seen] / np.abs(truth[seen]))
            below += int((error[sure] + SEEN < np.abs(truth[sure])).sum())
            unsure, total = unsure + int((~sure).sum()), total + sure.size
        sizes = ", ".join(f"{name} {model.size} -> {castings.machine.bodies[castings.machine.link(name)].modal_count}"
                          for name, model in castings.models.items())
        print(f"machine {seed}: {sizes}; last pose: errors to {np.abs(truth).max():.1e}, estimates to {error.max():.1e}",
              flush=True)
    print(f"{total} modes, {unsure} not sure: {below} estimates below the true error, median {np.median(ratios):.2f} x, least "
          f"{min(ratios):.2f} x, 95 % within {np.quantile(ratios, 0.95):.0f} x; {1e3 * np.median(spent):.0f} CPU ms a pose")


if __name__ == "__main__":
    main()
