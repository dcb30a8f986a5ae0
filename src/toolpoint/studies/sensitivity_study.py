r"""Sensitivity study: what each parameter of a machine does to its frequencies and shapes, alone and cumulated per part.

Relative sensitivity :math:`S = (p/f)\,df/dp`: per cent of frequency per per cent of the parameter. Shapes: MAC between the
shape at p and at p (1 + s) is, to second order, :math:`1 - s^2 c`, with c the squared length of the relative change of the
shape across itself; the table gives :math:`\sqrt c`, the angle of turn per unit of relative change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, count, fail
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine, assemble
from toolpoint.machine.derivatives import matrix_derivatives
from toolpoint.machine.description import parameters
from toolpoint.updating.system_model import AffineSystem, SystemModel
from toolpoint.vibration import Dof

_FIELDS = ("stiffness", "damping", "loss_factor", "mass", "density")


@dataclass(frozen=True, eq=False)
class SensitivityStudy:
    """Table of sensitivities.

    paths : (n_p); parts : joint or body of each; values : (n_p,), SI; frequencies : (n_modes,), Hz; frequency : (n_p, n_modes),
    (p/f) df/dp; damping : (n_p, n_modes), p d zeta/dp; shape : (n_p, n_modes), angle of turn of the shape per unit of dp/p
    (MAC = 1 - (angle dp/p)^2).
    """

    paths: tuple[str, ...]
    parts: tuple[str, ...]
    values: FloatArray
    frequencies: FloatArray
    frequency: FloatArray
    damping: FloatArray
    shape: FloatArray

    def mac_after(self, change: float) -> FloatArray:
        """Return the MAC of every shape with itself after a small relative change of each parameter, (n_p, n_modes)."""
        return np.asarray(np.maximum(0.0, 1 - (self.shape * change) ** 2))

    def cumulative(self, kind: str = "") -> dict[str, FloatArray]:
        """Return the relative sensitivity of each part, (n_modes,): all its parameters (of a kind) scaled together."""
        result: dict[str, FloatArray] = {}
        for path, part, row in zip(self.paths, self.parts, self.frequency, strict=True):
            if not kind or path.split(".")[2] == kind:
                result[part] = result.get(part, np.zeros(row.size)) + row
        return result

    def table(self) -> str:
        """Return single and cumulative sensitivities as text, per cent of frequency per per cent of the parameter."""
        parts = self.cumulative()
        width = max(map(len, (*self.paths, *parts)))
        lines = [f"{'relative d f / d p':{width}}" + "".join(f"{f:9.3f}" for f in self.frequencies) + "  Hz"]
        lines += [f"{path:{width}}" + "".join(f"{v:9.4f}" for v in row) for path, row in zip(
            self.paths, self.frequency, strict=True)]
        lines.append("cumulative per part")
        lines += [f"{part:{width}}" + "".join(f"{v:9.4f}" for v in row) for part, row in parts.items()]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"SensitivityStudy({len(self.paths)} parameters, {self.frequencies.size} modes)"


def sensitivity_study(
    machine: Machine, paths: Sequence[str] | None = None, modes: int = 6, pose: Pose | None = None,
    dofs: Sequence[Dof | str] | None = None,
) -> SensitivityStudy:
    """Return the exact sensitivities of the lowest modes at one pose.

    Parameters
    ----------
    machine : Machine
        Without gravity and loads; every direction held (no mode at 0 Hz among the lowest).
    paths : sequence of str, optional
        All stiffnesses, dampings, loss factors, masses and densities that are not zero where left out.
    modes : int
    pose : mapping, optional
    dofs : labels, optional
        Where shapes are seen; all points in x, y, z where left out.
    """
    names = tuple(paths) if paths is not None else tuple(
        p for p in parameters(machine.description) if p.split(".")[2] in _FIELDS and machine.value(p) != 0)
    if not names:
        fail("paths", "none", "must be at least one parameter")
    values = np.array([machine.value(n) for n in names])
    slopes = matrix_derivatives(machine, names, pose)
    system = assemble(machine, pose, dofs, modal_damping=False)
    held = AffineSystem(system, slopes, tuple(values.tolist()))
    found = SystemModel(held, count("modes", modes), modal_damping=machine.description.damping_ratio)({}, names)
    assert found.modes is not None and found.frequency_slopes is not None
    assert found.damping_slopes is not None and found.shape_slopes is not None
    frequency = values[:, None] * found.frequency_slopes / found.modes.frequency
    return SensitivityStudy(names, tuple(".".join(n.split(".")[:2]) for n in names), values, found.modes.frequency, frequency,
                            values[:, None] * found.damping_slopes,
                            _turn(np.real(found.modes.shape), values[:, None, None] * found.shape_slopes))


def _turn(shape: FloatArray, change: FloatArray) -> FloatArray:
    """Length of the part of the change that is square to the shape, over the shape's length."""
    power = (shape**2).sum(axis=0)
    along = (change * shape).sum(axis=1, keepdims=True) / power
    return np.asarray(np.linalg.norm(change - along * shape, axis=1) / np.sqrt(power))
