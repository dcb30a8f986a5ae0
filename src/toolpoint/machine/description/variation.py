"""Changes of a machine: factors over ranges and swaps between options, by parameter paths; what screening varies.

A support bearing beside a reducer whose translations are locked is exactly an addition to its bending stiffness: the radial
stiffness times the square of its distance along the axis. That is what `add` is for.
"""

from __future__ import annotations

import fnmatch
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from toolpoint._check import fail, suggestion
from toolpoint.machine.description.machine import MachineDescription, parameters


@dataclass(frozen=True)
class Factor:
    """A number over a range: `low` to `high` times its value (``scale``), added to it (``add``), or in its place (``set``).

    paths : parameter paths, ``*`` for any part: ``joints.joint_q1.stiffness.rz``, ``bodies.link2.density``. cost : of the
    whole range, for `improve`.

    >>> softer = Factor("feet", ("joints.feet.stiffness.*",), low=0.5, high=1.0)
    >>> softer.kind, softer.cost
    ('scale', 1.0)
    """

    name: str
    paths: tuple[str, ...]
    low: float = 0.8
    high: float = 1.2
    kind: Literal["scale", "add", "set"] = "scale"
    cost: float = 1.0

    def __post_init__(self) -> None:
        if not self.low < self.high:
            fail(f"factor {self.name}", f"low {self.low:g}, high {self.high:g}", "low must be below high (are they reversed?)")
        if not self.paths:
            fail(f"factor {self.name}", "no paths", "must name at least one parameter",
                 remedy="for example bodies.link2.density")
        if self.kind == "scale" and self.low <= 0:
            fail(f"factor {self.name}", f"low {self.low:g}", "a scale must be above zero")

    def level(self, share: float) -> float:
        """Return the number at a share (0 .. 1) of the range."""
        return self.low + share * (self.high - self.low)

    def words(self, share: float) -> str:
        """Return the level in words."""
        value = self.level(share)
        return {"scale": f"{100 * (value - 1):+.4g} %", "add": f"{value:+.4g}", "set": f"{value:.6g}"}[self.kind]


@dataclass(frozen=True)
class Option:
    """One option of a swap: numbers put in place (`values`), multiplied (`scale`), added to (`add`), by path; `branch` of an
    arm.

    >>> longer = Option(scale={"bodies.head.mass": 1.1}, add={"joints.guide.stiffness.x": -1e7})
    >>> longer.scale["bodies.head.mass"]
    1.1
    """

    values: Mapping[str, float] = field(default_factory=dict)
    scale: Mapping[str, float] = field(default_factory=dict)
    add: Mapping[str, float] = field(default_factory=dict)
    branch: str = ""


@dataclass(frozen=True)
class Swap:
    """A choice between options by name; the first is what stands now (an empty option changes nothing).

    >>> wide = Option(scale={"joints.guide.stiffness.rx": 2.0})
    >>> Swap("rails", {"as they are": Option(), "wide": wide}).share(1)  # the middle of the second half
    0.75
    """

    name: str
    options: Mapping[str, Option]

    def __post_init__(self) -> None:
        if len(self.options) < 2:
            fail(f"swap {self.name}", f"{len(self.options)} options", "must be at least two",
                 remedy="the first is what stands now")

    def index(self, share: float) -> int:
        """Return the option at a share (0 .. 1): all options have equal parts of it."""
        return min(int(share * len(self.options)), len(self.options) - 1)

    def words(self, share: float) -> str:
        """Return the option's name."""
        return list(self.options)[self.index(share)]

    def share(self, index: int) -> float:
        """Return the middle of an option's part."""
        return (index + 0.5) / len(self.options)


Change = Factor | Swap


def vary(description: MachineDescription, changes: Sequence[Change], shares: Sequence[float]) -> MachineDescription:
    """Return the machine with every factor and swap at its share (0 .. 1) of the range."""
    values: dict[str, float] = {}
    known_paths = _known_paths(description, changes)
    for change, share in zip(changes, shares, strict=True):
        if isinstance(change, Factor):
            number = change.level(share)
            operations: list[tuple[str, str, float]] = [(change.kind, path, number) for path in _paths(known_paths, change)]
        else:
            option = list(change.options.values())[change.index(share)]
            operations = [(kind, path, number) for kind, part in (("set", option.values), ("scale", option.scale),
                                                                  ("add", option.add))
                          for path, number in part.items()]
        for kind, path, number in operations:
            old = values.get(path)
            old = description.value(path) if old is None else old
            values[path] = number if kind == "set" else old * number if kind == "scale" else old + number
    return description.with_values(values)


def branch_of(changes: Sequence[Change], shares: Sequence[float]) -> str:
    """Return the branch that the chosen options ask for; empty where none does."""
    names = [list(change.options.values())[change.index(share)].branch
             for change, share in zip(changes, shares, strict=True) if isinstance(change, Swap)]
    return next((name for name in reversed(names) if name), "")


def _known_paths(description: MachineDescription, changes: Sequence[Change]) -> list[str]:
    """Return all parameters of a machine where a factor has a pattern for them; they are listed once for all factors."""
    has_pattern = any("*" in path for change in changes if isinstance(change, Factor) for path in change.paths)
    return list(parameters(description)) if has_pattern else []


def _paths(known_paths: Sequence[str], factor: Factor) -> list[str]:
    """Return the parameters that a factor changes, patterns resolved."""
    result: list[str] = []
    for pattern in factor.paths:
        matches = fnmatch.filter(known_paths, pattern) if "*" in pattern else [pattern]
        if not matches:
            fail(f"factor {factor.name}", f"no parameter is like {pattern!r}", "must match at least one",
                 remedy=suggestion(pattern, known_paths))
        result += matches
    return result


def check_changes(description: MachineDescription, changes: Sequence[Change]) -> None:
    """Raise ToolpointError for changes without parameters, of parameters that are not there, or with one name twice."""
    if not changes:
        fail("changes", "none", "must be at least one factor or swap")
    names = [change.name for change in changes]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        fail("changes", f"{repeated!r} appears twice", "names must differ")
    known_paths = _known_paths(description, changes)
    for change in changes:
        paths = _paths(known_paths, change) if isinstance(change, Factor) else [
            path for option in change.options.values() for part in (option.values, option.scale, option.add) for path in part]
        for path in paths:
            description.value(path)


def resting_shares(changes: Sequence[Change]) -> tuple[float, ...]:
    """Return the shares at which no change alters the machine: a factor at its neutral level (within its range), a swap's
    first."""
    shares = []
    for change in changes:
        if isinstance(change, Swap):
            shares.append(change.share(0))
            continue
        neutral = {"scale": 1.0, "add": 0.0}.get(change.kind, change.low)
        shares.append(min(max((neutral - change.low) / (change.high - change.low), 0.0), 1.0))
    return tuple(shares)
