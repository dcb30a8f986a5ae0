"""Frequency responses of a machine between named points at any pose, with intervals from its identified numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, increasing
from toolpoint._notebook import NotebookText
from toolpoint.kinematics.chain import check_poses
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.machine_uncertainty import MACHINE_DRAW_COUNT, AnswerSpread, machine_uncertainty
from toolpoint.studies.machines.pose_words import pose_words
from toolpoint.studies.machines.tool_point import rotate_to_axes, tool_axes
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof, Frf, SecondOrderSystem, StateSpace, damping, frequency_response, state_space

HEADER = ("pose", "response", "greatest µm/N", "at Hz", "95 % interval", "mostly of")
LINES_OF_RESONANCE = 4.0  # over the bandwidth of the sharpest mode
MIN_EVEN_LINES, MAX_EVEN_LINES = 400, 4000  # of responses without lines of the caller
MAX_UNCERTAIN_LINES = 800  # of a machine with identified numbers, whose slopes and draws are solved on every line
Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class MachineResponses(NotebookText):
    """Receptances of a machine at several poses.

    frfs : one Frf a pose; spread : of the natural logarithm of |H|, (n_poses, n_f, n_outputs, n_inputs), None where the machine
    holds no identified numbers with their covariance; notes : what was assumed.
    """

    machine: Machine
    poses: tuple[Mapping[str, float], ...]
    frfs: tuple[Frf, ...]
    spread: AnswerSpread | None = None
    notes: tuple[str, ...] = ()

    def band(self, pose: int) -> tuple[FloatArray, FloatArray] | None:
        """Return the ends of the 95 % interval of |H| at a pose, each (n_f, n_outputs, n_inputs); None without intervals."""
        if self.spread is None:
            return None
        size, half = np.abs(self.frfs[pose].values), self.spread.interval[pose]
        # The spread is one of the logarithm: an interval that is never negative.
        return size * np.exp(-half), size * np.exp(half)

    def rows(self) -> list[list[str]]:
        """Return a row of texts for every pose and driving response (all where there is none), see `HEADER`."""
        rows = []
        for k, (pose, frf) in enumerate(zip(self.poses, self.frfs, strict=True)):
            # Driving responses say most; where there is none every response is listed.
            pairs = [(i, j) for i, a in enumerate(frf.outputs) for j, b in enumerate(frf.inputs) if a == b] or [
                (i, j) for i in range(len(frf.outputs)) for j in range(len(frf.inputs))]
            for i, j in pairs:
                size = np.abs(frf.values[:, i, j])
                peak = int(np.argmax(size))
                row = [pose_words(self.machine, pose), f"{frf.outputs[i]} / {frf.inputs[j]}", f"{1e6 * size[peak]:.4g}",
                       f"{frf.frequency[peak]:.4g}", "", ""]
                if self.spread is not None:
                    row[4:] = (f"± {100 * np.expm1(self.spread.interval[k, peak, i, j]):.2g} %",
                               self.spread.main_part(k, peak, i, j))
                rows.append(row)
        return rows

    def table(self) -> str:
        """Return the greatest receptance of every response with its interval, and the joint that this comes from, as text."""
        return text_table(f"Responses of {self.machine.name}", HEADER, self.rows())

    def to_dict(self) -> dict[str, Any]:
        """Return lines (Hz), receptances (m/N), intervals of |H| and the joint each mostly comes from as plain data."""
        result = []
        for k, (pose, frf) in enumerate(zip(self.poses, self.frfs, strict=True)):
            band = self.band(k)
            result.append({
                "pose": dict(pose), "outputs": [str(dof) for dof in frf.outputs], "inputs": [str(dof) for dof in frf.inputs],
                "frequency_hz": frf.frequency.tolist(), "real_m_per_n": frf.values.real.tolist(),
                "imaginary_m_per_n": frf.values.imag.tolist(),
                "interval_m_per_n": None if band is None else [band[0].tolist(), band[1].tolist()]})
        return {"responses": result, "greatest": [dict(zip(HEADER, row, strict=True)) for row in self.rows()],
                "notes": list(self.notes)}


def study_responses_of_machine(
    machine: Machine, poses: Sequence[Mapping[str, float]] | None = None, outputs: Sequence[Dof | str] | None = None,
    *, inputs: Sequence[Dof | str] | None = None, frequency: ArrayLike | None = None, keep_draws: bool = False,
    progress: Progress | None = None,
) -> MachineResponses:
    """Return the receptances of a machine by direct solution, exact for damping of any kind.

    Parameters
    ----------
    machine : Machine
    poses : sequence of mappings of axis name to m or rad, optional
        Those of the description, or the reference pose, where left out.
    outputs, inputs : labels, optional
        ``point:direction``, also ``a-b:+x`` of a point relative to another. The tool against the table along the tool's x, y
        and z where left out; inputs where left out are the outputs.
    frequency : (n_f,) floats, optional
        Hz; where left out 400 to 4000 even lines over the lowest twelve modes, close enough for the sharpest of them (at most
        800 where the machine holds identified numbers).
    keep_draws : bool
        Let the Frfs keep the responses of machines drawn from the covariance of the identified numbers, for limits and for
        files: there what lines have in common counts. None are drawn of a machine without such numbers.
    progress : function of done and total, optional
        Of the slopes to the identified numbers, which the intervals come from.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, points={"tip": PointDescription("head")},
    ...                                    damping_ratio=0.02))
    >>> study = study_responses_of_machine(machine, outputs=["tip:+x"], frequency=[1.0])
    >>> round(float(abs(study.frfs[0].values[0, 0, 0])) * 1e7, 3)  # far below resonance: 1/k
    1.0
    """
    chosen = tuple(check_poses(poses) if poses is not None else machine.description.poses) or ({},)
    if not machine.description.damping_ratio and not machine.description.modal_damping and not _has_loss(machine):
        fail("machine", "no damping", "its responses would be infinite at every resonance",
             remedy="give damping_ratio, or loss_factor or damping to joints")
    # The same lines at every pose, so that responses can be laid over each other.
    uncertainty = machine_uncertainty(machine)
    line_count_max = MAX_EVEN_LINES if uncertainty is None else MAX_UNCERTAIN_LINES
    resonances = _resonances(machine, chosen)
    lines = _lines(resonances, line_count_max) if frequency is None else increasing("frequency",
                                                                          np.atleast_1d(np.asarray(frequency, float)))

    def responses(sample: Machine) -> list[Frf]:
        return [_response(sample, pose, outputs, inputs, lines=lines) for pose in chosen]

    spread = None if uncertainty is None else uncertainty.spread(
        lambda sample: np.log(np.maximum(np.abs([frf.values for frf in responses(sample)]), 1e-300)), progress)
    frfs = responses(machine)
    if uncertainty is not None and keep_draws:
        drawn = [responses(sample) for sample in uncertainty.samples(MACHINE_DRAW_COUNT, np.random.default_rng(0))]
        frfs = [_with_draws(frf, [sample[k] for sample in drawn]) for k, frf in enumerate(frfs)]
    notes = () if spread is not None else (
        "no intervals: the machine file holds no identified numbers with their covariance (section identified)",)
    return MachineResponses(machine, chosen, tuple(frfs), spread,
                            (*_spacing_notes(resonances, lines), *notes, *dict.fromkeys(n for frf in frfs for n in frf.notes)))


def _with_draws(frf: Frf, drawn: Sequence[Frf]) -> Frf:
    draws = np.stack([each.values for each in drawn])
    return replace(frf, draws=draws, variance=draws.var(axis=0))


def _response(machine: Machine, pose: Mapping[str, float], outputs: Sequence[Dof | str] | None,
              inputs: Sequence[Dof | str] | None, *, lines: FloatArray) -> Frf:
    return frequency_response.direct(_system_at(machine, pose, outputs, inputs), lines)


def _system_at(machine: Machine, pose: Mapping[str, float], outputs: Sequence[Dof | str] | None,
               inputs: Sequence[Dof | str] | None) -> SecondOrderSystem:
    """Return the equations at a pose; tool against table along the tool's axes where no outputs are given."""
    if outputs is not None:
        return assemble(machine, pose, outputs, inputs=inputs)
    description = machine.description
    if description.tool is None:
        fail("outputs", "none, and the machine names no tool", "must be point:direction labels",
             remedy="add 'tool: NAME' to the machine file, or name outputs")
    point = description.tool if description.table is None else f"{description.tool}-{description.table}"
    batch = {name: np.atleast_1d(float(value)) for name, value in pose.items()}
    system = assemble(machine, pose, [Dof.parse(f"{point}:{way}") for way in ("+x", "+y", "+z")], inputs=inputs)
    # With inputs of the caller only the outputs could be turned, so that neither is.
    return system if inputs is not None else rotate_to_axes(system, tool_axes(machine, batch)[0])


