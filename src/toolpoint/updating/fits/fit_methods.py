"""Methods of a fit as small objects: least squares, regularised towards the start, and Bayesian."""

from __future__ import annotations

from dataclasses import dataclass

from toolpoint._check import count, fail, one_of, positive

ALGORITHMS = ("trf", "dogbox", "lm")
LOSSES = ("linear", "soft_l1", "huber", "cauchy")


@dataclass(frozen=True)
class LeastSquares:
    """Weighted least squares. algorithm: ``trf``, ``dogbox`` (bounded) or ``lm``; loss: ``linear`` or a robust one."""

    algorithm: str = "trf"
    loss: str = "linear"
    evaluations: int = 200
    tolerance: float = 1e-9

    def __post_init__(self) -> None:
        one_of("algorithm", self.algorithm, ALGORITHMS)
        one_of("loss", self.loss, LOSSES)
        count("evaluations", self.evaluations)
        positive("tolerance", self.tolerance, 0.1)
        if self.algorithm == "lm" and self.loss != "linear":
            fail("loss", self.loss, "lm knows only 'linear'", remedy="use algorithm='trf'")


@dataclass(frozen=True)
class Regularised(LeastSquares):
    """Least squares with a pull towards the start: strength 1 counts a change by e (a scale) as one standard deviation.

    >>> Regularised(strength=0.1).algorithm  # a weak pull, otherwise as least squares
    'trf'
    """

    strength: float = 1.0


@dataclass(frozen=True)
class Bayesian(LeastSquares):
    """Maximum of the posterior with every parameter's normal prior, and Laplace's covariance about it.

    >>> Bayesian(loss="soft_l1").loss  # outliers count less; the priors are those of the parameters
    'soft_l1'
    """
