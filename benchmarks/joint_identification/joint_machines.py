"""Random machines whose joints are to be identified, and their hammer tests: the ground under `random_machines`.

Three to six boxes in a chain or a tree, each on a joint of a random kind in a random frame, with a loss factor of 2 to 10 % a
joint; two linear axes, tool and table points, a cut. The test: accelerances at 30 to 150 points from two driving points, with
noise of 1 to 5 % of the rms of every response. The tester's file tells the components, their masses and the axes.

Laws of damping: `coupled` (loss factors, complex shapes), `viscous` (every second joint a damper in place of its loss factor),
`real` and `real viscous` (the same losses, given to every mode by its strain energy: real shapes). Responses are solved here
directly, (K (1 + i eta) + i w C - w^2 M) taken whole, or with the modal damping matrix made here from the energies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.linalg

from toolpoint.cutting.description import CuttingDescription
from toolpoint.io import uff
from toolpoint.machine import Machine, assemble, build
from toolpoint.machine.description import (
    GROUND,
    AxisDescription,
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
)
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.virtual_test import MeasuringPoints, surface_points
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Dof, Frf, eigen, frequency_response

WAYS = ("x", "y", "z", "rx", "ry", "rz")
FIRST = {"isolators": WAYS, "feet": ("z", "rx", "ry"), "spherical": ("rx", "ry", "rz"), "universal": ("rx", "ry")}
LATER = {
    "hinge": ("rx",), "oblique hinge": ("rz",), "universal": ("rx", "ry"), "spherical": ("rx", "ry", "rz"),
    "turn and slide": ("x", "rz"), "slide": ("y",), "planar": ("x", "y", "rz"), "guide": ("y", "z", "rx", "ry", "rz"),
    "cylindrical": ("z", "rz")}
MOST = 14  # freedoms of a machine


@dataclass(frozen=True, eq=False)
class Case:
    """The true machine, its kinds of joint, the measuring points, the noise, and whether the bodies hang in a tree."""

    machine: Machine
    kinds: dict[str, str]
    points: MeasuringPoints
    noise: float
    law: str = "coupled"


LAWS = ("coupled", "real", "viscous", "real viscous")
TEST_FREQUENCY = 60.0  # Hz, at which a damper takes as much as the loss factor in whose place it is


def law_of(seed: int) -> str:
    """Return the law of damping of a seed: half coupled, half real shapes, a fifth of either with viscous joints."""
    return LAWS[seed % 2 + 2 * (seed // 2 % 5 == 4)]


def random_case(seed: int, law: str = "coupled", size: tuple[int, int] | None = None) -> Case:
    """Return the case of a seed; size : number of bodies and of points, random where left out."""
    rng = np.random.default_rng(seed)
    while True:
        case = _attempt(rng, size)
        if case is not None:
            return damped(case, law)


def damped(case: Case, law: str) -> Case:
    """Return a case by a law of damping."""
    description = case.machine.description
    joints = dict(description.joints)
    if "viscous" in law:
        for name in list(joints)[::2]:
            joint = joints[name]
            relaxation = joint.loss_factor / (2 * np.pi * TEST_FREQUENCY)
            joints[name] = replace(joint, loss_factor=0.0, damping={w: relaxation * k for w, k in joint.stiffness.items()})
    machine = build(replace(description, joints=joints, modal_damping="energy" if "real" in law else ""))
    return replace(case, machine=machine, law=law)


def full_response(machine: Machine, lines: np.ndarray, outputs, inputs, pose=None) -> Frf:
    """Return the receptance by direct solution of the raw matrices, or with the modal damping of real shapes made here."""
    description = machine.description
    system = assemble(build(replace(description, modal_damping="")), pose, outputs, inputs=inputs)
    zero = np.zeros_like(system.mass)
    structural = zero if system.structural_damping is None else system.structural_damping
    viscous = zero if system.damping is None else system.damping
    if description.modal_damping == "energy":
        squares, shapes = scipy.linalg.eigh(system.stiffness, system.mass)
        rate = np.diag(shapes.T @ structural @ shapes) / np.sqrt(squares) + np.diag(shapes.T @ viscous @ shapes)
        viscous = system.mass @ shapes @ np.diag(rate) @ shapes.T @ system.mass
        structural = zero
    elif description.modal_damping:
        raise ValueError("ratios of modes: the truth has none")
    return frequency_response.direct(replace(system, damping=viscous, structural_damping=structural), lines)


def _attempt(rng: np.random.Generator, size: tuple[int, int] | None = None) -> Case | None:
    count = int(rng.integers(3, 7)) if size is None else size[0]
    is_tree = rng.random() < 0.4
    bodies, joints, kinds, parents = {}, {}, {}, {}
    for i in range(count):
        name = f"b{i}"
        above = None if i == 0 else f"b{rng.integers(0, i) if is_tree else i - 1}"
        edges = rng.uniform(0.4, 1.0, 3) * (1.6 if i == 0 else 1.0)
        if above is None:
            centre = np.array([0.0, 0.0, edges[2] / 2])
        else:
            way = np.array([*rng.uniform(-0.6, 0.6, 2), 1.0]) * rng.choice([1.0, 1.0, -0.6])
            centre = np.array(bodies[above].centre) + 0.5 * way * (np.array(bodies[above].shape.size) + edges)
        bodies[name] = BodyDescription(float(rng.uniform(400, 1500) * edges.prod() * (3 if i == 0 else 1) + 60),
                                       tuple(map(float, centre)), shape=ShapeDescription("box", tuple(map(float, edges))))
        parents[name] = above
        kinds[name] = str(rng.choice(list(FIRST if above is None else LATER)))
    if sum(len(_ways(kinds[n], parents[n])) for n in bodies) > MOST:
        return None
    for name in bodies:
        joints[f"{parents[name] or GROUND}_{name}"] = _joint(rng, name, parents, bodies, kinds[name])
    machine = _complete(rng, bodies, joints)
    frequency = eigen.solve_undamped(assemble(machine, outputs=["tool:+x"])).frequency
    if frequency[0] < 8 or frequency[-1] > 400 or (np.diff(frequency) / frequency[1:]).min() < 0.01:
        return None
    points = surface_points(machine, int(rng.integers(max(30, 8 * count), 151)) if size is None else size[1], rng)
    return Case(machine, kinds, points, float(rng.uniform(0.01, 0.05)))


def _ways(kind: str, above: str | None) -> tuple[str, ...]:
    return FIRST[kind] if above is None else LATER[kind]


def _joint(rng, name, parents, bodies, kind) -> JointDescription:
    above = parents[name]
    here = np.array(bodies[name].centre)
    at = np.array([*rng.uniform(-0.3, 0.3, 2), 0.0]) if above is None else (here + np.array(bodies[above].centre)) / 2
    at = at + rng.uniform(-0.15, 0.15, 3)
    turn = rng.choice([0.0, np.pi / 2, -np.pi / 2], 3) * (above is not None)
    if kind == "oblique hinge" or (above is not None and rng.random() < 0.3):
        turn = turn + rng.uniform(-0.6, 0.6, 3)
    frame = tf.transform(rot.from_euler("zyx", turn), at)
    mass = _carried(name, parents, bodies)
    back = tf.adjoint(frame)
    local = back.T @ mass @ back
    stiffness = {}
    for way in _ways(kind, above):
        low = (12.0, 35.0) if above is None else (25.0, 160.0)
        f = float(np.exp(rng.uniform(*np.log(low))))
        stiffness[way] = float(local[WAYS.index(way), WAYS.index(way)] * (2 * np.pi * f) ** 2)
    return JointDescription(above or GROUND, name, FrameDescription(tuple(map(float, at)), tuple(map(float, turn))), stiffness,
                            loss_factor=float(rng.uniform(0.02, 0.10)), elastic_at=str(rng.choice(["child", "parent"])))


def _carried(name, parents, bodies) -> np.ndarray:
    """Mass matrix (6, 6) about the origin of a body and all it carries."""
    total = np.zeros((6, 6))
    for other, body in bodies.items():
        at = other
        while at is not None and at != name:
            at = parents[at]
        if at is None:
            continue
        square = np.array(body.shape.size) ** 2
        c = rot.skew(np.array(body.centre))
        total[:3, :3] += body.mass * np.eye(3)
        total[:3, 3:] += -body.mass * c
        total[3:, :3] += body.mass * c
        total[3:, 3:] += body.mass / 12 * np.diag(square.sum() - square) - body.mass * c @ c
    return total


def _complete(rng, bodies, joints) -> Machine:
    names = list(joints)
    axes = {}
    for axis, joint in zip("XY", rng.choice(names[1:], min(2, len(names) - 1), replace=False), strict=False):
        free = [w for w in ("x", "y", "z") if w not in joints[joint].stiffness] or ["x", "y", "z"]
        axes[axis] = AxisDescription(str(joint), str(rng.choice(free)), (-0.3, 0.3))
    last = bodies[list(bodies)[-1]]
    corner = np.array(last.centre) + 0.5 * np.array(last.shape.size) * rng.choice([-1, 1], 3)
    table = bodies["b1"] if rng.random() < 0.5 else bodies["b0"]
    table_name = "b1" if table is bodies["b1"] and len(bodies) > 2 else "b0"
    table_at = np.array(bodies[table_name].centre) + np.array([0, 0, 0.5 * bodies[table_name].shape.size[2]])
    points = {"tool": PointDescription(list(bodies)[-1], tuple(map(float, corner))),
              "table": PointDescription(table_name, tuple(map(float, table_at)))}
    cut = CuttingDescription.of(diameter=0.05, teeth=4, immersion=0.5, tangential=8e8, normal=3e8, speeds=(800.0, 4000.0))
    return build(MachineDescription("random", bodies, joints, axes, points, tool="tool", table="table", cutting=cut))


def responses(case: Case, rng: np.random.Generator) -> Frf:
    """Return noisy accelerances at all points from two driving points that see all modes."""
    machine = with_measured_points(case.machine, case.points.coordinates, case.points.components)
    labels = [Dof(p, way) for p in case.points.places for way in ("+x", "+y", "+z")]
    system = assemble(machine, outputs=labels)
    modes = eigen.solve_undamped(replace(system, damping=None))
    share = np.abs(modes.shape) / np.abs(modes.shape).max(axis=0)
    first = int(np.argmax(share.min(axis=1)))
    second = int(np.argmax(np.maximum(share, share[first]).min(axis=1) + 0.01 * share.mean(axis=1)))
    driven = [labels[first], labels[second if second != first else (first + 1) % len(labels)]]
    lines = np.arange(4.0, min(1.3 * modes.frequency[-1] + 10, 500.0), 0.25)
    exact = full_response(machine, lines, labels, driven).converted_to("accelerance")
    size = case.noise * np.sqrt((np.abs(exact.values) ** 2).mean(axis=0) / 2)
    noise = rng.normal(size=exact.values.shape) + 1j * rng.normal(size=exact.values.shape)
    return replace(exact, values=exact.values + size * noise)


def write_test(case: Case, frf: Frf, folder: Path, *, points=None, masses=None, order=None, extra: str = "", deviation: str = ""
               ) -> list[str]:
    """Write test.uff and components.yaml; return the arguments of the command without the page."""
    coordinates = points or case.points.coordinates
    geometry = uff.MeasuredGeometry(tuple(coordinates), np.array(list(coordinates.values())))
    uff.write(folder / "test.uff", geometry, frf)
    (folder / "components.yaml").write_text(component_text(case, masses or {}, order, extra, deviation))
    test = str(folder / "test.uff")
    return ["joints", test, "--geometry", test, "--components", str(folder / "components.yaml")]


def component_text(case: Case, masses: dict[str, float], order: dict[str, str] | None, extra: str = "",
                   deviation: str = "") -> str:
    """Return the tester's component file: what is known of the machine besides its joints."""
    description = case.machine.description
    parents = order or {joint.child: joint.parent for joint in description.joints.values()}
    lines = ["toolpoint: 1", "name: random", "parents:", *(f"  {child}: {parent}" for child, parent in parents.items()),
             "components:"]
    for name, body in description.bodies.items():
        mass = body.mass * masses.get(name, 1.0)
        lines += [f"  {name}:", f"    points: {case.points.components[name]}",
                  f"    body: {{mass: {mass:.12g} kg, centre: {list(body.centre)}, shape: {{kind: box, "
                  f"size: {list(body.shape.size)}}}}}"]
        if deviation:
            lines.append(f"    uncertainty: {{mass: {deviation}}}")
    lines.append("axes:")
    place = place_machine(case.machine)
    for axis, moved in description.axes.items():
        joint = description.joints[moved.joint]
        link = case.machine.joint_names.index(moved.joint)
        frame = place.joint_frames[0, link]
        way = frame[:3, "xyz".index(moved.direction)]
        lines.append(f"  {axis}: {{moves: {joint.child}, along: {way.tolist()}, "
                     f"limits: [-0.3, 0.3], elastic_at: {joint.elastic_at}}}")
    lines.append("points:")
    for name in ("tool", "table"):
        point = description.points[name]
        lines.append(f"  {name}: {{body: {point.body}, at: {list(point.at)}}}")
    lines += ["tool: tool", "table: table",
              "cutting: {diameter: 0.05, teeth: 4, immersion: 0.5, tangential: 8e8, normal: 3e8, speeds: [800, 4000]}"]
    return "\n".join(lines) + "\n" + extra


def random_poses(case: Case, rng: np.random.Generator, count: int = 5) -> list[dict[str, float]]:
    """Return poses that nobody tested."""
    return [{axis: float(rng.uniform(-0.3, 0.3)) for axis in case.machine.description.axes} for _ in range(count)]
