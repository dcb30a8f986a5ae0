r"""Effect of parameters that were left alone on those that were fitted, where their values are wrong.

A fit takes them as exact, and so do its intervals. With the Jacobian :math:`(J_f, J_l)` of free and left-alone coordinates at
the result, an error :math:`\delta_l` of the latter moves the former by :math:`-(J_f^T J_f)^{-1} J_f^T J_l \delta_l`.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import positive
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.problem import Problem

_MOST_NAMED = 3


def name_effects(problem: Problem, fit: ParameterFit, share: float = 0.2) -> tuple[str, ...]:
    """Return a sentence for every parameter left alone that moves a fitted one by more than its standard deviation.

    Parameters
    ----------
    problem, fit : Problem, ParameterFit
    share : float
        By how much a parameter left alone may be off, as a part of itself.
    """
    positive("share", share)
    left_alone = [name for name in problem.names if name in fit.left_alone]
    if not fit.free or not left_alone:
        return ()
    columns = [problem.names.index(name) for name in (*fit.free, *left_alone)]
    jacobian = problem.evaluated(fit.x, slopes=True, columns=columns).jacobian
    assert jacobian is not None
    count = len(fit.free)
    moved = -np.linalg.lstsq(jacobian[:, :count], jacobian[:, count:], rcond=None)[0]
    deviation = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
    lines = []
    for k, name in enumerate(left_alone):
        parameter = problem.parameters[problem.names.index(name)]
        # A share of the value in the coordinate that the parameter moves on.
        error = np.log1p(share) if parameter.log else share * abs(parameter.value) / max(abs(parameter.slope(0.0)), 1e-300)
        effect = error * moved[:, k]
        affected = [i for i in np.argsort(-np.abs(effect) / deviation)[:_MOST_NAMED] if abs(effect[i]) > deviation[i]]
        if affected:
            changed = ", ".join(f"{fit.free[i]} moves by {abs(effect[i]) / deviation[i]:.2g} of its standard deviations"
                                for i in affected)
            lines.append(f"{name} is left alone and taken as exact: if it is {100 * share:.0f} % off, {changed}; intervals "
                         "do not hold that")
    return tuple(lines)
