r"""Significance of modes between two points, tool against table: modes ranked by their relative motion.

The relative receptance of a mode at its resonance is :math:`|\delta_d^2| / (2 \zeta_r \omega_r^2)` for unit modal mass,
:math:`\delta = \phi_{plus} - \phi_{minus}`; a mode that moves both points alike does not matter to the cut.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint._rounding import number_text
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.modes import Modes

MIN_SELECTED_SHARE = 0.1  # of the largest peak along a direction, from which a mode counts for the cut
SCALED = ("unit modal mass", "modal A")  # scalings whose peaks are receptances


@dataclass(frozen=True, eq=False)
class Significance(NotebookText):
    """Peak relative receptance (m/N where the modes have a scale) of every mode and direction, (n_modes, n_directions).

    `points` are the two points, the first against the second; `share` (n_modes,) is the largest over the directions, each over
    the highest mode in that direction.

    >>> modes = Modes([50.0, 80.0], [0.02, 0.02], [[0.1, 0.1], [0.1, -0.1]], ["tool:+x", "table:+x"])
    >>> significance(modes, "tool", "table", directions=["x"]).selected().frequency.tolist()
    [80.0]
    """

    modes: Modes
    points: tuple[str, str]
    directions: tuple[str, ...]
    peak: FloatArray
    share: FloatArray

    def selected(self, min_share: float = MIN_SELECTED_SHARE) -> Modes:
        """Return the modes whose share is at least `min_share`, in their order of frequency."""
        positive("min_share", min_share, 1.0)
        return self.modes.selected(np.flatnonzero(self.share >= min_share).tolist())

    @property
    def ranking(self) -> np.ndarray:
        """Indices of the modes, the most significant first."""
        return np.argsort(-self.share, kind="stable")

    @property
    def status(self) -> str:
        """Sentence of the modes that move the points against each other, and of those that hardly do."""
        plus, minus = self.points
        selected = [f"{f:.4g}" for f in self.selected().frequency]
        if not selected:
            return f"No mode moves {plus} against {minus} along {', '.join(self.directions)}."
        others = self.modes.count - len(selected)
        left_out = "" if not others else ("; the other one moves both nearly alike, or neither, and hardly matters to the cut"
                                          if others == 1 else f"; the other {others} move both nearly alike, or neither, and "
                                                              "hardly matter to the cut")
        plural = len(selected) != 1
        return (f"The mode{'s' * plural} at {', '.join(selected)} Hz move{'' if plural else 's'} {plus} against {minus} by at "
                f"least a tenth of the largest along {' or '.join(self.directions)}{left_out}.")

    @property
    def header(self) -> list[str]:
        """Heads of the columns of `rows`."""
        unit = "nm/N" if self.modes.scaling in SCALED else "no unit"
        return ["mode", "frequency, Hz", *(f"peak along {way}, {unit}" for way in self.directions), "share, %", "selected"]

    def rows(self) -> list[list[object]]:
        """Return a row a mode: its peaks of the first point against the second, share, and whether it is selected."""
        scale = 1e9 if self.modes.scaling in SCALED else 1.0
        return [[i + 1, float(self.modes.frequency[i]), *(scale * self.peak[i]).tolist(), 100 * float(self.share[i]),
                 "yes" if self.share[i] >= MIN_SELECTED_SHARE else "no"] for i in range(self.modes.count)]

    def table(self) -> str:
        """Return peaks and shares of every mode as text, and which of them are selected."""
        lines = [f"{self.points[0]} against {self.points[1]}:", "  ".join(self.header)]
        for mode, frequency, *numbers, word in self.rows():
            cells = [number_text(float(str(value))).rjust(len(head))
                     for head, value in zip(self.header[2:-1], numbers, strict=True)]
            lines.append("  ".join([f"{mode:>4}", f"{frequency:>13.4f}", *cells, str(word)]))
        return "\n".join([*lines, self.status])

    def to_dict(self) -> dict[str, Any]:
        """Return points, directions, peaks (m/N where the modes have a scale) and shares as plain data."""
        return {"points": list(self.points), "directions": list(self.directions), "peak": self.peak.tolist(),
                "is_scaled": self.modes.scaling in SCALED, "share": self.share.tolist(),
                "selected": (self.share >= MIN_SELECTED_SHARE).tolist()}


def significance(modes: Modes, plus: str | int, minus: str | int, *, directions: Iterable[str] | None = None) -> Significance:
    """Return the relative motion of point `plus` against point `minus` (tool and table) in every mode.

    Unscaled modes are compared by their shapes relative to the rms of each; the peaks then have no unit.

    directions : of x, y and z; all along which both points were measured, where left out.

    Raises ToolpointError where a point is not among the shapes', or the two share no direction.

    >>> modes = Modes([50.0, 80.0], [0.02, 0.02], [[0.1, 0.1], [0.1, -0.1]], ["tool:+x", "table:+x"])
    >>> significance(modes, "tool", "table").share.tolist()  # at 50 Hz both move alike
    [0.0, 1.0]
    """
    if modes.frequency.ndim > 1:
        fail("modes", f"{modes.frequency.shape[0]} poses", "must be one pose", remedy="use at_pose(i)")
    axes = tuple(common_directions(modes.dofs, plus, minus) if directions is None else directions)
    relative = np.array([_motion(modes, plus, way) - _motion(modes, minus, way) for way in axes])
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
    return Significance(modes, (str(plus), str(minus)), axes, peak, share)


def common_directions(dofs: Iterable[Dof], plus: str | int, minus: str | int) -> list[str]:
    """Return those of x, y and z along which both points were measured; refuse a point without any, or two that share none."""
    labels = list(dofs)
    measured = {str(point): {dof.direction[-1] for dof in labels if str(dof.point) == str(point) and len(dof.direction) == 2}
                for point in (plus, minus)}
    for name, ways in measured.items():
        if not ways:
            points = list(dict.fromkeys(str(dof.point) for dof in labels))
            listed = ", ".join(points[:8]) + (" ..." if len(points) > 8 else "")
            fail("between", name, f"must be a point that was measured: {listed}")
    shared = [way for way in "xyz" if all(way in ways for ways in measured.values())]
    if not shared:
        fail("between", f"{plus} measured along {', '.join(sorted(measured[str(plus)]))}, {minus} along "
             f"{', '.join(sorted(measured[str(minus)]))}", "must share a direction", remedy="measure both along the same one")
    return shared


def _motion(modes: Modes, point: str | int, way: str) -> ComplexArray | FloatArray:
    """Return the motion of a point along +x, +y or +z in every mode, (n_modes,), from a sensor that points either way."""
    opposite = Dof.parse(f"{point}:-{way}")
    sign = -1.0 if opposite in modes.dofs else 1.0
    return sign * modes.shape_at([opposite if sign < 0 else Dof.parse(f"{point}:+{way}")])[0]
