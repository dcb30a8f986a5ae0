r"""Sensitivity study: effect of each parameter of a machine on its frequencies and shapes, alone and cumulated per part.

Relative sensitivity :math:`S = (p/f)\,df/dp`: per cent of frequency per per cent of the parameter. Shapes: MAC between the
shape at p and at p (1 + s) is, to second order, :math:`1 - s^2 c`, with c the squared length of the relative change of the
shape across itself; the table gives :math:`\sqrt c`, the angle of turn per unit of relative change. Cumulated: all
parameters of a part scaled together, so sensitivities add up, and changes of shape as vectors.
Elastic bodies that a file describes have modulus, density and loss factor of every set among their parameters. Others:
``bodies.NAME.modulus`` and ``bodies.NAME.density`` scale their whole stiffness and mass (Young's and shear modulus together),
which leaves the reduction basis as it is and is therefore exact; their value counts as one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import Array, FloatArray, count, fail
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine, assemble
from toolpoint.machine.assembly.system import loop_basis
from toolpoint.machine.derivatives import has_derivative, matrix_derivatives
from toolpoint.machine.description import parameters
from toolpoint.machine.pose.placement import body_coordinates, place_machine
from toolpoint.studies.machines.energy_law import warn_of_energy_law
from toolpoint.updating.models.damped_modes import is_skew
from toolpoint.updating.models.prediction import Prediction, ShapeSlopes
from toolpoint.updating.models.system_model import AffineSystem, SystemModel
from toolpoint.vibration import Dof
from toolpoint.vibration.sensitivity import MatrixDerivatives

MAX_PRINTED_PARAMETERS, HEADING = 10, "relative d f / d p"
_FIELDS = ("stiffness", "damping", "loss_factor", "mass", "density")
_ELASTIC_FIELDS = ("modulus", "density")
_PARAMETER_FIELDS = (*_FIELDS, *_ELASTIC_FIELDS)
_TERMS = ("mass", "damping", "stiffness", "structural_damping")


@dataclass(frozen=True, eq=False)
class SensitivityStudy(NotebookText):
    """Table of sensitivities.

    paths : (n_p); parts : joint or body of each; values : (n_p,), SI; frequencies : (n_modes,), Hz; frequency : (n_p, n_modes),
    (p/f) df/dp; damping : (n_p, n_modes), p d zeta/dp; turns : (n_p, n_dofs, n_modes), p d phi/dp across phi over |phi|,
    complex where there is damping.
    """

    paths: tuple[str, ...]
    parts: tuple[str, ...]
    values: FloatArray
    frequencies: FloatArray
    frequency: FloatArray
    damping: FloatArray
    turns: Array

    @property
    def shape(self) -> FloatArray:
        """Angle of turn of every shape per unit of dp/p, (n_p, n_modes): MAC = 1 - (angle dp/p)^2."""
        return np.asarray(np.linalg.norm(self.turns, axis=1))

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each parameter: stiffness, damping, mass, density, modulus, diameter."""
        return tuple(next((word for word in path.split(".")[2:] if word in _PARAMETER_FIELDS), path.rsplit(".", 1)[-1])
                     for path in self.paths)

    def mac_after(self, change: float) -> FloatArray:
        """Return the MAC of every shape with itself after a small relative change of each parameter, (n_p, n_modes)."""
        return np.asarray(np.maximum(0.0, 1 - (self.shape * change) ** 2))

    def cumulative(self, kind: str = "") -> dict[str, FloatArray]:
        """Return the relative sensitivity of each part, (n_modes,): all its parameters (of a kind) scaled together."""
        return self._summed(self.frequency, kind)

    def cumulative_shape(self, kind: str = "") -> dict[str, FloatArray]:
        """Return the angle of turn of the shapes with all parameters (of a kind) of each part scaled together, (n_modes,)."""
        return {part: np.linalg.norm(turn, axis=0) for part, turn in self._summed(self.turns, kind).items()}

    def _summed(self, rows: Array, kind: str) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for name, part, row in zip(self.kinds, self.parts, rows, strict=True):
            if not kind or name == kind:
                result[part] = result.get(part, np.zeros_like(row)) + row
        return result

    def table(self) -> str:
        """Return the largest single and cumulative sensitivities as text, per cent of frequency per per cent of the parameter.

        `MAX_PRINTED_PARAMETERS` of each, those with the largest effect on any mode first; `to_dict` and the page have all.
        """
        single, parts = (_largest(rows) for rows in (dict(zip(self.paths, self.frequency, strict=True)), self.cumulative()))
        width = max(map(len, (*single, *parts, HEADING)))
        lines = [f"{HEADING:{width}}" + "".join(f"{f:9.3f}" for f in self.frequencies) + "  Hz"]
        lines += [f"{path:{width}}" + "".join(f"{v:9.4f}" for v in row) for path, row in single.items()]
        if len(single) < len(self.paths):
            lines.append(f"the {len(single)} of {len(self.paths)} parameters that matter most; the page lists all")
        lines.append("cumulative per part")
        lines += [f"{part:{width}}" + "".join(f"{v:9.4f}" for v in row) for part, row in parts.items()]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the relative sensitivity of every frequency to every parameter as plain lists."""
        return {"frequency_hz": self.frequencies.tolist(), "relative_sensitivity": {
            path: row.tolist() for path, row in zip(self.paths, self.frequency, strict=True)}}

    def __repr__(self) -> str:
        return f"SensitivityStudy({len(self.paths)} parameters, {self.frequencies.size} modes)"


def _largest(rows: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return the `MAX_PRINTED_PARAMETERS` rows with the largest entries, the largest first."""
    order = sorted(rows, key=lambda name: -float(np.abs(rows[name]).max()))
    return {name: rows[name] for name in order[:MAX_PRINTED_PARAMETERS]}


