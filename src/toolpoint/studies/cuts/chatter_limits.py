"""ChatterMap: what a cut may be deep over poses, feed directions and speeds; the worst place named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.result import DOUBTFUL_ERROR_FRACTION
from toolpoint.studies.cuts.limit_spread import LimitSpread
from toolpoint.studies.machines.pose_words import position_words
from toolpoint.studies.text_table import text_table

HEADER = ("feed direction", "stable depth mm", "pose", "rev/min", "chatter Hz")


@dataclass(frozen=True)
class WorstCut:
    """Where the stable depth is least: pose, feed angle (rad), speed (rev/min), depth (m), chatter frequency (Hz).

    angles : axes of the pose that are angles.
    """

    pose: Mapping[str, float]
    feed_angle: float
    speed: float
    depth: float
    frequency: float
    angles: tuple[str, ...] = ()

    def __str__(self) -> str:
        if not np.isfinite(self.depth):
            return "no limit was found below the depths looked at"
        return (f"{1e3 * self.depth:.4f} mm at {pose_words(self.pose, self.angles)}, feed at {angle_words(self.feed_angle)}, "
                f"{self.speed:.0f} rev/min (chatter at {self.frequency:.1f} Hz)")


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
        """The doubt that the stated errors give, where they are more than a tenth of a limit."""
        if self.error is None:
            return ()
        known = np.isfinite(self.limit) & (self.limit > 0)
        share = np.where(known, self.error / np.where(known, self.limit, 1.0), 0.0)
        rough = int((share > DOUBTFUL_ERROR_FRACTION).sum())
        if not rough:
            return ()
        *place, way, at = (int(k) for k in np.unravel_index(int(share.argmax()), share.shape))
        where = (f"{pose_words(self.pose(place), self.angles)}, feed at {angle_words(self.feed_angles[way])}, "
                 f"{self.speeds[at]:.0f} rev/min")
        why = (f"the stated error is more than {100 * DOUBTFUL_ERROR_FRACTION:g} % of the limit at {rough} of "
               f"{share.size} charted cuts, {100 * share.max():.0f} % at {where}")
        return (Doubt("limits", why, "take the lower end there, or look at that pose with lobes", figure=float(share.max())),)

    @property
    def lowest(self) -> FloatArray:
        """Depth that is stable at every speed, m, shape (n_1, ..., n_directions); not a number where it failed."""
        return np.asarray(self.limit.min(axis=-1))

    @property
    def everywhere(self) -> FloatArray:
        """Depth that is stable at every pose and in every direction that did not fail, m, shape (n_speeds,)."""
        flat = self.limit.reshape(-1, self.speeds.size)
        return np.asarray(flat[~np.isnan(flat).any(axis=1)].min(axis=0))

    def pose(self, index: Sequence[int]) -> dict[str, float]:
        """Return the axis positions of a place."""
        if not self.axes:
            return dict(self.poses[index[0]])
        return {name: float(at[i]) for (name, at), i in zip(self.axes.items(), index)}

    def worst(self, direction: int | None = None) -> WorstCut:
        """Return the cut with the least stable depth, in one feed direction or in all."""
        limit = self.limit if direction is None else self.limit[..., direction:direction + 1, :]
        if np.isnan(limit).all():
            fail("worst", "every pose failed", f"the first because: {next(iter(self.failures.values()), '')}")
        *place, way, at = (int(i) for i in np.unravel_index(int(np.nanargmin(limit)), limit.shape))
        way = way if direction is None else direction
        index = (*place, way, at)
        return WorstCut(self.pose(place), float(self.feed_angles[way]), float(self.speeds[at]), float(self.limit[index]),
                        float(self.frequency[index]), self.angles)

    def rows(self) -> list[list[str]]:
        """Return a row of texts for every feed direction, see `HEADER`: least depth, where and at which speed."""
        rows = []
        top = float(np.nanmin(self.depth_max))
        for way, angle in enumerate(self.feed_angles):
            if np.isnan(self.limit[..., way, :]).all():
                rows.append([angle_words(angle), "failed", "", "", ""])
                continue
            worst = self.worst(way)
            place = [pose_words(worst.pose, self.angles), f"{worst.speed:.0f}", f"{worst.frequency:.1f}"]
            rows.append([angle_words(angle), depth_words(worst.depth, top), *(place if np.isfinite(worst.depth) else [""] * 3)])
        return rows

    def failed(self) -> list[str]:
        """Return a line on every pose that failed, with its feed direction where only that failed."""
        by_place: dict[tuple[int, ...], dict[int, str]] = {}
        for (*index, way), reason in self.failures.items():
            by_place.setdefault(tuple(index), {})[way] = reason
        lines = []
        for place, reasons in by_place.items():
            ways = "" if len(reasons) == self.feed_angles.size else ", feed at " + ", ".join(
                angle_words(self.feed_angles[way]) for way in reasons)
            lines.append(f"{pose_words(self.pose(place), self.angles)}{ways}: {next(iter(reasons.values()))}")
        return lines

    def table(self) -> str:
        """Return the least depth of every feed direction, the worst place, and what failed, as text."""
        title = f"Depth that is stable at every charted speed, {repr(self)[11:-1]}"
        return "\n".join([text_table(title, HEADER, self.rows()), *(f"failed: {text}" for text in self.failed()),
                          *mark_notes(self.doubts), f"Worst: {self.worst()}",
                          *([self.spread.words(self.worst().depth)] if self.spread is not None else [])])

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers and text; None where a pose failed, or no limit lies below depth_max."""
        worst = self.worst()
        least = {"pose": dict(worst.pose), "feed_angle_deg": float(np.degrees(worst.feed_angle)), "speed_rpm": worst.speed,
                 "depth_m": _finite(np.array(worst.depth)), "chatter_frequency_hz": _finite(np.array(worst.frequency))}
        return {"axes": {name: v.tolist() for name, v in self.axes.items()},
                **({} if self.axes else {"poses": [dict(pose) for pose in self.poses]}),
                "feed_angle_deg": np.degrees(self.feed_angles).tolist(), "speed_rpm": self.speeds.tolist(),
                "limit_m": _finite(self.limit), "chatter_frequency_hz": _finite(self.frequency),
                "depth_max_m": _finite(self.depth_max), "stable_everywhere_m": _finite(self.everywhere), "worst": least,
                "limit_interval_m": None if self.spread is None else [_finite(end) for end in self.spread.ends(self.limit)],
                "limit_error_m": None if self.error is None else _finite(self.error), "doubts": list(self.doubts),
                "failures": self.failed(), "notes": list(self.notes)}

    def __repr__(self) -> str:
        places = " x ".join(f"{name} {len(v)}" for name, v in self.axes.items()) if self.axes else f"{len(self.poses)} poses"
        return (f"ChatterMap({places}, {self.feed_angles.size} feed directions, {self.speeds.size} speeds, "
                f"{len(self.failures)} failed)")


def _finite(values: FloatArray) -> Any:
    """Return nested lists with None in place of what is no finite number."""
    cells = np.asarray(values).astype(object)
    cells[~np.isfinite(values)] = None
    return cells.tolist()


def pose_words(pose: Mapping[str, float], angles: Sequence[str] = ()) -> str:
    """Return a pose in words: ``X 100 mm, B 30°``."""
    return ", ".join(f"{name} {position_words(value, name in angles)}" for name, value in pose.items())


def depth_words(value: float, top: float) -> str:
    """Return a depth in mm; above the largest looked at where there is no limit."""
    return f"{1e3 * value:.4f}" if np.isfinite(value) else f"above {1e3 * top:.3g}"


def angle_words(angle: float) -> str:
    """Return an angle given in rad in degrees."""
    return f"{np.degrees(angle):.4g}°"
