"""Natural frequencies over a grid of axis positions."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointError, count, fail, floats
from toolpoint.machine.assemble import freedoms
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.model import Machine
from toolpoint.studies.execute import Engine, Progress, execute
from toolpoint.studies.text_table import text_table

_BLOCK = 256


@dataclass(frozen=True, eq=False)
class PoseMap:
    """Frequencies over a grid.

    axes : axis name to its positions, m or rad; frequency : (n_1, n_2, ..., n_modes), Hz, not a number where a pose failed;
    failures : grid index to reason.
    """

    axes: Mapping[str, FloatArray]
    frequency: FloatArray
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)

    def spread(self) -> FloatArray:
        """Return highest minus lowest frequency of every mode over the grid, Hz, shape (n_modes,)."""
        flat = self.frequency.reshape(-1, self.frequency.shape[-1])
        return np.nanmax(flat, axis=0) - np.nanmin(flat, axis=0)

    def failed(self) -> list[str]:
        """Return a line on every pose that failed: where it is, and why."""
        names = list(self.axes)
        return [", ".join(f"{name} {self.axes[name][i]:g}" for name, i in zip(names, index, strict=True)) + f": {reason}"
                for index, reason in self.failures.items()]

    def table(self) -> str:
        """Return how far every mode moves over the grid as text."""
        return text_table(repr(self), ["mode", "spread Hz"], [[str(i + 1), f"{s:.4f}"] for i, s in enumerate(self.spread())])

    def to_dict(self) -> dict[str, Any]:
        """Return the map as plain numbers and text, None where a pose failed; positions in m or rad."""
        values = self.frequency.astype(object)
        values[np.isnan(self.frequency)] = None
        return {"axes": {name: at.tolist() for name, at in self.axes.items()}, "frequency_hz": values.tolist(),
                "failures": self.failed()}

    def __repr__(self) -> str:
        grid = " x ".join(f"{name} {len(v)}" for name, v in self.axes.items())
        return f"PoseMap({grid}, {self.frequency.shape[-1]} modes, {len(self.failures)} poses failed)"


@dataclass(frozen=True)
class _Frequencies:
    """Frequencies of a block of poses; a pose that fails is found and its reason kept."""

    machine: Machine
    names: tuple[str, ...]
    modes: int
    path: str

    @property
    def identity(self) -> str:
        """What tells this study from another one on the same grid."""
        return repr((self.machine.description, self.modes, self.path))

    def __call__(self, block: Sequence[Sequence[float]]) -> dict[str, Any]:
        positions = np.array(block)
        try:
            return {"frequency": self._at(positions), "reasons": np.array([""] * len(block))}
        except ToolpointError:
            return self._one_by_one(positions)

    def _at(self, positions: FloatArray) -> FloatArray:
        return natural_frequencies(self.machine, dict(zip(self.names, positions.T, strict=True)), self.modes, path=self.path)

    def _one_by_one(self, positions: FloatArray) -> dict[str, Any]:
        values, reasons = np.full((len(positions), self.modes), np.nan), []
        for i, position in enumerate(positions):
            try:
                values[i] = self._at(position[None])[0]
                reasons.append("")
            except ToolpointError as error:
                reasons.append(str(error))
        return {"frequency": values, "reasons": np.array(reasons)}


def pose_map(
    machine: Machine, axes: Mapping[str, ArrayLike], modes: int = 6, *, engine: Engine | None = None,
    folder: str | Path | None = None, progress: Progress | None = None, path: str = "numpy",
) -> PoseMap:
    """Return the lowest natural frequencies over the grid of all combinations of axis positions.

    Parameters
    ----------
    machine : Machine
    axes : mapping of axis name to positions
        m or rad; axes left out stand at zero.
    modes : int
    engine, folder, progress : see `execute.execute`
    path : str
        ``numpy`` or ``compiled``, see `machine.frequencies.natural_frequencies`.
    """
    if not axes:
        fail("axes", "none", "must be at least one axis with its positions")
    modes = min(count("modes", modes), freedoms(machine))
    grid = {name: np.atleast_1d(floats(f"axes[{name!r}]", v)) for name, v in axes.items()}
    machine.chain.positions({name: float(v[0]) for name, v in grid.items()})
    poses = [list(map(float, pose)) for pose in itertools.product(*grid.values())]
    blocks = [poses[i:i + _BLOCK] for i in range(0, len(poses), _BLOCK)]
    run = execute(_Frequencies(machine, tuple(grid), modes, path), blocks, engine, folder=folder, progress=progress)
    shape = tuple(len(v) for v in grid.values())
    values, reasons = [], []
    for block, outcome in zip(blocks, run.outcomes, strict=True):
        parts = outcome.values
        values.append(np.full((len(block), modes), np.nan) if parts is None else parts["frequency"])
        reasons += [outcome.failure] * len(block) if parts is None else list(map(str, parts["reasons"]))
    failures = {tuple(int(k) for k in np.unravel_index(i, shape)): reason for i, reason in enumerate(reasons) if reason}
    return PoseMap(grid, np.concatenate(values).reshape(*shape, modes), failures)
