"""Hammer test from its records: verdict on every hit, responses with coherence and intervals, checks, doubts."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, suggestion
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.signals.checks import Reciprocity, free_of_masses, reciprocity
from toolpoint.signals.doubts import question
from toolpoint.signals.driving_doubts import DrivingPointCheck, driving_points
from toolpoint.signals.hammer import HammerTest, hammer_test, locate_hits
from toolpoint.signals.hits import Hit, HitRules
from toolpoint.signals.record_set import RecordSet
from toolpoint.signals.setups import join_setups
from toolpoint.signals.usable_band import UsableBand, usable_band
from toolpoint.signals.windows import WINDOW
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof, Frf, Record

MAX_WINDOWED_FRACTION = 0.2  # of the set-ups: above, an analyser's window is no chance
MAX_INCOMPLETE_FRACTION = 0.5  # of the sensors: where more lack responses to a struck point, the test is not one
ONE_HIT = "one hit only"  # what the doubt of a set-up with one usable hit is about (`signals.hammer`)
MAX_LISTED_SETUPS = 6  # in a message
HEADER = ("hit", "struck", "force N", "verdict", "why")
SetUp = tuple[Dof, tuple[Dof, ...]]


@dataclass(frozen=True)
class HitVerdict:
    """Verdict on a hit: its name, struck Dof, peak force (N), place in its test, and whether a person decided."""

    name: str
    struck: Dof
    hit: Hit
    record: Record
    by_hand: bool = False

    @property
    def verdict(self) -> str:
        """Accepted or refused, and whether a person decided."""
        return ("accepted" if self.hit.accepted else "refused") + (" by hand" if self.by_hand else "")


@dataclass(frozen=True, eq=False)
class HammerStudy(NotebookText):
    """Responses of a hammer test with their verdicts, band and checks.

    frf : all responses, one column for each struck Dof; tests : the test of each; verdicts : on every hit, in order; band :
    part of the lines that the test can be believed in; doubts : what may be wrong, first; notes : what was assumed and done.
    """

    frf: Frf
    tests: tuple[HammerTest, ...]
    verdicts: tuple[HitVerdict, ...]
    band: UsableBand
    driving: tuple[DrivingPointCheck, ...]
    pairs: tuple[Reciprocity, ...]
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]

    @property
    def used(self) -> int:
        """Number of hits used."""
        return sum(verdict.hit.accepted for verdict in self.verdicts)

    @property
    def status(self) -> str:
        """The answer in a sentence."""
        pairs = f"{len(self.frf.outputs)} x {len(self.frf.inputs)} responses ({self.frf.quantity})"
        return (f"{pairs} from {self.used} of {len(self.verdicts)} hits, lines of {1 / self.tests[0].duration:.4g} Hz, to be "
                f"believed from {self.band.low:.4g} to {self.band.high:.4g} Hz{self.scatter_words()}.")

    def scatter_words(self) -> str:
        """Return how far the responses scatter at their peaks (95 %), in words; what is unknown with one hit."""
        radii = [(test, test.radius()) for test in self.tests]
        if any(radius is None for _, radius in radii):
            return "; one hit tells no scatter"
        shares = []
        # Only lines near the peaks count: of a response that is nearly zero every scatter is a large share.
        for test, radius in radii:
            size = np.abs(test.frf.values)
            inside = (test.frf.frequency >= self.band.low) & (test.frf.frequency <= self.band.high)
            loud = inside[:, None, None] & (size > 0.3 * size[inside].max(axis=0))
            shares.append(np.asarray(radius)[loud] / size[loud])
        return f"; they scatter by ±{100 * float(np.median(np.concatenate(shares))):.2g} % where they are large (95 %)"

    def rows(self) -> list[list[str]]:
        """Return a row for every hit."""
        return [[v.name, str(v.struck), f"{v.hit.force:.4g}", v.verdict, "; ".join(v.hit.reasons)] for v in self.verdicts]

    def table(self) -> str:
        """Return the status, then the verdict on every hit, as text."""
        return self.status + "\n" + text_table("Hits", HEADER, self.rows())

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: verdicts, band, doubts, notes, checks."""
        return {"status": self.status, "doubts": list(self.doubts), "notes": list(self.notes),
                "hits": [{"name": v.name, "struck": str(v.struck), "force_n": v.hit.force, "accepted": v.hit.accepted,
                          "by_hand": v.by_hand, "reasons": list(v.hit.reasons)} for v in self.verdicts],
                "band_hz": [self.band.low, self.band.high], "line_spacing_hz": 1 / self.tests[0].duration,
                "window_decay_1_s": self.frf.decay, "outputs": [str(dof) for dof in self.frf.outputs],
                "inputs": [str(dof) for dof in self.frf.inputs],
                "driving_points": [{"dof": str(check.dof), "passive_share": None if np.isnan(check.share) else check.share,
                                    "doubts": list(check.doubts)} for check in self.driving],
                "reciprocity": [{"first": str(pair.first), "second": str(pair.second), "agreement": pair.agreement,
                                 "ratio": pair.ratio} for pair in self.pairs]}