def state_space_of_machine(machine: Machine, pose: Mapping[str, float] | None = None,
                           outputs: Sequence[Dof | str] | None = None, *, inputs: Sequence[Dof | str] | None = None
                           ) -> tuple[StateSpace, tuple[str, ...]]:
    """Return a machine at a pose as a state space with named inputs (N), outputs (m) and states, and notes on it.

    Arguments are those of `study_responses_of_machine`; states are the coordinates and their rates, m and rad, none left out.
    Structural damping, which has no form in time, becomes viscous damping of equal loss at each resonance: a note says so.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e4})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, points={"tip": PointDescription("head")}))
    >>> system, _ = state_space_of_machine(machine, outputs=["tip:+x"])
    >>> system.a.tolist(), system.states
    ([[0.0, 1.0], [-100.0, -0.0]], ('slide.x', 'dslide.x'))
    """
    system = damping.equivalent_viscous(_system_at(machine, dict(pose or {}), outputs, inputs))
    return state_space.physical(system), (f"state space at {pose_words(machine, pose or {})}", *system.notes)


def _has_loss(machine: Machine) -> bool:
    losses = [(law.damping, law.structural_damping) for law in (*machine.joints, *(loop.law for loop in machine.loops))]
    losses += [(body.damping, body.structural_damping) for body in machine.bodies]
    return any(np.any(damping) or np.any(structural) for damping, structural in losses)


