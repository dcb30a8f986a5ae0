"""Natural frequencies of a machine at a pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt, doubts_among, place_note, with_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.machine.assembly.gyroscopics import fastest_spin
from toolpoint.machine.assembly.reduction_error import doubt_modes_above_bands, estimate_note, reduction_note
from toolpoint.machine.assembly.reduction_estimate import ReductionEstimate, estimate_reduction
from toolpoint.machine.assembly.shapes import BodyShapes, body_shapes
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.studies.machines.machine_uncertainty import AnswerSpread, machine_uncertainty
from toolpoint.studies.text_table import text_table

MIN_REPORTED_SHIFT = 1e-5  # relative: smaller differences between undamped and fitted frequencies are not reported


@dataclass(frozen=True, eq=False)
class MachineModes(NotebookText):
    """The lowest natural frequencies (n_modes,) of a machine, Hz, at a pose; those of whirl where bodies spin.

    spread : of the frequencies, Hz, None where the machine holds no identified numbers with their covariance; notes : what the
    reduction of elastic bodies does at this pose, and what else is to be known or doubted (`Doubt`);
    damping_ratio : (n_modes,) by the losses stated, None where bodies spin;
    reduction : by how much the reduction of elastic bodies raises each frequency at most, None where nothing is reduced, or
    where bodies spin, or bodies do not keep what an estimate needs.
    """

    machine: Machine
    pose: Mapping[str, float]
    frequency: FloatArray
    spread: AnswerSpread | None = None
    notes: tuple[str, ...] = ()
    damping_ratio: FloatArray | None = None
    reduction: ReductionEstimate | None = None

    def table(self) -> str:
        """Return the frequencies as text, with their 95 % intervals and the joint that these mostly come from."""
        rows = [[str(i + 1), f"{f:.4f}"] for i, f in enumerate(self.frequency)]
        spin = fastest_spin(self.machine.description)
        title = self.machine.name + (f", bodies spinning at up to {spin * 30 / 3.141592653589793:.6g} rev/min" if spin else "")
        header = ["mode", "frequency Hz"]
        if self.damping_ratio is not None and self.damping_ratio.any():
            header.append("damping %")
            rows = [[*row, f"{100 * ratio:.3f}"] for row, ratio in zip(rows, self.damping_ratio, strict=True)]
        if self.reduction is not None:
            header.append("reduction error %")
            rows = [[*row, f"{100 * error:.2g}" if sure else "doubt"]
                    for row, error, sure in zip(rows, self.reduction.error, self.reduction.is_sure, strict=True)]
            if self.reduction.mesh is not None:
                header.append("mesh error %, about")
                rows = [[*row, f"{100 * error:.2g}"] for row, error in zip(rows, self.reduction.mesh, strict=True)]
        if self.spread is not None:
            header += ["± Hz (95 %)", "mostly of"]
            rows = [[*row, f"{self.spread.interval[i]:.2g}", self.spread.main_part(i)] for i, row in enumerate(rows)]
        return "\n".join(with_notes([text_table(title, header, rows)], self.notes))

    def to_dict(self) -> dict[str, Any]:
        """Return the frequencies (Hz) as plain data, with their intervals and errors of reduction and mesh.

        Half widths of 95 % intervals and their joints (None: not known); the largest relative error by reduction (None in the
        list: not to be believed); the approximate error by the mesh.
        """
        spread, estimate = self.spread, self.reduction
        return {"frequency_hz": self.frequency.tolist(),
                "interval_hz": None if spread is None else spread.interval.tolist(),
                "damping_ratio": None if self.damping_ratio is None else self.damping_ratio.tolist(),
                "reduction_error": None if estimate is None else [
                    float(error) if sure else None for error, sure in zip(estimate.error, estimate.is_sure, strict=True)],
                "mesh_error": None if estimate is None or estimate.mesh is None else estimate.mesh.tolist(),
                "doubts": doubts_among(self.notes), "notes": list(self.notes),
                "interval_mostly_of": None if spread is None else [spread.main_part(i) for i in range(len(self.frequency))]}


def solve_modes(machine: Machine, pose: Mapping[str, float] | None = None, count: int = 12) -> MachineModes:
    """Return the lowest natural frequencies of a machine at a pose (m, rad), undamped.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7}, loss_factor=0.04)
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}))
    >>> modes = solve_modes(machine)
    >>> modes.frequency.round(2).tolist(), modes.damping_ratio.round(3).tolist()  # half the loss factor
    ([50.33], [0.02])
    """
    chosen_pose = dict(pose or {})
    uncertainty = machine_uncertainty(machine)
    spread = None if uncertainty is None else uncertainty.spread(lambda sample: _frequencies(sample, chosen_pose, count))
    if fastest_spin(machine.description):
        frequency = _frequencies(machine, chosen_pose, count)
        standstill_note = reduction_note(machine, chosen_pose, min(count, 10))
        return MachineModes(machine, chosen_pose, frequency, spread, (*doubt_modes_above_bands(machine, frequency),
                                                                      *([place_note(standstill_note, "at standstill")]
                                                                        if standstill_note else [])))
    shapes = body_shapes(machine, chosen_pose, count)
    # The estimate bounds every mode; where it cannot be had a coarser note stands in.
    estimate = estimate_reduction(machine, chosen_pose, count)
    reduction = reduction_note(machine, chosen_pose, min(count, 10)) if estimate is None else estimate_note(estimate)
    notes = (*_mechanism_notes(shapes), *doubt_modes_above_bands(machine, shapes.frequency),
             *([reduction] if reduction else []), *_test_note(shapes))
    return MachineModes(machine, chosen_pose, shapes.frequency, spread, notes, shapes.damping_ratio, estimate)


def _mechanism_notes(shapes: BodyShapes) -> tuple[Doubt, ...]:
    """Return a doubt about modes at 0 Hz: a mechanism left free, named by what moves."""
    free = shapes.mechanisms()
    if not free:
        return ()
    return (Doubt("modes at 0 Hz", f"nothing holds {', '.join(free)}", "give the joint stiffness there, or a drive; leave it "
                  "where it is meant to be free"),)


def _test_note(shapes: BodyShapes) -> tuple[str, ...]:
    r"""Return by how much the frequencies of a test exceed the undamped ones.

    A pole under structural loss is :math:`\omega \sqrt{1 + i \eta}`, of size :math:`\omega (1 + \eta^2)^{1/4}`: modes fitted
    to measured responses state that size.
    """
    # The modulus of the root of 1 + i eta: a test names the pole, the model the frequency without damping.
    shift = (1 + (2 * shapes.structural_ratio) ** 2) ** 0.25 - 1
    if shift.size == 0 or shift.max() < MIN_REPORTED_SHIFT:
        return ()
    mode = int(shift.argmax())
    return (f"frequencies without damping: structural losses raise those that a test fits, by {100 * shift[mode]:.2g} % in "
            f"mode "
            f"{mode + 1}, at most",)


def _frequencies(machine: Machine, pose: Mapping[str, float], count: int) -> FloatArray:
    if fastest_spin(machine.description):
        return natural_frequencies(machine, pose, count)[0]
    return body_shapes(machine, pose, count).frequency
