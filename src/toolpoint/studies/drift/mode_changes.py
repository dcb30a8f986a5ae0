r"""Changes of modes between two tests of one machine, with what two tests of an unchanged machine differ by.

The logarithm of the ratio of two frequencies has the variance :math:`\sigma_b^2 / f_b^2 + \sigma_l^2 / f_l^2 + r^2`: of both
tests' stated noise, and of the repeatability r, which holds what no record shows (temperature, sensors put back, oil). The sum
of squares over the deviations has a chi-square distribution where nothing changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from toolpoint._check import FloatArray, IndexArray, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint.modal_identification import real_modes
from toolpoint.vibration import Modes
from toolpoint.vibration.correlation import assign_modes

MIN_TEST_MAC = 0.5  # of a mode in both tests; where fewer Dofs are measured, frequency decides
MAX_LOG_CHANGE = 0.25  # of a frequency between two tests: a stiffness by a factor 1.6 where it is alone
# Scatter of several baselines that is less likely than this says that tests repeat worse than stated.
_MIN_SCATTER_PROBABILITY = 0.01


@dataclass(frozen=True)
class Repeatability(NotebookText):
    """Standard deviations of what two tests of an unchanged machine differ by, besides the noise of their records.

    frequency : relative; shape : of an entry of a shape, over its largest.

    Examples
    --------
    >>> Repeatability(frequency=4e-3).shape
    0.03
    """

    frequency: float = 2e-3
    shape: float = 0.03

    def __post_init__(self) -> None:
        positive("Repeatability.frequency", self.frequency)
        positive("Repeatability.shape", self.shape)

    def __repr__(self) -> str:
        return f"Repeatability({100 * self.frequency:.2g} % of frequencies, {100 * self.shape:.2g} % of shapes)"


@dataclass(frozen=True, eq=False)
class ModeChanges(NotebookText):
    """Modes of a baseline beside those of a later test, at the Dofs of both, shapes real.

    partner : (n,) of every mode of the baseline in the later test, -1 for none; change : (n,) log of the ratio of frequencies,
    current over baseline, NaN for none; deviation : (n,) its standard deviation where nothing changed.
    """

    baseline: Modes
    current: Modes
    partner: IndexArray
    change: FloatArray
    deviation: FloatArray
    repeatability: Repeatability

    @property
    def paired(self) -> IndexArray:
        """Modes of the baseline (indices) that the later test shows too."""
        return np.flatnonzero(self.partner >= 0)

    @property
    def single_current(self) -> list[int]:
        """Modes of the later test that the baseline does not show."""
        return [j for j in range(self.current.count) if j not in self.partner]

    @property
    def probability(self) -> float:
        """Probability of changes as large as these, or larger, in a machine that did not change."""
        pairs = self.paired
        return float(chi2.sf(((self.change[pairs] / self.deviation[pairs]) ** 2).sum(), pairs.size)) if pairs.size else 1.0

    @property
    def scores(self) -> FloatArray:
        """Changes over their deviations, (n,), NaN for modes without a partner."""
        return np.asarray(self.change / self.deviation)

    def significant(self, false_alarms: float) -> IndexArray:
        """Return the modes (indices) that changed, at this probability of naming any that did not (Holm, 1979)."""
        pairs = self.paired
        probabilities = chi2.sf(self.scores[pairs] ** 2, 1)
        order = np.argsort(probabilities)
        limits = false_alarms / (pairs.size - np.arange(pairs.size))
        passed = probabilities[order] <= limits
        count = int(np.argmin(passed)) if not passed.all() else pairs.size
        return np.sort(pairs[order[:count]])

    def detectable_change(self, false_alarms: float) -> float:
        """Return the relative change of one mode that the sum over all modes shows with 95 % probability.

        The sum is then noncentral chi-square; the mode has the median deviation.
        """
        count = self.paired.size
        limit = float(chi2.isf(false_alarms, count))
        score = brentq(lambda size: float(ncx2.sf(limit, count, size**2)) - 0.95, 1e-3, 1e3)
        return float(score * np.median(self.deviation[self.paired]))

    def __repr__(self) -> str:
        return f"ModeChanges({self.paired.size} of {self.baseline.count} modes paired, probability {self.probability:.2g})"


def compare_modes(baseline: Modes, current: Modes, repeatability: Repeatability | None = None) -> ModeChanges:
    """Return the changes of modes between two tests.

    Parameters
    ----------
    baseline, current : Modes
        One pose, with at least one common Dof. Frequencies without a covariance count as exact.
    repeatability : Repeatability, optional

    Raises
    ------
    ToolpointError
        Where the tests have no Dof in common, or no mode.
    """
    common = [dof for dof in baseline.dofs if dof in current.dofs]
    if not common:
        fail("tests", "a later test without a degree of freedom of the baseline", "must share points and directions with it",
             remedy="name the points of both tests alike")
    first, second = (real_modes(modes.at_dofs(common)) for modes in (baseline, current))
    for name, modes in (("baseline", first), ("current", second)):
        if not modes.count:
            fail(name, "no modes", "must have some")
    repeat = repeatability or Repeatability()
    partner = _pair(first, second)
    change, deviation = np.full((2, first.count), np.nan)
    pairs = np.flatnonzero(partner >= 0)
    others = partner[pairs]
    change[pairs] = np.log(second.frequency[others] / first.frequency[pairs])
    deviation[pairs] = np.sqrt(_variance(first)[pairs] + _variance(second)[others] + repeat.frequency**2)
    return ModeChanges(first, second, partner, change, deviation, repeat)


def _pair(first: Modes, second: Modes) -> IndexArray:
    rows, columns, values = assign_modes(first, second)
    log_ratio = np.log(second.frequency[columns] / first.frequency[rows])
    # One or two directions look alike in every mode: there the frequency alone says which is which.
    lowest_mac = MIN_TEST_MAC if len(first.dofs) > 2 else 0.0
    is_pair = (values >= lowest_mac) & (np.abs(log_ratio) <= MAX_LOG_CHANGE)
    partner = np.full(first.count, -1)
    partner[rows[is_pair]] = columns[is_pair]
    return partner


def _variance(modes: Modes) -> FloatArray:
    """Return the relative variance of every frequency, (n,), 0 where none is stated."""
    if modes.covariance is None:
        return np.zeros(modes.count)
    return np.asarray(np.maximum(modes.covariance[:, 0, 0], 0.0) / modes.frequency**2)


def pool_baselines(tests: Sequence[Modes], repeatability: Repeatability) -> tuple[Modes, Repeatability, bool]:
    """Return one baseline of several tests of an unchanged machine, the repeatability, and whether their scatter raised it.

    Every mode of the first test gets the mean frequency of the tests that show it. Where they scatter more than their noise and
    the repeatability explain, this is raised to what explains it; it is never lowered: a few good tests prove no better one.
    """
    first = tests[0]
    comparisons = [compare_modes(first, test, repeatability) for test in tests[1:]]
    if not comparisons:
        return first, repeatability, False
    changes = np.stack([np.zeros(first.count), *(comparison.change for comparison in comparisons)])
    counts = np.isfinite(changes).sum(axis=0)
    means = np.nansum(changes, axis=0) / counts
    noise = np.stack([np.sqrt(np.maximum(c.deviation**2 - repeatability.frequency**2, 0.0)) for c in comparisons])
    # A difference of two tests holds both repeatabilities; the scatter about the mean holds each test's half of it.
    mean_noise = np.nansum(noise**2, axis=0) / np.maximum(np.isfinite(noise).sum(axis=0), 1)
    single_variance = (repeatability.frequency**2 + mean_noise) / 2
    freedom = int((counts - 1).sum())
    scatter = np.nansum((changes - means) ** 2, axis=0)
    statistic = float((scatter / np.where(counts > 1, single_variance, 1.0))[counts > 1].sum())
    raised = freedom > 0 and chi2.sf(statistic, freedom) < _MIN_SCATTER_PROBABILITY
    if raised:
        repeatability = replace(repeatability, frequency=float(np.sqrt(2 * scatter[counts > 1].sum() / freedom)))
    covariance = None
    if first.covariance is not None:
        covariance = first.covariance / counts[:, None, None]
    return replace(first, frequency=first.frequency * np.exp(means), covariance=covariance), repeatability, raised
