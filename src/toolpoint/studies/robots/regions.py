r"""Regions of even properties: the straight segment over which the summed peak-to-peak spread of the values is least.

:math:`\Sigma = \sum_m (\max_s v_m(s) - \min_s v_m(s))` over places s of a segment of any length and direction, m the modes (or
directions). The source walks a grid in four directions (eqs. 9-11): its diagonals are longer by the root of two, and its eq.
10 takes five points where its text says four. Here every segment has the requested length, and its places are computed where
they are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointError, count, fail, floats, positive
from toolpoint._doubt import Doubt, with_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.execute import Progress
from toolpoint.studies.machines.arm_reach import Pose
from toolpoint.studies.robots.place_map import PlaceGrid, PlaceMap, PlaceQuantity, PoseValues, map_places, place_words
from toolpoint.studies.robots.segment_poses import SegmentFollower
from toolpoint.studies.text_table import text_table

_EQUAL_PLACE_TOLERANCE = 1e-7  # m: nearer places are computed once
_DIRECTION_DECIMALS = 6  # by which directions are told apart
_MAX_LISTED_SEGMENTS = 8  # in the table and in the data


@dataclass(frozen=True, eq=False)
class EvenSegment:
    """Segment over which a quantity is even.

    start, end : m; values : (n_samples, n_columns); branch : of the arm on which it is followed, empty where the machine has
    none; poses : at the samples.
    """

    start: FloatArray
    end: FloatArray
    values: FloatArray
    branch: str = ""
    poses: tuple[Pose, ...] = ()

    @property
    def spread(self) -> FloatArray:
        """Peak-to-peak of every column."""
        return np.ptp(self.values, axis=0)

    @property
    def total(self) -> float:
        """The spread, summed over the columns."""
        return float(self.spread.sum())

    @property
    def share(self) -> float:
        """The spread over the mean, the largest of all columns."""
        return float((self.spread / self.values.mean(axis=0)).max())


@dataclass(frozen=True, eq=False)
class RegionSearch(NotebookText):
    """Segments that are reached whole, the most even one first.

    tried : number of segments; samples : places on each; notes : on the reliability of the values.
    """

    quantity: PlaceQuantity
    length: float
    regions: tuple[EvenSegment, ...]
    tried: int
    samples: int
    notes: tuple[str, ...] = ()

    @property
    def best(self) -> EvenSegment:
        """The most even segment."""
        return self.regions[0]

    @property
    def worst(self) -> EvenSegment:
        """The least even segment."""
        return self.regions[-1]

    def by_direction(self) -> list[tuple[FloatArray, float, int]]:
        """Return each direction (3,), unit, with the median spread of its segments and their number; the most even first."""
        groups: dict[tuple[float, ...], list[float]] = {}
        for region in self.regions:
            way = (region.end - region.start) / np.linalg.norm(region.end - region.start)
            groups.setdefault(tuple((np.round(way, _DIRECTION_DECIMALS) + 0.0).tolist()), []).append(region.total)
        medians = [(np.array(way), float(np.median(spreads)), len(spreads)) for way, spreads in groups.items()]
        return sorted(medians, key=lambda each: each[1])

    def direction_words(self) -> list[str]:
        """Return a line on the most and the least even segment, and one on directions where there are several."""
        unit = self.quantity.unit
        ends = [f"{name}: along {_direction_words(r.end - r.start)} from {place_words(r.start)}, {r.total:.4g} {unit}"
                for name, r in (("most even", self.best), ("least even", self.worst))]
        ways = self.by_direction()
        if len(ways) < 2:
            return ["; ".join(ends)]
        parts = [f"{_direction_words(way)} {median:.4g} ({count} segments)" for way, median, count in ways]
        return ["; ".join(ends), f"median spread by direction, {unit}: {', '.join(parts)}"]

    @property
    def title(self) -> str:
        """Length, quantity and number of the segments, in words."""
        return (f"Most even segments of {1e3 * self.length:g} mm by {self.quantity.kind}: {len(self.regions)} of {self.tried} "
                "are reached whole")

    def table(self) -> str:
        """Return the best segments as text."""
        unit = self.quantity.unit
        rows = [[place_words(r.start), place_words(r.end), f"{r.total:.4g}", f"{100 * r.share:.2f} %",
                 " ".join(f"{v:.4g}" for v in r.values.mean(axis=0)), *([r.branch] if self.best.branch else [])]
                for r in self.regions[:_MAX_LISTED_SEGMENTS]]
        header = ["from", "to", f"spread {unit}", "largest share", f"means {unit}", *(["branch"] if self.best.branch else [])]
        return "\n".join(with_notes([text_table(self.title, header, rows), *self.direction_words(),
                                     f"each judged at {self.samples} places, both ends included"], self.notes))

    def to_dict(self) -> dict[str, Any]:
        """Return the best segments as plain data; m."""
        return {"quantity": self.quantity.kind, "unit": self.quantity.unit, "length_m": self.length, "tried": self.tried,
                "whole": len(self.regions), "samples": self.samples, "notes": list(self.notes),
                "directions": [{"direction": way.tolist(), "median_spread": median, "segments": number}
                               for way, median, number in self.by_direction()],
                "worst": {"start": self.worst.start.tolist(), "end": self.worst.end.tolist(), "spread": self.worst.total},
                "regions": [
                    {"branch": r.branch, "start": r.start.tolist(), "end": r.end.tolist(), "spread": r.total, "share": r.share,
                     "spreads": r.spread.tolist(), "means": r.values.mean(axis=0).tolist()}
                    for r in self.regions[:_MAX_LISTED_SEGMENTS]]}

    def __repr__(self) -> str:
        return (f"RegionSearch({self.quantity.kind}, segments of {1e3 * self.length:g} mm, {len(self.regions)} of {self.tried} "
                "reached whole)")


def _direction_words(way: FloatArray) -> str:
    """Return a direction in words: an axis, or its parts along x, y and z."""
    unit = np.round(way / np.linalg.norm(way), _DIRECTION_DECIMALS) + 0.0
    axis = int(np.argmax(np.abs(unit)))
    if abs(unit[axis]) == 1.0:
        return f"{'-' if unit[axis] < 0 else ''}{'xyz'[axis]}"
    return "(" + ", ".join(f"{part:.3g}" for part in unit) + ")"


def plane_directions(first: ArrayLike, second: ArrayLike, number: int = 4) -> FloatArray:
    """Return directions in the plane of two vectors, evenly over half a turn, (number, 3); the source takes four.

    Examples
    --------
    >>> plane_directions((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 2).round(9).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    a = floats("first", first, (3,)) / np.linalg.norm(first)
    b = floats("second", second, (3,)) - a * float(np.dot(a, second))
    b = b / np.linalg.norm(b)
    angle = np.pi * np.arange(count("number", number)) / number
    return np.cos(angle)[:, None] * a + np.sin(angle)[:, None] * b


def search_regions(machine: Machine, starts: ArrayLike, directions: ArrayLike, *, length: float = 0.2, samples: int = 5,
                   quantity: PlaceQuantity | None = None, direction: ArrayLike | None = None, turn: float = 0.0,
                   branch: str = "", point: str = "", progress: Progress | None = None) -> RegionSearch:
    """Return the segments over which a quantity is most even, each on one branch of the machine, without a jump of an axis.

    Parameters
    ----------
    machine : Machine
    starts : (n, 3) floats
        Where segments start, m.
    directions : (k, 3) floats
        Where they go, any length.
    length : float
        m.
    samples : int
        Places on a segment, both ends included.
    direction, turn, branch, point
        Direction and turn of the tool, see `reach_places`.
    progress : function
        Told how many places are judged, of how many.

    Examples
    --------
    Runs in ``examples/find_the_best_place_to_mill.py``.
    """
    measure = quantity or PlaceQuantity()
    first, ways = floats("starts", starts, (None, 3)).reshape(-1, 3), floats("directions", directions, (None, 3))
    size = np.linalg.norm(ways, axis=1, keepdims=True)
    if size.min() == 0:
        fail("directions", "length 0", "must not be zero")
    share = np.linspace(0, positive("length", length), count("samples", samples, 2))
    places = first[:, None, None] + share[:, None] * (ways / size)[:, None]
    ends = places.reshape(-1, samples, 3)
    follower = SegmentFollower(machine, direction, turn=turn, branch=branch, point=point)
    followed = [follower.follow(each) for each in ends]
    reasons = Counter(each.reason for each in followed if each.reason)
    # One pose for a place and a branch, however many segments run through it.
    keys = [[(each.branch, *np.rint(place / _EQUAL_PLACE_TOLERANCE).astype(int).tolist()) for place in row] if each.poses
            else []
            for each, row in zip(followed, ends, strict=True)]
    poses = {key: pose for each, row in zip(followed, keys, strict=True) for key, pose in zip(row, each.poses, strict=True)}
    number = {key: i for i, key in enumerate(poses)}
    judged = measure.judge(machine, list(poses.values()), progress=progress)
    # How even a segment is cannot be said where a place is known to lie above a bound alone.
    values = np.where(judged.bounds[:, None], np.nan, judged.values)
    regions = [EvenSegment(row[0], row[-1], part, each.branch, each.poses)
               for each, row, names in zip(followed, ends, keys, strict=True)
               if names and not np.isnan(part := values[[number[name] for name in names]]).any()]
    if not regions:
        reason = next((text for text in (*judged.reasons, *(text for text, _ in reasons.most_common(1))) if text), "")
        fail("starts", f"{len(ends)} segments", "none can be reached whole and judged" + (f": {reason}" if reason else ""),
             remedy="take a shorter length or other places"
                    + ("" if not judged.bounds.any() else ", or speeds that have a limit"))
    return RegionSearch(measure, float(length), tuple(sorted(regions, key=lambda r: r.total)), len(ends), samples,
                        _notes(judged, reasons))


def _notes(judged: PoseValues, reasons: Mapping[str, int]) -> tuple[str, ...]:
    """Return notes on the segments' values: those of the quantity, and the segments left out."""
    lines = [f"{number} segment{'s are' if number > 1 else ' is'} left out: {reason}" for reason, number in reasons.items()]
    lines += [f"segments over {number} places {why} are left out" for number, why in (
        (sum(map(bool, judged.reasons)), "whose chart failed"),
        (int(judged.bounds.sum()), "without a limit within the charted depth")) if number]
    return (*lines, *judged.notes)


@dataclass(frozen=True, eq=False)
class RegionStudy(NotebookText):
    """Quantity over places, and the segments over which it is most even.

    search : None where none were searched, or none could be judged; the notes of the map say which.
    """

    map: PlaceMap
    search: RegionSearch | None = None

    def table(self) -> str:
        """Return the map, and the best segments, as text."""
        return "\n".join(part.table() for part in (self.map, self.search) if part is not None)

    def to_dict(self) -> dict[str, Any]:
        """Return both as plain data."""
        return {"map": self.map.to_dict(), "search": None if self.search is None else self.search.to_dict()}


def study_region(machine: Machine, grid: PlaceGrid, quantity: PlaceQuantity | None = None, *, length: float = 0.2,
                 directions: int = 4, samples: int = 5, direction: ArrayLike | None = None, turn: float = 0.0,
                 branch: str = "", point: str = "", step: Callable[[str], None] = lambda name: None,
                 progress: Progress | None = None) -> RegionStudy:
    """Return a quantity over the places of a grid, and the segments of a length between them over which it is most even.

    Parameters
    ----------
    machine, grid, quantity, direction, turn, branch, point
        See `map_places`.
    length : float
        Of the segments, m; 0 for the map alone.
    directions : int
        Directions of segments in the plane of the grid's first two directions, evenly over half a turn.
    samples : int
        Places on a segment, both ends included.
    step : function of a name
        Called at the beginning of both parts.
    progress : function
        Told in both parts how many places are judged, of how many.

    Examples
    --------
    Runs in ``examples/map_where_a_robot_is_even.py``.
    """
    step("map over places")
    measure = quantity or PlaceQuantity()
    place_map = map_places(machine, grid, measure, direction=direction, turn=turn, branch=branch, point=point,
                           progress=progress)
    if length == 0:
        return RegionStudy(place_map)
    step("segments")
    units = dict(zip("xyz", np.eye(3), strict=True))
    first, second = (list(grid.names) * 2)[:2]
    ways = units[first][None] if len(grid.names) == 1 else plane_directions(units[first], units[second], directions)
    try:
        search = search_regions(machine, grid.places.reshape(-1, 3), ways, length=length, samples=samples, quantity=measure,
                                direction=direction, turn=turn, branch=branch, point=point, progress=progress)
    except ToolpointError as error:  # the map took its time and stays
        return RegionStudy(replace(place_map, notes=(Doubt("segments", str(error)), *place_map.notes)))
    return RegionStudy(place_map, search)
