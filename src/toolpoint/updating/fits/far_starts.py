"""Starts over decades: where short fits end that begin far from a problem's start, in a space that Halton points fill.

A joint that is a hundred times stiffer in its file than on the machine moves no measured peak: from there no slope leads to it.
Points over decades are asked for their misfit, and short fits begin at the best of them. Each group of numbers is taken from
the fit that explains best what the group moves: two planes of a machine that know nothing of each other are then found each
by itself, not both at once by luck.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.stats import qmc

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.updating.fits.fit import fit
from toolpoint.updating.fits.fit_methods import LeastSquares
from toolpoint.updating.measured.targets import Targets
from toolpoint.updating.problem import Problem

# The search in the parameters' coordinates (from a factor 1/90 to 7: joints are softer than their files more often), points
# where the misfit is asked for a start, evaluations of each start.
MIN_SEARCH_COORDINATE, MAX_SEARCH_COORDINATE = -4.5, 2.0
POINTS_PER_START, EVALUATIONS_PER_START = 40, 60
# Deviations of the search by modes: wide, so that its valleys are.
SEARCH_FREQUENCY_SD, SEARCH_SHAPE_SD = 0.02, 0.1
MIN_DISTANCE_OF_ENDS = 0.1  # largest difference of coordinates from which two ends are two
MIN_OVERLAP_OF_ACTIONS = 0.01  # cosine of what two numbers do to the residuals, from which they are one group


def relax_targets(targets: Targets) -> Targets:
    """Return targets of which frequencies and shapes alone count, with wide deviations."""
    if targets.modes is None:
        return targets
    modes = replace(targets.modes, covariance=None, shape_variance=None)
    return replace(targets, modes=modes, damping=False, frequency_sd=SEARCH_FREQUENCY_SD, shape_sd=SEARCH_SHAPE_SD)


def find_far_ends(problem: Problem, names: Sequence[str], *, starts: int = 24) -> list[FloatArray]:
    """Return the ends of short fits of the named parameters from far starts, the best first, those that are one taken once."""
    columns = [problem.names.index(name) for name in names]
    ends: list[tuple[float, FloatArray]] = []
    for x in _far_points(problem, columns, starts):
        try:
            # Starts are only to be told apart: the best ones are fitted to the end afterwards.
            rough = fit(problem, LeastSquares(evaluations=EVALUATIONS_PER_START, tolerance=1e-4), free=tuple(names), start=x)
        except ToolpointError:  # the model does not exist there
            continue
        ends.append((rough.cost, rough.x))
    kept: list[FloatArray] = []
    for _, x in sorted(ends, key=lambda pair: pair[0]):
        if all(np.abs(x - other)[columns].max() > MIN_DISTANCE_OF_ENDS for other in kept):
            kept.append(x)
    return kept


def _far_points(problem: Problem, columns: Sequence[int], starts: int) -> list[FloatArray]:
    """Return the Halton points of least misfit."""
    lower, upper = problem.bounds
    points = []
    # Without random numbers: a file gives the same answer each time. The first Halton point is a corner.
    for row in qmc.Halton(len(columns), scramble=False).random(starts * POINTS_PER_START + 1)[1:]:
        x = problem.start
        coordinates = MIN_SEARCH_COORDINATE + (MAX_SEARCH_COORDINATE - MIN_SEARCH_COORDINATE) * row
        x[columns] = np.clip(coordinates, lower[columns], upper[columns])
        try:
            points.append((float((problem.evaluated(x).values ** 2).sum()), x))
        except ToolpointError:
            continue
    return [x for _, x in sorted(points, key=lambda pair: pair[0])[:starts]]


def compose_ends(problem: Problem, names: Sequence[str], ends: Sequence[FloatArray]) -> FloatArray | None:
    """Return the point that has each group of numbers from the end with the least misfit where the group acts; None of no end.

    Numbers that act on the same residuals are one group. Where a number acts is the square of its column of the Jacobian, the
    mean over the ends: at one of them it may be so stiff that it moves nothing.
    """
    columns = [problem.names.index(name) for name in names]
    usable_ends, misfits, actions = [], [], []
    for x in ends:
        try:
            residuals = problem.evaluated(x, slopes=True, columns=columns)
        except ToolpointError:  # the model exists at the end, its slopes do not
            continue
        assert residuals.jacobian is not None
        usable_ends.append(x)
        misfits.append(residuals.values ** 2)
        actions.append(residuals.jacobian ** 2)
    if not usable_ends:
        return None
    action = np.mean(actions, axis=0)
    # By length one each: the overlap of two numbers is then a cosine, whatever their sizes.
    action /= np.maximum(np.linalg.norm(action, axis=0), np.finfo(float).tiny)
    count, group_of = connected_components(action.T @ action > MIN_OVERLAP_OF_ACTIONS, directed=False)
    of_groups = np.stack([action[:, group_of == group].sum(axis=1) for group in range(count)])
    # Each residual belongs to the group that moves it most; each group takes the end that leaves least of its own.
    costs = np.array(misfits) @ (of_groups.argmax(axis=0)[:, None] == np.arange(count))
    composed = usable_ends[0].copy()
    for column, group in zip(columns, group_of, strict=True):
        composed[column] = usable_ends[int(costs[:, group].argmin())][column]
    return np.asarray(composed)
