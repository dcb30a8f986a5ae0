r"""Exact derivatives of a machine's matrices to its parameters, addressed by path.

A body's mass matrix is linear in its inertia tensor, whose derivative is written down: a step would leave what bodies can
have where the body is a flat plate. It is a polynomial of low degree in any one of its other numbers (mass, centre, density,
size), and a joint's matrices are affine in stiffness, damping and loss factor. A seven-point central difference is exact for
polynomials up to degree six, so the derivative of a part is exact to rounding whatever the step; the rest of the chain
(geometry, null-space basis) does not depend on these parameters and is linear. Of elastic bodies modulus, density and loss
factor scale reduced parts, and sections of beams are differenced in the shapes kept: lengths, meshes and Poisson's ratio have
no derivative here.

Gravity and loads add a geometric stiffness. Along a tree it is linear in masses and does not depend on stiffness, since loads
are carried whatever the springs; the same difference is then exact. Loops share the load by their stiffness, as ratios of
polynomials: there the difference errs by the sixth power of its step, 1e-10.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.bodies.reduced import KINDS, BodySlope
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.gyroscopics import elastic_spins
from toolpoint.machine.assembly.joint_terms import loop_motion
from toolpoint.machine.assembly.preload import geometric_stiffness
from toolpoint.machine.assembly.system import loop_basis
from toolpoint.machine.description.body import SCALING_KEYS
from toolpoint.machine.description.machine import MachineDescription, parameters
from toolpoint.machine.parts.build import build
from toolpoint.machine.parts.laws import law_in
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement, body_coordinates, place_machine
from toolpoint.vibration.sensitivity import MatrixDerivatives

# Seven-point central difference: weights of f(x + k h) - f(x - k h).
_DIFFERENCE_WEIGHTS = {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
_JOINT_FIELDS = ("stiffness", "damping", "loss_factor")
_BODY_FIELDS = ("mass", "density", "centre", "inertia", "shape")
SECTION_NUMBERS = ("diameter", "bore", "width", "height")  # of a beam: polynomials, or smooth by Cowper's coefficient
_MATRIX_TERMS = ("mass", "damping", "stiffness", "structural_damping")


def matrix_derivatives(machine: Machine, paths: Iterable[str], poses: Pose | None = None) -> MatrixDerivatives:
    """Return dM/dp, dC/dp, dK/dp and dD/dp for parameters given by path.

    Parameters
    ----------
    machine : Machine
    paths : str
        For example ``joints.foundation.stiffness.rx``, ``bodies.column.mass``, ``bodies.column.inertia.xx``,
        ``bodies.base.density``, ``joints.guide.damping.x``, ``joints.guide.loss_factor``. The machine's ``damping_ratio``
        moves none of its matrices: it damps modes.
    poses : mapping, optional
        As for `assemble`; a batch gives a leading pose axis.

    Raises
    ------
    ToolpointError
        For a path that is not there, geometry (joint frames, points), and numbers of elastic bodies that gravity or loads
        make enter in other ways.
    """
    names = tuple(paths)
    place = place_machine(machine, poses)
    basis = loop_basis(place) if machine.loops else None
    size = machine.size if basis is None else basis.shape[-1]
    result = {term: np.zeros((place.poses, len(names), size, size)) for term in _MATRIX_TERMS}
    for k, path in enumerate(names):
        slopes = _derivatives_to(place, path)
        if (of_preload := _preload_slope(place, path, poses)) is not None:
            slopes["stiffness"] = slopes.get("stiffness", 0.0) + of_preload
        for term, matrix in slopes.items():
            result[term][:, k] = matrix if basis is None else np.swapaxes(basis, -1, -2) @ matrix @ basis
    single = poses is None or all(np.ndim(v) == 0 for v in poses.values())
    return MatrixDerivatives(names, **{
        term: (a[0] if single or _is_constant(a) else a) if np.any(a) else None for term, a in result.items()})


def has_derivative(description: MachineDescription, path: str) -> bool:
    """Return whether a listed parameter is one whose exact derivative is known."""
    room, name, kind = path.split(".")[:3]
    if room == "bodies" and description.bodies[name].is_elastic:
        return kind in SCALING_KEYS and path.rsplit(".", 1)[1] in (*KINDS, *(SECTION_NUMBERS if kind == "beam" else ()))
    return kind in (*_JOINT_FIELDS, *_BODY_FIELDS)


def _is_constant(array: FloatArray) -> bool:
    # Derivatives of tree joints do not depend on the pose; without the pose axis they are far cheaper to use.
    return bool((array == array[:1]).all())


def _derivatives_to(place: Placement, path: str) -> dict[str, FloatArray]:
    """Return the derivatives of a machine's matrices, by term, to one parameter."""
    machine = place.machine
    value = machine.value(path)
    room, name, kind = [*path.split("."), "", "", ""][:3]
    if room == "bodies" and kind in _BODY_FIELDS and name in machine.body_names:
        link = machine.link(name)
        slope = _inertia_slope(path) if kind == "inertia" else _difference(
            machine.description, path, value, lambda d: _body_mass(machine, d, name))
        coordinates = body_coordinates(place, link)
        return {"mass": np.swapaxes(coordinates, -1, -2) @ slope @ coordinates}
    if room == "bodies" and name in machine.reduced and kind in SCALING_KEYS:
        return _motion_terms(place, name, elastic_slope(machine, path))
    if room == "joints" and kind in _JOINT_FIELDS:
        return _joint_derivatives(place, path, name, value)
    if path == "damping_ratio":
        return {}
    known_paths = [p for p in parameters(machine.description) if has_derivative(machine.description, p)]
    fail("path", repr(path), "has no exact derivative", remedy=f"known: {', '.join(known_paths[:4])} ...")


