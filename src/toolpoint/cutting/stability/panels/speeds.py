"""Search of all speeds of a chart by panels: one after the other where each begins with the one before, else side by side."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass

from toolpoint._threads import available_threads, run_side_by_side
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.panels.first import FirstLimitSearch
from toolpoint.cutting.stability.panels.store import PanelStore
from toolpoint.cutting.stability.warm_start import WarmStart

MIN_SPEEDS_FOR_THREADS = 8  # fewer speeds are over before threads gain anything
Settings = tuple[int, int, float]


@dataclass(frozen=True, eq=False)
class SpeedOutcome:
    """Search at one speed: rows of its boundary points, slopes at the roots, and whether the map overflowed or is normal."""

    rows: list[tuple[float, ...]]
    slopes: list[tuple[float, float]]
    overflow: bool
    is_normal: bool


def search_chain(settings: Settings, problem: MillingProblem, speeds: Sequence[float], *, depth_max: float, warm: WarmStart,
                 expected: float) -> list[SpeedOutcome]:
    """Return the first losses of stability, each looked for from where the speed before had it; `expected` is of the first."""
    store, subspace_sizes = warm.panels(problem), dict[float, int]()
    outcomes = []
    for speed in speeds:
        search = FirstLimitSearch(settings, problem, speed, depth_max, store, warm.roots.get(speed))
        search.subspace_sizes = subspace_sizes
        rows = search.lowest(expected)
        expected = rows[0][0] if rows else expected
        outcomes.append(SpeedOutcome(rows, search.slopes, search.overflow, search.is_normal))
    return outcomes


def search_each(settings: Settings, problem: MillingProblem, speeds: Sequence[float], *, depth_max: float, warm: WarmStart
                ) -> list[SpeedOutcome]:
    """Return all boundary points, the speeds on as many threads as there are cores for them.

    Speeds do not depend on each other, nor on the panels that are kept: the points are the same to the last bit. Each thread
    has panels of its own, the first one those of `warm`.
    """
    store = warm.panels(problem)

    def search(speed: float, store: PanelStore) -> SpeedOutcome:
        begun = FirstLimitSearch(settings, problem, speed, depth_max, store, warm.roots.get(speed))
        return SpeedOutcome(begun.rows(), begun.slopes, begun.overflow, begun.is_normal)

    threads = available_threads()
    if threads == 1 or len(speeds) < MIN_SPEEDS_FOR_THREADS:
        return [search(speed, store) for speed in speeds]
    # The first speed compiles what is not compiled yet, alone.
    first, local = search(speeds[0], store), threading.local()

    def search_with_own_panels(speed: float) -> SpeedOutcome:
        if not hasattr(local, "store"):
            local.store = PanelStore(room=store.room // threads, cut=store.cut)
        return search(speed, local.store)

    return [first, *run_side_by_side(search_with_own_panels, speeds[1:], threads)]
