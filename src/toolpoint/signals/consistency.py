r"""Hits that the others contradict: another spot, another direction, the opposite side, another gain.

Every hit gives a response :math:`H_i = X_i / F_i` of its own. How badly the response of one hit explains another's is

.. math:: d_{ij} = \frac{\sum |X_i - H_j F_i|^2}{\sum |X_i|^2},

the mean over channels, on lines where the force is not small. The hit that explains most of the others best stands for the
majority; those that agree with it are pooled, and every hit is compared with the pool less itself. What a factor of the pool
explains is a turned sign or another gain; the rest is another spot or direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.signals.hits import Hit, HitRules

EXCITED = 1e-2  # of the largest power of the force, on lines that are compared
TIMES = 6.0  # the usual misfit, above which a hit is left out
SCALED = 0.15  # misfit left by a factor, as share of the misfit without, up to which the factor explains it
Spectra = Sequence[tuple[ComplexArray, ComplexArray]]


@dataclass(frozen=True)
class Misfit:
    """How much of a hit's response the others leave unexplained, and with the best real factor (and that factor)."""

    share: float
    factor: float
    left: float

    @property
    def reason(self) -> str:
        """What the misfit looks like."""
        part = f"{100 * min(self.share, 9.99):.0f} % of its response is not explained by the other hits"
        if self.left < SCALED * self.share and self.factor < 0:
            return ("opposite direction: struck from the other side or one channel turned "
                    f"({part}; it is {self.factor:.2g} times theirs)")
        if self.left < SCALED * self.share:
            return (f"scaled: the response is {self.factor:.2g} times that of the other hits ({part}): struck at another spot "
                    "near by, in a direction that was tilted, or with another range or cable")
        return f"contradicts the other hits: struck at another spot or in another direction ({part})"


def compare_hits(hits: Sequence[Hit], spectra: Spectra, rules: HitRules
                 ) -> tuple[list[Hit], tuple[Doubt, ...]]:
    """Return the hits with those marked that contradict the majority, and a doubt where there is no majority.

    `spectra` : of every hit the force (n_f,) and the responses (n_f, n_channels).
    """
    good = [i for i, hit in enumerate(hits) if hit.accepted]
    if len(good) < 2:
        return list(hits), ()
    force, response = (np.array([spectra[i][k] for i in good]) for k in (0, 1))
    pairs = _misfits(force, response)
    limit = _limit(pairs[~np.eye(len(good), dtype=bool)], rules)
    if len(good) == 2:
        worst = float(pairs.max())
        if worst < max(rules.inconsistent, 0.05):
            return list(hits), ()
        return list(hits), (Doubt("hits", f"the two good ones contradict each other ({100 * min(worst, 9.99):.0f} % of the "
                                  "response to one is not explained by the other): nobody can tell which is right",
                                  "strike again", figure=worst),)
    agree = pairs < limit
    middle = int(np.argmax(agree.sum(axis=1) - np.median(pairs, axis=1) / max(float(np.median(pairs)), 1e-300) * 1e-3))
    inside = agree[middle] | (np.arange(len(good)) == middle)
    if 2 * inside.sum() <= len(good):
        return list(hits), (Doubt("hits", f"no majority among {len(good)} good ones: the largest group that agrees has "
                                  f"{int(inside.sum())}", "look at spot and direction and strike again"),)
    for _ in range(2):
        shares = [misfit(force, response, i, inside=inside) for i in range(len(good))]
        usual = float(np.median([shares[i].share for i in np.flatnonzero(inside)]))
        inside = np.array([fit.share < max(rules.inconsistent, TIMES * usual) for fit in shares])
    result = list(hits)
    for place, i in enumerate(good):
        if not inside[place]:
            result[i] = hits[i].rejected(shares[place].reason)
    return result, ()


def _limit(values: FloatArray, rules: HitRules) -> float:
    """Return the misfit of two hits that still agree: above the usual one of the better half of the pairs."""
    return max(rules.inconsistent, TIMES * float(np.quantile(values, 0.2)))


def _misfits(force: ComplexArray, response: ComplexArray) -> FloatArray:
    """Return d_ij of all pairs of hits; force (n, n_f), response (n, n_f, n_channels)."""
    power = np.abs(force) ** 2
    lines = power.mean(axis=0) > EXCITED * power.mean(axis=0).max()
    f, x = force[:, lines], response[:, lines]
    # In every own response small forces would blow up noise: regularised by a thousandth of the largest power.
    response = x * (f.conj() / (np.abs(f) ** 2 + 1e-3 * (np.abs(f) ** 2).max(axis=1, keepdims=True)))[:, :, None]
    size = np.maximum((np.abs(x) ** 2).sum(axis=1), 1e-300)
    result = np.empty((len(f), len(f)))
    for i in range(len(f)):
        left = (np.abs(x[i] - response * f[i][None, :, None]) ** 2).sum(axis=1)
        result[:, i] = (left / size[i]).mean(axis=1)
    np.fill_diagonal(result, 0.0)
    return result


def misfit(force: ComplexArray, response: ComplexArray, hit: int, *, inside: Array) -> Misfit:
    """Return the misfit of one hit with the pooled response of the others that are `inside`."""
    rest = np.asarray(inside).copy()
    rest[hit] = False
    power = (np.abs(force[rest]) ** 2).sum(axis=0)
    lines = power > EXCITED * power.max()
    cross = (response[rest][:, lines] * force[rest][:, lines].conj()[:, :, None]).sum(axis=0)
    model = cross / power[lines, None] * force[hit, lines, None]
    actual = response[hit, lines]
    size = np.maximum((np.abs(actual) ** 2).sum(axis=0), 1e-300)
    share = float(((np.abs(actual - model) ** 2).sum(axis=0) / size).mean())
    factor = float((model.conj() * actual / size).sum().real / max(float((np.abs(model) ** 2 / size).sum()), 1e-300))
    left = float(((np.abs(actual - factor * model) ** 2).sum(axis=0) / size).mean())
    return Misfit(share, factor, left)