def study_sensitivity(
    machine: Machine, paths: Sequence[str] | None = None, modes: int = 6, *, pose: Pose | None = None,
    dofs: Sequence[Dof | str] | None = None,
) -> SensitivityStudy:
    """Return the exact sensitivities of the lowest modes at one pose.

    Parameters
    ----------
    machine : Machine
        Without gravity and loads; every direction held (no mode at 0 Hz among the lowest).
    paths : sequence of str, optional
        All stiffnesses, dampings, loss factors, masses and densities that are not zero, and moduli, densities, loss factors and
        sections of elastic bodies, where left out.
    modes : int
    pose : mapping, optional
    dofs : labels, optional
        Where shapes are seen; all points in x, y, z where left out.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 2e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint},
    ...                                    points={"tip": PointDescription("head")}))
    >>> study_sensitivity(machine, modes=2).frequency.round(3).tolist()  # frequencies go with the root of k/m
    [[-0.5, -0.5], [0.5, 0.0], [0.0, 0.5]]
    """
    names = tuple(paths) if paths is not None else _all_paths(machine)
    if not names:
        fail("paths", "none", "must be at least one parameter")
    # A body that is scaled as a whole has no value of its own: the scale, which is 1.
    values = np.array([1.0 if _is_elastic_path(machine, n) else machine.value(n) for n in names])
    slopes = _without_gyroscopic_part(_slopes(machine, names, pose))
    warn_of_energy_law(machine, pose, dofs)
    system = assemble(machine, pose, dofs, modal_damping=False, joint_damping=True)
    held = AffineSystem(system, slopes, tuple(values.tolist()))
    prediction = SystemModel(held, count("modes", modes), modal_damping=machine.description.damping_ratio)({}, names)
    assert prediction.modes is not None and isinstance(prediction.shape_slopes, ShapeSlopes)
    # The skew part of the damping matrix of a machine that spins is gyroscopic: the modes are those at standstill.
    is_viscous = system.damping is not None and not is_skew(system.damping)
    is_structural = not is_viscous and system.structural_damping is not None
    hertz, frequency, damping = _poles(prediction, is_structural=is_structural)
    parts = tuple(".".join(n.split(".")[:2]) for n in names)
    return SensitivityStudy(names, parts, values, hertz, values[:, None] * frequency, values[:, None] * damping, _relative_turn(
        prediction.modes.shape, values[:, None, None] * prediction.shape_slopes.array))


