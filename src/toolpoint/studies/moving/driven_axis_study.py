r"""Test by the axis itself: modes and damping of the axis standing and moving, and what its joint's damping does between both.

Friction locks a standing axis and lets a moving one slide: stiffness and damping of its joint differ. With the machine's strain
energies :math:`s_{kj}` (share of joint j in mode k), :math:`2 \zeta_k = \sum_j s_{kj} \eta_j`. All joints together cannot be
told from a few modes; two things can: the most that the loss factor of one joint can be, :math:`\min_k 2 \zeta_k / s_{kj}`, and
its change between two states if it alone changes, :math:`\Delta (2 \zeta_k) = s_{kj} \Delta \eta_j`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95, with_uncertainty
from toolpoint.machine import Machine
from toolpoint.modal_identification import Identification
from toolpoint.signals.driven_axis import DrivenAxisTest
from toolpoint.studies.drift.hypotheses import model_drift
from toolpoint.studies.measured.identification import identify_modes
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Modes

MAX_STATE_RATIO = 0.15  # of the frequencies of a mode in two states
STATE_ALARM = 0.01  # of a mode alike in both states of being called another
MIN_LINES_OF_WIDTH = 6.0  # line spacings within the half-power width of a resonance
MIN_ENERGY_SHARE = 0.05  # of a joint in a mode, from which the mode tells of its damping


@dataclass(frozen=True, eq=False)
class AxisState:
    """One state of an axis: its name, its test, its modes."""

    name: str
    test: DrivenAxisTest
    modes: Identification


@dataclass(frozen=True)
class JointDamping:
    """Damping of the driven joint: the most that its loss factor can be in each state; its change from the first state to the
    second with its 95 % half width, if it alone changes, and the probability of the misfit that this leaves."""

    joint: str
    at_most: tuple[float, ...]
    change: float | None = None
    half_width: float = 0.0
    misfit_probability: float = 1.0


@dataclass(frozen=True, eq=False)
class DrivenAxisStudy(NotebookText):
    """Modes of a driven axis in one state or two, pairs of modes of both, and its joint's damping, None without a machine.

    Examples
    --------
    Runs in ``examples/shake_an_axis_by_itself.py``.
    """

    states: tuple[AxisState, ...]
    pairs: tuple[tuple[int, int], ...]
    damping: JointDamping | None
    doubts: tuple[Doubt, ...]

    def _changes(self, kind: int) -> list[tuple[int, float, float, float]]:
        """Return pair, difference, its 95 % half width and p-value of frequency (0) or damping ratio (1), of every pair."""
        if len(self.states) < 2:
            return []
        first, second = (state.modes.modes for state in self.states)
        result = []
        for k, (i, j) in enumerate(self.pairs):
            difference = (second.frequency[j] - first.frequency[i], second.damping_ratio[j] - first.damping_ratio[i])[kind]
            deviation = float(np.sqrt(_variance(first, i, kind) + _variance(second, j, kind)))
            ratio = abs(float(difference)) / deviation if deviation > 0 else float("nan")
            probability = 2 * float(scipy.special.ndtr(-ratio))
            result.append((k, float(difference), NORMAL_QUANTILE_95 * deviation, probability))
        return result

    @property
    def status(self) -> str:
        """The answer in a sentence or two."""
        first = self.states[0]
        count = first.modes.modes.count
        words = f"{count} mode{'s' * (count != 1)} of the {first.name} axis, shaken from {first.test.shaken[0]:.4g} to " \
                f"{first.test.shaken[1]:.4g} Hz"
        return words + self._state_words() + "." + self._damping_words()

    def _state_words(self) -> str:
        """Return which modes of the second state are others, and in what."""
        if len(self.states) < 2:
            return ""
        first, second = (state.modes.modes for state in self.states)
        alarm = STATE_ALARM / max(2 * len(self.pairs), 1)
        parts = [f"frequency {first.frequency[i]:.4g} to {second.frequency[j]:.4g} Hz" if kind == 0 else
                 f"damping of {first.frequency[i]:.4g} Hz {100 * first.damping_ratio[i]:.3g} to "
                 f"{100 * second.damping_ratio[j]:.3g} %"
                 for kind in (0, 1) for k, _, _, p in self._changes(kind) if p < alarm for i, j in [self.pairs[k]]]
        name = self.states[1].name
        return f"; {name}: {', '.join(parts)}" if parts else f"; {name}, none of {len(self.pairs)} differs beyond its interval"

    def _damping_words(self) -> str:
        if self.damping is None:
            return ""
        limits = " and ".join(f"{each:.3f} {state.name}" for each, state in zip(self.damping.at_most, self.states, strict=True))
        words = f" The loss factor of {self.damping.joint} is at most {limits}"
        if self.damping.change is not None:
            words += f"; it changes by {self.damping.change:+.3f} ± {self.damping.half_width:.3f} if it alone changes"
            if self.damping.misfit_probability < STATE_ALARM:
                words += ", which does not explain all modes"
        return words + "."

    def rows(self) -> list[list[str]]:
        """Return a row for every mode of the first state, with its partner in the second."""
        first, rows = self.states[0].modes.modes, []
        partners = dict(self.pairs)
        for i in range(first.count):
            row = [str(i + 1), _with_interval(first, i, 0), _with_interval(first, i, 1)]
            if len(self.states) == 2:
                second, j = self.states[1].modes.modes, partners.get(i)
                row += ["not seen", ""] if j is None else [_with_interval(second, j, 0), _with_interval(second, j, 1)]
            rows.append(row)
        return rows

    @property
    def header(self) -> list[str]:
        """Head of the rows."""
        return ["mode", *(f"{state.name}, {unit}" for state in self.states for unit in ("Hz", "damping %"))]

    def table(self) -> str:
        """Return the answer and the modes as text, doubts first."""
        return "\n".join([*mark_notes(self.doubts), self.status,
                          text_table("Modes with 95 % intervals", self.header, self.rows())])

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"status": self.status, "doubts": list(self.doubts), "pairs": [list(pair) for pair in self.pairs],
                "states": [{"name": state.name, "shaken_hz": list(state.test.shaken),
                            "frequency_hz": state.modes.modes.frequency.tolist(),
                            "damping_ratio": state.modes.modes.damping_ratio.tolist()} for state in self.states],
                "joint_damping": None if self.damping is None else vars(self.damping)}


def study_driven_axis(tests: Mapping[str, DrivenAxisTest], *, machine: Machine | None = None, joint: str | None = None,
                      pose: Mapping[str, float] | None = None) -> DrivenAxisStudy:
    """Return the modes of an axis that shook itself, in one state or two (``{"standing": .., "moving": ..}``).

    Parameters
    ----------
    tests : mapping of a state's name to its DrivenAxisTest
    machine, joint, pose : optional
        The machine whose points bear the names of the outputs, the joint of the axis, and the pose: its damping is judged.

    Examples
    --------
    Runs in ``examples/shake_an_axis_by_itself.py``.
    """
    if not 1 <= len(tests) <= 2:
        fail("tests", f"{len(tests)} states", "must be one or two")
    states = tuple(AxisState(name, test, identify_modes(test.frf, band=test.shaken)) for name, test in tests.items())
    doubts = [doubt.within(state.name) for state in states for doubt in state.modes.doubts]
    for state in states:
        inside = (state.test.frf.frequency >= state.test.shaken[0]) & (state.test.frf.frequency <= state.test.shaken[1])
        bias = float(np.median(np.abs(state.test.direct_values[inside] / state.test.frf.values[inside, :, 0] - 1)))
        if bias > 1.0:
            doubts.append(Doubt(f"{state.name}: force", "the plain response to the motor's force is off by "
                                f"{bias:.1f} times the response: loads besides the set point are loud",
                                "take a louder set point, or record longer", figure=bias))
    doubts += [doubt for state in states for doubt in _resolution_doubts(state)]
    pairs = _pair_states(states)
    damping = None
    if machine is not None:
        damping = _joint_damping(states, pairs, machine, joint, pose)
    return DrivenAxisStudy(states, tuple(pairs), damping, tuple(doubts))


def _resolution_doubts(state: AxisState) -> list[Doubt]:
    """Return the doubt that lines are too wide for the narrowest resonance: windowed spectra of noise smear it."""
    frequency, modes = state.test.frf.frequency, state.modes.modes
    spacing = float(frequency[1] - frequency[0])
    widths = 2 * modes.frequency * modes.damping_ratio
    if not modes.count or widths.min() >= MIN_LINES_OF_WIDTH * spacing:
        return []
    mode = int(widths.argmin())
    return [Doubt(f"{state.name}: lines", f"spaced {spacing:.2g} Hz, the resonance at {modes.frequency[mode]:.4g} Hz is "
                  f"{widths[mode]:.2g} Hz wide: its damping is too high, and it may look like two modes",
                  f"take a `resolution` of {widths[mode] / MIN_LINES_OF_WIDTH:.1g} Hz, with a longer record",
                  figure=spacing / float(widths[mode]))]


def _pair_states(states: tuple[AxisState, ...]) -> list[tuple[int, int]]:
    """Return the modes of both states that are one: the nearest by frequency, one to one."""
    if len(states) < 2:
        return []
    first, second = (state.modes.modes.frequency for state in states)
    distance = np.abs(np.log(first[:, None] / second[None, :]))
    rows, columns = scipy.optimize.linear_sum_assignment(distance)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if distance[i, j] <= MAX_STATE_RATIO]


def _joint_damping(states: tuple[AxisState, ...], pairs: list[tuple[int, int]], machine: Machine, joint: str | None,
                   pose: Mapping[str, float] | None) -> JointDamping:
    """Return the damping of a joint by its share of every mode's strain energy."""
    names = list(machine.joint_names)
    if joint not in names:
        fail("joint", repr(joint), f"must be one of {', '.join(names)}", remedy="name the joint that the axis drives")
    modes = [state.modes.modes for state in states]
    model = model_drift(machine, modes[0].dofs, pose, highest=float(modes[0].frequency.max()))
    slope = next(each.slope for each in model.hypotheses if each.part == f"joint {joint}" and not each.direction)
    assert slope is not None
    energy = np.diag(slope) / model.nominal.omega**2

    def shares(frequency: FloatArray) -> FloatArray:
        distance = np.abs(np.log(frequency[:, None] / model.nominal.frequency[None, :]))
        partners = distance.argmin(axis=1)
        return np.where(distance.min(axis=1) <= MAX_STATE_RATIO, energy[partners], 0.0)

    at_most = []
    for each in modes:
        share = shares(each.frequency)
        limits = 2 * each.damping_ratio[share >= MIN_ENERGY_SHARE] / share[share >= MIN_ENERGY_SHARE]
        at_most.append(float(limits.min(initial=np.inf)))
    if not pairs:
        return JointDamping(f"joint {joint}", tuple(at_most))
    first, second = [i for i, _ in pairs], [j for _, j in pairs]
    share = shares(modes[0].frequency[first])
    change = 2 * (modes[1].damping_ratio[second] - modes[0].damping_ratio[first])
    variance = np.array([4 * (_variance(modes[0], i, 1) + _variance(modes[1], j, 1)) for i, j in pairs])
    weight = 1 / np.maximum(variance, 1e-300)
    information = float((weight * share**2).sum())
    if information <= 0:
        return JointDamping(f"joint {joint}", tuple(at_most))
    estimate = float((weight * share * change).sum()) / information
    misfit = float((weight * (change - share * estimate) ** 2).sum())
    probability = float(scipy.special.chdtrc(len(pairs) - 1, misfit)) if len(pairs) > 1 else 1.0
    return JointDamping(f"joint {joint}", tuple(at_most), estimate, NORMAL_QUANTILE_95 / float(np.sqrt(information)),
                        probability)


def _variance(modes: Modes, place: int, kind: int) -> float:
    return 0.0 if modes.covariance is None else float(modes.covariance[place][kind, kind])


def _with_interval(modes: Modes, place: int, kind: int) -> str:
    value = (float(modes.frequency[place]), 100 * float(modes.damping_ratio[place]))[kind]
    half_width = NORMAL_QUANTILE_95 * float(np.sqrt(_variance(modes, place, kind))) * (1, 100)[kind]
    return with_uncertainty(value, half_width, "") if half_width > 0 else f"{value:.4g}"
