r"""Significance of modes between two points, tool against table: modes ranked by their relative motion.

The relative receptance of a mode at its resonance is :math:`|\delta_d^2| / (2 \zeta_r \omega_r^2)` for unit modal mass,
:math:`\delta = \phi_{plus} - \phi_{minus}`; a mode that moves both points alike does not matter to the cut.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.modes import Modes


@dataclass(frozen=True, eq=False)
class Significance:
    """Peak relative receptance (m/N where the modes have a scale) of every mode and direction, (n_modes, n_directions).

    `share` (n_modes,) is the largest over the directions, each over the highest mode in that direction.

    >>> modes = Modes([50.0, 80.0], [0.02, 0.02], [[0.1, 0.1], [0.1, -0.1]], ["tool:+x", "table:+x"])
    >>> significance(modes, "tool", "table", directions=["x"]).selected().frequency.tolist()
    [80.0]
    """

    modes: Modes
    directions: tuple[str, ...]
    peak: FloatArray
    share: FloatArray

    def selected(self, min_share: float = 0.1) -> Modes:
        """Return the modes whose share is at least `min_share`, in their order of frequency."""
        positive("least", min_share, 1.0)
        return self.modes.selected(np.flatnonzero(self.share >= min_share).tolist())

    @property
    def ranking(self) -> np.ndarray:
        """Indices of the modes, the most significant first."""
        return np.argsort(-self.share, kind="stable")


def significance(modes: Modes, plus: str | int, minus: str | int,
                 *, directions: Iterable[str] = ("x", "y", "z")) -> Significance:
    """Return the relative motion of point `plus` against point `minus` (tool and table) in every mode.

    Unscaled modes are compared by their shapes relative to the rms of each; the peaks then have no unit.

    >>> modes = Modes([50.0, 80.0], [0.02, 0.02], [[0.1, 0.1], [0.1, -0.1]], ["tool:+x", "table:+x"])
    >>> significance(modes, "tool", "table", directions=["x"]).share.tolist()  # at 50 Hz both move alike
    [0.0, 1.0]
    """
    if modes.frequency.ndim > 1:
        fail("modes", f"{modes.frequency.shape[0]} poses", "must be one pose", remedy="use at_pose(i)")
    axes = tuple(directions)
    relative = modes.shape_at([Dof(plus, way) for way in axes]) - modes.shape_at([Dof(minus, way) for way in axes])
    square = np.abs(relative.T) ** 2
    w, zeta = modes.omega, np.maximum(np.abs(modes.damping_ratio), 1e-6)
    if modes.scaling == "unit modal mass":
        peak = square / (2 * zeta * w**2)[:, None]
    elif modes.scaling == "modal A":
        peak = square / (zeta * w)[:, None]
    else:
        peak = square / (np.abs(modes.shape) ** 2).mean(axis=0)[:, None]
    largest = peak.max(axis=0)
    share = (peak / np.where(largest > 0, largest, 1.0)).max(axis=1)
    return Significance(modes, axes, peak, share)
