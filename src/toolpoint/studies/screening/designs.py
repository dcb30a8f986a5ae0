"""Designs of screenings: one at a time, full and fractional factorial, Latin hypercube and Sobol samples of factors and swaps.

A point is a share (0 .. 1) of every change's range. Samplers and indices are those of `scipy.stats`.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import hadamard
from scipy.stats import qmc

from toolpoint._check import FloatArray, count, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.machine.description.variation import Change, Swap, resting_shares

MAX_FACTORIAL_RUNS = 1_000_000  # points of a full factorial design


@dataclass(frozen=True, eq=False)
class ScreeningDesign(NotebookText):
    """Points (n, n_changes) of a design; kind : of the sampling; labels : of points that stand for one change."""

    kind: str
    changes: tuple[Change, ...]
    points: FloatArray
    labels: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the changes."""
        return tuple(change.name for change in self.changes)

    def words(self, index: int) -> str:
        """A point in words: its label, or the levels of all changes."""
        if self.labels:
            return self.labels[index]
        return ", ".join(f"{c.name} {c.words(float(s))}" for c, s in zip(self.changes, self.points[index], strict=True))

    @property
    def title(self) -> str:
        """Kind and size of the design in words."""
        return f"({self.kind}): {len(self.points)} variants by {len(self.changes)} changes"

    def __repr__(self) -> str:
        return f"ScreeningDesign({self.kind}, {len(self.changes)} changes, {len(self.points)} points)"


def one_at_a_time(changes: Sequence[Change]) -> ScreeningDesign:
    """Return the machine as it is, and every change alone: factors at both ends of their range, swaps at every other option.

    An end that leaves the machine as it is is left out.

    Examples
    --------
    >>> from toolpoint.machine.description.variation import Factor, Option
    >>> stiffness = Factor("foundation", ("joints.foundation.stiffness.x",))
    >>> head = Swap("head", {"light": Option(), "heavy": Option(scale={"bodies.head.mass": 2.0})})
    >>> one_at_a_time([stiffness, head]).labels
    ('as it is', 'foundation -20 %', 'foundation +20 %', 'head heavy')
    """
    resting = np.array(resting_shares(changes))
    points, labels = [resting], ["as it is"]
    for k, change in enumerate(changes):
        shares = [change.share(i) for i in range(1, len(change.options))] if isinstance(change, Swap) else [
            end for end in (0.0, 1.0) if abs(end - resting[k]) > 1e-12]
        for share in shares:
            point = resting.copy()
            point[k] = share
            points.append(point)
            labels.append(f"{change.name} {change.words(share)}")
    return ScreeningDesign("one at a time", tuple(changes), np.array(points), tuple(labels))


def full_factorial(changes: Sequence[Change], levels: int = 2) -> ScreeningDesign:
    """Return all combinations of levels, evenly over every range; swaps at all their options."""
    steps = [[c.share(i) for i in range(len(c.options))] if isinstance(c, Swap)
             else list(np.linspace(0, 1, count("levels", levels, 2))) for c in changes]
    number = int(np.prod([len(part) for part in steps]))
    if number > MAX_FACTORIAL_RUNS:
        fail("changes", f"{number} combinations", f"must be at most {MAX_FACTORIAL_RUNS}",
             remedy="take fewer levels, or a fractional design")
    return ScreeningDesign(f"full factorial, {levels} levels", tuple(changes), np.array(list(itertools.product(*steps))))


def fractional_factorial(changes: Sequence[Change], resolution: int = 4) -> ScreeningDesign:
    """Return a two-level fraction from the columns of a Hadamard matrix.

    Resolution 3: main effects are clear of each other; 4 (folded over): also of pairs of changes. Swaps need two options.
    """
    for change in changes:
        if isinstance(change, Swap) and len(change.options) != 2:
            fail(f"swap {change.name}", f"{len(change.options)} options", "a two-level design needs two",
                 remedy="take a full factorial")
    if resolution not in (3, 4):
        fail("resolution", str(resolution), "must be 3 or 4")
    # The next power of two above the number of changes: the first column is all ones.
    size = 1 << len(changes).bit_length()
    signs = hadamard(size)[:, 1:len(changes) + 1]
    if resolution == 4:
        # The same runs with all signs turned: pairs of changes then cancel in the main effects.
        signs = np.concatenate([signs, -signs])
    ends = np.array([[c.share(0), c.share(1)] if isinstance(c, Swap) else [0.0, 1.0] for c in changes])
    points = np.where(signs > 0, ends[:, 1], ends[:, 0])
    return ScreeningDesign(f"fractional factorial of resolution {resolution}", tuple(changes), points)


def latin_hypercube(changes: Sequence[Change], number: int, rng: np.random.Generator) -> ScreeningDesign:
    """Return a Latin hypercube with a number of points."""
    points = qmc.LatinHypercube(len(changes), rng=rng).random(count("number", number))
    return ScreeningDesign("Latin hypercube", tuple(changes), points)


def sobol_sequence(changes: Sequence[Change], number: int, rng: np.random.Generator) -> ScreeningDesign:
    """Return a scrambled Sobol sequence; the number is raised to a power of two, which its balance needs."""
    power = int(np.ceil(np.log2(count("number", number))))
    return ScreeningDesign("Sobol sequence", tuple(changes), qmc.Sobol(len(changes), rng=rng).random_base2(power))


def sobol_pairs(changes: Sequence[Change], number: int, rng: np.random.Generator) -> ScreeningDesign:
    """Return the points A, B and A with each column of B (Saltelli, 2010) for main and total effects, number (2 + n) of them.

    The number is raised to a power of two.
    """
    n = 2 ** int(np.ceil(np.log2(count("number", number, 2))))
    # One sequence of twice the dimension gives two independent samples.
    both = qmc.Sobol(2 * len(changes), rng=rng).random(n)
    first, second = both[:, :len(changes)], both[:, len(changes):]
    mixed = []
    for k in range(len(changes)):
        part = first.copy()
        part[:, k] = second[:, k]
        mixed.append(part)
    return ScreeningDesign("Sobol indices", tuple(changes), np.concatenate([first, second, *mixed]))


def given_points(changes: Sequence[Change], points: FloatArray, labels: Sequence[str] = ()) -> ScreeningDesign:
    """Return a design of points (n, n_changes) of one's own, shares of the ranges."""
    checked = floats("points", points, (None, len(changes)))
    if checked.min() < 0 or checked.max() > 1:
        fail("points", f"{checked.min():g} .. {checked.max():g}", "must be within 0 .. 1", remedy="shares of every range")
    return ScreeningDesign("given points", tuple(changes), checked, tuple(labels))
