r"""Figures 34 to 37 and 41 of the milling robot's source by its own equations: real parts, zero-order limit, forces.

The limit is :math:`a = -1/(K_s Z\, \Re H)`, :math:`K_s = K_t\sqrt{1 + K_r^2}` (12, 13) at the speeds
:math:`n = 60 \cdot 2\pi f/(Z (\pi + 2k\pi - 2\varphi))`, :math:`\varphi = -\arctan|\Im H/\Re H|` (14, 15), one direction alone.
Responses below 150 Hz are left out as there: the robot's first modes, which limit low speeds, are not in this limit. The exact
chart of the demo has them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText
from toolpoint.cutting.build import coefficients_of, tool_of
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.tool_point import tool_point

SOURCE_SPAN, _SOURCE_STEP = (150.0, 2500.0), 0.25  # Hz
SOURCE_LOBES = {"x": (1025.0,), "y": (245.0, 1030.0), "z": (153.0, 198.0, 245.0, 556.0, 1165.0)}  # Hz, figures 34 to 36
SOURCE_POINT = (15000.0, 0.5e-3)  # rev/min and m, the point that is taken from figure 37
_MAX_LOBE_NUMBER = 60  # of the lobes drawn: those above lie below the charted speeds
_MIN_SPEED, _MAX_SPEED, _LIMIT_SPEED_COUNT = 2000.0, 24000.0, 221  # rev/min


@dataclass(frozen=True, eq=False)
class SourceFigures(NotebookText):
    """Figures of the source at one pose.

    lines : (n,), Hz; real : (n, 3), real parts along x, y, z, m/N; speeds : (m,), rev/min, and limit : (m,), zero-order depth
    along z, m, not a number where no lobe reaches; angle : (k,), rad, and force : (k, 2), N of a tooth along the feed and
    across it, for a millimetre of depth.
    """

    lines: FloatArray
    real: FloatArray
    speeds: FloatArray
    limit: FloatArray
    angle: FloatArray
    force: FloatArray

    def lobe_starts(self, way: str) -> FloatArray:
        """Return where the real part along x, y or z begins to be negative and comes back, Hz."""
        negative = np.signbit(self.real[:, "xyz".index(way)]).astype(int)
        down = np.flatnonzero(np.diff(negative) > 0) + 1
        up = np.flatnonzero(np.diff(negative) < 0) + 1
        return np.asarray(self.lines[[k for k in down if (up > k).any()]])

    def words(self) -> list[str]:
        """Return each figure's numbers beside the source's."""
        lines = []
        for number, (way, source) in zip((34, 35, 36), SOURCE_LOBES.items(), strict=True):
            starts_text = ", ".join(f"{f:.0f}" for f in self.lobe_starts(way)) or "none"
            lines.append(f"figure {number}, negative lobes along {way} from 150 Hz on: the source near "
                         f"{', '.join(f'{f:.0f}' for f in source)} Hz; here from {starts_text} Hz")
        speed, depth = SOURCE_POINT
        lowest_limit = float(np.nanmin(self.limit))
        lines.append(f"figure 37, zero-order limit along z: the source takes {1e3 * depth:g} mm at {speed:.0f} rev/min as "
                     f"stable; here the least limit is {1e3 * lowest_limit:.2f} mm (modes below 150 Hz left out, as there)")
        across = self.force[:, 1]
        lines.append(f"figure 41, a millimetre deep: across the feed {across.min():.1f} to {across.max():.1f} N, largest at "
                     f"{np.degrees(self.angle[across.argmax()]):.0f} deg (the source: never negative, largest at 90 deg, which "
                     "its own constants do not give: edge forces turn it as a tooth enters)")
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Return lobes, limit and forces as plain data, SI."""
        return {"lobes_hz": {way: self.lobe_starts(way).tolist() for way in SOURCE_LOBES}, "words": self.words()}

    def __repr__(self) -> str:
        return f"SourceFigures({self.lines.size} lines, {self.speeds.size} speeds)"


def compute_source_figures(machine: Machine, pose: Mapping[str, float]) -> SourceFigures:
    """Return the figures of a machine that names its tool and its cut, at a pose.

    Raises ToolpointError where the machine describes no cut.
    """
    cut = machine.description.cutting
    if cut is None:
        fail("machine", "no cut", "must describe one", remedy="add 'cutting' to the machine file")
    lines = np.arange(SOURCE_SPAN[0], SOURCE_SPAN[1] + _SOURCE_STEP / 2, _SOURCE_STEP)
    response = tool_point(machine, [pose], lines).frf.values[0]
    speeds = np.linspace(_MIN_SPEED, _MAX_SPEED, _LIMIT_SPEED_COUNT)
    law, teeth = coefficients_of(cut), tool_of(cut).teeth
    specific = float(np.hypot(law.kt, law.kn))
    limit = _zero_order(lines, response[:, 2, 2], speeds, teeth=teeth, specific=specific)
    angle = np.linspace(0, np.pi, 361)
    chip, depth = cut.feed_per_tooth * np.sin(angle), 1e-3
    tangential = depth * (law.kt * chip + law.edge_t)
    normal = depth * (law.kn * chip + law.edge_n)
    force = np.stack([-np.cos(angle) * tangential - np.sin(angle) * normal,
                      np.sin(angle) * tangential - np.cos(angle) * normal], axis=1)
    return SourceFigures(lines, np.diagonal(response, axis1=1, axis2=2).real.copy(), speeds, limit, angle, force)


def _zero_order(lines: FloatArray, response: Any, speeds: FloatArray, *, teeth: int, specific: float) -> FloatArray:
    """Return the least zero-order depth at every speed, m, not a number where no lobe reaches."""
    negative = response.real < 0
    f, value = lines[negative], response[negative]
    depth = -1 / (specific * teeth * value.real)
    phase = -np.arctan(np.abs(value.imag / value.real))
    limit = np.full(len(speeds), np.inf)
    for k in range(_MAX_LOBE_NUMBER):
        speed = 60 * 2 * np.pi * f / (teeth * (np.pi + 2 * k * np.pi - 2 * phase))
        place = np.rint((speed - speeds[0]) / (speeds[1] - speeds[0])).astype(int)
        inside = (place >= 0) & (place < len(speeds))
        np.minimum.at(limit, place[inside], depth[inside])
    return np.where(np.isfinite(limit), limit, np.nan)
