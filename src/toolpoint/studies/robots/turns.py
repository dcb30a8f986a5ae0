"""Redundant turn about the tool: the best at every place of a path, the best path without jumps, and branches compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats, positive
from toolpoint._notebook import NotebookText
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.arm_reach import Pose
from toolpoint.studies.machines.reach import Reach, branch_names, reach_places
from toolpoint.studies.robots.place_map import PlaceQuantity
from toolpoint.studies.text_table import text_table


@dataclass(frozen=True, eq=False)
class TurnChoice(NotebookText):
    """Merit over places and turns, and the chosen turns.

    turns : (n_turns,) rad; merit : (n_places, n_turns), the least of the quantity's columns, not a number out of reach; best :
    (n,) turn of the greatest merit at each place alone; followed : (n,) turns of the path of greatest summed merit along which
    no axis moves further than `largest_step` from place to place; poses : along that path.
    """

    quantity: PlaceQuantity
    places: FloatArray
    turns: FloatArray
    merit: FloatArray
    best: FloatArray
    followed: FloatArray
    poses: tuple[Pose, ...]
    largest_step: float

    def table(self) -> str:
        """Return the chosen turns as text, every place."""
        indices = np.arange(len(self.places))
        index = [int(np.abs(self.turns - turn).argmin()) for turn in self.followed]
        rows = [[str(i + 1), f"{np.degrees(self.best[i]):.1f}", f"{np.nanmax(self.merit[i]):.4g}",
                 f"{np.degrees(self.followed[i]):.1f}", f"{self.merit[i, index[i]]:.4g}"] for i in indices]
        title = f"Turn about the tool by {self.quantity.kind} at {len(self.places)} places, of {self.turns.size} turns"
        return text_table(title, ["place", "best deg", self.quantity.unit, "followed deg", self.quantity.unit], rows)

    def to_dict(self) -> dict[str, Any]:
        """Return the choice as plain data; rad."""
        merit = self.merit.astype(object)
        merit[np.isnan(self.merit)] = None
        return {"quantity": self.quantity.kind, "turns": self.turns.tolist(), "merit": merit.tolist(),
                "best": self.best.tolist(),
                "followed": self.followed.tolist(), "poses": [dict(pose) for pose in self.poses]}

    def __repr__(self) -> str:
        return f"TurnChoice({self.quantity.kind}, {len(self.places)} places, {self.turns.size} turns)"


def choose_turns(machine: Machine, places: ArrayLike, direction: ArrayLike | None = None, *, turns: ArrayLike | None = None,
                 quantity: PlaceQuantity | None = None, branch: str = "", largest_step: float = 0.5) -> TurnChoice:
    """Return the turn about the tool that makes the weakest value of a quantity largest, at every place of a path.

    turns : rad, every 15 deg over a full turn where left out; largest_step : rad, an axis from one place to the next.

    Examples
    --------
    Runs in ``examples/choose_the_branch_of_an_arm.py``.
    """
    targets = floats("places", places, (None, 3)).reshape(-1, 3)
    angles = np.radians(np.arange(-180, 180, 15.0)) if turns is None else np.atleast_1d(floats("turns", turns))
    measure = quantity or PlaceQuantity("static")
    reaches = [reach_places(machine, targets, direction, turn=float(turn), branch=branch, follow=True) for turn in angles]
    merit = np.full((len(targets), angles.size), np.nan)
    for k, reach in enumerate(reaches):
        poses = [pose for pose in reach.poses if pose is not None]
        # The weakest direction, or mode, decides.
        merit[reach.reached, k] = measure.at_poses(machine, poses).min(axis=-1)
    is_unreached = np.isnan(merit).all(axis=1)
    if is_unreached.any():
        i = int(is_unreached.argmax())
        fail(f"places[{i}]", reaches[0].reasons[i] or "failed at every turn", "must be reached at one turn at least")
    path = _follow_turns(merit, reaches, positive("largest_step", largest_step))
    chosen = [reaches[k].poses[i] for i, k in enumerate(path)]
    return TurnChoice(measure, targets, angles, merit, angles[np.nanargmax(merit, axis=1)], angles[path],
                      tuple(pose for pose in chosen if pose is not None), largest_step)


def _follow_turns(merit: FloatArray, reaches: Sequence[Reach], largest_step: float) -> list[int]:
    """Return the turns of the greatest summed merit without a jump of an axis, by dynamic programming."""
    names = list(next(pose for reach in reaches for pose in reach.poses if pose is not None))
    # A step to or from a place out of reach is not a number, which no comparison lets through.
    unreached = [np.nan] * len(names)
    positions: Array = np.array([[unreached if pose is None else [pose[name] for name in names] for pose in reach.poses]
                                 for reach in reaches])
    value, origin_of = np.where(np.isnan(merit[0]), -np.inf, merit[0]), np.zeros(merit.shape, int)
    for i in range(1, len(merit)):
        step = np.abs(positions[None, :, i] - positions[:, None, i - 1]).max(axis=-1)  # from, to
        reward = np.where(step <= largest_step, value[:, None], -np.inf)
        origin_of[i] = reward.argmax(axis=0)
        # Bellman's recursion: the best sum up to here, for every turn that this place may be left with.
        value = reward.max(axis=0) + np.where(np.isnan(merit[i]), -np.inf, merit[i])
        if not np.isfinite(value).any():
            fail(f"places[{i}]", "no turn leads on from the place before", f"an axis may move {largest_step:g} rad at most",
                 remedy="take places nearer to each other, or another branch")
    # Back along the remembered origins, from the best end.
    path = [int(value.argmax())]
    for i in range(len(merit) - 1, 0, -1):
        path.insert(0, int(origin_of[i][path[0]]))
    return path


@dataclass(frozen=True, eq=False)
class BranchComparison(NotebookText):
    """Quantity on each branch of an arm along places.

    rows : name, number of reached places, means and least values (n_columns,) over the places that all branches reach.

    shared : how many those are; where there are none every branch is judged by its own places, and the one that reaches most is
    first.
    """

    quantity: PlaceQuantity
    rows: tuple[tuple[str, int, FloatArray, FloatArray], ...]
    places: int
    shared: int

    def table(self) -> str:
        """Return the branches as text."""
        rows = [[name, f"{reached} of {self.places}", " ".join(f"{v:.4g}" for v in mean), " ".join(f"{v:.4g}" for v in minima)]
                for name, reached, mean, minima in self.rows]
        table = text_table(f"Branches by {self.quantity.kind}, {self.quantity.unit}", ["branch", "places", "means", "least"],
                           rows)
        return table if self.shared == self.places else f"{table}\n{self.caution}"

    @property
    def caution(self) -> str:
        """Basis of the comparison, where not all branches reach all places."""
        if self.shared:
            return f"compared over the {self.shared} of {self.places} places that all these branches reach"
        return "no place is reached on all branches: each stands for its own places, which does not compare them"

    def to_dict(self) -> dict[str, Any]:
        """Return the branches as plain data."""
        return {"quantity": self.quantity.kind, "unit": self.quantity.unit, "places": self.places, "shared": self.shared,
                "branches": [
            {"name": name, "reached": reached, "means": mean.tolist(), "least": minima.tolist()}
            for name, reached, mean, minima in self.rows]}


def compare_branches(machine: Machine, places: ArrayLike, direction: ArrayLike | None = None, *, turn: float = 0.0,
                     quantity: PlaceQuantity | None = None, point: str = "") -> BranchComparison:
    """Return a quantity on every branch that reaches the first place, along all places.

    The branch of the greatest mean over the places that all of them reach comes first.

    Examples
    --------
    Runs in ``examples/choose_the_branch_of_an_arm.py``.
    """
    targets = floats("places", places, (None, 3)).reshape(-1, 3)
    measure, values_by_branch = quantity or PlaceQuantity(), dict[str, FloatArray]()
    for name in branch_names(machine, targets[0], direction, turn=turn, point=point):
        reach = reach_places(machine, targets, direction, turn=turn, branch=name, point=point)
        values_by_branch[name] = np.full((len(targets), len(measure.columns)), np.nan)
        values_by_branch[name][reach.reached] = measure.at_poses(machine, [pose for pose in reach.poses if pose is not None])
    if not values_by_branch:
        fail("places[0]", "reached on no branch", "must be within reach of an arm with a spherical wrist")
    has_value = {name: ~np.isnan(values).any(axis=1) for name, values in values_by_branch.items()}
    shared = np.logical_and.reduce(list(has_value.values()))
    rows = []
    for name, values in values_by_branch.items():
        if not has_value[name].any():
            fail("places", f"{measure.kind} failed at every place on the branch {name}", "must be known at one at least")
        used = values[shared if shared.any() else has_value[name]]
        rows.append((name, int(has_value[name].sum()), used.mean(axis=0), used.min(axis=0)))
    rows.sort(key=lambda row: -float(row[2][0]) if shared.any() else -row[1])
    return BranchComparison(measure, tuple(rows), len(targets), int(shared.sum()))
