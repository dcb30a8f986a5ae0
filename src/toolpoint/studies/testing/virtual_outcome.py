"""Outcome of a planned hammer test by a virtual one: modes found, errors, shapes after expansion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.modal_identification import identify
from toolpoint.signals.hammer import hammer_test
from toolpoint.signals.setups import join_setups
from toolpoint.studies.machines.virtual_test import Hammer, Imperfections, hammer_records
from toolpoint.studies.testing.point_choice import expand
from toolpoint.vibration import Dof, Frf, Modes
from toolpoint.vibration.correlation import mac

SENSOR_DIRECTIONS = ("+x", "+y", "+z")
MODE_FREQUENCY_TOLERANCE = 0.02  # relative distance within which a mode counts as one of the model


@dataclass(frozen=True, eq=False)
class VirtualOutcome:
    """Outcome of a virtual test, for every mode of the model.

    frequency_error, damping_error : relative, not a number where the mode was not found; mac : of the measured shape, expanded
    to all points, with the model's.
    """

    points: tuple[str | int, ...]
    frequency_error: FloatArray
    damping_error: FloatArray
    mac: FloatArray
    false: int = 0

    @property
    def seen(self) -> int:
        """Number of modes found with a shape that is theirs."""
        return int((self.mac > 0.9).sum())

    @property
    def least_mac(self) -> float:
        """Least MAC after expansion, 0 where a mode was not found."""
        return float(np.nan_to_num(self.mac).min())

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        plain_numbers = (lambda values: [None if np.isnan(v) else float(v) for v in values])
        return {"points": list(self.points), "frequency_error": plain_numbers(self.frequency_error),
                "damping_error": plain_numbers(self.damping_error), "mac": plain_numbers(self.mac), "false_modes": self.false}


def run_virtual_test(modes: Modes, points: Sequence[str | int], struck: Sequence[Dof], *, hammer: Hammer, block: float,
                     highest: float, noise: float, rng: np.random.Generator,
                     progress: Callable[[int, int], None] = lambda finished, total: None) -> VirtualOutcome:
    """Return the outcome of the test: a sensor of three directions at every point, every Dof of `struck` struck each time.

    progress : of set-ups that were struck, of all; the identification behind them counts as much as all of them.
    """
    parts: list[Frf] = []
    count = len(struck) * len(points)
    for force in struck:
        for point in points:
            progress(len(parts), 2 * count)
            record = hammer_records(modes, force, [Dof(point, way) for way in SENSOR_DIRECTIONS], rng=rng, hammer=hammer,
                                    imperfections=Imperfections(noise=noise))
            parts.append(hammer_test(record, block, highest=highest).frf)
    frf = join_setups(parts)
    progress(count, 2 * count)
    frequency_min = 0.4 * float(modes.frequency.min())
    nothing = np.full(modes.count, np.nan)
    try:
        result = identify(frf, band=(max(frequency_min, float(frf.frequency[1])), highest)).modes
    except ToolpointError:
        return VirtualOutcome(tuple(points), nothing, nothing, np.zeros(modes.count))
    return _pair_with_model(modes, result, tuple(points))


def _pair_with_model(modes: Modes, result: Modes, points: tuple[str | int, ...]) -> VirtualOutcome:
    """Pair modes by their expanded shapes among those of near frequency, and return the errors."""
    # Responses that hear nothing but noise are left out by `identify`: their rows of the shapes are not there.
    measured, placed = set(result.dofs), set(points)
    dofs = [dof for dof in modes.dofs if dof.point in placed and dof in measured]
    macs = mac(modes.shape, expand(modes, result, dofs))
    is_near = np.abs(result.frequency[None, :] / modes.frequency[:, None] - 1) < MODE_FREQUENCY_TOLERANCE
    worth = np.where(is_near, macs, 0.0)
    frequency, damping, shape = (np.full(modes.count, np.nan) for _ in range(3))
    taken: set[int] = set()
    for i in np.argsort(-worth.max(axis=1)).tolist():
        order = [j for j in np.argsort(-worth[i]).tolist() if j not in taken and worth[i, j] > 0]
        if order:
            j = order[0]
            taken.add(j)
            frequency[i] = result.frequency[j] / modes.frequency[i] - 1
            damping[i] = result.damping_ratio[j] / modes.damping_ratio[i] - 1
            shape[i] = macs[i, j]
    return VirtualOutcome(points, frequency, damping, np.nan_to_num(shape), result.count - len(taken))
