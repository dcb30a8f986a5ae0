"""Stages of an update: modes lead, responses on few lines follow, all lines end it; identifiability is judged in between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.updating import LeastSquares, ParameterFit, Problem, fit, fit_with_restarts, identifiability
from toolpoint.updating.fits.far_starts import compose_ends, find_far_ends, relax_targets
from toolpoint.updating.fits.fit import is_explained
from toolpoint.updating.identifiability import Identifiability

MAX_FAR_ENDS = 4  # ends of far starts that are fitted whole
FAR_START_WORDS = "; from a start far from the file's values"
_MAX_STAGE_ROUNDS = 3  # repeats of the stages until the set of free parameters stays


def fit_on_all_lines(task: Problem, thinned: Problem, method: LeastSquares | None, *, limit: float | None,
                     least_influence: float,
                     restarts: int, start: FloatArray | None) -> ParameterFit:
    """Return the fit of a problem, led to its end by `thinned`, the same problem on fewer lines (or itself).

    start : coordinates to which modes have led, None where nothing has; the rest as in `machine_update.update`.
    """
    # How much a parameter moves depends on where lines are close: it is computed on those that were measured.
    judge = _logarithmic_problem(task)
    result = None if start is None else _fit_from_modes(thinned, method, limit, least_influence, start, judge=judge)
    if result is None:
        result = fit_in_stages(thinned, method, limit, least_influence=least_influence, restarts=restarts, start=start,
                               judge=judge)
    if thinned is task or not result.free:
        return result
    return _carried_over(task, result, method)


def fit_from_afar(task: Problem, thinned: Problem, result: ParameterFit, *, method: LeastSquares | None,
                  limit: float | None, least_influence: float) -> ParameterFit:
    """Return the fit, or where it does not explain the data the best of those that begin at far starts.

    A joint that is a hundred times stiffer in its file moves no peak, and no slope leads from there; far from the truth shapes
    lead into other minima. Far starts follow the logarithms of the responses on few lines, or frequencies and shapes with wide
    deviations where there are modes alone. task, thinned : as in `fit_on_all_lines`.
    """
    names = [name for name in task.names if ".stiffness" in name]
    if not names or (result.converged and is_explained(result, task.assumed)):
        return result
    judge = _logarithmic_problem(thinned)
    search = judge if any(targets.frf is not None for targets in task.targets) else (
        task.with_targets([relax_targets(targets) for targets in task.targets]))
    ends = find_far_ends(search, names)
    composed = compose_ends(search, names, ends)
    best = result
    for start in ([] if composed is None else [composed]) + ends[:MAX_FAR_ENDS]:
        other = _fit_from_modes(thinned, method, limit, least_influence, start, judge=judge, stages=(judge, thinned))
        if other is None:
            continue
        other = other if thinned is task else _carried_over(task, other, method)
        if other.converged and (not best.converged or other.chi_square < best.chi_square):
            best = replace(other, status=other.status + FAR_START_WORDS)
    return best


def _carried_over(task: Problem, led: ParameterFit, method: LeastSquares | None) -> ParameterFit:
    """Return the fit on all lines from the end of that on few."""
    last = fit(task, method, free=led.free, start=led.x)
    start_misfit = float((task.evaluated(task.start).values ** 2).sum())
    return replace(last, evaluations=led.evaluations + last.evaluations, start_chi_square=start_misfit,
                   identifiability=led.identifiability, left_alone=led.left_alone)


def fit_in_stages(task: Problem, method: LeastSquares | None, limit: float | None, *, least_influence: float, restarts: int,
                  start: FloatArray | None = None, judge: Problem | None = None) -> ParameterFit:
    """Return the fit through modes, logarithms of responses and the stated targets, with restarts of the first stage.

    judge : the problem that what is free is asked of; that of the logarithms where left out.
    """
    stages = _stages(task)
    if len(stages) == 1:
        return fit_with_restarts(stages[0], method, limit, least_influence=least_influence, restarts=restarts)
    # What is free is decided before anything is moved, on the logarithmic responses: a narrow peak that moves by its width
    # would make every stiffness look far better known than it is.
    judged = stages[-2] if judge is None else judge
    verdict = None if limit is None else identifiability(judged, None, limit, least_influence=least_influence)
    free = task.names if verdict is None else verdict.identifiable
    start_misfit = float((task.evaluated(task.start).values ** 2).sum())
    result = _fit_first_stage(stages[0], method, limit, least_influence, free, restarts, start)
    later_stages = stages[1:] if all(t.frf is None for t in stages[0].targets) else stages
    result, now = _repeat_stages(later_stages, result, method, limit, least_influence,
                                 judge=later_stages[0] if judge is None else judge)
    left_alone = {} if now is None else now.reasons
    return replace(result, start_chi_square=start_misfit, identifiability=verdict, left_alone=left_alone)


def _fit_from_modes(task: Problem, method: LeastSquares | None, limit: float | None, least_influence: float, start: FloatArray,
                    *, judge: Problem, stages: Sequence[Problem] = ()) -> ParameterFit | None:
    """Return the fit from the coordinates to which modes led, None where it does not explain the data.

    So near the end the logarithm is not needed: it would let lines of noise weigh as much as resonances. What is free is
    still asked of it.
    """
    verdict = None if limit is None else identifiability(judge, start, limit, least_influence=least_influence)
    free = task.names if verdict is None else verdict.identifiable
    if not free:
        return None
    start_misfit = float((task.evaluated(task.start).values ** 2).sum())
    first = fit(task, method, free=free, start=np.where([name in free for name in task.names], start, 0.0))
    result, now = _repeat_stages(stages or [task], first, method, limit, least_influence, judge=judge)
    if not result.converged or not is_explained(result, task.assumed):
        return None
    return replace(result, start_chi_square=start_misfit, identifiability=verdict,
                   left_alone={} if now is None else now.reasons)


def _repeat_stages(stages: Sequence[Problem], first: ParameterFit, method: LeastSquares | None, limit: float | None,
                   least_influence: float,
                   *, judge: Problem) -> tuple[ParameterFit, Identifiability | None]:
    """Return the fit through the stages, repeated until `judge` frees the same parameters at the result."""
    result, evaluations, now, task = first, first.evaluations, None, stages[-1]
    free = result.free
    for _ in range(_MAX_STAGE_ROUNDS):
        for stage in stages:
            result = fit(stage, method, free=free, start=result.x)
            evaluations += result.evaluations
        # Far from the measurement a damper may hide that shows near it: the same rule is applied again at the result.
        now = None if limit is None else identifiability(judge, result.x, limit, least_influence=least_influence)
        if now is None or set(now.identifiable) == set(free):
            break
        free = now.identifiable
        result = replace(result, x=np.where([n in free for n in task.names], result.x, 0.0))
    else:
        result = fit(task, method, free=free, start=result.x)
        evaluations += result.evaluations
    return replace(result, evaluations=evaluations), now


def _fit_first_stage(
    task: Problem, method: LeastSquares | None, limit: float | None, least_influence: float, free: tuple[str, ...],
    restarts: int,
    start: FloatArray | None,
) -> ParameterFit:
    if any(t.frf is not None for t in task.targets):
        return fit_with_restarts(task, method, free=free, restarts=min(restarts, 8), start=start)
    mode_verdict = None if limit is None else identifiability(task, None, limit, least_influence=least_influence)
    chosen = tuple(n for n in free if mode_verdict is None or n in mode_verdict.identifiable)
    result = fit_with_restarts(task, method, free=chosen, restarts=restarts)
    if limit is None or not result.converged:
        return result
    identifiable = identifiability(task, result.x, limit, least_influence=least_influence).identifiable
    if set(identifiable) <= set(chosen):
        return result
    extended = fit(task, method, free=(*chosen, *(n for n in identifiable if n not in chosen)), start=result.x)
    return replace(extended, evaluations=result.evaluations + extended.evaluations)


def _stages(task: Problem) -> list[Problem]:
    """Return the stages: modes lead from far away, logarithms of responses forgive shifted peaks, then the stated targets."""
    if all(t.frf is None for t in task.targets):
        return [task]
    result = [_logarithmic_problem(task)]
    if any(t.frf is not None and t.frf_kind != "log" for t in task.targets):
        result.append(task)
    shaped = [k for k, t in enumerate(task.targets) if t.modes is not None]
    if shaped:
        only = [replace(t, frf=None, line_correlation=None, channel_correlation=None) if t.modes is not None else t
                for t in task.targets]
        result.insert(0, task.with_targets(only).with_sets(shaped))
    return result


def _logarithmic_problem(task: Problem) -> Problem:
    """Return the problem with logarithms of the responses, as it is where there are none."""
    return task.with_targets([t if t.frf is None else replace(t, frf_kind="log") for t in task.targets])
