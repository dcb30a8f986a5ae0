r"""Evidence for each change of a machine that could explain a drift.

Residuals of a hypothesis with the factor :math:`e^\theta`: of every mode's change of frequency,
:math:`\ln(f_l / f_b) - \ln(f(\theta) / f(0))`, and of the change of every entry of its shape. Their variances hold the noise of
both tests, the repeatability, and a share of the predicted change itself, because the machine's sensitivities are only as right
as the machine. The evidence is :math:`\int L(\theta) p(\theta) d\theta`, by Laplace's method about its largest value (MacKay,
Information Theory, Inference, and Learning Algorithms, 2003, chapter 27).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import chi2

from toolpoint._check import FloatArray, IndexArray
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.studies.drift.hypotheses import DriftModel, Hypothesis
from toolpoint.studies.drift.mode_changes import ModeChanges
from toolpoint.vibration import Modes
from toolpoint.vibration.correlation import assign_modes

MODEL_ERROR_FRACTION = 0.1  # of a predicted change: standard deviation by what the machine's numbers leave open
# That the machine's file does not tell which part moves which mode: of 140 random machines whose joint was named, 4 were wrong
# (benchmarks/studies/drift.py), with files 3 and 10 % off.
WRONG_MODEL_PROBABILITY = 0.05
# Two parts changed: their share before a test beside one part; how many of the likeliest are joined with all others
PAIR_WEIGHT, PAIR_LEADERS = 0.1, 3
MAX_PAIR_MISFIT = 0.99  # probability of larger residuals than one part leaves, above which no second is sought
_PAIR_STEP, _PAIR_EVALUATIONS = 0.5, 60  # of the search for both factors: deviations before the test; predictions
_MAX_DEVIATIONS = 4.0  # of the logarithm of a factor before the test: where it is sought
_START_COUNT = 9  # factors that the search begins between
_MIN_RESIDUAL_PROBABILITY = 1e-3  # below it a change does not explain what was measured
_LOG_FACTOR_STEP = 1e-3  # of the logarithm of a factor, for the curvature of the likelihood


@dataclass(frozen=True, eq=False)
class Explanation(NotebookText):
    """A change that explains a drift more or less.

    part, direction : see `Hypothesis`; factor : of its stiffness, mass, or of all frequencies; interval : its 95 % interval if
    this is what changed; probability : of this change among those looked at, if one of them happened; misfit : probability of
    residuals as large as what it leaves; second : of two parts that change together ("joint a and joint b"), factor and
    interval of the second.
    """

    part: str
    direction: str
    factor: float
    interval: tuple[float, float]
    probability: float
    misfit: float
    second: tuple[float, float, float] | None = None

    @property
    def fits(self) -> bool:
        """Whether this change alone explains what was measured."""
        return self.misfit >= _MIN_RESIDUAL_PROBABILITY

    @property
    def change_text(self) -> str:
        """Change by the factor in per cent: ``-15.2 %``."""
        return " and ".join(f"{100 * (factor - 1):+.1f} %" for factor in (self.factor, *(self.second or ())[:1]))

    @property
    def interval_text(self) -> str:
        """The 95 % interval of the change in per cent: ``-18.1 to -11.4 %``."""
        intervals = (self.interval, *([self.second[1:]] if self.second else []))
        return " and ".join(f"{100 * (lower - 1):+.1f} to {100 * (upper - 1):+.1f} %" for lower, upper in intervals)

    @property
    def words(self) -> str:
        """The change in words: ``joint feet, direction z``."""
        return f"{self.part}, direction {self.direction}" if self.direction else self.part

    def __repr__(self) -> str:
        return f"Explanation({self.words}: factor {self.factor:.3g}, probability {self.probability:.2g})"


@dataclass(frozen=True, eq=False)
class DriftData:
    """Measured changes of the modes that the model has as well.

    rows : modes of the baseline; model_modes : their modes of the model; change, variance : of log frequencies, (k,);
    turn, turn_variance : of shapes scaled to the baseline's, (n_dofs, k); scale : of the model's shapes to the baseline's,
    (k,).
    """

    rows: IndexArray
    model_modes: IndexArray
    change: FloatArray
    variance: FloatArray
    turn: FloatArray
    turn_variance: FloatArray
    scale: FloatArray


def gather_data(changes: ModeChanges, model: Modes, partner: IndexArray) -> DriftData:
    """Return the data of the modes that both tests and the model have.

    model : modes of the unchanged model at the Dofs of the tests; partner : (n_baseline,) of every mode of the baseline among
    them, -1 for none.
    """
    rows = np.flatnonzero((changes.partner >= 0) & (partner >= 0))
    first, second = changes.baseline.shape[:, rows], changes.current.shape[:, changes.partner[rows]]
    ratio = (first * second).sum(axis=0) / np.maximum((second**2).sum(axis=0), 1e-300)
    model_shape = model.shape[:, partner[rows]]
    scale = (first * model_shape).sum(axis=0) / np.maximum((model_shape**2).sum(axis=0), 1e-300)
    variance = (changes.repeatability.shape * np.abs(first).max(axis=0)) ** 2 * np.ones_like(first)
    of_tests = ((changes.baseline, rows, np.ones_like(ratio)), (changes.current, changes.partner[rows], ratio))
    for modes, picks, factor in of_tests:
        if modes.shape_variance is not None:
            variance = variance + modes.shape_variance[:, picks] * factor**2
    return DriftData(rows, partner[rows], changes.change[rows], changes.deviation[rows] ** 2, second * ratio - first, variance,
                     scale)


def weigh_hypotheses(model: DriftModel, data: DriftData) -> list[Explanation]:
    """Return every hypothesis of a model, and pairs of them, with its probability, the likeliest first."""
    nominal = model.modes()
    fits = [DriftFit.single(model, hypothesis, data, nominal=nominal) for hypothesis in model.hypotheses]
    fits += _fit_pairs(model, fits, data, nominal)
    logs = np.array([fit.log_evidence for fit in fits])
    shares, weights = np.exp(logs - logs.max()), np.array([fit.weight for fit in fits])
    # However clear the residuals are: where the machine's file is wrong, they say nothing.
    shares = (1 - WRONG_MODEL_PROBABILITY) * shares / shares.sum() + WRONG_MODEL_PROBABILITY * weights / weights.sum()
    explanations = [fit.explanation(float(share)) for fit, share in zip(fits, shares, strict=True)]
    return sorted(explanations, key=lambda e: -e.probability)


def _fit_pairs(model: DriftModel, singles: list[DriftFit], data: DriftData, nominal: Modes) -> list[DriftFit]:
    """Return fits of two parts that change together: each of the likeliest with every other part, in their likeliest ways."""
    best: dict[str, DriftFit] = {}
    for fit in sorted(singles, key=lambda each: -each.log_evidence):
        best.setdefault(fit.hypotheses[0].part, fit)
    parts = list(best)
    if best[parts[0]].misfit > MAX_PAIR_MISFIT:
        return []
    pairs = {frozenset((a, b)): (best[a], best[b]) for a in parts[:PAIR_LEADERS] for b in parts if a != b}
    return [DriftFit.pair(model, pair, data, nominal=nominal) for pair in pairs.values()]


@dataclass(frozen=True)
class DriftFit:
    """The largest posterior of one hypothesis, or of two together: logarithms of factors, their standard deviations."""

    hypotheses: tuple[Hypothesis, ...]
    thetas: FloatArray
    deviations: FloatArray
    log_evidence: float
    misfit: float

    @property
    def weight(self) -> float:
        """Share before the test."""
        weight = float(np.prod([hypothesis.weight for hypothesis in self.hypotheses]))
        return weight if len(self.hypotheses) == 1 else PAIR_WEIGHT * weight

    def explanation(self, probability: float) -> Explanation:
        """Return it in words and factors."""
        intervals = [_factor_interval(theta, NORMAL_QUANTILE_95 * deviation)
                     for theta, deviation in zip(self.thetas, self.deviations, strict=True)]
        first, second = intervals[0], intervals[1] if len(intervals) > 1 else None
        part = " and ".join(hypothesis.part for hypothesis in self.hypotheses)
        directions = [hypothesis.direction or "all" for hypothesis in self.hypotheses]
        direction = self.hypotheses[0].direction if second is None else (
            " and ".join(directions) if any(hypothesis.direction for hypothesis in self.hypotheses) else "")
        return Explanation(part, direction, first[0], first[1:], probability, self.misfit, second)

    @classmethod
    def single(cls, model: DriftModel, hypothesis: Hypothesis, data: DriftData, *, nominal: Modes) -> DriftFit:
        """Return the fit of one hypothesis."""
        def cost(theta: float) -> float:
            prediction = _predict(model.modes((hypothesis, float(theta))), data, nominal)
            return _cost(prediction, data) + (theta / hypothesis.deviation) ** 2 / 2

        # Shapes that exchange places make a likelihood with more than one hill: the best of a grid is refined.
        grid = hypothesis.deviation * np.linspace(-_MAX_DEVIATIONS, _MAX_DEVIATIONS, _START_COUNT)
        costs = [cost(theta) for theta in grid]
        k = int(np.argmin(costs))
        bounds = (grid[max(k - 1, 0)], grid[min(k + 1, _START_COUNT - 1)])
        # theta is the logarithm of a factor: 1e-5 of it is far below any interval that a test gives.
        theta = float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-5}).x)
        return cls._at(model, (hypothesis,), np.array([theta]), data, nominal)

    @classmethod
    def pair(cls, model: DriftModel, singles: tuple[DriftFit, DriftFit], data: DriftData, *, nominal: Modes) -> DriftFit:
        """Return the fit of two hypotheses together, by Nelder and Mead's method from where each is best alone."""
        hypotheses = tuple(fit.hypotheses[0] for fit in singles)
        prior = np.array([hypothesis.deviation for hypothesis in hypotheses])

        def cost(scaled: FloatArray) -> float:
            thetas = prior * scaled
            prediction = _predict(model.modes(*zip(hypotheses, thetas.tolist(), strict=True)), data, nominal)
            return _cost(prediction, data) + float((scaled**2).sum()) / 2

        start = np.array([singles[0].thetas[0] / prior[0], 0.0])
        simplex = start + np.array([[0.0, 0.0], [-_PAIR_STEP, 0.0], [0.0, -_PAIR_STEP]])
        thetas = prior * minimize(cost, start, method="Nelder-Mead",
                                  options={"xatol": 1e-3, "fatol": 1e-2, "maxfev": _PAIR_EVALUATIONS,
                                           "initial_simplex": simplex}).x
        return cls._at(model, hypotheses, thetas, data, nominal)

    @classmethod
    def _at(cls, model: DriftModel, hypotheses: tuple[Hypothesis, ...], thetas: FloatArray, data: DriftData, nominal: Modes
            ) -> DriftFit:
        """Return the evidence by the curvature at the largest posterior."""
        def residuals(values: FloatArray) -> FloatArray:
            return _residuals(_predict(model.modes(*zip(hypotheses, values.tolist(), strict=True)), data, nominal), data)

        prior = np.array([hypothesis.deviation for hypothesis in hypotheses])
        # Gauss-Newton curvature: second differences of a likelihood this narrow would be noise.
        steps = _LOG_FACTOR_STEP * prior
        slopes = np.array([(residuals(thetas + move) - residuals(thetas - move)) / (2 * step)
                           for move, step in zip(np.diag(steps), steps, strict=True)])
        curvature = slopes @ slopes.T + np.diag(prior**-2.0)
        remaining = residuals(thetas)
        prediction = _predict(model.modes(*zip(hypotheses, thetas.tolist(), strict=True)), data, nominal)
        cost = _cost(prediction, data) + float(((thetas / prior) ** 2).sum()) / 2
        misfit = float(chi2.sf((remaining**2).sum(), max(remaining.size - len(thetas), 1)))
        # The model's error is one for all modes alike: it does not average out over them as noise does.
        deviations = np.hypot(np.sqrt(np.diag(np.linalg.inv(curvature))), MODEL_ERROR_FRACTION * thetas)
        fit = cls(hypotheses, thetas, deviations, 0.0, misfit)
        log_evidence = np.log(fit.weight / prior.prod()) - cost - np.linalg.slogdet(curvature)[1] / 2
        return replace(fit, log_evidence=float(log_evidence))


