r"""Identifiability: which parameters the data can tell, before any is moved.

With the Jacobian J of the weighted residuals to the parameters' coordinates x (ln p, or p over its scale):

1. influence of a parameter: the length of its column, :math:`\|J_j\|`, the number of standard deviations by which the
   data move per unit of x;
2. the parameters are taken in the order of a QR decomposition with column pivoting (the largest influence that the
   ones before cannot imitate comes first); :math:`1/|R_{jj}|` is the standard deviation of x_j with those before known;
3. taken while that deviation is at most `limit` and the influence at least `least_influence` of the
   largest of its kind (stiffness, damping, mass);
4. of the taken ones the deviations with all of them free are the roots of the diagonal of :math:`(J^T J)^{-1}`; while any is
   above `limit`, the last taken is dropped.

Sources: Golub, Klema, Stewart, Rank degeneracy and least squares problems, 1976 (subset selection); Friswell, Mottershead,
Finite Element Model Updating in Structural Dynamics, 1995, ch. 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from toolpoint._check import FloatArray, positive
from toolpoint._notebook import NotebookText
from toolpoint.updating.problem import Problem


@dataclass(frozen=True, eq=False)
class Identifiability(NotebookText):
    """Parameters that the data determine, and why the others are not determined.

    names : the parameters; groups : what each belongs to; influence : (n,), standard deviations of the data per unit of x;
    deviation : (n,), standard deviation of x with all identifiable parameters free (of those left out: with the identifiable
    ones free beside each); singular_values : (n,) of J with unit columns; correlations : (n, n) of all parameters free;
    identifiable : names, in order of selection; reasons : why each of the others is not; rule : in words.

    >>> from toolpoint.updating import Parameter, Prediction, Problem, Targets
    >>> from toolpoint.vibration import Modes
    >>> def model(values, names=()):  # a mass of 2 kg on a spring
    ...     return Prediction(Modes([np.sqrt(values["k"] / 2.0) / (2 * np.pi)], [0.01], [[1.0]], ["tool:+x"]))
    >>> problem = Problem(model, [Parameter("k", 5e6, 1e6, 2e7)], Targets(model({"k": 8e6}).modes), "finite differences")
    >>> identifiability(problem).group_ranking[0][0]
    'k'
    """

    names: tuple[str, ...]
    groups: tuple[str, ...]
    influence: FloatArray
    deviation: FloatArray
    singular_values: FloatArray
    correlations: FloatArray
    identifiable: tuple[str, ...]
    reasons: dict[str, str]
    rule: str

    @property
    def group_ranking(self) -> tuple[tuple[str, float], ...]:
        """Groups (interfaces, parts) with the root of the summed squares of influence, largest first."""
        total: dict[str, float] = {}
        for group, value in zip(self.groups, self.influence, strict=True):
            total[group] = total.get(group, 0.0) + float(value) ** 2
        return tuple(sorted(((g, v**0.5) for g, v in total.items()), key=lambda item: -item[1]))

    def table(self) -> str:
        """Return rank, influence, deviation and verdict of every parameter, and the ranking of the groups, as text."""
        width = max(len(n) for n in self.names)
        largest_influence = max(float(self.influence.max()), 1e-300)
        lines = [f"Identifiability: {self.rule}", f"{'parameter':{width}}  influence  relative  deviation  verdict"]
        for i in np.argsort(-self.influence, kind="stable"):
            name = self.names[i]
            verdict = "identifiable" if name in self.identifiable else "left alone: " + self.reasons[name]
            lines.append(f"{name:{width}} {self.influence[i]:10.4g} {self.influence[i] / largest_influence:9.4f} "
                         f"{self.deviation[i]:10.3g}  {verdict}")
        lines.append("groups by influence: " + ", ".join(f"{g} {v:.4g}" for g, v in self.group_ranking))
        lines.append("singular values (unit columns): " + " ".join(f"{s:.3g}" for s in self.singular_values))
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"Identifiability({len(self.identifiable)} of {len(self.names)} parameters can be told by the data)"


def identifiability(
    problem: Problem, x: FloatArray | None = None, limit: float = 0.5, *, least_influence: float = 0.02
) -> Identifiability:
    """Return what the data can tell about the parameters at x (the start where left out), by the rule of this module.

    Parameters
    ----------
    problem : Problem
    x : (n,) floats, optional
    limit : float
        Largest standard deviation in x: 0.5 is about a factor of 1.6 for parameters on a logarithmic scale.
    least_influence : float
        Smallest influence as part of the largest. What moves the data less is within what any real model gets wrong
        elsewhere, and would only take up those errors.

    >>> from toolpoint.updating import Parameter, Prediction, Targets
    >>> from toolpoint.vibration import Modes
    >>> def model(values, names=()):  # two springs side by side
    ...     return Prediction(Modes([np.sqrt(values["a"] + values["b"]) / (2 * np.pi)], [0.01], [[1.0]], ["tool:+x"]))
    >>> measured = Targets(model({"a": 4e6, "b": 4e6}).modes)
    >>> problem = Problem(model, [Parameter("a", 4e6), Parameter("b", 4e6)], measured, "finite differences")
    >>> len(identifiability(problem).identifiable)  # one frequency tells their sum alone
    1
    """
    positive("limit", limit)
    chosen = problem.start if x is None else x
    jacobian = problem.evaluated(chosen, slopes=True).jacobian
    assert jacobian is not None
    jacobian = _triangle_of(jacobian)
    influence = np.linalg.norm(jacobian, axis=0)
    share = influence / _largest(problem, influence)
    order = _selected(jacobian, share, limit, least_influence)
    deviation = _deviations(jacobian, order)
    names = problem.names
    reasons = {names[j]: _reason(influence[j], share[j], deviation[j], limit, least_influence)
               for j in range(len(names)) if j not in order}
    unit = jacobian / np.maximum(influence, 1e-300)
    rule = (f"taken by influence that others cannot imitate while the standard deviation stays below {limit:g} and the "
            f"influence above {100 * least_influence:g} % of the largest of its kind")
    return Identifiability(names, tuple(p.group for p in problem.parameters), influence, deviation,
                           np.linalg.svd(unit, compute_uv=False), correlations(unit),
                           tuple(names[j] for j in order), reasons, rule)


def _triangle_of(jacobian: FloatArray) -> FloatArray:
    """Return as few rows as columns with the same J^T J, which is all that is asked of them; few rows as they are."""
    return jacobian if len(jacobian) <= 4 * jacobian.shape[1] else np.asarray(np.linalg.qr(jacobian, mode="r"))


def correlations(jacobian: FloatArray) -> FloatArray:
    """Return the correlations of the estimates, (n, n); from the pseudo-inverse where the Jacobian is rank deficient."""
    covariance = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    sd = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return np.asarray(covariance / np.outer(sd, sd))


def _largest(problem: Problem, influence: FloatArray) -> FloatArray:
    kinds = [p.kind for p in problem.parameters]
    largest_influence = {kind: max(float(v) for k, v in zip(kinds, influence, strict=True) if k == kind) for kind in kinds}
    return np.array([max(largest_influence[kind], 1e-300) for kind in kinds])


def _selected(jacobian: FloatArray, share: FloatArray, limit: float, least_of_kind: float) -> list[int]:
    able = np.flatnonzero(share >= least_of_kind)
    if able.size == 0:
        return []
    triangle, pivot = qr(jacobian[:, able], mode="r", pivoting=True)
    size = np.abs(np.diag(triangle))
    order = [int(able[j]) for j, r in zip(pivot, size, strict=False) if r * limit >= 1]
    while order and (_deviations(jacobian, order)[order] > limit).any():
        order.pop()
    return order


def _deviations(jacobian: FloatArray, order: list[int]) -> FloatArray:
    """Return standard deviations with the parameters of `order` free, of the others with each one of them free beside these."""
    result = np.full(jacobian.shape[1], np.inf)
    basis = np.zeros((jacobian.shape[0], 0))
    if order:
        basis, triangle = np.linalg.qr(jacobian[:, order])
        if (np.abs(np.diag(triangle)) > 1e-300).all():
            result[order] = np.linalg.norm(np.linalg.inv(triangle), axis=1)
    for j in set(range(jacobian.shape[1])) - set(order):
        others = jacobian[:, j] - basis @ (basis.T @ jacobian[:, j])
        size, length = float(np.linalg.norm(others)), float(np.linalg.norm(jacobian[:, j]))
        # What is left of a column behind the others is rounding: the parameter follows from them, and has no interval.
        result[j] = 1 / size if size > 1e-10 * max(length, 1e-300) else np.inf
    return result


def _reason(influence: float, share: float, deviation: float, limit: float, least_of_kind: float) -> str:
    if influence == 0:
        return "the data do not depend on it"
    if share < least_of_kind:
        return f"influence {100 * share:.2g} % of the largest of its kind"
    if influence * limit >= 1:
        return "the parameters taken before it imitate its effect"
    return f"deviation {deviation:.2g} is above {limit:g}"
