"""Conclusions over assumptions: whether each holds for every drawn machine, for some or for none, and what decides it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError, count
from toolpoint._notebook import NotebookText
from toolpoint.machine.description.variation import Factor, check_changes, vary
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.text_table import text_table


@dataclass(frozen=True, eq=False)
class DrawnConclusions(NotebookText):
    """Conclusions judged at drawn machines.

    names : (n_conclusions); held : (n_draws, n_conclusions) of bool, failed draws left out; levels : (n_draws, n_factors), the
    factors' levels; factors : (n_factors) names; failures : the reasons of the draws that could not be judged.
    """

    names: tuple[str, ...]
    held: Array
    levels: FloatArray
    factors: tuple[str, ...]
    failures: tuple[str, ...]

    def count(self, name: str) -> int:
        """Return at how many of the judged draws a conclusion holds."""
        return int(self.held[:, self.names.index(name)].sum())

    def words(self, name: str) -> str:
        """Return for how many draws a conclusion holds, in words."""
        holding, judged = self.count(name), len(self.held)
        kind = "every value drawn" if holding == judged else "some values drawn" if holding else "no value drawn"
        return f"holds for {kind} ({holding} of {judged})"

    def decisive(self, name: str) -> tuple[str, float]:
        """Return the factor that goes most with a conclusion and their correlation, in -1 .. 1 (0 where nothing differs).

        The correlation of the logarithm of the level with whether it holds: a sign that the factor decides it, no proof.
        """
        held = self.held[:, self.names.index(name)].astype(float)
        levels = np.log(np.maximum(self.levels, np.finfo(float).tiny))
        if not held.std() or not len(self.factors):
            return "", 0.0
        spread = np.where(np.ptp(levels, axis=0) > 0, levels.std(axis=0), np.inf)
        correlation = ((levels - levels.mean(axis=0)) * (held - held.mean())[:, None]).mean(axis=0) / (spread * held.std())
        k = int(np.abs(correlation).argmax())
        return self.factors[k], float(correlation[k])

    def summary(self) -> dict[str, int | str]:
        """Return ``draws``, those that were judged, and of every conclusion ``holds_NAME`` and what decides it, ``by_NAME``."""
        result: dict[str, int | str] = {"draws": len(self.held)}
        for name in self.names:
            factor, correlation = self.decisive(name)
            words = f"goes most with {factor}, correlation {correlation:+.2f}" if factor else "nothing drawn changes it"
            result |= {f"holds_{name}": self.count(name), f"by_{name}": words}
        return result

    def table(self) -> str:
        """Return every conclusion with its count and the factor that goes most with it as text."""
        rows = []
        for name in self.names:
            factor, correlation = self.decisive(name)
            rows.append([name, self.words(name), f"{factor} ({correlation:+.2f})" if factor else ""])
        title = f"{len(self.names)} conclusions on {len(self.held)} drawn machines"
        lines = [text_table(title, ["conclusion", "drawn", "goes most with"], rows)]
        if self.failures:
            lines.append(f"{len(self.failures)} draws could not be judged, the first: {self.failures[0]}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the counts and what goes with each conclusion as plain data."""
        return {"draws": len(self.held), "failures": list(self.failures), "conclusions": [
            {"name": name, "holds": self.count(name), "factor": self.decisive(name)[0],
             "correlation": self.decisive(name)[1]} for name in self.names]}

    def __repr__(self) -> str:
        return f"DrawnConclusions({len(self.names)} conclusions, {len(self.held)} draws, {len(self.failures)} failed)"


def draw_conclusions(machine: Machine, factors: Sequence[Factor], judge: Callable[[Machine], Mapping[str, bool]], *,
                     draws: int = 200, rng: np.random.Generator) -> DrawnConclusions:
    """Return at how many drawn machines each conclusion of `judge` holds.

    Parameters
    ----------
    machine : Machine
    factors : sequence of Factor
        What is not known, each drawn over its range: scales evenly in their logarithm, others evenly.
    judge : callable
        A machine to the names of its conclusions and whether they hold, the same names each time.
    draws : int
    rng : numpy.random.Generator

    Raises
    ------
    ToolpointError
        For factors without parameters, and where no draw could be judged.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.studies import solve_modes
    >>> machine = build(MachineDescription(
    ...     "slide", {"table": BodyDescription(2.0, inertia=InertiaDescription(1.0, 1.0, 1.0))},
    ...     {"guide": JointDescription("ground", "table", stiffness={"x": 5e6})}))
    >>> drawn = draw_conclusions(machine, [Factor("guide", ("joints.guide.stiffness.x",), 0.5, 2.0)],
    ...                          lambda one: {"above 100 Hz": bool(solve_modes(one, None, 1).frequency[0] > 100)},
    ...                          draws=20, rng=np.random.default_rng(1))
    >>> drawn.words("above 100 Hz")
    'holds for every value drawn (20 of 20)'
    """
    count("draws", draws)
    check_changes(machine.description, factors)
    held: list[list[bool]] = []
    levels: list[list[float]] = []
    failures: list[str] = []
    names: tuple[str, ...] = ()
    for shares in rng.random((draws, len(factors))):
        drawn = [_share(factor, share) for factor, share in zip(factors, shares, strict=True)]
        try:
            result = judge(machine.rebuild(vary(machine.description, factors, drawn)))
        except ToolpointError as error:
            failures.append(str(error))
            continue
        names = tuple(result)
        held.append([bool(value) for value in result.values()])
        levels.append([factor.level(share) for factor, share in zip(factors, drawn, strict=True)])
    if not held:
        raise ToolpointError(f"draws: none of {draws} could be judged; the first: {failures[0]}")
    return DrawnConclusions(names, np.array(held), np.array(levels), tuple(factor.name for factor in factors), tuple(failures))


def _share(factor: Factor, share: float) -> float:
    """Return the share of the range at which a factor's level is drawn: of scales the logarithm is even."""
    if factor.kind != "scale":
        return share
    return float((factor.low * (factor.high / factor.low) ** share - factor.low) / (factor.high - factor.low))
