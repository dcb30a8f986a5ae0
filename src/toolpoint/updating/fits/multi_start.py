"""Multi-start: the same fit from many starts, and how many different optima it finds."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from toolpoint._check import FloatArray, ToolpointError, count, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint.updating.fits.fit import fit
from toolpoint.updating.fits.fit_methods import LeastSquares
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.identifiability import identifiability
from toolpoint.updating.problem import Problem


@dataclass(frozen=True, eq=False)
class Optimum:
    """One optimum: its `fit`, and the `starts` (0 is the given one) that led to it."""

    fit: ParameterFit
    starts: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class MultiStart(NotebookText):
    """Different optima, the best first; `failures`: start to reason, where no minimum was reached.

    >>> from toolpoint.updating import Parameter, Prediction, Problem, Targets
    >>> from toolpoint.vibration import Modes
    >>> def model(values, names=()):  # a mass of 2 kg on a spring
    ...     return Prediction(Modes([np.sqrt(values["k"] / 2.0) / (2 * np.pi)], [0.01], [[1.0]], ["tool:+x"]))
    >>> problem = Problem(model, [Parameter("k", 5e6, 1e6, 2e7)], Targets(model({"k": 8e6}).modes), "finite differences")
    >>> multi_start(problem, np.random.default_rng(1), starts=2).table().splitlines()[0]
    '1 optima, 0 as good as the best, 0 starts failed'
    """

    optima: tuple[Optimum, ...]
    failures: dict[int, str]

    @property
    def best(self) -> ParameterFit:
        """The fit with the least chi-square; its status says how many optima are as good."""
        return self.optima[0].fit

    @property
    def rivals(self) -> tuple[Optimum, ...]:
        """Optima that the data do not tell from the best: chi-square (with prior) within 9 (3 standard deviations)."""
        best = self.best.cost
        scale = max(self.best.reduced_chi_square, 1.0) if self.best.scaled else 1.0
        # Nine on the scale of chi-square is three deviations: a worse optimum is no rival.
        return tuple(o for o in self.optima[1:] if o.fit.cost - best <= 9.0 * scale)

    def table(self) -> str:
        """Return chi-square, number of starts and free values of every optimum as text."""
        lines = [f"{len(self.optima)} optima, {len(self.rivals)} as good as the best, {len(self.failures)} starts failed"]
        for k, optimum in enumerate(self.optima):
            values = ", ".join(f"{n} {optimum.fit.values[n]:.5g}" for n in optimum.fit.free)
            lines.append(f"{k + 1}: chi-square {optimum.fit.chi_square:.5g}, {len(optimum.starts)} starts: {values}")
        lines += [f"{reason}: {n} starts" for reason, n in Counter(self.failures.values()).items()]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"MultiStart({len(self.optima)} optima, {len(self.rivals)} rivals, {len(self.failures)} failed starts)"


def multi_start(
    problem: Problem, rng: np.random.Generator, starts: int = 16, *, spread: float = 1.0, method: LeastSquares | None = None,
    limit: float | None = 0.5, least_influence: float = 0.02, free: tuple[str, ...] | None = None,
) -> MultiStart:
    """Return the optima found from the given start and from a Latin hypercube about it.

    Which parameters are free is decided once, at the given start; the others stay there.

    Parameters
    ----------
    problem : Problem
    rng : numpy.random.Generator
    starts : int
        The given one included.
    spread : float
        Half width of the hypercube in the parameters' coordinates (1: a factor e on a logarithmic scale), cut at bounds.
    method, limit, least_influence, free : see `fit`

    Raises
    ------
    ToolpointError
        Where no start reaches a minimum, with the reasons.

    >>> from toolpoint.updating import Parameter, Prediction, Problem, Targets
    >>> from toolpoint.vibration import Modes
    >>> def model(values, names=()):  # a mass of 2 kg on a spring
    ...     return Prediction(Modes([np.sqrt(values["k"] / 2.0) / (2 * np.pi)], [0.01], [[1.0]], ["tool:+x"]))
    >>> problem = Problem(model, [Parameter("k", 5e6, 1e6, 2e7)], Targets(model({"k": 8e6}).modes), "finite differences")
    >>> result = multi_start(problem, np.random.default_rng(1), starts=3)
    >>> len(result.optima), round(result.best.values["k"])  # one minimum, whatever the start
    (1, 8000000)
    """
    count("starts", starts)
    positive("spread", spread)
    if free is None:
        free = problem.names if limit is None else identifiability(
            problem, limit=limit, least_influence=least_influence).identifiable
    if not free:
        fail("problem", "no parameter that the data can tell", "must be at least one",
             remedy="measure more, or raise the limit")
    fits, failures = {}, {}
    for k, start in enumerate(_points(problem, rng, starts, spread, free)):
        try:
            trial = fit(problem, method, free=free, start=start)
        except ToolpointError as error:
            failures[k] = str(error)
            continue
        if trial.converged:
            fits[k] = trial
        else:
            failures[k] = trial.status.removeprefix("doubtful: fit: ").split(";")[0]
    if not fits:
        fail("multi_start", f"none of {starts} starts reached a minimum ({next(iter(failures.values()))})",
             "must be at least one", remedy="start nearer, use a smaller spread, or more evaluations")
    optima = _distinct(fits)
    result = MultiStart(optima, failures)
    if result.rivals:
        best = replace(optima[0].fit, status=optima[0].fit.status + f"; {len(result.rivals)} other optima explain the data as "
                       "well: add measurements or priors that tell them apart")
        result = replace(result, optima=(replace(optima[0], fit=best), *optima[1:]))
    return result


def _points(
    problem: Problem, rng: np.random.Generator, starts: int, spread: float, names: tuple[str, ...]
) -> list[FloatArray]:
    """Return the given start and those of a Latin hypercube about it, (n_parameters,) each, cut at the bounds."""
    free = [problem.names.index(n) for n in names]
    lower, upper = problem.bounds
    cube = qmc.LatinHypercube(len(free), seed=rng).random(starts - 1) if starts > 1 else np.zeros((0, len(free)))
    points = [problem.start]
    for row in cube:
        x = problem.start
        x[free] = np.clip(spread * (2 * row - 1), lower[free], upper[free])
        points.append(x)
    return points


def _distinct(fits: dict[int, ParameterFit]) -> tuple[Optimum, ...]:
    """Two results are one optimum where they differ by less than a tenth of the standard errors, or by 1e-3 in all x."""
    optima: list[Optimum] = []
    # The best first: it stands for its optimum, and later starts are compared with the end that is nearest to the minimum.
    for k, result in sorted(fits.items(), key=lambda item: item[1].cost):
        free = [i for i, p in enumerate(result.parameters) if p.name in result.free]
        for i, other in enumerate(optima):
            sd = np.sqrt(np.maximum(np.diag(other.fit.covariance), 0.0))
            # A tenth of a deviation apart they are one optimum, reached from two sides within the tolerance of the fit.
            if (np.abs(result.x[free] - other.fit.x[free]) <= np.maximum(1e-3, 0.1 * sd)).all():
                optima[i] = replace(other, starts=(*other.starts, k))
                break
        else:
            optima.append(Optimum(result, (k,)))
    return tuple(optima)
