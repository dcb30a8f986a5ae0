r"""Uncertainty of a machine's answers, from the covariance of its identified numbers, at any pose.


A smooth answer y(p) gets its 95 % interval to first order, :math:`\sigma^2 = g^T C g` with the slopes g by central
differences of a tenth of a standard deviation (exact to second order in it; one-sided where a number has no room on the
other side); an answer that is not smooth (a limit over
lobes) by samples of the whole machine. The share of one joint is :math:`g_j^T C_{jj} g_j`, what would be left if only its
numbers were uncertain. """

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.machine.parts.model import Machine

MACHINE_DRAW_COUNT = 40  # machines drawn where responses keep draws
MAX_DRAWN_STIFFNESS_RATIO = 1e3  # of a drawn stiffness over the largest of its joint: rounding would hide all other springs
_SLOPE_STEP_DEVIATIONS = 0.1  # step of the central differences, in standard deviations of the number


@dataclass(frozen=True, eq=False)
class MachineUncertainty(NotebookText):
    """The identified numbers of a machine.

    paths : of the numbers; covariance : (n, n); parts : the joint or body that each belongs to.
    """

    machine: Machine
    paths: tuple[str, ...]
    covariance: FloatArray

    @property
    def parts(self) -> tuple[str, ...]:
        """Joint or body of every number."""
        return tuple(" ".join(path.split(".")[:2]).replace("joints", "joint").replace("bodies", "body") for path in self.paths)

    def slopes(self, answer: Callable[[Machine], FloatArray], progress: Callable[[int, int], None] | None = None
               ) -> FloatArray:
        """Return the slopes (n, ...) of an answer, per standard deviation of each number."""
        deviation = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        rows = []
        for path, size in zip(self.paths, deviation, strict=True):
            above, below = self._moved(path, size), self._moved(path, -size)
            change = np.asarray(answer(above[0])) - np.asarray(answer(below[0]))
            rows.append(change / max(above[1] + below[1], 1e-300))
            if progress is not None:
                progress(len(rows), len(self.paths))
        return np.array(rows)

    def _moved(self, path: str, size: float) -> tuple[Machine, float]:
        """Return the machine with a number moved by a tenth of `size`, less where no machine can be so, and by what share.

        A flat body's inertia, or a loss factor of zero, has room on one side only.
        """
        value = self.machine.value(path)
        # A flat body's inertia has room on one side only, and little of it: shorter steps are tried.
        for step in (_SLOPE_STEP_DEVIATIONS, _SLOPE_STEP_DEVIATIONS / 10, _SLOPE_STEP_DEVIATIONS / 100):
            if {"loss_factor", "damping", "modal_damping"} & set(path.split(".")) and value + step * size < 0:
                continue
            try:
                return self.machine.with_values({path: value + step * size}), step
            except ToolpointError:
                continue
        return self.machine, 0.0

    def spread(self, answer: Callable[[Machine], FloatArray], progress: Callable[[int, int], None] | None = None
               ) -> AnswerSpread:
        """Return the standard deviations of a smooth answer, and what each part brings to them."""
        slopes = self.slopes(answer, progress)
        size = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))
        unit = self.covariance / np.outer(size, size)
        flat = slopes.reshape(len(self.paths), -1)
        total = np.einsum("ni,nm,mi->i", flat, unit, flat)
        shares = {}
        for part in dict.fromkeys(self.parts):
            indices = [i for i, name in enumerate(self.parts) if name == part]
            shares[part] = np.einsum("ni,nm,mi->i", flat[indices], unit[np.ix_(indices, indices)],
                                     flat[indices]).reshape(slopes.shape[1:])
        return AnswerSpread(np.sqrt(np.maximum(total, 0.0)).reshape(slopes.shape[1:]), shares)

    def samples(self, count: int, rng: np.random.Generator) -> Iterator[Machine]:
        """Yield machines drawn from the covariance; a draw that no machine can have is drawn again."""
        values, vectors = np.linalg.eigh(self.covariance / self._scale)
        root = np.sqrt(np.diag(self._scale))[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        middle = np.array([self.machine.value(path) for path in self.paths])
        remaining, tries = count, 20 * count
        while remaining and tries:
            tries -= 1
            numbers = middle + root @ rng.normal(size=len(middle))
            if not self._is_possible(numbers, middle):
                continue
            drawn = zip(self.paths, numbers, strict=True)
            try:
                sample = self.machine.with_values({path: _clip_loss(path, float(value)) for path, value in drawn})
            except ToolpointError:
                continue
            yield sample
            remaining -= 1
        if remaining:
            fail("identified.covariance", f"{20 * count} draws gave {count - remaining} possible machines",
                 f"must give {count}", remedy=f"{self._least_known}: the numbers are known too badly for samples; mend what "
                 "the doubts on its joint name, or measure more")

    def _is_possible(self, numbers: FloatArray, middle: FloatArray) -> bool:
        """Whether no stiffness of a draw is far beyond the largest of its joint: of one that is not determined, draws are."""
        for part in dict.fromkeys(self.parts):
            mine = [k for k, path in enumerate(self.paths) if ".stiffness" in path and self.parts[k] == part]
            if mine and np.abs(numbers[mine]).max() > MAX_DRAWN_STIFFNESS_RATIO * np.abs(middle[mine]).max():
                return False
        return True

    @property
    def _least_known(self) -> str:
        """The number with the largest deviation over itself, in words."""
        deviation = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        share = deviation / np.maximum(np.abs([self.machine.value(path) for path in self.paths]), 1e-300)
        share[[".stiffness" not in path for path in self.paths]] = 0.0
        k = int(share.argmax())
        return f"{self.paths[k]} is known within {100 * NORMAL_QUANTILE_95 * share[k]:.3g} % only"

    @property
    def _scale(self) -> FloatArray:
        size = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))
        return np.outer(size, size)

    def __repr__(self) -> str:
        return f"MachineUncertainty({self.machine.name!r}, {len(self.paths)} numbers of {len(set(self.parts))} parts)"


@dataclass(frozen=True, eq=False)
class AnswerSpread:
    """Standard deviations of an answer, and the variance that each joint or body alone would bring."""

    deviation: FloatArray
    shares: dict[str, FloatArray]

    @property
    def interval(self) -> FloatArray:
        """Half width of the 95 % interval."""
        return np.asarray(NORMAL_QUANTILE_95 * self.deviation)

    def main_part(self, *index: int) -> str:
        """Return the joint or body that brings most of the variance of one number of the answer."""
        return max(self.shares, key=lambda part: float(self.shares[part][index])) if self.shares else ""


def _clip_loss(path: str, value: float) -> float:
    """Return a value that its number can have: no loss below zero, no stiffness or mass at or below it."""
    if {"loss_factor", "damping", "modal_damping"} & set(path.split(".")):
        return max(value, 0.0)
    return value


def machine_uncertainty(machine: Machine) -> MachineUncertainty | None:
    """Return the identified numbers of a machine with their covariance, None where its file holds none."""
    identified = machine.description.identified
    if identified is None or not identified.parameters:
        return None
    return MachineUncertainty(machine, identified.parameters, identified.matrix)
