"""Drift study: later tests of a machine beside its baseline: has it changed, which modes, which part is likeliest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, positive
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import probability_text
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine
from toolpoint.studies.drift.evidence import Explanation, gather_data, weigh_hypotheses
from toolpoint.studies.drift.hypotheses import model_drift
from toolpoint.studies.drift.mode_changes import (
    ModeChanges,
    Repeatability,
    compare_modes,
    pool_baselines,
)
from toolpoint.vibration import Modes
from toolpoint.vibration.correlation import assign_modes

MIN_NAMED_PROBABILITY = 0.8  # of a part that is named alone
MAX_LISTED_EXPLANATIONS = 8
_MIN_MODEL_MAC = 0.5  # of a mode of the baseline and the machine's
_MAX_BASELINE_DIFFERENCE = 0.1  # of the machine from the baseline, above which its sensitivities are doubted
_MIN_MODE_COUNT = 3  # that tell parts of a machine apart


@dataclass(frozen=True, eq=False)
class DriftStudy(NotebookText):
    """Later tests beside a baseline.

    names : of the later tests, in their order in time; history : changes from the baseline to each of them; false_alarms :
    probability of calling an unchanged machine changed, for each test; explanations : of the last test, the likeliest first,
    empty without a machine or without a change.
    """

    names: tuple[str, ...]
    history: tuple[ModeChanges, ...]
    false_alarms: float
    explanations: tuple[Explanation, ...]
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]

    @property
    def last(self) -> ModeChanges:
        """Changes from the baseline to the last test."""
        return self.history[-1]

    @property
    def has_changed(self) -> bool:
        """Whether the machine of the last test is another than that of the baseline."""
        return self.last.probability < self.false_alarms

    @property
    def parts(self) -> list[tuple[str, float]]:
        """Parts that could have changed with their probabilities, all directions of a joint together, the likeliest first."""
        shares: dict[str, float] = {}
        for each in self.explanations:
            shares[each.part] = shares.get(each.part, 0.0) + each.probability
        return sorted(shares.items(), key=lambda item: -item[1])

    @property
    def status(self) -> str:
        """Whether the machine changed, how, and which part is likeliest, in a sentence or two."""
        return " ".join([self._change_words(), *self._part_words()])

    def _change_words(self) -> str:
        last, modes = self.last, self.last.significant(self.false_alarms)
        count = last.paired.size
        if not self.has_changed:
            smallest = 100 * last.detectable_change(self.false_alarms)
            return (f"No change is seen in {count} modes: the differences are those of two tests of one machine "
                    f"(probability {last.probability:.2g}); one mode that moved by {smallest:.2g} % would have been seen in 19 "
                    f"of 20 tests.")
        listed = ", ".join(f"{last.baseline.frequency[i]:.4g} Hz by {100 * np.expm1(last.change[i]):+.2g} %" for i in modes[:4])
        others = f" and {modes.size - 4} more" if modes.size > 4 else ""
        what = f": {listed}{others}" if modes.size else ", though no single mode moved beyond doubt"
        return f"The machine has changed{what} (by chance: {_chance_text(last.probability)})."

    def _part_words(self) -> list[str]:
        if not self.explanations:
            return []
        (part, share), *others = self.parts
        best = next(each for each in self.explanations if each.part == part)
        way = f" in direction {best.direction}" if best.direction else ""
        factor = f"{best.part}{way}: {best.change_text} ({best.interval_text})"
        if not any(each.fits for each in self.explanations):
            return [f"No part and no pair of parts explains it; nearest comes {factor}, and what it leaves is more than noise."]
        # The table lists each direction of a joint alone: a sum of them says that it is one.
        is_sum = probability_text(best.probability) != probability_text(share)
        if share >= MIN_NAMED_PROBABILITY and is_sum:
            return [f"Likeliest is {part}, with a probability of {probability_text(share)} for all its directions together; "
                    f"{probability_text(best.probability)} belong to {factor}."]
        if share >= MIN_NAMED_PROBABILITY:
            return [f"Likeliest is {factor}, with a probability of {probability_text(share)}."]
        names = [f"{name} ({probability_text(each)})" for name, each in [(part, share), *others[:3]] if each > 0.05]
        return [f"The test does not tell which part: {', '.join(names)}, all directions of a joint together. If it is the "
                f"first, {factor}."]

    def table(self) -> str:
        """Return the changes of all modes over the tests, then the parts that could have changed, as text."""
        lines = [*mark_notes(self.doubts), self.status,
                 " baseline Hz" + "".join(f"{name[:14]:>16}" for name in self.names) + "   last, deviations"]
        first = self.history[0].baseline
        for i in range(first.count):
            cells = "".join(f"{100 * np.expm1(c.change[i]):+14.3f} %" if np.isfinite(c.change[i]) else f"{'not seen':>16}"
                            for c in self.history)
            score = self.last.scores[i]
            lines.append(f"{first.frequency[i]:12.3f}{cells}" + (f"{score:+16.1f}" if np.isfinite(score) else ""))
        if self.explanations:
            lines.append(f"{'what could have changed':34} probability   factor   95 % interval   fits")
            lines += [f"{e.words:34} {probability_text(e.probability):>11} {e.factor:8.3f}   "
                      f"{e.interval[0]:.3f} .. {e.interval[1]:.3f}   {'yes' if e.fits else 'no'}"
                      for e in self.explanations[:MAX_LISTED_EXPLANATIONS]]
        return "\n".join([*lines, *self.notes])

    def to_dict(self) -> dict[str, Any]:
        """Return changes and explanations as plain data; frequencies in Hz, changes relative."""
        first = self.history[0].baseline
        return {
            "status": self.status, "changed": self.has_changed, "false_alarms": self.false_alarms,
            "probability_unchanged": [c.probability for c in self.history], "tests": list(self.names),
            "baseline_hz": first.frequency.tolist(),
            "change": [[float(np.expm1(v)) if np.isfinite(v) else None for v in c.change] for c in self.history],
            "deviation": [[float(v) if np.isfinite(v) else None for v in c.deviation] for c in self.history],
            "changed_modes": self.last.significant(self.false_alarms).tolist(),
            "parts": [{"part": part, "probability": share} for part, share in self.parts],
            "explanations": [{"part": e.part, "direction": e.direction, "factor": e.factor, "interval": list(e.interval),
                              "probability": e.probability, "misfit": e.misfit} for e in self.explanations],
            "doubts": list(self.doubts), "notes": list(self.notes)}

    def __repr__(self) -> str:
        return f"DriftStudy({len(self.history)} later tests, {'changed' if self.has_changed else 'no change seen'})"


def study_drift(baseline: Modes | Sequence[Modes], tests: Sequence[Modes], machine: Machine | None = None, *,
                pose: Pose | None = None, names: Sequence[str] = (), repeatability: Repeatability | None = None,
                false_alarms: float = 0.01) -> DriftStudy:
    """Judge later tests of a machine against its baseline.

    Parameters
    ----------
    baseline : Modes, or several of an unchanged machine
        Several show how well tests repeat: where they scatter more than `repeatability`, this is raised.
    tests : sequence of Modes
        In their order in time, at some of the baseline's Dofs: three points are enough.
    machine : Machine, optional
        Calibrated at the time of the baseline, its points named as the measured ones: what could have changed is ranked.
    pose : mapping, optional
        Of the machine in the tests.
    names : sequence of str, optional
        Of the later tests.
    repeatability : Repeatability, optional
    false_alarms : float
        Probability of calling an unchanged machine changed.

    Raises
    ------
    ToolpointError
        For no later test, tests without a common Dof, a machine without a measured point.

    Examples
    --------
    >>> import numpy as np
    >>> def measure(frequencies):
    ...     return Modes(frequencies, [0.02, 0.02], [[1.0, 0.5], [0.4, -1.0], [0.2, 0.7]], ["a:+x", "b:+x", "c:+x"])
    >>> study = study_drift(measure([40.0, 90.0]), [measure([38.0, 90.05])])
    >>> study.has_changed, study.last.significant(0.01).tolist()
    (True, [0])
    """
    if not tests:
        raise ToolpointError("`tests`: no test; must be at least one, beside the baseline")
    positive("false_alarms", false_alarms, 0.5)
    baselines = [baseline] if isinstance(baseline, Modes) else list(baseline)
    first, repeat, raised = pool_baselines(baselines, repeatability or Repeatability())
    history = tuple(compare_modes(first, test, repeat) for test in tests)
    doubts, notes = [*_noise_doubts(baselines, tests), *_pairing_doubts(history[-1])], []
    if raised:
        notes.append("the baselines scatter more than was stated: tests are taken to repeat within "
                     f"{100 * repeat.frequency:.2g} %")
    labels = tuple(names) or tuple(f"test {k + 1}" for k in range(len(tests)))
    study = DriftStudy(labels, history, false_alarms, (), tuple(doubts), tuple(notes))
    if machine is None or not study.has_changed:
        return study
    explanations, of_model = _explain(machine, history[-1], pose)
    return DriftStudy(labels, history, false_alarms, tuple(explanations), (*doubts, *of_model), tuple(notes))


def _explain(machine: Machine, changes: ModeChanges, pose: Pose | None) -> tuple[list[Explanation], list[Doubt]]:
    dofs = [dof for dof in changes.baseline.dofs if str(dof.point) in machine.description.points]
    if not dofs:
        measured = ", ".join(dict.fromkeys(str(dof.point) for dof in changes.baseline.dofs))
        raise ToolpointError("`machine`: no point of it is measured; it has "
                             f"{', '.join(machine.description.points) or 'none'}, the tests {measured}")
    changes = compare_modes(changes.baseline.at_dofs(dofs), changes.current.at_dofs(dofs), changes.repeatability)
    model = model_drift(machine, dofs, pose, highest=float(changes.baseline.frequency.max()))
    nominal = model.modes()
    rows, columns, values = assign_modes(changes.baseline, nominal)
    partner = np.full(changes.baseline.count, -1)
    is_pair = values >= _MIN_MODEL_MAC
    partner[rows[is_pair]] = columns[is_pair]
    data = gather_data(changes, nominal, partner)
    if not data.rows.size:
        return [], [Doubt("machine", "none of its modes looks like one of the baseline",
                          "compare them by `toolpoint correlate`", grave=True)]
    explanations = weigh_hypotheses(model, data)
    offset = nominal.frequency[data.model_modes] / changes.baseline.frequency[data.rows] - 1
    return explanations, _model_doubts(offset, explanations[0])


def _model_doubts(offset: np.ndarray, best: Explanation) -> list[Doubt]:
    doubts = []
    difference = float(np.abs(offset).max())
    if difference > _MAX_BASELINE_DIFFERENCE:
        doubts.append(Doubt("machine", f"a frequency of it is {100 * difference:.2g} % off the baseline: what a part does to "
                            f"the "
                            "modes is as far off", "calibrate it by `toolpoint update` on the baseline", figure=difference))
    if offset.size < _MIN_MODE_COUNT:
        doubts.append(Doubt("which part changed", f"{offset.size} modes of the tests are the machine's: too few to tell parts "
                            "apart", "measure more points or a wider band"))
    if not best.fits:
        doubts.append(Doubt("which part changed", "no single change and no pair of them explains what was measured: more parts "
                            "changed, "
                            "the pose or the sensors were others, or the machine is not the one of the baseline",
                            "look at the changes of the modes"))
    return doubts


def _noise_doubts(baselines: Sequence[Modes], tests: Sequence[Modes]) -> list[Doubt]:
    bare_count = sum(modes.covariance is None for modes in (*baselines, *tests))
    if not bare_count:
        return []
    return [Doubt("noise of the tests", f"{bare_count} of {len(baselines) + len(tests)} tests state no intervals: their "
                  "frequencies count as exact within the repeatability", "identify them by `toolpoint identify`, which states "
                  "them")]


def _pairing_doubts(changes: ModeChanges) -> list[Doubt]:
    unseen = changes.baseline.frequency[changes.partner < 0]
    new = changes.current.frequency[changes.single_current]
    inside = new[(new > changes.baseline.frequency.min()) & (new < changes.baseline.frequency.max())]
    words = [f"{text} {', '.join(f'{f:.4g}' for f in values)} Hz" for text, values in (
        ("the later test does not show", unseen), ("the baseline does not show", inside)) if values.size]
    if not words:
        return []
    return [Doubt("modes", f"{' and '.join(words)}: these are not judged", "look at both tests by `toolpoint identify`")]


def _chance_text(probability: float) -> str:
    """Return a probability of chance: below one in a million nobody knows it better."""
    return f"{100 * probability:.1g} %" if probability >= 1e-6 else "less than one in a million"