def _poles(prediction: Prediction, *, is_structural: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    r"""Return frequencies, Hz, with their relative slopes and those of the damping ratios, (n_p, n_modes).

    As `modes` states them: modes of structural damping alone by :math:`s^2 = -\omega^2 (1 + 2 i \zeta)`, all others by size
    and decay of s.
    """
    assert prediction.modes is not None and prediction.frequency_slopes is not None and prediction.damping_slopes is not None
    hertz, ratio = prediction.modes.frequency, prediction.modes.damping_ratio
    relative, ratio_slopes = prediction.frequency_slopes / hertz, prediction.damping_slopes
    if not is_structural:
        return hertz, relative, ratio_slopes
    part, root = 1 - 2 * ratio**2, np.sqrt(1 - ratio**2)
    return (hertz * np.sqrt(part), relative - 2 * ratio * ratio_slopes / part,
            ratio_slopes * (1 / root + 4 * ratio**2 * root / part**2))


def _without_gyroscopic_part(slopes: MatrixDerivatives) -> MatrixDerivatives:
    """Return the derivatives without their gyroscopic part, which is skew: the modes of this study are those at standstill."""
    if slopes.damping is None:
        return slopes
    # The symmetric part of the damping remains.
    return replace(slopes, damping=(slopes.damping + np.swapaxes(slopes.damping, -1, -2)) / 2)


def _relative_turn(shape: Array, change: Array) -> Array:
    """Return the part of the change that is orthogonal to the shape, over the shape's length."""
    power = (np.abs(shape) ** 2).sum(axis=0)
    # Change along a shape is scaling, which no MAC sees.
    along = (change * shape.conj()).sum(axis=1, keepdims=True) / power
    return np.asarray((change - along * shape) / np.sqrt(power))


def _is_elastic_path(machine: Machine, path: str) -> bool:
    room, name, kind = [*path.split("."), "", ""][:3]
    return (room == "bodies" and kind in _ELASTIC_FIELDS and name in machine.body_names and name not in machine.reduced
            and machine.bodies[machine.link(name)].modal_count > 0)


def _all_paths(machine: Machine) -> tuple[str, ...]:
    elastic_bodies = [name for name, body in zip(machine.body_names, machine.bodies, strict=True)
                      if body.modal_count and name not in machine.reduced]
    plain_paths = [p for p in parameters(machine.description) if p.split(".")[1] not in elastic_bodies and machine.value(p) != 0
                   and has_derivative(machine.description, p) and (p.split(".")[2] in _FIELDS
                                                                   or p.split(".")[1] in machine.reduced)]
    return (*plain_paths, *(f"bodies.{name}.{kind}" for name in elastic_bodies for kind in _ELASTIC_FIELDS))


def _slopes(machine: Machine, names: tuple[str, ...], pose: Pose | None) -> MatrixDerivatives:
    plain_paths = [n for n in names if not _is_elastic_path(machine, n)]
    elastic_paths = [n for n in names if _is_elastic_path(machine, n)]
    if not elastic_paths:
        return matrix_derivatives(machine, names, pose)
    place = place_machine(machine, pose)
    closed = loop_basis(place) if machine.loops else None
    # With closed loops only motions that keep them closed are coordinates.
    basis = np.eye(machine.size) if closed is None else closed[0]
    slopes = {n: [np.zeros((basis.shape[1],) * 2) for _ in _TERMS] for n in names}
    plain_slopes = matrix_derivatives(machine, plain_paths, pose) if plain_paths else None
    for k, name in enumerate(plain_paths):
        for t, term in enumerate(_TERMS):
            matrices = getattr(plain_slopes, term)
            if matrices is not None:
                slopes[name][t] = matrices[k]
    for name in elastic_paths:
        link = machine.link(name.split(".")[1])
        twist, body = body_coordinates(place, link)[0] @ basis, machine.bodies[link]
        if name.endswith(".density"):
            # Mass scales with the density, stiffness with the modulus: the slope by the scale is the matrix itself.
            slopes[name][0] = twist.T @ body.mass @ twist
        else:
            slopes[name][2] = twist[6:].T @ body.stiffness @ twist[6:]
    return MatrixDerivatives(names, **{term: np.stack([slopes[n][t] for n in names]) for t, term in enumerate(_TERMS)})
