"""Any quantity over places of the tool: a line, a plane or a volume in any direction, reachable places only, feed included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats, one_of
from toolpoint._doubt import with_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.cuts.chatter_limits import ChatterMap
from toolpoint.studies.cuts.chatter_map import chatter_map
from toolpoint.studies.execute import Engine, Progress
from toolpoint.studies.machines.arm_reach import Pose
from toolpoint.studies.machines.branch_words import branch_lines
from toolpoint.studies.machines.pose_grid import plain_cells
from toolpoint.studies.machines.reach import Reach, reach_places
from toolpoint.studies.machines.stiffness_map import NAMES, stiffness_rows
from toolpoint.studies.machines.tool_point import batch_of, tool_point
from toolpoint.studies.text_table import text_table

QUANTITIES = {"frequency": "Hz", "static": "N/µm", "dynamic": "N/µm", "depth": "mm"}
_UNITS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True, eq=False)
class PlaceGrid(NotebookText):
    """Places in rows: names of the directions, positions along each (m), and all places (n_1, ..., 3)."""

    names: tuple[str, ...]
    positions: tuple[FloatArray, ...]
    places: FloatArray

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of positions along each direction."""
        return tuple(len(positions) for positions in self.positions)

    def __repr__(self) -> str:
        return "PlaceGrid(" + " x ".join(f"{name} {len(positions)}" for name,
                                         positions in zip(self.names, self.positions, strict=True)) + ")"


def place_grid(along: Mapping[str, ArrayLike], origin: ArrayLike = (0.0, 0.0, 0.0), *,
               directions: Mapping[str, ArrayLike] | None = None) -> PlaceGrid:
    """Return the places of a line, plane or volume.

    Parameters
    ----------
    along : mapping of name to positions
        m; x, y, z, or names of `directions`.
    origin : (3,) floats
        Where all positions are zero, m.
    directions : mapping of name to (3,) floats, optional
        Directions of the names that are not x, y or z; unit vectors are made of them.

    Examples
    --------
    >>> grid = place_grid({"x": [0.0, 0.1], "z": [0.0, 0.1, 0.2]}, origin=(0.0, 0.0, 0.5))
    >>> grid.shape, grid.places[1, 2].tolist()
    ((2, 3), [0.1, 0.0, 0.7])
    """
    if not 1 <= len(along) <= 3:
        fail("along", f"{len(along)} directions", "must be one (a line) to three (a volume)")
    vectors = _UNITS | {name: tuple(floats(f"directions[{name!r}]", v, (3,))) for name, v in (directions or {}).items()}
    rows = []
    for name in along:
        vector = np.array(vectors[one_of("along", name, vectors)])
        rows.append(vector / np.linalg.norm(vector))
    # Directions need not be at right angles, but must span a line, a plane or a volume.
    matrix = np.array(rows)
    if np.linalg.matrix_rank(matrix) < len(rows):
        fail("along", ", ".join(along), "must be independent directions")
    positions = tuple(np.atleast_1d(floats(f"along[{name!r}]", values)) for name, values in along.items())
    mesh = np.stack(np.meshgrid(*positions, indexing="ij"), axis=-1)
    return PlaceGrid(tuple(along), positions, floats("origin", origin, (3,)) + mesh @ matrix)


