r"""Parts at poses -> SecondOrderSystem, in minimal coordinates, any number of poses in one call.

:math:`M = \sum_b B_b^T M_b B_b` with :math:`B_b` the body's own coordinates per minimal coordinate; K and C of tree
joints are diagonal blocks; loop joints add :math:`R^T K R`, and their locked directions are removed with a null-space
basis N: :math:`N^T M N` and so on.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import place_note
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly import preload
from toolpoint.machine.assembly.gyroscopics import gyroscopic_matrix
from toolpoint.machine.assembly.joint_terms import joint_matrices, loop_motion
from toolpoint.machine.assembly.modal_damping import ENERGY_DAMPING, damp_modes
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement, body_coordinates, frame_motion, place_machine
from toolpoint.vibration import Dof, SecondOrderSystem, damping
from toolpoint.vibration.dof import dofs


def assemble(
    machine: Machine, poses: Pose | None = None, outputs: Iterable[Dof | str] | None = None,
    *, inputs: Iterable[Dof | str] | None = None, modal_damping: bool = True, joint_damping: bool = False,
) -> SecondOrderSystem:
    """Return the machine's equations of motion about a pose or a batch of poses.

    Parameters
    ----------
    machine : Machine
    poses : mapping of axis name to position (m, rad) or to an array of n_poses positions, optional
        Axes left out stand at zero. With arrays the result has one leading axis of poses, otherwise none.
    outputs, inputs : labels, optional
        ``point:direction``; all points in x, y, z where left out; inputs where left out are the outputs.
    modal_damping : bool
        Whether the description's `damping_ratio`, if given, is turned into a damping matrix (one eigen-solution per
        pose).
    joint_damping : bool
        Whether losses stay in the joints where the description's `modal_damping` gives them to the modes by ``energy``: for
        who needs the matrices' slopes.

    Raises
    ------
    ToolpointError
        For an unknown axis or point, a position beyond the limits, or (with gravity or loads) a pose that is not an
        equilibrium of the free directions.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> table = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> guide = JointDescription("ground", "table", stiffness={"x": 1e7})
    >>> slide = MachineDescription("slide", {"table": table}, {"guide": guide}, points={"vice": PointDescription("table")})
    >>> system = assemble(build(slide))
    >>> system.mass.tolist(), system.stiffness.tolist()
    ([[100.0]], [[10000000.0]])
    """
    place = place_machine(machine, poses)
    output_dofs = dofs(outputs) if outputs is not None else _all_points(machine)
    input_dofs = output_dofs if inputs is None else dofs(inputs)
    mass, stiffness, viscous, structural, basis = equations(place)
    output_map, input_map = motion_map(place, output_dofs), np.swapaxes(motion_map(place, input_dofs), -1, -2)
    names = machine.coordinates
    if basis is not None:
        output_map, input_map = output_map @ basis, np.swapaxes(basis, -1, -2) @ input_map
        names = tuple(f"z{i + 1}" for i in range(basis.shape[-1]))
    is_single = poses is None or all(np.ndim(v) == 0 for v in poses.values())
    drop_pose_axis = (lambda a: a[0]) if is_single else (lambda a: a)
    system = SecondOrderSystem(
        drop_pose_axis(mass), drop_pose_axis(stiffness), drop_pose_axis(viscous) if np.any(viscous) else None,
        drop_pose_axis(structural) if np.any(structural) else None,
        drop_pose_axis(output_map), drop_pose_axis(input_map), output_dofs, input_dofs, names,
        notes=(*_notes(machine), *place.notes))
    ratio, law = machine.description.damping_ratio, machine.description.modal_damping
    if law and not (joint_damping and law == ENERGY_DAMPING):
        return damp_modes(machine, system, mass_matrix(place_machine(machine)))
    return damping.modal(system, ratio) if ratio is not None and modal_damping else system


def equations(place: Placement) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray | None]:
    """Return mass, stiffness, damping, structural damping (P, n, n) and the loop basis (P, n_tree, n), None without loops."""
    _check_freedom(place.machine.size)
    mass, (stiffness, viscous, structural) = mass_matrix(place), joint_matrices(place)
    gyroscopic = gyroscopic_matrix(place)
    if gyroscopic is not None:
        viscous = viscous + gyroscopic
    stiffness = stiffness + preload.geometric_stiffness(place)
    basis = loop_basis(place) if place.machine.loops else None
    if basis is None:
        return mass, stiffness, viscous, structural, None
    mass, stiffness, viscous, structural = (_projected(a, basis) for a in (mass, stiffness, viscous, structural))
    return mass, stiffness, viscous, structural, basis


def _notes(machine: Machine) -> tuple[str, ...]:
    ratio = machine.description.damping_ratio
    law = machine.description.modal_damping
    bodies = [place_note(note, name) for name, body in zip(machine.body_names, machine.bodies, strict=True)
              for note in body.notes]
    remarks = [f"modal damping ratio {ratio:g} for all modes, as the description says"] if ratio is not None else []
    remarks += ["modes are damped one by one, by the share that joints have in their strain energy: shapes are real, as the "
                "description says"] if law == ENERGY_DAMPING else []
    remarks += (["modes have the damping ratios that the description states: shapes are real"]
                if law and law != ENERGY_DAMPING else [])
    return (*bodies, *remarks)


def _all_points(machine: Machine) -> tuple[Dof, ...]:
    if not machine.description.points:
        fail("outputs", "none, and the machine has no points", "must be point:direction labels",
             remedy="give the machine points")
    return tuple(Dof(name, way) for name in machine.description.points for way in ("+x", "+y", "+z"))


def mass_matrix(place: Placement) -> FloatArray:
    """Return the mass matrix in the tree's coordinates, shape (P, n, n).

    With M_b = F^T F every body gives F B; one product of the stacked rows is the whole matrix. Where an elastic body's shapes
    are not coupled with its rigid motion, their mass is a block that stands, and six rows are all it gives.
    """
    machine, constant_blocks = place.machine, list[tuple[list[int], FloatArray]]()
    rows = []
    for i, body in enumerate(machine.bodies):
        if body.modal_count and not body.mass[:6, 6:].any():
            constant_blocks.append((list(machine.modal_columns[i]), body.mass[6:, 6:]))
            rows.append(_root(body.mass[:6, :6]) @ frame_motion(place, i))
        else:
            rows.append(_root(body.mass) @ body_coordinates(place, i))
    stacked = np.concatenate(rows, axis=1)
    result: FloatArray = np.swapaxes(stacked, -1, -2) @ stacked
    for columns, block in constant_blocks:
        result[:, columns[0]:columns[-1] + 1, columns[0]:columns[-1] + 1] += block
    return result


def _root(matrix: FloatArray) -> FloatArray:
    """Return F with F^T F a positive semidefinite matrix."""
    values, vectors = np.linalg.eigh(matrix)
    # Rounding makes eigenvalues of -1e-16; a mass that is negative beyond that is a fault of the data.
    if values[0] < -1e-9 * values[-1]:
        fail("Body.mass", f"eigenvalue {values[0]:g}", "must be positive semidefinite")
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def loop_basis(place: Placement) -> FloatArray | None:
    """Return an orthonormal basis of the motions that all locked loop directions allow, (P, n, n_free); None if none lock.

    Redundant constraints are allowed; their number must be the same at all poses of the batch.
    """
    rows = [loop_motion(place, loop)[:, [i for i in range(6) if loop.law.states[i] == "locked"]]
            for loop in place.machine.loops]
    constraints = np.concatenate(rows, axis=1)
    if constraints.shape[1] == 0:
        return None
    # Rotations count by the size of the machine, so that metres and radians weigh alike in the rank decision.
    _, singular, vt = np.linalg.svd(constraints, full_matrices=True)
    ranks = (singular > 1e-9 * singular.max(axis=-1, keepdims=True)).sum(axis=-1)
    if (ranks != ranks[0]).any():
        fail("poses", f"the number of independent loop constraints changes from {ranks.min()} to {ranks.max()}",
             "must be the same over a batch", remedy="a pose is singular: leave it out or assemble it alone")
    return np.swapaxes(vt[:, ranks[0]:], -1, -2)


def freedoms(machine: Machine) -> int:
    """Return the number of coordinates that are left when all loops are closed, at the reference pose."""
    basis = loop_basis(place_machine(machine)) if machine.loops else None
    number = machine.size if basis is None else int(basis.shape[-1])
    _check_freedom(number)
    return number


def _check_freedom(number: int) -> None:
    if number == 0:
        fail("machine", "no elastic or free direction", "must have one to vibrate",
             remedy="give its joints stiffness, for example stiffness: {rx: 4e5, ry: 4e5, rz: 1.2e5}")


def _projected(matrix: FloatArray, basis: FloatArray) -> FloatArray:
    """Return N^T A N."""
    return np.swapaxes(basis, -1, -2) @ matrix @ basis


def motion_map(place: Placement, labels: tuple[Dof, ...]) -> FloatArray:
    """Return the displacement of every labelled point and direction per coordinate, shape (P, n_labels, n).

    A point named ``a-b`` is point a relative to point b, both of the machine; ``tool`` and ``table`` are what the machine has
    in these roles, where no point bears the name.
    """
    jacobians: dict[str, FloatArray] = {}
    rows = []
    for label in labels:
        name = str(label.point)
        if name not in jacobians:
            jacobians[name] = _label_jacobian(place, name)
        rows.append(label.unit @ jacobians[name])
    return np.stack(rows, axis=1)


def _label_jacobian(place: Placement, name: str) -> FloatArray:
    """Return the motion of a point, a role or one of them relative to another per coordinate, (P, 6, n)."""
    description = place.machine.description
    roles = {"tool": description.tool or "tool", "table": description.table or "table"}
    names = description.points.keys() | roles.keys()
    first_point, dash, second_point = name.partition("-")
    if name in names or not (dash and first_point in names and second_point in names):
        return place.point_jacobian(name if name in description.points else roles.get(name, name))
    first, second = (point if point in description.points else roles[point] for point in (first_point, second_point))
    if second == "table" and description.table is None and "table" not in description.points:
        return place.point_jacobian(first)  # the ground is the table of a machine that names none
    return place.point_jacobian(first) - place.point_jacobian(second)
