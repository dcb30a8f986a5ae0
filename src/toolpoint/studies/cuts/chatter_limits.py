"""Chatter limits of a cut over poses, feed directions and speeds (`ChatterMap`), with the cut of the least stable depth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt, doubts_among, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import limit_text, text_below
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.result import DOUBTFUL_ERROR_FRACTION
from toolpoint.studies.cuts.limit_spread import LimitSpread
from toolpoint.studies.machines.pose_words import position_words
from toolpoint.studies.text_table import text_table

HEADER = ("feed direction", "stable depth mm", "pose", "rev/min", "chatter Hz")


@dataclass(frozen=True)
class WorstCut:
    """Cut of the least stable depth: pose, feed angle (rad), speed (rev/min), depth (m), chatter frequency (Hz).

    angles : axes of the pose that are angles; error : what is stated of the depth, m.
    """

    pose: Mapping[str, float]
    feed_angle: float
    speed: float
    depth: float
    frequency: float
    angles: tuple[str, ...] = ()
    error: float = 0.0

    def __str__(self) -> str:
        if not np.isfinite(self.depth):
            return "no limit was found below the depths looked at"
        return (f"{limit_text(1e3 * self.depth, 1e3 * self.error)} mm at {pose_words(self.pose, self.angles)}, "
                f"feed at {angle_words(self.feed_angle)}, {self.speed:.0f} rev/min (chatter at {self.frequency:.1f} Hz)")


@dataclass(frozen=True, eq=False)
class ChatterMap(NotebookText):
    """Limits of one cut over a grid of axis positions, or over a list of poses.

    axes : axis name to its positions, m or rad; empty for a list of poses, which has one leading axis instead.
    feed_angles : (n_directions,) rad from x towards y; speeds : (n_speeds,) rev/min.
    limit : (n_1, ..., n_directions, n_speeds) depth of the first loss of stability, m, infinite above `depth_max`, not a number
    where it failed; error : the same shape, what its method states of it, m; frequency : the same shape, chatter frequency
    there, Hz; depth_max : (n_1, ...) largest depth looked at, m.
    failures : place and direction to reason; notes : remarks of the method; poses : those of a list; angles : axes in rad.
    """

    axes: Mapping[str, FloatArray]
    feed_angles: FloatArray
    speeds: FloatArray
    limit: FloatArray
    frequency: FloatArray
    depth_max: FloatArray
    cut: CuttingDescription
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    poses: tuple[Mapping[str, float], ...] = ()
    angles: tuple[str, ...] = ()
    spread: LimitSpread | None = None
    error: FloatArray | None = None

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts of the charts, and one about limits whose stated error is more than a tenth of them."""
        return (*doubts_among(self.notes), *self._rough_limits())

    def _rough_limits(self) -> tuple[Doubt, ...]:
        if self.error is None:
            return ()
        has_limit = np.isfinite(self.limit) & (self.limit > 0)
        # A share of no limit, or of a limit of zero, is none.
        share = np.where(has_limit, self.error / np.where(has_limit, self.limit, 1.0), 0.0)
        doubtful_count = int((share > DOUBTFUL_ERROR_FRACTION).sum())
        if not doubtful_count:
            return ()
        # Position in the grid, feed direction, speed: the axes of the limits.
        *place, way, speed_index = (int(k) for k in np.unravel_index(int(share.argmax()), share.shape))
        where = (f"{pose_words(self.pose(place), self.angles)}, feed at {angle_words(self.feed_angles[way])}, "
                 f"{self.speeds[speed_index]:.0f} rev/min")
        why = (f"the stated error is more than {100 * DOUBTFUL_ERROR_FRACTION:g} % of the limit at {doubtful_count} of "
               f"{share.size} charted cuts, {100 * share.max():.0f} % at {where}")
        return (Doubt("limits", why, "take the lower end there, or look at that pose with lobes", figure=float(share.max())),)

    @property
    def lowest(self) -> FloatArray:
        """Depth that is stable at every speed, m, shape (n_1, ..., n_directions); not a number where it failed."""
        # The minimum keeps not-a-number: a pose that failed at one speed has no depth for all.
        return np.asarray(self.limit.min(axis=-1))

    @property
    def everywhere(self) -> FloatArray:
        """Depth that is stable at every pose and in every direction that did not fail, m, shape (n_speeds,)."""
        flat = self.limit.reshape(-1, self.speeds.size)
        # Poses that failed say nothing; they are listed with the failures.
        return np.asarray(flat[~np.isnan(flat).any(axis=1)].min(axis=0))

    def pose(self, index: Sequence[int]) -> dict[str, float]:
        """Return the axis positions of a place."""
        if not self.axes:
            return dict(self.poses[index[0]])
        return {name: float(positions[i]) for (name, positions), i in zip(self.axes.items(), index)}

    def worst(self, direction: int | None = None) -> WorstCut:
        """Return the cut with the least stable depth, in one feed direction or in all."""
        limit = self.limit if direction is None else self.limit[..., direction:direction + 1, :]
        if np.isnan(limit).all():
            fail("worst", "every pose failed", f"the first because: {next(iter(self.failures.values()), '')}")
        *place, way, speed_index = (int(i) for i in np.unravel_index(int(np.nanargmin(limit)), limit.shape))
        # Of one direction the slice has a single column, whose index is 0.
        way = way if direction is None else direction
        index = (*place, way, speed_index)
        return WorstCut(self.pose(place), float(self.feed_angles[way]), float(self.speeds[speed_index]),
                        float(self.limit[index]),
                        float(self.frequency[index]), self.angles, 0.0 if self.error is None else float(self.error[index]))

    def rows(self) -> list[list[str]]:
        """Return a row of texts for every feed direction, see `HEADER`: least depth, where and at which speed."""
        rows = []
        depth_max = float(np.nanmin(self.depth_max))
        for way, angle in enumerate(self.feed_angles):
            if np.isnan(self.limit[..., way, :]).all():
                rows.append([angle_words(angle), "failed", "", "", ""])
                continue
            worst_cut = self.worst(way)
            place = [pose_words(worst_cut.pose, self.angles), f"{worst_cut.speed:.0f}", f"{worst_cut.frequency:.1f}"]
            rows.append([angle_words(angle), depth_words(worst_cut.depth, depth_max),
                         *(place if np.isfinite(worst_cut.depth) else [""] * 3)])
        return rows

    def failed(self) -> list[str]:
        """Return a line on every pose that failed, with its feed direction where only that failed."""
        by_place: dict[tuple[int, ...], dict[int, str]] = {}
        for (*index, way), reason in self.failures.items():
            by_place.setdefault(tuple(index), {})[way] = reason
        lines = []
        for place, reasons in by_place.items():
            # A pose that failed in every direction is named once, without them.
            ways = "" if len(reasons) == self.feed_angles.size else ", feed at " + ", ".join(
                angle_words(self.feed_angles[way]) for way in reasons)
            lines.append(f"{pose_words(self.pose(place), self.angles)}{ways}: {next(iter(reasons.values()))}")
        return lines

    def table(self) -> str:
        """Return the least depth of every feed direction, the worst place, and the failures, as text."""
        title, worst_cut = f"Depth that is stable at every charted speed: {self._size}", self.worst()
        return "\n".join([*mark_notes(self.doubts), text_table(title, HEADER, self.rows()),
                          *(f"failed: {text}" for text in self.failed()), f"Worst: {worst_cut}",
                          *([self.spread.words(worst_cut.depth, worst_cut.error)] if self.spread is not None else [])])

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers and text; None where a pose failed, or no limit lies below depth_max."""
        worst_cut = self.worst()
        ends = None if self.spread is None else self.spread.ends(self.limit, 0.0 if self.error is None else self.error)
        worst_entry = {"pose": dict(worst_cut.pose), "feed_angle_deg": float(np.degrees(worst_cut.feed_angle)),
                       "speed_rpm": worst_cut.speed,
                       "depth_m": _finite(np.array(worst_cut.depth)), "depth_error_m": _finite(np.array(worst_cut.error)),
                       "chatter_frequency_hz": _finite(np.array(worst_cut.frequency))}
        return {"axes": {name: v.tolist() for name, v in self.axes.items()},
                **({} if self.axes else {"poses": [dict(pose) for pose in self.poses]}),
                "feed_angle_deg": np.degrees(self.feed_angles).tolist(), "speed_rpm": self.speeds.tolist(),
                "limit_m": _finite(self.limit), "chatter_frequency_hz": _finite(self.frequency),
                "depth_max_m": _finite(self.depth_max), "stable_everywhere_m": _finite(self.everywhere), "worst": worst_entry,
                "limit_interval_m": None if ends is None else [_finite(end) for end in ends],
                "limit_error_m": None if self.error is None else _finite(self.error), "doubts": list(self.doubts),
                "failures": self.failed(), "notes": list(self.notes)}

    @property
    def _size(self) -> str:
        """Numbers of poses, feed directions and speeds in words."""
        places = " x ".join(f"{name} {len(v)}" for name, v in self.axes.items()) if self.axes else f"{len(self.poses)} poses"
        directions = f"{self.feed_angles.size} feed direction{'s' if self.feed_angles.size > 1 else ''}"
        return f"{places}, {directions}, {self.speeds.size} speeds, {len(self.failures)} failed"

    def __repr__(self) -> str:
        return f"ChatterMap({self._size})"


def _finite(values: FloatArray) -> Any:
    """Return nested lists with None in place of infinite and undefined numbers."""
    # JSON has neither infinity nor not-a-number.
    cells = np.asarray(values).astype(object)
    cells[~np.isfinite(values)] = None
    return cells.tolist()


def pose_words(pose: Mapping[str, float], angles: Sequence[str] = ()) -> str:
    """Return a pose in words: ``X 100 mm, B 30°``."""
    return ", ".join(f"{name} {position_words(value, name in angles)}" for name, value in pose.items())


def depth_words(value: float, depth_max: float) -> str:
    """Return a depth in mm, rounded down to three digits; "above" the largest searched depth where there is no limit."""
    return text_below(1e3 * value) if np.isfinite(value) else f"above {1e3 * depth_max:.3g}"


def angle_words(angle: float) -> str:
    """Return an angle given in rad in degrees."""
    return f"{np.degrees(angle):.4g}°"