@dataclass(frozen=True, eq=False)
class PoseValues:
    """Values of a quantity at poses, (n_poses, n_columns), not a number where it could not be computed.

    reasons : of each pose without a value, else empty; bounds : (n_poses,), whether some value is a lower bound only; notes :
    on the reliability of the values.
    """

    values: FloatArray
    reasons: tuple[str, ...]
    bounds: Array
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlaceQuantity:
    """Quantity of a pose: ``frequency``, ``static`` or ``dynamic`` stiffness, or ``depth``.

    Frequencies of so many modes; stiffness along x, y, z of the tool and in principal directions; the lowest stable depth over
    the speeds for every feed direction (rad).

    Examples
    --------
    >>> PlaceQuantity("depth", feed_angles=(0.0, np.pi / 4)).columns
    ('feed at 0 deg', 'feed at 45 deg')
    """

    kind: str = "frequency"
    modes: int = 4
    feed_angles: tuple[float, ...] = (0.0,)
    speeds: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        one_of("quantity", self.kind, QUANTITIES)

    @classmethod
    def over_feeds(cls, kind: str, modes: int = 4, number: int = 1) -> PlaceQuantity:
        """Return a quantity with a number of feed directions, evenly over half a turn."""
        # Half a turn is enough: a linear cut has the same limits forwards and backwards.
        return cls(kind, modes, tuple(float(v) for v in np.pi * np.arange(number) / number))

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return QUANTITIES[self.kind]

    @property
    def columns(self) -> tuple[str, ...]:
        """Name of every value."""
        if self.kind == "frequency":
            return tuple(f"mode {i + 1}" for i in range(self.modes))
        if self.kind == "depth":
            return tuple(f"feed at {np.degrees(angle):g} deg" for angle in self.feed_angles)
        return NAMES

    def at_poses(self, machine: Machine, poses: Sequence[Pose], *, engine: Engine | None = None,
                 progress: Progress | None = None
                 ) -> FloatArray:
        """Return the values at poses, shape (n_poses, n_columns), in the unit; not a number where one failed."""
        return self.judge(machine, poses, engine=engine, progress=progress).values

    def judge(self, machine: Machine, poses: Sequence[Pose], *, engine: Engine | None = None,
              progress: Progress | None = None) -> PoseValues:
        """Return the values at poses with the reasons of failures and the reliability of the values."""
        if not poses:
            return PoseValues(np.zeros((0, len(self.columns))), (), np.zeros(0, bool))
        if self.kind == "depth":
            return _depths(chatter_map(machine, list(poses), speeds=self.speeds or None, feed_angles=self.feed_angles,
                                       engine=engine, progress=progress))
        return PoseValues(self._linear(machine, poses), ("",) * len(poses), np.zeros(len(poses), bool))

    def _linear(self, machine: Machine, poses: Sequence[Pose]) -> FloatArray:
        """Frequencies or stiffness at poses."""
        if self.kind == "frequency":
            return natural_frequencies(machine, batch_of(machine, poses), self.modes)
        # Where joints have dampers the number of poles may differ from pose to pose: one at a time.
        size = 1 if machine.description.damping_ratio is None else 64
        blocks = [poses[i:i + size] for i in range(0, len(poses), size)]
        lines = np.array([0.0, 1.0])
        # From N/m to N/µm; the first six columns are stiffness.
        return 1e-6 * np.concatenate([stiffness_rows(tool_point(machine, block, lines), self.kind)[:, :6] for block in blocks])


def _depths(charted: ChatterMap) -> PoseValues:
    """Lowest depths over the speeds, mm, of a chatter map over a list of poses.

    Where no speed has a limit within the charted depth the cut is stable up to there: that depth bounds it from below.
    """
    lowest, depth_max = charted.lowest, charted.depth_max[:, None]
    is_bound = np.isposinf(lowest)
    reasons = [""] * len(lowest)
    for (i, *_), reason in charted.failures.items():
        reasons[i] = reasons[i] or reason
    n = charted.speeds
    notes = [f"the least of {n.size} speeds from {n.min():.0f} to {n.max():.0f} rev/min; "
             "between them it may be a little less"]
    if is_bound.any():
        notes.append(f"{int(is_bound.any(axis=1).sum())} of {len(lowest)} poses have no limit within the charted depth at any "
                     "speed: that depth is shown, the limit lies above it")
    depth = 1e3 * np.where(is_bound, np.broadcast_to(depth_max, lowest.shape), lowest)
    return PoseValues(depth, tuple(reasons), np.asarray(is_bound.any(axis=1)), (*charted.doubts, *notes, *charted.notes))


