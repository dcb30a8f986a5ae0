r"""Choice of the next test: how much each measured point, direction or pose would narrow an answer of an identified machine.

The identified numbers have covariance C; a candidate test measures z with slopes H and noise R, so that the numbers would have
:math:`C' = C - C H^T (H C H^T + R)^{-1} H C` (Kalman's update) and an answer with slopes g the variance :math:`g^T C' g`. That
needs no measured value: candidates are ranked before anything is measured. Source of the criterion (c-optimality): Pukelsheim,
Optimal Design of Experiments, chapter 2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.machine_uncertainty import MachineUncertainty, machine_uncertainty
from toolpoint.studies.machines.pose_words import pose_words
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof, Modes, frequency_response
from toolpoint.vibration.damped_modes import solve_as_damped

MIN_NARROWING = 0.02  # of today's interval, by the best test: below, none is worth its time
HEADER = ("next test", "95 % interval of the answer after it %", "of today's")
FLAT_WORDS = ("no further test of shapes or frequencies narrows the {answer} (± {today:.2g} %): what is left of its interval "
              "comes from what they do not tell, such as masses and calibration")
Pose = Mapping[str, float]
Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class NextTest(NotebookText):
    """Candidate tests, best first.

    names : what is measured; after : 95 % half width of the answer (relative) after each; today : the same now; answer : in
    words.
    """

    names: tuple[str, ...]
    after: FloatArray
    today: float
    answer: str

    @property
    def random(self) -> float:
        """Mean half width after a candidate chosen at random."""
        return float(self.after.mean())

    @property
    def is_worth_measuring(self) -> bool:
        """Whether the best candidate narrows the answer by at least `MIN_NARROWING`."""
        return narrows(self.today, float(self.after[0]))

    def table(self, row_count: int = 10) -> str:
        """Return the best candidates, and what a random choice would leave, as text."""
        rows = [[name, f"{100 * left:.3g}", f"{100 * left / max(self.today, 1e-300):.3g} %"] for name, left in zip(
            self.names[:row_count], self.after[:row_count], strict=True)]
        share = self.random / max(self.today, 1e-300)
        rows.append(["(a random one of these)", f"{100 * self.random:.3g}", f"{100 * share:.3g} %"])
        table = text_table(f"{self.answer}: ± {100 * self.today:.3g} % today (95 %)", HEADER, rows)
        if self.is_worth_measuring:
            return table
        return f"{FLAT_WORDS.format(answer=self.answer, today=100 * self.today)}.\n{table}"

    def to_dict(self) -> dict[str, Any]:
        """Return all candidates with what they would leave (relative half widths, 95 %) as plain data."""
        return {"answer": self.answer, "today": self.today, "random": self.random,
                "candidates": [{"test": name, "after": float(left)} for name, left in zip(self.names, self.after, strict=True)]}


def narrows(today: float, after: float) -> bool:
    """Return whether a test narrows an answer enough to be advised: half widths today and after it.

    >>> narrows(0.032, 0.020), narrows(0.032, 0.0319)
    (True, False)
    """
    return after <= (1 - MIN_NARROWING) * today


def rank_tests(
    machine: Machine, pose: Pose | None = None, poses: Sequence[Pose] = (), *, points: Sequence[str] | None = None,
    frequency_deviation: float = 1e-4, damping_deviation: float = 0.005, shape_deviation: float = 0.02,
    progress: Progress | None = None,
) -> NextTest:
    """Return the candidate tests by how much they narrow the greatest compliance of tool against table at a pose.

    Parameters
    ----------
    machine : Machine
        Identified, with the covariance of its numbers, a tool point and damping.
    pose : mapping of axis name to m or rad, optional
        Where the answer is wanted.
    poses : sequence of poses
        Candidates: natural frequencies and damping of all modes measured there.
    points : names, optional
        Candidates: all mode shapes measured once more at the pose of the test, at one point in one direction; all points of the
        machine where left out, none for an empty sequence.
    frequency_deviation, damping_deviation, shape_deviation : float
        Of the measurement, relative: of frequencies, of damping ratios, and of shapes over the mode's greatest motion at the
        machine's points.

    Examples
    --------
    Runs in ``examples/ask_an_identified_machine.py``.
    """
    uncertainty = machine_uncertainty(machine)
    if uncertainty is None:
        fail("machine", "no identified numbers", "must hold them with their covariance (section identified)",
             remedy="make the machine with `toolpoint joints`")
    for name, value in (("frequency_deviation", frequency_deviation), ("damping_deviation", damping_deviation),
                        ("shape_deviation", shape_deviation)):
        positive(name, value)
    names = list(machine.description.points) if points is None else list(points)
    labels = [Dof.parse(f"{name}:{way}") for name in names for way in ("+x", "+y", "+z")]
    candidates = [dict(candidate) for candidate in poses]
    if not labels and not candidates:
        fail("candidates", "none", "must be points or poses")

    def measured(sample: Machine) -> FloatArray:
        parts = []
        for candidate in candidates:
            modes = _modes(sample, candidate, labels[:1] or [Dof.parse(f"{next(iter(machine.description.points))}:+x")])
            # Logarithms over their relative deviation: every measured value then has noise of one.
            parts += [np.log(modes.frequency) / frequency_deviation,
                      np.log(np.maximum(modes.damping_ratio, 1e-9)) / damping_deviation]
        if labels:
            # Amplitudes alone: the sign and phase of a computed shape are arbitrary.
            shape = np.abs(_modes(sample, {}, labels).shape)
            parts.append((shape / reference / shape_deviation).ravel())
        return np.concatenate([_log_compliance(sample, pose or {}), *parts])

    reference = np.ones(1)
    if labels:
        reference = np.abs(_modes(machine, {}, labels).shape).max(axis=0)
    slopes = uncertainty.slopes(measured, progress)
    return _rank(uncertainty, slopes, candidates, labels, machine=machine, pose=pose or {})


def _rank(uncertainty: MachineUncertainty, slopes: FloatArray, candidates: Sequence[Pose], labels: Sequence[Dof], *,
          machine: Machine, pose: Pose) -> NextTest:
    """Return the candidates by what Kalman's update with each of them would leave of the answer's interval."""
    size = np.sqrt(np.maximum(np.diag(uncertainty.covariance), 1e-300))
    # Scaled to correlations, as the slopes are to standard deviations.
    unit = uncertainty.covariance / np.outer(size, size)
    g, candidate_slopes = slopes[:, 0], slopes[:, 1:]
    today = float(np.sqrt(g @ unit @ g))
    # A pose brings frequencies and damping of every mode, a direction its shape's amplitudes.
    modes = candidate_slopes.shape[1] // max(2 * len(candidates) + len(labels), 1)
    ends = np.cumsum([0, *[2 * modes] * len(candidates), *[modes] * len(labels)])
    names = [f"frequencies and damping at {pose_words(machine, candidate)}" for candidate in candidates]
    names += [f"shapes at {label}" for label in labels]
    after = []
    for k in range(len(names)):
        h = candidate_slopes[:, ends[k]:ends[k + 1]].T
        cross = h @ unit
        narrowing = cross @ g
        # Kalman's update: the noise of every scaled value is one, hence the unit matrix.
        after.append(float(np.sqrt(max(g @ unit @ g - narrowing @ np.linalg.solve(cross @ h.T + np.eye(len(h)), narrowing),
                                       0.0))))
    order = np.argsort(after)
    return NextTest(tuple(names[i] for i in order), NORMAL_QUANTILE_95 * np.array(after)[order], NORMAL_QUANTILE_95 * today,
                    f"greatest compliance of the tool at {pose_words(machine, pose)}")


def _modes(machine: Machine, pose: Pose, labels: Sequence[Dof]) -> Modes:
    return solve_as_damped(assemble(machine, pose, labels))


def _log_compliance(machine: Machine, pose: Pose) -> FloatArray:
    """Return ln of the greatest |H| of tool against table along x, y or z over the modes, shape (1,)."""
    description = machine.description
    if description.tool is None:
        fail("tool", "none", "must name the point where the tool cuts", remedy="add 'tool: NAME' to the machine file")
    point = description.tool if description.table is None else f"{description.tool}-{description.table}"
    system = assemble(machine, pose, [Dof.parse(f"{point}:{way}") for way in ("+x", "+y", "+z")])
    # Peaks lie at the natural frequencies: the compliance is looked at there alone, motions without stiffness left out.
    frequency = body_shapes(machine, pose).frequency
    values = np.abs(np.einsum("fii->fi", frequency_response.direct(system, frequency[frequency > 1e-6]).values))
    return np.log(values.max(keepdims=True)).ravel()
