"""Moving structure: poses of a machine along a path of its tool, and its matrices at every node of the path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from toolpoint._check import FloatArray, ToolpointError, fail, positive
from toolpoint.machine.assembly.inverse_dynamics import base_reaction
from toolpoint.machine.assembly.system import assemble, loop_basis
from toolpoint.machine.description.gravity import gravity_of
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement, body_coordinates, place_machine
from toolpoint.spatial import transform as tf
from toolpoint.studies.accuracy.joint_servos import JointServo, add_servos
from toolpoint.studies.accuracy.tool_paths import PathSide
from toolpoint.studies.machines.arm_reach import Pose
from toolpoint.studies.machines.reach import Reach, path_faults, reach_places
from toolpoint.studies.machines.tool_point import tool_axes
from toolpoint.vibration import SecondOrderSystem, damping
from toolpoint.vibration.simulation.varying import VaryingSystem, reduce_system

MIN_INTERVALS = 16  # between nodes of a whole side: fewer err by a percent on lines of 10 mm
LOADS = ("cutting", "gravity", "path")
_TIP_DIRECTIONS = ("+x", "+y", "+z", "+rx", "+ry", "+rz")


@dataclass(frozen=True, eq=False)
class ToolStance:
    """Stance of the tool along a path.

    direction : of its axis, that at the reference pose where left out; turn : rad; branch : of an arm; start : pose from which
    the first one is sought.

    Examples
    --------
    >>> ToolStance(direction=(0.0, 0.0, 1.0), turn=np.pi / 2).branch  # empty: the branch nearest to the start
    ''
    """

    direction: tuple[float, float, float] | None = None
    turn: float = 0.0
    branch: str = ""
    start: Pose | None = None


@dataclass(frozen=True, eq=False)
class MovingStructure:
    """Structure along a side.

    system : matrices at nodes, inputs: tip force in cutter axes, then one column for each further load; axes : (N, 3, 3)
    cutter axes (feed, normal, tool) in machine axes; tips : (N, 3) m; nominal : (N, 6) reaction of the base at rest (gravity),
    else zero.
    """

    side: PathSide
    reach: Reach
    system: VaryingSystem
    axes: FloatArray
    tips: FloatArray
    nominal: FloatArray
    loads: tuple[str, ...]

    def load_factors(self, motion: FloatArray) -> FloatArray:
        """Return the factor of every further load for motions (n, 4: length, speed, acceleration, jerk), (n, w - 3)."""
        columns: list[FloatArray] = []
        if "gravity" in self.loads:
            columns.append(np.ones(len(motion)))
        if "path" in self.loads:
            columns += [motion[:, 1] ** 2, motion[:, 2]]
        return np.ascontiguousarray(np.stack(columns, axis=1)) if columns else np.zeros((len(motion), 0))


def structure_along(machine: Machine, side: PathSide, stance: ToolStance, *, spacing: float = 2e-3,
                    loads: tuple[str, ...] = ("cutting",),
                    gravity: tuple[float, float, float] | None = None, reference: float = 500.0,
                    span: tuple[float, float] | None = None, servos: Mapping[str, JointServo] | None = None) -> MovingStructure:
    """Return the structure at nodes of a side, `spacing` (m) apart.

    servos : of axes whose motors yield; all hold their set points where left out. loads : ``cutting`` alone; with
    ``gravity`` the changing sag, with ``path`` the inertia of the nominal motion too. gravity : m/s^2 in the machine frame; the
    machine's own where left out.

    Raises ToolpointError for a path out of reach, beyond limits, or through a singular pose: where on the path, and why.
    """
    unknown = [name for name in loads if name not in LOADS]
    if unknown:
        fail("loads", repr(unknown[0]), f"must be of {', '.join(LOADS)}")
    length = _nodes(side.length, positive("spacing", spacing), span)
    count = length.size
    reach = reach_places(machine, side.points(np.array(length)), stance.direction, turn=stance.turn, branch=stance.branch,
                         start=stance.start,
                         follow=True)
    faults = path_faults(machine, reach, length.tolist())
    if faults:
        raise ToolpointError(f"{side.name}: " + "; ".join(faults[:3]))
    batch = reach.batch()
    place = place_machine(machine, batch)
    system, align = _systems(machine, place, batch)
    axes = _cutter_axes(machine, side, length, batch)
    point = str(machine.description.tool)
    tips = place.position(machine.description.points[point])
    output, momentum = system.output_map @ align, _momentum_map(place, align)
    columns: list[FloatArray] = [np.swapaxes(output[:, :3], -1, -2) @ axes]
    field = gravity_of(machine.description) if gravity is None else gravity
    if "gravity" in loads:
        columns.append(_gravity_load(place, align, np.array(field))[..., None])
    if "path" in loads:
        columns.append(_inertia_loads(machine, place, align, batch, length))
    mass, viscous, stiffness = (np.swapaxes(align, -1, -2) @ matrix @ align
                                for matrix in (system.mass, _viscous(system), system.stiffness))
    varying = VaryingSystem(length, mass, viscous, stiffness, np.concatenate(columns, axis=-1), output, momentum)
    mechanical = varying.size
    if servos:
        varying = add_servos(machine, varying, tuple(system.coordinates), servos=servos, batch=batch, loads=loads,
                             reference=reference)
    weighs = "gravity" in loads and _is_rigid(machine)
    nominal = base_reaction(machine, batch, gravity=field) if weighs else np.zeros((count, 6))
    return MovingStructure(side, reach, reduce_system(varying, kept_count=varying.size - mechanical), axes, tips, nominal,
                           loads)


def _nodes(length: float, spacing: float, span: tuple[float, float] | None) -> FloatArray:
    """Return the nodes of a side, the same whatever part of it is needed; at least `MIN_INTERVALS` lie between them."""
    count = 4 * int(np.ceil(max(length / spacing, MIN_INTERVALS) / 4))  # every other and every fourth end at the last
    first, last = (0, count) if span is None else (int(span[0] / length * count), int(np.ceil(span[1] / length * count)))
    last = min(max(last, first + 4), count)
    return np.asarray(length * np.arange(min(first, last - 4), last + 1) / count)


def _loop_basis(place: Placement) -> FloatArray | None:
    return loop_basis(place) if place.machine.loops else None


def _is_rigid(machine: Machine) -> bool:
    return not any(body.modal_count for body in machine.bodies)


def _viscous(system: SecondOrderSystem) -> FloatArray:
    return np.zeros_like(system.mass) if system.damping is None else system.damping


def _systems(machine: Machine, place: Placement, batch: dict[str, FloatArray]) -> tuple[SecondOrderSystem, FloatArray]:
    """Return the systems at all nodes, viscously damped, and rotations that make their coordinates continuous."""
    description = machine.description
    point = description.tool if description.table is None else f"{description.tool}-{description.table}"
    system = assemble(machine, batch, [f"{point}:{way}" for way in _TIP_DIRECTIONS], modal_damping=False)
    if description.damping_ratio is not None:
        system = damping.modal(system, description.damping_ratio)
    elif system.structural_damping is not None:
        # As much loss at every resonance, coupled between modes: a function of M and K, so it is smooth along the path.
        system = damping.equivalent_viscous(system)
    if system.damping is None or not np.any(system.damping):
        fail("machine", "no damping", "what rings at the start would never die",
             remedy="give damping_ratio, or damping to joints")
    basis = _loop_basis(place)
    align = np.broadcast_to(np.eye(system.size), (place.poses, system.size, system.size)).copy()
    if basis is not None:  # null-space bases of neighbouring poses differ by a rotation that means nothing
        for i in range(1, place.poses):
            u, _, vt = np.linalg.svd(basis[i].T @ basis[i - 1] @ align[i - 1])
            align[i] = u @ vt
    return system, align


def _cutter_axes(machine: Machine, side: PathSide, length: FloatArray, batch: dict[str, FloatArray]) -> FloatArray:
    """Return feed, normal and tool axis at the nodes as columns, (N, 3, 3)."""
    tool = tool_axes(machine, batch, len(length))[:, :, 2]
    tangent = side.tangents(length)
    feed = tangent - tool * (tangent * tool).sum(axis=1, keepdims=True)
    across = np.linalg.norm(feed, axis=1)
    if across.min() < 0.2:
        k = int(across.argmin())
        fail("path", f"{side.name} runs along the tool's axis at {1e3 * length[k]:.4g} mm", "must run across it",
             remedy="drilling is no milling; turn the tool or the path")
    feed = feed / across[:, None]
    return np.stack([feed, np.cross(tool, feed), tool], axis=-1)


def _body_maps(place: Placement, align: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return the coordinates of every body per coordinate of the machine (N, 6 + m, n), with its mass (6 + m, 6 + m)."""
    basis = _loop_basis(place)
    turn = align if basis is None else basis @ align
    return [(body_coordinates(place, link) @ turn, body.mass) for link, body in enumerate(place.machine.bodies)]


