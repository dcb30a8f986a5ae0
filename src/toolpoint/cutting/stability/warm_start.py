"""WarmStart: results of the chart of one pose with which the chart of a neighbouring pose begins."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from toolpoint._check import Array, FloatArray
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.floquet.records import ScanMemory

if TYPE_CHECKING:
    from toolpoint.cutting.stability.panels.store import PanelStore

CUT_FIELDS = ("tool", "engagement", "speed_variation")  # or what another cut left is of no use
PANEL_FIELDS = ("coefficients", "process_damping", "damping_friction")  # what panels hang on besides


@dataclass
class WarmStart:
    """Memory between charts of nearly the same cut: neighbouring poses, feed directions, samples of uncertain parameters.

    Give the same object to one `stability.chart` after the other. It only says where to look first: every count and every
    boundary is computed and checked anew, so the charts are those of a cold start within their stated errors. With another
    tool, engagement or depth range it begins anew by itself. Not for two threads at once.

    Parameters
    ----------
    fixed : bool
        Let charts begin with what is known, but leave nothing.

    Examples
    --------
    Give one memory to the charts of neighbouring poses in turn, ``chart(problem, speeds, warm=memory)``:

    >>> memory = WarmStart()
    >>> memory.scans, memory.roots
    ({}, {})
    """

    fixed: bool = False
    scans: dict[tuple[float, int], ScanMemory] = field(default_factory=dict, repr=False)
    roots: dict[float, FloatArray] = field(default_factory=dict, repr=False)
    attempts: dict[float, int] = field(default_factory=dict, repr=False)
    cut: tuple[Any, ...] = field(default=(), repr=False)

    @cached_property
    def store(self) -> PanelStore:
        """Panels of PanelArnoldi."""
        from toolpoint.cutting.stability.panels.store import PanelStore  # brings the compiler, which few callers need

        return PanelStore()

    def share_panels(self) -> WarmStart:
        """Return an empty memory that shares the panels: for the same cut with another feed direction, say."""
        another = WarmStart()
        another.__dict__["store"] = self.store
        return another

    def fit(self, problem: MillingProblem, depth_max: float) -> None:
        """Forget what does not hold for this cut or depth range."""
        cut = (*(_content(getattr(problem, name)) for name in CUT_FIELDS), problem.plane.size, depth_max)
        if cut != self.cut:
            for part in (self.scans, self.roots, self.attempts):
                part.clear()
        self.cut = cut

    def panels(self, problem: MillingProblem) -> PanelStore:
        """Return the panels, emptied if they were another cut's."""
        self.store.fit((*(_content(getattr(problem, name)) for name in (*CUT_FIELDS, *PANEL_FIELDS)), problem.plane.size))
        return self.store

    def begin(self, speeds: FloatArray, empty: ScanMemory) -> ScanMemory:
        """Return what is known of these speeds as one array a kind, for the kernel to bring up to date.

        empty : the same for one speed of which nothing is known.
        """
        key = empty.poles.shape[0]
        memories = [self.scans.get((n, key), empty) for n in speeds.tolist()]
        return ScanMemory(*(np.array(list(kind), kind[0].dtype) for kind in zip(*memories)))

    def keep_roots(self, speed: float, roots: list[tuple[float, float]]) -> None:
        """Take depths and slopes of the growth of the roots at one speed."""
        if not self.fixed:
            self.roots[speed] = np.array(roots).reshape(-1, 2)

    def keep_attempts(self, speeds: FloatArray, attempts: Array) -> None:
        """Take which number of arc nodes these speeds asked for."""
        if not self.fixed:
            self.attempts.update(zip(speeds.tolist(), attempts.tolist()))

    def keep(self, speeds: FloatArray, memory: ScanMemory) -> None:
        """Take what the kernel left."""
        if self.fixed:
            return
        for i, n in enumerate(speeds.tolist()):
            self.scans[n, memory.poles.shape[1]] = ScanMemory(*(kind[i] for kind in memory))


def _content(part: object) -> object:
    """Return the values that tell two parts of a cut apart."""
    if is_dataclass(part):
        return tuple(_content(getattr(part, f.name)) for f in fields(part))
    return tuple(part.ravel().tolist()) if isinstance(part, np.ndarray) else part