def study_hammer_records(records: RecordSet | Sequence[Record], *, duration: float | None = None, final: float | None = None,
                         estimator: str = "H1", rules: HitRules | None = None,
                         decisions: Mapping[str, bool] | None = None,
                         masses: Mapping[str, float] | None = None) -> HammerStudy:
    """Return the responses of a hammer test from its records, one hit a record or many, struck at one Dof or several.

    Parameters
    ----------
    records : RecordSet (of `io.read_records`) or sequence of Record
    duration : float, optional
        Length of a block, s; the longest that fits behind the hits where left out.
    final : float, optional
        End value of the exponential window; what the slowest mode needs where left out, 1 for none.
    estimator : str
        ``H1``, ``H2`` or ``Hv``.
    rules : HitRules, optional
    decisions : mapping of the name of a hit to bool, optional
        Hits that a person accepts or refuses, beside those of the record set.
    masses : mapping of Dof to kg, optional
        What sensors add to the structure; taken off at driving points (`signals.checks.free_of_masses`).

    Raises
    ------
    ToolpointError
        Where no hit is usable (with the reasons of each), channels do not fit together, a decided hit is not there.

    Examples
    --------
    >>> from toolpoint.studies.machines.virtual_test import Hammer, hammer_records
    >>> from toolpoint.vibration import Modes
    >>> tip = Modes([200.0], [0.03], [[0.2]], ["tip:+x"])
    >>> hammer = Hammer(contact=1e-3, force=100.0, hits=3, block=0.5, sample_rate=2048.0)
    >>> record = hammer_records(tip, "tip:+x", ["tip:+x"], rng=np.random.default_rng(1), hammer=hammer)
    >>> study = study_hammer_records([record])
    >>> study.used, abs(float(study.frf.frequency[abs(study.frf.values[:, 0, 0]).argmax()]) - 200.0) < 20
    (3, True)
    """
    record_set = records if isinstance(records, RecordSet) else RecordSet(tuple(records), tuple(
        record.name or f"record {k}" for k, record in enumerate(records, 1)))
    # Decisions given here prevail over those that the records bring along.
    decided = {**record_set.decisions, **(decisions or {})}
    groups = _groups(record_set)
    tests, left_out, without_hit = _test_setups(record_set, groups, duration=duration, final=final, estimator=estimator,
                                                rules=rules, decided=decided)
    verdicts = _verdicts(record_set, tests, decided)
    _check_decisions(decided, [verdict.name for verdict in verdicts])
    joined, incomplete = _join_tests([test for _, test in tests], left_out, without_hit)
    joined = free_of_masses(joined, masses or {})
    frf, test_notes = replace(joined, notes=()), _name_single_hits([test for _, test in tests])
    notes = tuple(dict.fromkeys([*record_set.notes, *test_notes, *joined.notes]))
    # A note that is a doubt is listed with the doubts only.
    doubted = _join_window_doubts([note for note in notes if isinstance(note, Doubt)], len(tests))
    checks = tuple(driving_points(frf))
    doubts = (*left_out, *incomplete, *doubted, *question(frf))
    # The hit that excites least far up bounds the band of all responses.
    band = usable_band(frf, min(test.excited for _, test in tests))
    return HammerStudy(frf, tuple(test for _, test in tests), verdicts, band, checks, tuple(reciprocity(frf)),
                       tuple(dict.fromkeys(doubts)), tuple(note for note in notes if not isinstance(note, Doubt)))


