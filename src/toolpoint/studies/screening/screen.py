"""Screening: metrics of a machine at all points of a design; serial, processes or Dask, resumable; effects with confidence."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import Array, FloatArray, count, fail
from toolpoint._notebook import NotebookText
from toolpoint.machine.description import MachineDescription
from toolpoint.machine.description.variation import Change, Factor, branch_of, check_changes, vary
from toolpoint.machine.parts.build import build
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.execute import Engine, Progress, execute
from toolpoint.studies.screening.designs import ScreeningDesign
from toolpoint.studies.screening.metrics import Metric, share_text, shown_name, shown_unit
from toolpoint.studies.text_table import text_table

PARTS = "parts"  # folder of the parts of unfinished variants
_MAX_TABLE_METRICS = 4  # metrics in the table; all are in the data


@dataclass(frozen=True, eq=False)
class Screening(NotebookText):
    """Metrics at all points of a design.

    values : (n_draws, n_points, n_metrics), not a number where a variant failed; draws : (n_draws, n_doubts) shares of the
    uncertain inputs, the first draw the stated ones; loads : for which loads the metrics hold; failures : point to reason.
    """

    design: ScreeningDesign
    metrics: tuple[str, ...]
    values: FloatArray
    draws: FloatArray
    loads: str
    failures: Mapping[int, str]
    status: str

    @property
    def stated(self) -> FloatArray:
        """The metrics with all uncertain inputs as stated, (n_points, n_metrics)."""
        return self.values[0]

    def metric(self, name: str) -> FloatArray:
        """Return one metric of all draws and points, (n_draws, n_points)."""
        if name not in self.metrics:
            fail("metric", repr(name), f"must be of {', '.join(self.metrics)}")
        return self.values[..., self.metrics.index(name)]

    def table(self) -> str:
        """Return every point as text (at most 40).

        The change against the first stands beside it where the design begins with the machine as it is.
        """
        base = self.stated[0] if self.design.labels and self.design.labels[0] == "as it is" else None
        rows = []
        factors = [shown_unit(name)[1] for name in self.metrics]
        for i in range(min(len(self.stated), 40)):
            cells = [f"{factor * v:.4g}" if base is None or i == 0 else f"{factor * v:.4g} ({share_text(v / b - 1)})"
                     for v, b, factor in zip(self.stated[i], self.stated[0], factors, strict=True)]
            rows.append([self.design.words(i), *(cells if i not in self.failures else [self.failures[i]] * len(cells))])
        rows = [[cell for k, cell in enumerate(row) if k <= _MAX_TABLE_METRICS] for row in rows]
        header = ["variant", *map(shown_name, self.metrics[:_MAX_TABLE_METRICS])]
        return "\n".join([text_table(self.title, header, rows), f"loads: {self.loads}", self.status])

    @property
    def title(self) -> str:
        """Kind and size of the screening, in words."""
        draws = f", {len(self.draws)} draws of the uncertain inputs" if len(self.draws) > 1 else ""
        failed = f", {len(self.failures)} of them failed" if self.failures else ""
        return f"Screening {self.design.title}{failed}{draws}"

    def to_dict(self) -> dict[str, Any]:
        """Return all values as plain data, None where a variant failed."""
        values = self.values.astype(object)
        values[np.isnan(self.values)] = None
        return {"design": self.design.kind, "changes": list(self.design.names), "points": self.design.points.tolist(),
                "variants": [self.design.words(i) for i in range(len(self.stated))], "metrics": list(self.metrics),
                "values": values.tolist(), "loads": self.loads, "failures": {str(k): v for k, v in self.failures.items()},
                "status": self.status}

    def __repr__(self) -> str:
        draws = f", {len(self.draws)} draws" if len(self.draws) > 1 else ""
        return f"Screening({self.design!r}, {len(self.metrics)} metrics{draws}, {len(self.failures)} failed)"


@dataclass(frozen=True)
class _Variant:
    """Metrics of the variant at a point: shares of the changes, then of the doubts.

    folder : where the parts of a variant are kept until it is finished, where its metric has any.
    """

    description: MachineDescription
    changes: tuple[Change, ...]
    doubts: tuple[Change, ...]
    metric: Metric
    folder: Path | None = None

    @property
    def identity(self) -> str:
        return repr((self.description, self.changes, self.doubts, getattr(self.metric, "identity", repr(self.metric))))

    def __call__(self, point: Sequence[float]) -> dict[str, Any]:
        size = len(self.changes)
        described = vary(vary(self.description, self.doubts, point[size:]), self.changes, point[:size])
        metric = self.metric
        branch = branch_of(self.changes, point[:size])
        if branch:
            if not hasattr(metric, "on_branch"):
                fail("metric", type(metric).__name__, "knows no branches", remedy="screen branches with an accuracy metric")
            metric = metric.on_branch(branch)
        if self.folder is None or not hasattr(metric, "kept_in"):
            answers = metric(build(described))
        else:  # a variant of minutes goes on inside itself
            parts = self.folder / hashlib.sha256(repr(list(map(float, point))).encode()).hexdigest()[:16]
            answers = metric.kept_in(parts)(build(described))
            shutil.rmtree(parts, ignore_errors=True)  # what they gave is in the chunk
        return {"names": np.array(list(answers)), "values": np.array(list(answers.values()), float)}


def screen(
    machine: Machine | MachineDescription, design: ScreeningDesign, metric: Metric, *, doubts: Sequence[Factor] = (),
    draws: int = 0,
    rng: np.random.Generator | None = None, engine: Engine | None = None, folder: str | Path | None = None,
    progress: Progress | None = None, chunk_seconds: float = 1.0,
) -> Screening:
    """Return the metrics of a machine's variants.

    Parameters
    ----------
    machine : Machine or its description
    design : ScreeningDesign
        Which variants.
    metric : NamedMetrics, an accuracy metric, or any function
        Takes a Machine, returns a mapping of names to numbers; with Dask it must be importable or picklable.
    doubts : sequence of Factor, optional
        Inputs that are uncertain: every draw places them evenly over their range, and all variants see the same draws.
    draws : int
        How many draws beside the stated inputs; needs `rng`.
    engine, folder, progress, chunk_seconds : see `execute.execute`

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description.variation import Factor
    >>> from toolpoint.studies.screening.designs import one_at_a_time
    >>> from toolpoint.studies.screening.metrics import NamedMetrics
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}))
    >>> result = screen(machine, one_at_a_time([Factor("head", ("bodies.head.mass",))]), NamedMetrics())
    >>> result.metric("frequency 1").round(2).tolist()  # as it is, 20 % lighter, 20 % heavier
    [[50.33, 56.27, 45.94]]
    """
    description = machine.description if isinstance(machine, Machine) else machine
    check_changes(description, design.changes)
    if draws and (rng is None or not doubts):
        fail("draws", str(draws), "needs doubts and a random generator",
             remedy="give doubts=[Factor(...)], rng=numpy.random.default_rng(1)")
    if doubts:
        check_changes(description, doubts)
    from toolpoint.machine.description.variation import resting_shares

    resting = np.array(resting_shares(doubts))
    shares = np.vstack([resting[None], rng.random((count("draws", draws, 0),
                                                   len(doubts)))]) if rng is not None else resting[None]
    points = [[*map(float, point), *map(float, draw)] for draw in shares for point in design.points]
    variant = _Variant(description, design.changes, tuple(doubts), metric, None if folder is None else Path(folder) / PARTS)
    run = execute(variant, points, engine, folder=folder, progress=progress, chunk_seconds=chunk_seconds)
    good = [outcome.values for outcome in run.outcomes if outcome.values is not None]
    if not good:
        fail("design", "every variant failed", "the first because: " + run.outcomes[0].failure)
    names = tuple(map(str, good[0]["names"]))
    empty = np.full(len(names), np.nan)
    values: Array = np.array([empty if o.values is None else o.values["values"] for o in run.outcomes])
    failures = {i % len(design.points): reason for i, reason in run.failures.items()}
    loads = str(getattr(metric, "loads", "as the metric has them: none but the cut's own, no gravity, no inertia of a path"))
    return Screening(design, names, values.reshape(len(shares), len(design.points), -1), shares, loads, failures,
                     "complete" if not failures else f"{len(failures)} variants failed; their reasons stand in the table")