def _lines(resonances: FloatArray, line_count_max: int) -> FloatArray:
    """Return even lines over the resonances (`_resonances`), `LINES_OF_RESONANCE` over the bandwidth of the sharpest where
    `line_count_max` allows: limits of cuts on a saved response hang on its peaks."""
    lowest, highest = 0.2 * float(resonances[0].min()), 1.3 * float(resonances[0].max())
    sharpest = float(resonances[1].min(initial=highest))
    count = int(np.clip(np.ceil(LINES_OF_RESONANCE * (highest - lowest) / sharpest), MIN_EVEN_LINES, line_count_max))
    return np.linspace(lowest, highest, count)


def _resonances(machine: Machine, poses: Sequence[Mapping[str, float]]) -> FloatArray:
    """Return frequencies and bandwidths (2, n), Hz, of the lowest modes at all poses; motions without stiffness left out."""
    ends = [body_shapes(machine, pose, 12) for pose in poses]
    frequency, ratio = (np.concatenate([getattr(shapes, name) for shapes in ends]) for name in ("frequency", "damping_ratio"))
    return np.stack([frequency, 2 * ratio * frequency])[:, frequency > 1e-6]


def _spacing_notes(resonances: FloatArray, lines: FloatArray) -> tuple[str, ...]:
    """Return a note where a resonance within the lines may fall between two of them."""
    frequency, width = resonances[:, (resonances[0] > lines[0]) & (resonances[0] < lines[-1])]
    spacing = np.diff(lines)[np.clip(np.searchsorted(lines, frequency) - 1, 0, None)] if lines.size > 1 else np.zeros(0)
    if not spacing.size or (spacing <= width).all():
        return ()
    k = int(np.argmax(spacing / np.maximum(width, 1e-300)))
    return (f"lines are {spacing[k]:.3g} Hz apart at {frequency[k]:.4g} Hz, where a resonance is {width[k]:.2g} Hz wide: its "
            f"peak may fall between them; lines {width[k] / LINES_OF_RESONANCE:.2g} Hz apart show it (`lines`)",)
