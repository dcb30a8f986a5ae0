r"""Static and dynamic stiffness of the tool against the work over poses, along x, y, z of the tool and in principal directions.

The compliance :math:`G(f)` of tool against table is (3, 3); its largest singular value is the greatest displacement that a unit
force of any direction causes, so :math:`1/\sigma_{max}` is the least stiffness, and the singular vector its direction. The
dynamic stiffness is the least over frequency.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import ComplexArray, FloatArray, one_of
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.studies.execute import Engine, Progress
from toolpoint.studies.machines.pose_grid import Grid, check_grid, evaluate_block, map_over, plain_cells
from toolpoint.studies.machines.tool_point import ToolPoint, tool_point
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import frequency_response

KINDS = ("static", "dynamic")
NAMES = ("along x", "along y", "along z", "softest direction", "middle direction", "stiffest direction")
_NEWTON_PER_MICRON = 1e6  # N/m in one N/µm
_STIFFNESS_MAP_LINES = 600  # frequency lines beside those around the resonances


@dataclass(frozen=True, eq=False)
class StiffnessMap(NotebookText):
    """Stiffness over a grid.

    axes : axis name to its positions, m or rad; stiffness : (n_1, ..., 6), N/m, along the tool's x, y, z and in principal
    directions from the softest up, not a number where a pose failed; softest : (n_1, ..., 3), the softest direction in the
    tool's axes; frequency : (n_1, ...), Hz, where the dynamic stiffness is least (zero for the static one).
    """

    kind: str
    axes: Mapping[str, FloatArray]
    stiffness: FloatArray
    softest: FloatArray
    frequency: FloatArray
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)
    angles: tuple[str, ...] = ()

    @property
    def grid(self) -> Grid:
        """The axes with their positions."""
        return Grid(self.axes, self.angles)

    def failed(self) -> list[str]:
        """Return a line on every pose that failed: where it is, and why."""
        return self.grid.failure_lines(self.failures)

    def extremes(self) -> list[str]:
        """Return a line on every direction: where the stiffness is least and greatest."""
        return self.grid.extreme_lines(self.stiffness / _NEWTON_PER_MICRON, NAMES, "N/µm")

    def table(self) -> str:
        """Return the range of every direction and where the ends lie as text."""
        flat = self.stiffness.reshape(-1, len(NAMES)) / _NEWTON_PER_MICRON
        rows = [[name, f"{np.nanmin(column):.4g}", f"{np.nanmax(column):.4g}"]
                for name, column in zip(NAMES, flat.T, strict=True) if not np.isnan(column).all()]
        return "\n".join([text_table(f"{self.kind.capitalize()} stiffness over {self.grid}, {len(self.failures)} poses failed",
                                     ["direction", "least N/µm", "greatest N/µm"], rows), *self.extremes()])

    def to_dict(self) -> dict[str, Any]:
        """Return the map as plain numbers and text, None where a pose failed; positions in m or rad, N/m."""
        return {"kind": self.kind, "axes": {name: positions.tolist() for name, positions in self.axes.items()},
                "directions": list(NAMES),
                "stiffness_n_per_m": plain_cells(self.stiffness), "softest_direction": plain_cells(self.softest),
                "frequency_hz": plain_cells(self.frequency), "failures": self.failed(), "extremes": self.extremes()}

    def __repr__(self) -> str:
        return f"StiffnessMap({self.kind}, {self.grid}, {len(self.failures)} poses failed)"


@dataclass(frozen=True)
class _Stiffness:
    """Stiffness of a block of poses: six values, the softest direction, and its frequency."""

    machine: Machine
    names: tuple[str, ...]
    kind: str

    @property
    def identity(self) -> str:
        """Key of this study among others on the same grid."""
        return repr((self.machine.description, self.kind))

    def __call__(self, block: Sequence[Sequence[float]]) -> dict[str, Any]:
        return evaluate_block(self._evaluate, self.machine, self.names, block=block, columns=10)

    def _evaluate(self, poses: Mapping[str, FloatArray]) -> FloatArray:
        count = len(next(iter(poses.values())))
        listed = [{name: float(positions[i]) for name, positions in poses.items()} for i in range(count)]
        study = tool_point(self.machine, listed, np.array([0.0, 1.0]))
        return stiffness_rows(study, self.kind)


def stiffness_rows(study: ToolPoint, kind: str) -> FloatArray:
    """Return stiffness along x, y, z and in principal directions, the softest direction, and the frequency, (n_poses, 10)."""
    if kind == "static":
        return _least_stiffness(study.frf.values[:, :1], np.zeros(1))
    rows = []
    for i in range(len(study.poses)):
        modes = study.modes.at_pose(i)
        f = resonance_lines(modes.frequency, modes.damping_ratio)
        rows.append(_least_stiffness(frequency_response.modal(modes, f).values[None], f)[0])
    return np.array(rows)


def resonance_lines(frequency: FloatArray, damping_ratio: FloatArray) -> FloatArray:
    """Return lines from zero upwards that are dense around every resonance, so that no peak is missed, Hz."""
    moving = frequency[frequency > 0]
    # An undamped mode would have all its lines at one place, and no width to take the peak from.
    width = np.maximum(damping_ratio[frequency > 0], 1e-4)[:, None] * moving[:, None]
    # A hyperbolic sine is dense at the resonance and reaches far down its sides.
    around = moving[:, None] + width * np.sinh(np.linspace(-3, 3, 61)) / 4
    lines = np.concatenate([np.linspace(0, 1.2 * float(moving.max()), _STIFFNESS_MAP_LINES), around.ravel()])
    return np.unique(lines[lines >= 0])


def _least_stiffness(values: ComplexArray, frequency: FloatArray) -> FloatArray:
    """Return rows of the least stiffness over frequency from compliances (P, n_f, 3, 3)."""
    direct = np.abs(np.diagonal(values, axis1=-2, axis2=-1)).max(axis=1)
    u, singular, _ = np.linalg.svd(values)
    softest_line = singular[:, :, 0].argmax(axis=1)
    pose_index = np.arange(len(values))
    # A complex vector is turned by the phase that makes it as real as it can be.
    vector = u[pose_index, softest_line, :, 0]
    vector = np.real(vector * np.exp(-0.5j * np.angle((vector**2).sum(axis=-1)))[:, None])
    vector = vector / np.linalg.norm(vector, axis=-1, keepdims=True)
    sign = np.sign(vector[pose_index, np.abs(vector).argmax(axis=-1)])[:, None]
    with np.errstate(divide="ignore"):
        return np.concatenate([1 / direct, 1 / singular[pose_index, softest_line], sign * vector,
                               frequency[softest_line][:, None]], axis=1)


def stiffness_map(
    machine: Machine, axes: Mapping[str, ArrayLike], kind: str = "static", *, engine: Engine | None = None,
    folder: str | Path | None = None, progress: Progress | None = None,
) -> StiffnessMap:
    """Return the stiffness of the tool against the work over the grid of all combinations of axis positions.

    Parameters
    ----------
    machine : Machine
        Names its tool point, and the table where there is one.
    axes : mapping of axis name to positions
        m or rad; axes left out are at rest.
    kind : str
        ``static``, or ``dynamic`` (the least over frequency).
    engine, folder, progress : see `execute.execute`

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     AxisDescription,
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"y": 2e7, "z": 4e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, {"X": AxisDescription("slide", "x")},
    ...                                    {"tip": PointDescription("head")}, tool="tip", damping_ratio=0.02))
    >>> (stiffness_map(machine, {"X": [0.0]}).stiffness[0, :3] / 1e6).round(3).tolist()  # N/µm; the axis itself holds rigidly
    [inf, 20.0, 40.0]
    """
    one_of("kind", kind, KINDS)
    grid = check_grid(machine, axes)
    values, failures = map_over(_Stiffness(machine, tuple(grid.axes), kind), grid, 10, engine=engine, folder=folder,
                                progress=progress)
    return StiffnessMap(kind, grid.axes, values[..., :6], values[..., 6:9], values[..., 9], failures, grid.angles)
