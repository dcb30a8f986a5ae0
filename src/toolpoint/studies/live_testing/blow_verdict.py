"""Verdict on a blow, within its record alone, as soon as it is there; the words that the tester hears."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.signals.hits import Hit, HitRules, find_hits, judge_hits
from toolpoint.studies.live_testing.blow_direction import find_velocity, question_direction
from toolpoint.vibration import Dof, Record

STRONGEST_WINDOW_END = 0.01  # of the exponential window that may still be put on a block: what is left then was cut off


@dataclass(frozen=True)
class BlowVerdict:
    """Verdict on a blow.

    Parameters
    ----------
    name : str
        Of its file.
    struck : Dof
    force : float
        Peak, N; nan where no blow stands in the record.
    reasons : tuple of str
        Against the blow; empty where it is accepted.
    remarks : tuple of str
        What should be looked at although the blow is accepted.
    remaining : int
        Good blows that are still asked for.
    delay : float
        From the last sample of the blow to its verdict, s.

    Examples
    --------
    >>> verdict = BlowVerdict("blow_0001.npz", Dof("tip", "+x"), 210.0, (), (), 2)
    >>> verdict.words
    'blow_0001.npz: good, 210 N; two more good blows at tip:+x'
    """

    name: str
    struck: Dof
    force: float
    reasons: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    remaining: int = 0
    delay: float = 0.0

    @property
    def accepted(self) -> bool:
        """Whether there is no reason against the blow."""
        return not self.reasons

    @property
    def words(self) -> str:
        """The verdict in a sentence."""
        force = f"{self.force:.3g} N" if np.isfinite(self.force) else "no blow"
        verdict = f"good, {force}" if self.accepted else f"REFUSED, {force}: {'; '.join(self.reasons)}"
        remarks = "".join(f"; look: {remark}" for remark in self.remarks)
        return f"{self.name}: {verdict}{remarks}; {ask_for(self.remaining, self.struck)}"


def ask_for(remaining: int, struck: Dof) -> str:
    """Return how many more good blows are asked for, in words."""
    number = {1: "one", 2: "two", 3: "three", 4: "four", 5: "five"}.get(remaining, str(remaining))
    if remaining <= 0:
        return f"enough at {struck}"
    return f"{number} more good blow{'s' * (remaining > 1)} at {struck}"


@dataclass(frozen=True, eq=False)
class JudgedBlow:
    """A record with its hit as it was judged, and the velocity that the blow left, None where no sensor tells."""

    record: Record
    hit: Hit | None
    velocity: FloatArray | None = None


def judge_blow(record: Record, earlier: Sequence[JudgedBlow], *, rules: HitRules, duration: float | None, set_aside: str = ""
               ) -> tuple[JudgedBlow, BlowVerdict]:
    """Judge a blow by its own record: double, weak, clipped, cut off, a bad ring-down, a turned direction.

    Parameters
    ----------
    record : Record
        SI, with one force.
    earlier : sequence of JudgedBlow
        Blows before it: a weak one is weak relative to them.
    rules : HitRules
    duration : float, optional
        Length of a block, s; as much as stands behind the blow where left out.
    set_aside : str
        A reason against the blow that its samples do not show.
    """
    force_at = record.quantities.index("force")
    struck = record.channels[force_at]
    try:
        hit = _judge(record, force_at, earlier, rules, duration)
    except ToolpointError as error:
        return JudgedBlow(record, None), BlowVerdict(record.name, struck, float("nan"), (set_aside or str(error),))
    # A torn or clipped record has other faults as consequences: the cause alone is told.
    hit = replace(hit, reasons=(set_aside,)) if set_aside else hit
    velocity, remarks = find_velocity(record, hit), tuple[str, ...]()
    if velocity is not None and hit.accepted:
        good = [blow.velocity for blow in earlier if blow.hit is not None and blow.hit.accepted and blow.velocity is not None]
        words, is_reason = question_direction(velocity, struck, good)
        if words and is_reason:
            hit = hit.rejected(words)
        remarks = (words,) if words and not is_reason else ()
    return JudgedBlow(record, hit, velocity), BlowVerdict(record.name, struck, hit.force, hit.reasons, remarks)


def _judge(record: Record, force_at: int, earlier: Sequence[JudgedBlow], rules: HitRules, duration: float | None) -> Hit:
    """Return the first hit of a record, judged."""
    samples = record.samples.shape[0]
    block = samples if duration is None else round(duration * record.sample_rate)
    first = find_hits(record.samples[:, force_at], block, rules)[0]
    if duration is None:
        block = samples - first.start
    # A hit with a reason is not judged again: those before this one count for the median force alone.
    others = [replace(blow.hit, reasons=("judged before",), record=0) for blow in earlier if blow.hit is not None]
    places = [k for k in range(record.samples.shape[1]) if k != force_at]
    judged = judge_hits([*others, replace(first, record=0)], [record], force_at, others=places, block=block, rules=rules,
                        final=STRONGEST_WINDOW_END)
    return judged[-1]