def _momentum_map(place: Placement, align: FloatArray) -> FloatArray:
    """Return the momentum about the machine's origin per velocity, in machine axes, (N, 6, n)."""
    total = np.zeros((place.poses, 6, align.shape[-1]))
    for link, (motion, mass) in enumerate(_body_maps(place, align)):
        to_origin = np.swapaxes(tf.adjoint(tf.inverse(place.frames[:, link])), -1, -2)
        total += to_origin @ (mass @ motion)[:, :6]
    return total


def _gravity_load(place: Placement, align: FloatArray, gravity: FloatArray) -> FloatArray:
    load = np.zeros((place.poses, align.shape[-1]))
    for link, (motion, mass) in enumerate(_body_maps(place, align)):
        field = np.zeros((place.poses, mass.shape[0]))
        field[:, :3] = gravity @ place.frames[:, link, :3, :3]
        load += np.einsum("pan,pa->pn", motion, field @ mass)
    return load


def _inertia_loads(machine: Machine, place: Placement, align: FloatArray, batch: dict[str, FloatArray],
                   length: FloatArray) -> FloatArray:
    """Loads of the nominal motion per squared speed and per acceleration along the path, (N, n, 2).

    With twists V = V' s' of the bodies about the fixed origin the wrench is I (V' s'' + V'' s'^2) + V' x* I V' s'^2.
    """
    names = [axis.name for axis in machine.chain.driven_axes]
    rate = CubicSpline(length, np.stack([batch[name] for name in names], axis=1), axis=0)(length, 1)
    load = np.zeros((place.poses, align.shape[-1], 2))
    for link, (motion, mass) in enumerate(_body_maps(place, align)):
        twist = np.einsum("pak,pa->pk", machine.chain.axis_twists(batch, link), rate)
        bend = CubicSpline(length, twist, axis=0)(length, 1)
        inward = tf.adjoint(tf.inverse(place.frames[:, link]))
        to_origin = np.swapaxes(inward, -1, -2)
        inertia = to_origin @ mass[:6, :6] @ inward
        speed = (inertia @ bend[..., None])[..., 0] + _convective_rate(twist, (inertia @ twist[..., None])[..., 0])
        for column, wrench in enumerate((speed, (inertia @ twist[..., None])[..., 0])):
            # The wrench in the body's own frame acts on its six rigid coordinates.
            frame = place.frames[:, link]
            body_wrench = (np.swapaxes(tf.adjoint(frame), -1, -2) @ wrench[..., None])[..., 0]
            load[:, :, column] -= np.einsum("pan,pa->pn", motion[:, :6], body_wrench)
    return load


def _convective_rate(twist: FloatArray, momentum: FloatArray) -> FloatArray:
    v, w, f, m = twist[:, :3], twist[:, 3:], momentum[:, :3], momentum[:, 3:]
    return np.concatenate([np.cross(w, f), np.cross(w, m) + np.cross(v, f)], axis=-1)
