"""Weights of a project's draws after cuts that were tried: likelihood of stable, chatter and its frequency; contradictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt
from toolpoint.cutting.advice.probability import OUTCOME_RELIABILITY
from toolpoint.machine.description.project_plan import TriedCut
from toolpoint.project.limits.drawn_limits import CutQuestion, DrawnLimits, draw_limits
from toolpoint.project.limits.systems import DrawnSystems
from toolpoint.studies.cuts.uncertain_cut import MIN_OUTCOME_LIKELIHOOD

HEARD_FREQUENCY_DEVIATION = 0.01  # relative, of a chatter frequency that was heard: a line of a spectrum, and the model's own
STRAY_FREQUENCY_PROBABILITY = 0.05  # that a heard frequency is not that of the chatter (another line of the spectrum)
STRAY_FREQUENCY_SPREAD = 1.0  # relative width over which a stray frequency may lie
MIN_EFFECTIVE_DRAWS = 15.0  # below, intervals rest on too few draws


@dataclass(frozen=True, eq=False)
class WeighedDraws:
    """Weights of the draws after tried cuts, and the doubts about them; likelihoods : of every cut's outcome before it."""

    weights: FloatArray
    likelihoods: tuple[float, ...] = ()
    doubts: tuple[Doubt, ...] = ()

    @property
    def effective(self) -> float:
        """Number of equal draws that say as much."""
        return 1 / float((self.weights**2).sum())


def weigh_draws(systems: DrawnSystems, tried: Sequence[TriedCut], questions: Mapping[str, CutQuestion]) -> WeighedDraws:
    """Return the weights of the draws after cuts that were tried; questions : the cuts of the project by name."""
    outcomes = [_hear(systems, cut, _question(cut, questions)) for cut in tried]
    doubts, likelihoods = [doubt for outcome in outcomes for doubt in outcome.doubts], list[float]()
    for number, (cut, outcome) in enumerate(zip(tried, outcomes, strict=True)):
        others = _weights([other.likelihood for k, other in enumerate(outcomes) if k != number], systems.count)
        # The smaller of that before any cut and that beside all the others: cuts may contradict each other alone.
        share = min(float(outcome.agrees.mean()), float(others @ outcome.agrees))
        likelihoods.append(share)
        if share < MIN_OUTCOME_LIKELIHOOD:
            doubts.append(_contradiction(cut, share))
    weights = _weights([outcome.likelihood for outcome in outcomes], systems.count)
    effective = 1 / float((weights**2).sum())
    if tried and effective < MIN_EFFECTIVE_DRAWS:
        doubts.append(Doubt("tried cuts", f"only {effective:.0f} of {systems.count} draws agree with them: intervals rest "
                            "on these few", "take more draws (draws: in project.yaml), or look at what the cuts say"))
    return WeighedDraws(weights, tuple(likelihoods), tuple(dict.fromkeys(doubts)))


@dataclass(frozen=True, eq=False)
class _HeardCut:
    """Likelihood of a tried cut's outcome for every draw, and the chance that it gives stable or chatter as it was."""

    likelihood: FloatArray
    agrees: FloatArray
    doubts: tuple[Doubt, ...]


def _weights(likelihoods: Sequence[FloatArray], count: int) -> FloatArray:
    """Return the weights of draws by the product of likelihoods."""
    product = np.prod([np.ones(count), *likelihoods], axis=0)
    return np.asarray(product / product.sum())


def _question(cut: TriedCut, questions: Mapping[str, CutQuestion]) -> CutQuestion:
    """Return the question that a tried cut answers."""
    name = cut.cut or (next(iter(questions)) if len(questions) == 1 else "")
    if name not in questions:
        fail("tried.cut", repr(cut.cut), f"must be one of {', '.join(questions) or 'the cuts of project.yaml, which has none'}")
    stated = questions[name]
    return CutQuestion(name, stated.cut, stated.deviation, (cut.speed,), cut.pose or stated.pose, cut.depth)


def _hear(systems: DrawnSystems, cut: TriedCut, question: CutQuestion) -> _HeardCut:
    """Return what a tried cut says about the draws, with the doubt where its frequency is none of the model's."""
    limits = draw_limits(systems, question)
    agrees = limits.stable[:, 0] if cut.stable else 1 - limits.stable[:, 0]
    likelihood = 1 - OUTCOME_RELIABILITY + (2 * OUTCOME_RELIABILITY - 1) * agrees
    if cut.stable or cut.frequency is None:
        return _HeardCut(likelihood, agrees, ())
    of_frequency, doubts = _frequency_likelihood(limits, cut.frequency, question)
    return _HeardCut(likelihood * (1 + agrees * (of_frequency - 1)), agrees, tuple(doubts))


def _frequency_likelihood(limits: DrawnLimits, frequency: float, question: CutQuestion) -> tuple[FloatArray, list[Doubt]]:
    """Return the likelihood of a heard chatter frequency for every draw, over that at its own frequency (at most 1)."""
    drawn = limits.frequencies[:, 0]
    distance = np.abs(np.log(np.where(np.isfinite(drawn), drawn, 1e9) / frequency)) / HEARD_FREQUENCY_DEVIATION
    stray = STRAY_FREQUENCY_PROBABILITY * HEARD_FREQUENCY_DEVIATION * np.sqrt(2 * np.pi) / STRAY_FREQUENCY_SPREAD
    likelihood = (1 - STRAY_FREQUENCY_PROBABILITY) * np.exp(-0.5 * distance**2) + stray
    if (distance < 3).any():
        return likelihood, []
    limited = drawn[np.isfinite(drawn)]
    spans = f"{limited.min():.4g} .. {limited.max():.4g} Hz" if limited.size else "at no frequency"
    return np.ones(drawn.size), [Doubt(
        f"tried cut at {question.speeds[0]:g} rev/min", f"chatter was heard at {frequency:.4g} Hz, the draws chatter at "
        f"{spans}: another part vibrates that the model does not hold (tool, holder, workpiece), or the heard line is no "
        "chatter",
        "strike the tool's tip and the workpiece, or listen to the cut again (toolpoint listen)")]


def _contradiction(cut: TriedCut, share: float) -> Doubt:
    return Doubt(f"tried cut at {cut.speed:g} rev/min and {1e3 * cut.depth:g} mm",
                 f"its outcome ({'stable' if cut.stable else 'chatter'}) contradicts the model: {100 * share:.1f} % of the "
                 "draws give it, by itself or beside the other cuts", "check dynamics, coefficients and the outcome",
                 figure=share)
