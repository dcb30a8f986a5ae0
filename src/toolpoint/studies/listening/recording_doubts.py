"""Doubts of a recorded cut: clipping, gain that follows the level, a short record, hidden frequencies, an uncertain speed."""

from __future__ import annotations

from toolpoint._doubt import Doubt
from toolpoint.studies.listening.evidence import Evidence
from toolpoint.studies.listening.probability import has_hidden_flip

MAX_CLEAN_CLIPPING = 2e-4  # of the samples
MAX_HIDDEN_FRACTION = 0.1  # of the frequencies, nearer to an order than can be told
MAX_SKIRT = 0.3  # of the power of the orders, beside them: the speed wanders, or chatter hides there
MIN_TOOTH_FRACTION = 0.3  # of the power of all orders, at tooth passings
MIN_HALF_TOOTH_FRACTION = 0.1  # of the power of all orders, at half tooth passings of two teeth
RIVAL_MARGIN = 0.1  # of the score of a searched speed: a rival within it is as likely


def question_recording(evidence: Evidence, speed_given: bool) -> list[Doubt]:
    """Return what makes a verdict on a record doubtful."""
    doubts = []
    cut = evidence.duration
    if evidence.clipped > MAX_CLEAN_CLIPPING:
        doubts.append(Doubt("recording", f"clipped: {100 * evidence.clipped:.2g} % of the samples stand at the largest value, "
                            "and clipping mixes lines that are not in the cut", "record again with less gain",
                            figure=evidence.clipped))
    if evidence.lines.hidden > MAX_HIDDEN_FRACTION:
        needed = cut * evidence.lines.hidden / MAX_HIDDEN_FRACTION
        doubts.append(Doubt("resolution", f"{100 * evidence.lines.hidden:.0f} % of the frequencies are nearer to a spindle "
                            f"order than {cut:.2g} s of cut can tell", f"record at least {needed:.2g} s",
                            figure=evidence.lines.hidden))
    if evidence.skirt > MAX_SKIRT:
        doubts.append(Doubt("spindle speed", f"lines beside the orders hold {100 * evidence.skirt:.0f} % of the orders' power: "
                            "the speed wanders more than is tracked, or chatter lies nearer to an order than can be told",
                            "record longer at a steady speed", figure=evidence.skirt))
    if not evidence.tells_speed:
        doubts.append(Doubt("spindle speed", f"tooth passings that stand out at {evidence.speed.speed:.0f} rev/min: "
                            f"{evidence.speed.harmonics}; speed or number of teeth may be wrong",
                            "check both, or record nearer to the cut"))
    if not speed_given:
        doubts += _rivals(evidence)
    return doubts


def question_teeth(evidence: Evidence) -> list[Doubt]:
    """Return the doubt of a number of teeth whose tooth passings are weaker than the orders between them."""
    orders = evidence.lines.orders
    tooth = float(orders[evidence.teeth - 1::evidence.teeth].sum())
    if evidence.teeth > 1 and tooth < MIN_TOOTH_FRACTION * float(orders.sum()):
        return [Doubt("teeth", f"the orders of {evidence.teeth} teeth hold {100 * tooth / float(orders.sum()):.0f} % "
                      "of the power of all spindle orders: another number of teeth, a broken tooth or large run-out",
                      "check the number of teeth")]
    return []


def question_flip(evidence: Evidence) -> list[Doubt]:
    """Return the doubt that a flip is hidden: with two teeth half the tooth passing is a spindle order, as that of run-out."""
    half = evidence.lines.half_tooth / max(evidence.lines.order_power, 1e-300)
    if evidence.teeth == 2 and half > MIN_HALF_TOOTH_FRACTION:
        return [Doubt("flip", f"half the tooth passing and its odd multiples hold {100 * half:.0f} % of the orders' power; "
                      "with two teeth run-out gives the same lines as chatter of period two", "measure the run-out, or "
                      "change the speed by a few percent: run-out stays", figure=half)]
    if has_hidden_flip(evidence):
        return [Doubt("flip", f"the lines at half the tooth passing are spindle orders of {evidence.teeth} teeth: run-out that "
                      "alternates from tooth to tooth gives the same", "measure the run-out, or change the speed by a few "
                      "percent: run-out stays", figure=half)]
    return []


def _rivals(evidence: Evidence) -> list[Doubt]:
    best = evidence.rivals[0]
    close_rivals = [rival for rival in evidence.rivals[1:] if rival.score > best.score - RIVAL_MARGIN * abs(best.score)]
    lines = [Doubt("spindle speed", f"searched in the sound: {best.speed:.1f} rev/min", "give `speed` where it is known")]
    if close_rivals:
        speeds = ", ".join(f"{rival.speed:.0f}" for rival in close_rivals[:3])
        lines.append(Doubt("spindle speed", f"{speeds} rev/min explain the lines as well as {best.speed:.0f}", "give `speed`"))
    return lines
