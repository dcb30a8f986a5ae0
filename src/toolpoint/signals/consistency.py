r"""Hits that the others contradict: another spot, another direction, the opposite side, another gain.

Every hit gives a response :math:`H_i = X_i / F_i` of its own. The misfit of one hit's response to another's motion is

.. math:: d_{ij} = \frac{\sum |X_i - H_j F_i|^2}{\sum |X_i|^2},

the mean over channels, on lines where the force is not small. The hit that explains most of the others best represents the
majority; those that agree with it are pooled, and every hit is compared with the pool less itself. A misfit that a factor of
the pool explains is a turned sign or another gain; any other is another spot or direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.signals.hits import Hit, HitRules

MIN_FORCE_POWER = 1e-2  # of the largest power of the force, on lines that are compared
MAX_MISFIT_RATIO = 6.0  # misfit over the usual one: above, a hit is left out
MAX_SCALED_MISFIT = 0.15  # misfit after a factor over that without: up to this the factor explains it
Spectra = Sequence[tuple[ComplexArray, ComplexArray]]


@dataclass(frozen=True)
class Misfit:
    """Misfit of a hit with the pooled response of the others.

    share : of the response's power that they do not explain; factor : best real factor on theirs; left : share that remains
    with it.
    """

    share: float
    factor: float
    left: float

    @property
    def reason(self) -> str:
        """Probable cause of the misfit, in words."""
        part = f"{100 * min(self.share, 9.99):.0f} % of its response is not explained by the other hits"
        if self.left < MAX_SCALED_MISFIT * self.share and self.factor < 0:
            return ("opposite direction: struck from the other side or one channel turned "
                    f"({part}; it is {self.factor:.2g} times theirs)")
        if self.left < MAX_SCALED_MISFIT * self.share:
            return (f"scaled: the response is {self.factor:.2g} times that of the other hits ({part}): struck at another spot "
                    "near by, in a direction that was tilted, or with another range or cable")
        return f"contradicts the other hits: struck at another spot or in another direction ({part})"


def compare_hits(hits: Sequence[Hit], spectra: Spectra, rules: HitRules
                 ) -> tuple[list[Hit], tuple[Doubt, ...]]:
    """Return the hits with those marked that contradict the majority, and a doubt where there is no majority.

    `spectra` : of every hit the force (n_f,) and the responses (n_f, n_channels).
    """
    accepted = [i for i, hit in enumerate(hits) if hit.accepted]
    if len(accepted) < 2:
        return list(hits), ()
    force, response = (np.array([spectra[i][k] for i in accepted]) for k in (0, 1))
    pairs = _misfits(force, response)
    limit = _limit(pairs[~np.eye(len(accepted), dtype=bool)], rules)
    if len(accepted) == 2:
        largest_misfit = float(pairs.max())
        if largest_misfit < max(rules.inconsistent, 0.05):
            return list(hits), ()
        return list(hits), (Doubt("hits",
                                  f"the two good ones contradict each other ({100 * min(largest_misfit, 9.99):.0f} % of the "
                                  "response to one is not explained by the other): nobody can tell which is right",
                                  "strike again", figure=largest_misfit),)
    agrees = pairs < limit
    reference = int(np.argmax(agrees.sum(axis=1) - np.median(pairs, axis=1) / max(float(np.median(pairs)), 1e-300) * 1e-3))
    is_pooled = agrees[reference] | (np.arange(len(accepted)) == reference)
    if 2 * is_pooled.sum() <= len(accepted):
        return list(hits), (Doubt("hits", f"no majority among {len(accepted)} good ones: the largest group that agrees has "
                                  f"{int(is_pooled.sum())}", "look at spot and direction and strike again"),)
    for _ in range(2):
        misfits = [misfit(force, response, i, is_pooled=is_pooled) for i in range(len(accepted))]
        usual_misfit = float(np.median([misfits[i].share for i in np.flatnonzero(is_pooled)]))
        is_pooled = np.array([fit.share < max(rules.inconsistent, MAX_MISFIT_RATIO * usual_misfit) for fit in misfits])
    result = list(hits)
    for place, i in enumerate(accepted):
        if not is_pooled[place]:
            result[i] = hits[i].rejected(misfits[place].reason)
    return result, ()


def _limit(misfits: FloatArray, rules: HitRules) -> float:
    """Return the misfit up to which two hits agree, from the 20 % quantile of all pairs."""
    # Against the good hits of this test: a fifth is taken as good, so that up to four fifths may be bad.
    return max(rules.inconsistent, MAX_MISFIT_RATIO * float(np.quantile(misfits, 0.2)))


def _misfits(force: ComplexArray, response: ComplexArray) -> FloatArray:
    """Return d_ij of all pairs of hits; force (n, n_f), response (n, n_f, n_channels)."""
    power = np.abs(force) ** 2
    lines = power.mean(axis=0) > MIN_FORCE_POWER * power.mean(axis=0).max()
    f, x = force[:, lines], response[:, lines]
    # In the response of a single hit small forces would amplify noise: regularised by a thousandth of the largest power.
    response = x * (f.conj() / (np.abs(f) ** 2 + 1e-3 * (np.abs(f) ** 2).max(axis=1, keepdims=True)))[:, :, None]
    power_of_hit = np.maximum((np.abs(x) ** 2).sum(axis=1), 1e-300)
    result = np.empty((len(f), len(f)))
    for i in range(len(f)):
        residual = (np.abs(x[i] - response * f[i][None, :, None]) ** 2).sum(axis=1)
        result[:, i] = (residual / power_of_hit[i]).mean(axis=1)
    np.fill_diagonal(result, 0.0)
    return result


def misfit(force: ComplexArray, response: ComplexArray, hit: int, *, is_pooled: Array) -> Misfit:
    """Return the misfit of one hit with the pooled H1 response of the other hits in the pool."""
    others = np.asarray(is_pooled).copy()
    others[hit] = False
    power = (np.abs(force[others]) ** 2).sum(axis=0)
    lines = power > MIN_FORCE_POWER * power.max()
    cross = (response[others][:, lines] * force[others][:, lines].conj()[:, :, None]).sum(axis=0)
    model = cross / power[lines, None] * force[hit, lines, None]
    actual = response[hit, lines]
    scale = np.maximum((np.abs(actual) ** 2).sum(axis=0), 1e-300)
    share = float(((np.abs(actual - model) ** 2).sum(axis=0) / scale).mean())
    factor = float((model.conj() * actual / scale).sum().real / max(float((np.abs(model) ** 2 / scale).sum()), 1e-300))
    remaining = float(((np.abs(actual - factor * model) ** 2).sum(axis=0) / scale).mean())
    return Misfit(share, factor, remaining)