def _name_single_hits(tests: Sequence[HammerTest]) -> list[str]:
    """Return the notes of all set-ups; the doubt about one hit alone names those that it is about, where there are others."""
    single = [test for test in tests if any(isinstance(note, Doubt) and note.what == ONE_HIT for note in test.frf.notes)]
    if len(tests) == 1 or not single:
        return [note for test in tests for note in test.frf.notes]
    names = [f"{test.frf.inputs[0]} / {test.frf.outputs[0]}" for test in single[:MAX_LISTED_SETUPS]]
    listed = ", ".join(names) + (f" and {len(single) - len(names)} more" if len(single) > len(names) else "")
    where = f"in {len(single)} of {len(tests)} set-ups (struck / first sensor: {listed})"
    return [Doubt(ONE_HIT, f"{note.why} {where}", note.remedy) if isinstance(note, Doubt) and note.what == ONE_HIT else note
            for test in tests for note in test.frf.notes]


def _join_window_doubts(doubts: Sequence[Doubt], count: int) -> tuple[Doubt, ...]:
    """Return doubts with those on the window of the analyser as one: set-ups have one analyser, and each its own noise."""
    windowed = [doubt for doubt in doubts if doubt.what == WINDOW]
    others = tuple(doubt for doubt in doubts if doubt.what != WINDOW)
    if len(windowed) < 2:
        return tuple(doubts)
    median = sorted(windowed, key=lambda doubt: doubt.figure)[len(windowed) // 2]
    return (Doubt(WINDOW, f"in {len(windowed)} of {count} set-ups {median.why}", median.remedy, figure=median.figure,
                  grave=len(windowed) > MAX_WINDOWED_FRACTION * count), *others)


def _groups(record_set: RecordSet) -> dict[SetUp, list[int]]:
    """Return the records of every set-up (a struck Dof with its sensors), in their order."""
    groups: dict[SetUp, list[int]] = {}
    for k, record in enumerate(record_set.records):
        forces = [dof for dof, kind in zip(record.channels, record.quantities, strict=True) if kind == "force"]
        if len(forces) != 1 or len(record.quantities) < 2:
            raise ToolpointError(f"{record_set.names[k]}: {len(forces)} force channels and "
                                 f"{len(record.quantities) - len(forces)} "
                                 f"responses ({', '.join(map(str, record.quantities))}); must hold one force and some "
                                 "responses; say what each channel is with `channel`")
        groups.setdefault((forces[0], record.channels), []).append(k)
    return groups


def _test_setups(record_set: RecordSet, groups: Mapping[SetUp, list[int]], *, duration: float | None, final: float | None,
                 estimator: str, rules: HitRules | None, decided: Mapping[str, bool]
                 ) -> tuple[list[tuple[list[int], HammerTest]], list[Doubt], list[Dof]]:
    """Return the test of every set-up with a usable hit, all with one block and window, doubts about the others, their Dofs."""
    def test(places: list[int], block: float | None, end: float | None) -> HammerTest:
        records = [record_set.records[k] for k in places]
        numbers = _numbers([record_set.names[k] for k in places], records, block, rules, decided)
        return hammer_test(records, block, estimator=estimator, final=end, rules=rules, decisions=numbers)

    tests, doubts, without_hit = [], list[Doubt](), list[Dof]()
    for (struck, channels), places in groups.items():
        try:
            tests.append((places, test(places, duration, final)))
        except ToolpointError as error:
            words = f"struck at {struck}: {_name_hits(str(error), [record_set.names[k] for k in places])}"
            # Without another set-up there is nothing left to study.
            if len(groups) == 1:
                raise ToolpointError(words) from None
            doubts.append(Doubt("left out", words))
            without_hit += channels
    if not tests:
        raise ToolpointError("; ".join(doubts))
    # All set-ups share the shortest block and the strongest window: the same lines, the same added damping.
    block = min(result.duration for _, result in tests)
    ends = [float(np.exp(-result.frf.decay * result.duration)) for _, result in tests]
    if any(result.duration > block * (1 + 1e-9) for _, result in tests) or max(ends) - min(ends) > 1e-9:
        tests = [(places, test(places, block, min(ends))) for places, _ in tests]
    return tests, doubts, without_hit


def _numbers(names: Sequence[str], records: Sequence[Record], block: float | None, rules: HitRules | None,
             decided: Mapping[str, bool]) -> dict[int, bool]:
    """Return the decisions about the hits of a test by the number of the hit, for which hits are located first."""
    if not decided:
        return {}
    labels = _hit_names(names, locate_hits(records, block, rules))
    return {number: decided[label] for number, label in enumerate(labels) if label in decided}


def _hit_names(names: Sequence[str], hits: Sequence[Hit]) -> list[str]:
    """Return the names of hits: that of their record, with a number where it holds several."""
    counts = [sum(hit.record == k for hit in hits) for k in range(len(names))]
    numbers = [0] * len(names)
    labels = []
    for hit in hits:
        numbers[hit.record] += 1
        labels.append(names[hit.record] + (f"#{numbers[hit.record]}" if counts[hit.record] > 1 else ""))
    return labels


def _name_hits(error: str, names: Sequence[str]) -> str:
    """Return an error with the names of records for the numbers of hits, where every record holds one."""
    count = re.search(r"none of (\d+) hits", error)
    # Where a record holds several hits their numbers are not those of records: the message stays as it is.
    if count is None or int(count[1]) != len(names):
        return error
    return re.sub(r"\bhit (\d+):", lambda number: f"{names[int(number[1]) - 1]}:", error)


def _verdicts(record_set: RecordSet, tests: Sequence[tuple[list[int], HammerTest]], decided: Mapping[str, bool]
              ) -> tuple[HitVerdict, ...]:
    verdicts = []
    for places, test in tests:
        labels = _hit_names([record_set.names[k] for k in places], test.hits)
        verdicts += [HitVerdict(label, test.frf.inputs[0], hit, record_set.records[places[hit.record]], label in decided)
                     for label, hit in zip(labels, test.hits, strict=True)]
    return tuple(verdicts)


def _check_decisions(decided: Mapping[str, bool], names: Sequence[str]) -> None:
    for name in decided:
        if name not in names:
            raise ToolpointError(f"`accept`, `refuse` {name}: no such hit; {suggestion(name, names) or 'known: '}"
                                 + ("" if suggestion(name, names) else ", ".join(names[:6])))


def _join_tests(tests: Sequence[HammerTest], left_out: Sequence[Doubt], without_hit: Sequence[Dof]
                ) -> tuple[Frf, list[Doubt]]:
    """Return the responses of all set-ups, and a doubt where sensors lack those to a struck point and are left out.

    left_out : doubts about set-ups without a usable hit, and without_hit : their Dofs.
    """
    frfs, doubts = [test.frf for test in tests], list[Doubt]()
    if len(frfs) == 1:
        return replace(frfs[0], notes=()), doubts
    outputs = dict.fromkeys(dof for frf in frfs for dof in frf.outputs)
    measured = {(dof, struck) for frf in frfs for dof in frf.outputs for struck in frf.inputs}
    inputs = dict.fromkeys(struck for frf in frfs for struck in frf.inputs)
    incomplete = [dof for dof in outputs if any((dof, struck) not in measured for struck in inputs)]
    if incomplete and set(incomplete) <= set(without_hit) and len(incomplete) <= MAX_INCOMPLETE_FRACTION * len(outputs):
        frfs = [frf.selected(outputs=kept) for frf in frfs if (kept := [dof for dof in frf.outputs if dof not in incomplete])]
        doubts = [Doubt(f"sensors {', '.join(map(str, incomplete))}", "they lack the responses to a struck point, where no hit "
                        "was usable: they are left out for all struck points", "measure them again")]
    try:
        return replace(join_setups(frfs), notes=()), doubts
    except ToolpointError as error:
        listed = [f"struck at {test.frf.inputs[0]}: sensors {', '.join(map(str, test.frf.outputs))}" for test in tests]
        rest_words = f"; and {len(listed) - MAX_LISTED_SETUPS} more" if len(listed) > MAX_LISTED_SETUPS else ""
        words = "; ".join([*map(str, left_out), *listed[:MAX_LISTED_SETUPS]]) + rest_words
        raise ToolpointError(f"the struck points do not make one set of responses ({error}); {words}; give the files of each "
                             "set of sensors apart") from None
