"""The stages of an update: modes lead, responses on few lines follow, all lines end it; what is free is asked on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.updating import LeastSquares, ParameterFit, Problem, fit, fit_with_restarts, identifiability
from toolpoint.updating.fits.fit import is_explained
from toolpoint.updating.identifiability import Identifiability

_ROUNDS = 3


def fit_on_all_lines(task: Problem, few: Problem, method: LeastSquares | None, *, limit: float | None, least: float,
                     restarts: int, start: FloatArray | None) -> ParameterFit:
    """Return the fit of a problem, led to its end by `few`, the same problem on fewer lines (or itself).

    start : coordinates to which modes have led, None where nothing has; the rest as in `machine_update.update`.
    """
    # How much a parameter moves depends on where lines are close: it is asked of those that were measured.
    judge = _judge(task)
    result = None if start is None else _from_modes(few, method, limit, least, start, judge=judge)
    if result is None:
        result = fit_in_stages(few, method, limit, least=least, restarts=restarts, start=start, judge=judge)
    if few is task or not result.free:
        return result
    last = fit(task, method, free=result.free, start=result.x)
    before = float((task.evaluated(task.start).values ** 2).sum())
    return replace(last, evaluations=result.evaluations + last.evaluations, start_chi_square=before,
                   identifiability=result.identifiability, left_alone=result.left_alone)


def fit_in_stages(task: Problem, method: LeastSquares | None, limit: float | None, *, least: float, restarts: int,
                  start: FloatArray | None = None, judge: Problem | None = None) -> ParameterFit:
    """Return the fit through modes, logarithms of responses and what is asked for, with restarts of the first stage.

    judge : the problem that what is free is asked of; that of the logarithms where left out.
    """
    stages = _stages(task)
    if len(stages) == 1:
        return fit_with_restarts(stages[0], method, limit, least_influence=least, restarts=restarts)
    # What is free is decided before anything is moved, on the logarithmic responses: a narrow peak that moves by its width
    # would make every stiffness look far better known than it is.
    asked = stages[-2] if judge is None else judge
    verdict = None if limit is None else identifiability(asked, None, limit, least_influence=least)
    free = task.names if verdict is None else verdict.identifiable
    before = float((task.evaluated(task.start).values ** 2).sum())
    result = _first(stages[0], method, limit, least, free, restarts, start)
    rest = stages[1:] if all(t.frf is None for t in stages[0].targets) else stages
    result, now = _settled(rest, result, method, limit, least, judge=rest[0] if judge is None else judge)
    left = {} if now is None else now.reasons
    return replace(result, start_chi_square=before, identifiability=verdict, left_alone=left)


def _from_modes(task: Problem, method: LeastSquares | None, limit: float | None, least: float, start: FloatArray,
                *, judge: Problem) -> ParameterFit | None:
    """Return the fit from where modes have led, None where it does not explain the data.

    So near the end the logarithm is not needed: it would let lines of noise weigh as much as resonances. What is free is
    still asked of it.
    """
    verdict = None if limit is None else identifiability(judge, start, limit, least_influence=least)
    free = task.names if verdict is None else verdict.identifiable
    if not free:
        return None
    before = float((task.evaluated(task.start).values ** 2).sum())
    result, now = _settled([task], fit(task, method, free=free, start=start), method, limit, least, judge=judge)
    if not result.converged or not is_explained(result, task.assumed):
        return None
    return replace(result, start_chi_square=before, identifiability=verdict, left_alone={} if now is None else now.reasons)


def _settled(stages: Sequence[Problem], first: ParameterFit, method: LeastSquares | None, limit: float | None, least: float,
             *, judge: Problem) -> tuple[ParameterFit, Identifiability | None]:
    """Return the fit through the stages, from a first one, until what `judge` frees at its result is what was free in it."""
    result, evaluations, now, task = first, first.evaluations, None, stages[-1]
    free = result.free
    for _ in range(_ROUNDS):
        for stage in stages:
            result = fit(stage, method, free=free, start=result.x)
            evaluations += result.evaluations
        # Far from the measurement a damper may hide that shows near it: the same rule is asked again at the result.
        now = None if limit is None else identifiability(judge, result.x, limit, least_influence=least)
        if now is None or set(now.identifiable) == set(free):
            break
        free = now.identifiable
        result = replace(result, x=np.where([n in free for n in task.names], result.x, 0.0))
    else:
        result = fit(task, method, free=free, start=result.x)
        evaluations += result.evaluations
    return replace(result, evaluations=evaluations), now


def _first(
    task: Problem, method: LeastSquares | None, limit: float | None, least: float, free: tuple[str, ...], restarts: int,
    start: FloatArray | None,
) -> ParameterFit:
    if any(t.frf is not None for t in task.targets):
        return fit_with_restarts(task, method, free=free, restarts=min(restarts, 8), start=start)
    inner = None if limit is None else identifiability(task, None, limit, least_influence=least)
    some = tuple(n for n in free if inner is None or n in inner.identifiable)
    result = fit_with_restarts(task, method, free=some, restarts=restarts)
    if limit is None or not result.converged:
        return result
    again = identifiability(task, result.x, limit, least_influence=least).identifiable
    if set(again) <= set(some):
        return result
    more = fit(task, method, free=(*some, *(n for n in again if n not in some)), start=result.x)
    return replace(more, evaluations=result.evaluations + more.evaluations)


def _stages(task: Problem) -> list[Problem]:
    """Modes lead from far away; logarithms of the responses forgive shifted peaks; then everything as it is asked for."""
    if all(t.frf is None for t in task.targets):
        return [task]
    result = [_judge(task)]
    if any(t.frf is not None and t.frf_kind != "log" for t in task.targets):
        result.append(task)
    shaped = [k for k, t in enumerate(task.targets) if t.modes is not None]
    if shaped:
        only = [replace(t, frf=None, line_correlation=None, channel_correlation=None) if t.modes is not None else t
                for t in task.targets]
        result.insert(0, task.with_targets(only).with_sets(shaped))
    return result


def _judge(task: Problem) -> Problem:
    """Return the problem with logarithms of the responses, as it is where there are none."""
    return task.with_targets([t if t.frf is None else replace(t, frf_kind="log") for t in task.targets])