def _preload_slope(place: Placement, path: str, poses: Pose | None) -> FloatArray | None:
    """Return the derivative of the geometric stiffness of gravity and loads, (P, n, n); None where a number has none."""
    machine = place.machine
    description = machine.description
    if description.gravity is None and not description.loads:
        return None
    room, _, kind = [*path.split("."), "", "", ""][:3]
    if kind in ("inertia", "damping", "loss_factor") or path == "damping_ratio" or path.endswith(".loss_factor"):
        return None
    if room == "joints" and not machine.loops:
        return None  # statically determinate: what a joint carries does not depend on its stiffness
    if room == "bodies" and kind in SCALING_KEYS:
        if path.endswith(".modulus") and not machine.loops:
            return None
        fail("path", repr(path), "has no exact derivative while gravity or loads act on the elastic body",
             remedy="vary it by `screen`, or take gravity and loads out of the file")
    return _difference(description, path, machine.value(path),
                       lambda changed: np.asarray(geometric_stiffness(place_machine(build(changed), poses))))


def _motion_terms(place: Placement, name: str, slope: BodySlope) -> dict[str, FloatArray]:
    """Return the derivatives of a machine's matrices for those of a body's."""
    machine = place.machine
    link = machine.link(name)
    motion, modal = body_coordinates(place, link), list(machine.modal_columns[link])
    result = {term: _embedded(matrix, modal, machine.size) for term, matrix in (
        ("stiffness", slope.stiffness), ("structural_damping", slope.structural_damping)) if matrix is not None}
    if slope.mass is not None:
        result["mass"] = np.swapaxes(motion, -1, -2) @ slope.mass @ motion
    speed = elastic_spins(machine).get(link, 0.0)
    if slope.gyroscopic is not None and speed:
        result["damping"] = np.swapaxes(motion, -1, -2) @ (speed * slope.gyroscopic) @ motion
    return result