@dataclass(frozen=True, eq=False)
class PlaceMap(NotebookText):
    """Quantity over places: values (n_1, ..., n_columns), not a number without a pose; and the poses.

    reasons : of every place in turn, why it has no value; notes : on what the values are worth.
    """

    machine: Machine
    grid: PlaceGrid
    quantity: PlaceQuantity
    values: FloatArray
    reach: Reach
    reasons: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def failures(self) -> dict[tuple[int, ...], str]:
        """Return grid index and reason of every place that has no value."""
        return {tuple(int(k) for k in np.unravel_index(i, self.grid.shape)): reason
                for i, reason in enumerate(self.reasons) if reason}

    def extremes(self) -> list[str]:
        """Return a line on every column: where it is lowest and highest."""
        lines, flat = [], self.values.reshape(-1, self.values.shape[-1])
        for name, column in zip(self.quantity.columns, flat.T, strict=True):
            if np.isnan(column).all():
                lines.append(f"{name}: no place can be")
                continue
            lowest, highest = int(np.nanargmin(column)), int(np.nanargmax(column))
            lines.append(f"{name}: lowest {column[lowest]:.5g} {self.quantity.unit} at {self._where(lowest)}; "
                         f"highest {column[highest]:.5g} {self.quantity.unit} at {self._where(highest)}")
        return lines

    def _where(self, number: int) -> str:
        """Return a place in words, with its branch where the map has several."""
        branch = self.reach.branches[number]
        several = len(set(filter(None, self.reach.branches))) > 1
        return place_words(self.reach.places[number]) + (f" ({branch})" if several and branch else "")

    @property
    def title(self) -> str:
        """Quantity, size of the grid and places reached, in words."""
        size = " x ".join(f"{len(positions)} along {name}" for name, positions in zip(self.grid.names, self.grid.positions,
                                                                                      strict=True))
        return f"{self.quantity.kind.capitalize()} over {size}: {int(self.reach.reached.sum())} of {len(self.reach.poses)} " \
               "places are reached"

    def table(self) -> str:
        """Return the range of every column and the places of its ends as text."""
        flat = self.values.reshape(-1, self.values.shape[-1])
        rows = [[name, f"{np.nanmin(column):.5g}", f"{np.nanmax(column):.5g}"]
                for name, column in zip(self.quantity.columns, flat.T, strict=True) if not np.isnan(column).all()]
        header = [self.quantity.kind, f"lowest {self.quantity.unit}", "highest"]
        return "\n".join(with_notes([text_table(self.title, header, rows), *self.extremes(), *branch_lines(self.reach.branches),
                                     *self.failed()], self.notes))

    def failed(self) -> list[str]:
        """Return a line on the places that are reached and have no value all the same."""
        failures = [(place, reason) for place, pose, reason in zip(self.reach.places, self.reach.poses, self.reasons,
                                                                   strict=True)
                    if reason and pose is not None]
        return [f"failed: {place_words(place)}: {reason}" for place, reason in failures]

    def to_dict(self) -> dict[str, Any]:
        """Return the map as plain numbers and text, None where a place cannot be; m."""
        return {"along": {name: positions.tolist() for name, positions in zip(self.grid.names, self.grid.positions,
                                                                              strict=True)},
                "places": self.grid.places.tolist(), "quantity": self.quantity.kind, "unit": self.quantity.unit,
                "columns": list(self.quantity.columns), "branches": list(self.reach.branches),
                "values": plain_cells(self.values), "extremes": self.extremes(),
                "failures": [[list(k), reason] for k, reason in self.failures().items()], "notes": list(self.notes)}

    def __repr__(self) -> str:
        count = int(self.reach.reached.sum())
        return f"PlaceMap({self.quantity.kind} over {self.grid!r}, {count} of {len(self.reach.poses)} places reached)"


def map_places(machine: Machine, grid: PlaceGrid, quantity: PlaceQuantity | None = None, *, direction: ArrayLike | None = None,
               turn: float = 0.0, branch: str = "", point: str = "", engine: Engine | None = None,
               progress: Progress | None = None
               ) -> PlaceMap:
    """Return a quantity over all places of a grid that the tool reaches; arguments are those of `reach_places`.

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
    ...                                    {"tip": PointDescription("head", (0.0, 0.0, -0.2))}, tool="tip"))
    >>> grid = place_grid({"x": [0.0, 0.1]}, (0.0, 0.0, -0.2))
    >>> map_places(machine, grid, PlaceQuantity("frequency", modes=2)).values.round(2).tolist()
    [[71.18, 100.66], [71.18, 100.66]]
    """
    measure = quantity or PlaceQuantity()
    reach = reach_places(machine, grid.places.reshape(-1, 3), direction, turn=turn, branch=branch, point=point)
    values = np.full((len(reach.poses), len(measure.columns)), np.nan)
    judged = measure.judge(machine, [pose for pose in reach.poses if pose is not None], engine=engine, progress=progress)
    # Only reached poses were judged: the other places keep the reason that reach gave.
    values[reach.reached] = judged.values
    reasons = np.array(reach.reasons, object)
    reasons[reach.reached] = judged.reasons
    return PlaceMap(machine, grid, measure, values.reshape(*grid.shape, -1), reach, tuple(map(str, reasons)), judged.notes)


def place_words(place: ArrayLike) -> str:
    """Return a place in words, mm."""
    # Rounding leaves -0.0 behind, which + 0.0 turns into 0.
    return ", ".join(f"{name} {1e3 * v:.5g}" for name, v in zip("xyz", np.round(np.asarray(place, float), 9) + 0.0,
                                                                strict=True)) + " mm"
