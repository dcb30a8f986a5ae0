"""Parameter: one number of a model that may be moved, with its bounds, its prior and the numbers linked to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import FloatArray, fail, positive, scalar


@dataclass(frozen=True)
class Parameter:
    r"""A parameter with value p, moved through the coordinate x.

    :math:`x = \ln(p / p_0)` on a logarithmic scale, otherwise :math:`x = (p - p_0) / s` with s = `prior_sd`, or
    :math:`|p_0|`, or 1, the first that is there; p_0 is `value`.

    Parameters
    ----------
    name : str
        The model's name of it, for a machine its path.
    value : float
        Where it starts, SI; also the mean (median on a logarithmic scale) of the prior.
    low, high : float
        Bounds, SI.
    prior_sd : float, optional
        Standard deviation of the prior: of ln p on a logarithmic scale (0.3 is about 30 %), otherwise in the unit of p.
    log : bool
        Whether it moves on a logarithmic scale: right for positive quantities known to a factor (stiffness, damping).
    links : mapping of name to factor
        Other numbers of the model that follow: factor times this value.
    group : str
        What it belongs to (an interface, a part) in rankings; its name up to the second dot where left out.
    kind : str
        What it is (stiffness, damping, mass): influences are compared within a kind, since dampers always move the data less
        than springs; the part of its name between the second and third dot where left out.

    Examples
    --------
    A stiffness of a machine that is known to 30 %, between a fifth and five times its value:

    >>> stiffness = Parameter("joints.foot.stiffness.z", 4e8, 0.8e8, 2e9, prior_sd=0.3)
    >>> stiffness.kind, stiffness.group
    ('stiffness', 'joints.foot')
    """

    name: str
    value: float
    low: float = -np.inf
    high: float = np.inf
    prior_sd: float | None = None
    log: bool = True
    links: Mapping[str, float] = field(default_factory=dict)
    group: str = ""
    kind: str = ""

    def __post_init__(self) -> None:
        scalar(f"Parameter {self.name!r}: value", self.value)
        if self.prior_sd is not None:
            positive(f"Parameter {self.name!r}: prior_sd", self.prior_sd)
        if self.log and self.value <= 0:
            fail(f"Parameter {self.name!r}: value", f"{self.value:g}", "must be above zero on a logarithmic scale",
                 remedy="use log=False, or start from a small positive value")
        if self.log and self.low < 0:
            object.__setattr__(self, "low", 0.0)
        if not self.low <= self.value <= self.high or self.low >= self.high:
            fail(f"Parameter {self.name!r}: value", f"{self.value:g}", f"must lie within {self.low:g} .. {self.high:g}",
                 remedy="widen the bounds or start inside them")
        for name, factor in self.links.items():
            scalar(f"Parameter {self.name!r}: link {name!r}", factor)
        if not self.group:
            object.__setattr__(self, "group", ".".join(self.name.split(".")[:2]))
        if not self.kind:
            object.__setattr__(self, "kind", [*self.name.split("."), "", "", ""][2])

    @property
    def scale(self) -> float:
        """s, the size of one unit of x on a linear scale."""
        return self.prior_sd or abs(self.value) or 1.0

    @property
    def prior(self) -> float | None:
        """Standard deviation of the prior in x."""
        return None if self.prior_sd is None else self.prior_sd if self.log else self.prior_sd / self.scale

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds in x."""
        return self.coordinate(self.low), self.coordinate(self.high)

    def coordinate(self, value: float) -> float:
        """Return x of a value."""
        if not self.log:
            return (value - self.value) / self.scale
        return -np.inf if value <= 0 else float(np.log(value / self.value))

    def at(self, x: float) -> float:
        """Return the value at x; infinite where a trial step goes beyond the largest number, which no model takes."""
        with np.errstate(over="ignore"):
            return float(self.value * np.exp(x)) if self.log else self.value + self.scale * x

    def slope(self, x: float) -> float:
        """Return dp/dx."""
        return self.at(x) if self.log else self.scale

    def moved_to(self, value: float) -> Parameter:
        """Return the parameter starting from another value."""
        return replace(self, value=value)


def check_parameters(parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Return the parameters as a tuple after refusing none at all and names that appear twice, links included."""
    result = tuple(parameters)
    names = [n for p in result for n in (p.name, *p.links)]
    if not names:
        fail("parameters", "none", "must be at least one")
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        fail("parameters", f"{', '.join(twice)} more than once", "every number may be moved by one parameter only",
             remedy="remove it from the list or from the links")
    return result


class Coordinates:
    """All parameters at once: values of all numbers at coordinates, and how each number moves with its parameter."""

    def __init__(self, parameters: Sequence[Parameter]) -> None:
        pairs = [(j, n, f) for j, p in enumerate(parameters) for n, f in ((p.name, 1.0), *p.links.items())]
        self.names = tuple(n for _, n, _ in pairs)
        self.owner, self.factor = np.array([j for j, _, _ in pairs]), np.array([f for _, _, f in pairs])
        self.log = np.array([p.log for p in parameters])
        self.value, self.scale = np.array([p.value for p in parameters]), np.array([p.scale for p in parameters])
        self._chosen: dict[tuple[int, ...], tuple[tuple[str, ...], tuple[int, ...], np.ndarray]] = {}

    def _own(self, x: FloatArray) -> FloatArray:
        return np.asarray(np.where(self.log, self.value * np.exp(np.where(self.log, x, 0.0)), self.value + self.scale * x))

    def values(self, x: FloatArray) -> dict[str, float]:
        """Return all numbers of the model, links included, at coordinates x (n,)."""
        return dict(zip(self.names, (self.factor * self._own(x)[self.owner]).tolist(), strict=True))

    def directions(self, x: FloatArray, columns: tuple[int, ...]) -> tuple[tuple[str, ...], tuple[int, ...], FloatArray]:
        """Return the numbers that the parameters `at` move, the place in `at` of each one's parameter, and d number/dx."""
        if columns not in self._chosen:
            place = {j: k for k, j in enumerate(columns)}
            rows = np.flatnonzero(np.isin(self.owner, columns))
            rows = rows[np.argsort([place[int(self.owner[r])] for r in rows], kind="stable")]
            self._chosen[columns] = (tuple(self.names[r] for r in rows), tuple(place[int(self.owner[r])] for r in rows), rows)
        names, owner, rows = self._chosen[columns]
        slope = np.where(self.log, self._own(x), self.scale)
        return names, owner, self.factor[rows] * slope[self.owner[rows]]
