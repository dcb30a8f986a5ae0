"""Restarts: other ways into the same fit, tried only where the first does not reach a minimum that explains the data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._threads import on_one_thread
from toolpoint.updating.fits.fit import fit, is_explained
from toolpoint.updating.fits.fit_methods import LeastSquares
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.problem import Problem

FREQUENCY_PAIRING_WEIGHT = 3.0  # a third of a logarithm (40 % in frequency) then costs as much as a whole MAC can give


@on_one_thread
def fit_with_restarts(
    problem: Problem, method: LeastSquares | None = None, limit: float | None = 0.5, *, least_influence: float = 0.02,
    free: tuple[str, ...] | None = None, restarts: int = 24, spread: float = 0.5, start: FloatArray | None = None,
) -> ParameterFit:
    """Return `fit`; where it does not explain the data, the best of up to `restarts` more, the first that does.

    The first restart pairs modes by frequency to get near and then by MAC: from a wrong start strongly coupled shapes may
    look more like another mode's than like their own. The next ones start from Halton points (no random numbers) within
    +- `spread` of the start in the free parameters' coordinates, all ways in turn (the second: frequencies alone first).

    Parameters
    ----------
    problem, method, limit, least_influence, free, start : see `fit`; the restarts are about the problem's own start
    restarts : int
        0 for none.
    spread : float

    >>> import numpy as np
    >>> from toolpoint.updating import Parameter, Prediction, Problem, Targets
    >>> from toolpoint.vibration import Modes
    >>> def model(values, names=()):  # a mass of 2 kg on a spring
    ...     return Prediction(Modes([np.sqrt(values["k"] / 2.0) / (2 * np.pi)], [0.01], [[1.0]], ["tool:+x"]))
    >>> problem = Problem(model, [Parameter("k", 5e6, 1e6, 2e7)], Targets(model({"k": 8e6}).modes), "finite differences")
    >>> "restarts" in fit_with_restarts(problem).status  # the first fit explains the data
    False
    """
    first = fit(problem, method, limit, least_influence=least_influence, free=free, start=start)
    assumed = problem.assumed
    if (first.converged and is_explained(first, assumed)) or not first.free:
        return first
    best, evaluations, tried = first, first.evaluations, 0
    for other in _starts(problem, first, restarts, spread, method, repeated=start is None):
        tried += 1
        try:
            result = fit(problem, method, free=first.free, start=other)
        except ToolpointError:
            # A start may lie where the model does not exist (no stable equilibrium); the count below tells of it.
            continue
        evaluations += result.evaluations
        # A minimum counts before a lower cost: what still falls is no answer yet.
        if (result.converged, -result.cost) > (best.converged, -best.cost):
            best = result
        if result.converged and is_explained(result, assumed):
            break
    status = best.status + f"; after {tried} restarts" if tried else best.status
    return replace(best, status=status, evaluations=evaluations, identifiability=first.identifiability,
                   left_alone=first.left_alone, start_chi_square=first.start_chi_square)


def _starts(
    problem: Problem, first: ParameterFit, restarts: int, spread: float, method: LeastSquares | None, *, repeated: bool
) -> Iterator[FloatArray]:
    """Yield starts; with `repeated` the problem's own start was the first one and is not tried again in the same way."""
    free_columns = [problem.names.index(n) for n in first.free]
    lower, upper = problem.bounds
    halton = qmc.Halton(len(free_columns), scramble=False).random(restarts + 1)[1:]
    ways = _ways(problem)
    for k in range(restarts):
        if repeated and k == 0 and ways[0] is None:
            continue
        x = problem.start
        if k >= len(ways):
            x[free_columns] = np.clip(spread * (2 * halton[k] - 1), lower[free_columns], upper[free_columns])
        way = ways[k % len(ways)]
        try:
            yield x if way is None else fit(way, method, free=first.free, start=x).x
        except ToolpointError:
            # This way in leads where the model does not exist; the next one is tried.
            continue


def _ways(problem: Problem) -> tuple[Problem | None, ...]:
    """Return the problems that lead near in turn (None: the problem itself): paired by frequency, frequencies alone."""
    with_modes = [t for t in problem.targets if t.modes is not None]
    if not with_modes:
        return (None,)
    other = problem.with_pairing(FREQUENCY_PAIRING_WEIGHT)
    if not all(t.frequency and (t.shape or t.mac) for t in with_modes) or len(with_modes) < len(problem.targets):
        return other, None
    frequencies_only = [replace(t, frf=None, damping=False, shape=False, mac=False, line_correlation=None,
                                channel_correlation=None) for t in problem.targets]
    return other, other.with_targets(frequencies_only), None