def elastic_slope(machine: Machine, path: str) -> BodySlope:
    """Return the derivative of an elastic body's matrices to a number of its materials or sections, its shapes kept."""
    name, (*part_keys, number) = path.split(".")[1], path.split(".")[4:]
    kept_body, part = machine.reduced[name], ".".join(part_keys)
    if number in KINDS:
        return kept_body.reduced.slope(part, number, kept_body.part.numbers[part])
    if kept_body.basis is None or number not in SECTION_NUMBERS:
        fail("path", repr(path), f"has no exact derivative: {number} moves nodes, or enters them otherwise",
             remedy="vary it by `screen`, or by machine.with_values")
    from toolpoint.machine.parts.beam_body import beam_part  # only where a body is a beam

    basis, segment = kept_body.basis, part_keys[0]
    parts = [each for each in kept_body.part.numbers if each.partition(".")[0] == segment]

    def matrices(description: MachineDescription) -> FloatArray:
        beam = description.bodies[name].beam
        assert beam is not None
        size = kept_body.reduced.nominal.mass.shape[0]
        total = np.zeros((4, size, size))
        for each in parts:
            segment_part = beam_part(beam, basis, each)
            total[0] += segment_part.mass
            total[1, 6:, 6:] += segment_part.stiffness
            total[2, 6:, 6:] += segment_part.numbers.loss_factor * segment_part.stiffness
            total[3] += 0.0 if segment_part.gyroscopic is None else segment_part.gyroscopic
        return total

    mass, stiffness, structural, gyroscopic = _difference(machine.description, path, machine.value(path), matrices)
    return BodySlope(mass, stiffness[6:, 6:], structural[6:, 6:] if structural.any() else None, gyroscopic)


def _joint_derivatives(place: Placement, path: str, name: str, value: float) -> dict[str, FloatArray]:
    """Return the derivatives to a number of a joint, in the tree's coordinates."""
    machine = place.machine

    def law(description: MachineDescription) -> FloatArray:
        joint = law_in(description, name)
        return np.stack([joint.damping, joint.stiffness, joint.structural_damping])

    slopes = dict(zip(_MATRIX_TERMS[1:], _difference(machine.description, path, value, law), strict=True))
    if name in machine.joint_names:
        i = machine.joint_names.index(name)
        free, columns = list(machine.joints[i].freedoms), list(machine.joint_columns[i])
        return {term: _embedded(slope[np.ix_(free, free)], columns, machine.size) for term, slope in slopes.items()}
    motion = loop_motion(place, next(loop for loop in machine.loops if loop.name == name))
    return {term: np.swapaxes(motion, -1, -2) @ slope @ motion for term, slope in slopes.items()}


def _embedded(block: FloatArray, columns: list[int], size: int) -> FloatArray:
    """Return a block put into a matrix of zeros."""
    matrix = np.zeros((size, size))
    matrix[np.ix_(columns, columns)] = block
    return matrix


def _inertia_slope(path: str) -> FloatArray:
    """Return the derivative (6, 6) of a body's spatial inertia to one entry of its tensor, both halves of a product."""
    i, j = ("xyz".index(letter) for letter in path.rsplit(".", 1)[-1])
    slope = np.zeros((6, 6))
    slope[3 + i, 3 + j] = slope[3 + j, 3 + i] = 1.0
    return slope


def _body_mass(machine: Machine, description: MachineDescription, name: str) -> FloatArray:
    """Return the spatial inertia (6, 6) of a body of a changed description."""
    return np.asarray(build(description).bodies[machine.link(name)].mass)


def _difference(
    description: MachineDescription, path: str, value: float, part: Callable[[MachineDescription], FloatArray]
) -> FloatArray:
    """Return the derivative of a part by the seven-point central difference, exact for polynomials up to degree six."""
    if not value and ".loss_factor" in path:  # its matrix is proportional to it, and it cannot be negative
        return np.asarray(part(description.with_values({path: 1.0})) - part(description))
    # Steps stay small against the value, so that positive quantities stay positive; rounding grows to about 1e-13.
    step = 0.02 * abs(value) if value else 1e-3
    total: FloatArray | float = 0.0
    for k, weight in _DIFFERENCE_WEIGHTS.items():
        forward = part(description.with_values({path: value + k * step}))
        backward = part(description.with_values({path: value - k * step}))
        total = total + weight * (forward - backward)
    return np.asarray(total) / step