def _predict(changed: Modes, data: DriftData, nominal: Modes) -> tuple[FloatArray, FloatArray]:
    """Return predicted changes of log frequency, (k,), and of shapes scaled to the baseline's, (n_dofs, k)."""
    # Modes of the changed model are found among the nominal ones as those of the later test among the baseline's.
    rows, columns, _ = assign_modes(nominal, changed)
    follower = np.empty(nominal.count, int)
    follower[rows] = columns
    picks = follower[data.model_modes]
    change = np.log(changed.frequency[picks] / nominal.frequency[data.model_modes])
    first, second = nominal.shape[:, data.model_modes], changed.shape[:, picks]
    ratio = (first * second).sum(axis=0) / np.maximum((second**2).sum(axis=0), 1e-300)
    return np.asarray(change), np.asarray((second * ratio - first) * data.scale)


def _variances(predicted: tuple[FloatArray, FloatArray], data: DriftData) -> tuple[FloatArray, FloatArray]:
    return (data.variance + (MODEL_ERROR_FRACTION * predicted[0]) ** 2,
            data.turn_variance + (MODEL_ERROR_FRACTION * predicted[1]) ** 2)


def _residuals(predicted: tuple[FloatArray, FloatArray], data: DriftData) -> FloatArray:
    """Return what a prediction leaves of all changes, over the deviations, (k + n_dofs k,)."""
    variances = _variances(predicted, data)
    return np.concatenate([(data.change - predicted[0]) / np.sqrt(variances[0]),
                           ((data.turn - predicted[1]) / np.sqrt(variances[1])).ravel()])


def _cost(predicted: tuple[FloatArray, FloatArray], data: DriftData) -> float:
    """Return minus the logarithm of the likelihood, without its constant."""
    variances = _variances(predicted, data)
    return float((_residuals(predicted, data) ** 2).sum() / 2 + sum(np.log(v).sum() for v in variances) / 2)


def _factor_interval(logarithm: float, half_width: float) -> tuple[float, float, float]:
    """Return a factor with the ends of its interval, of its logarithm and the half width of that."""
    return float(np.exp(logarithm)), float(np.exp(logarithm - half_width)), float(np.exp(logarithm + half_width))
