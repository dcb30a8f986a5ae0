"""The measured reference of a machine's own file beside its modes: frequencies, and damping where it was measured."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.description import ReferenceDescription
from toolpoint.machine.parts.model import Machine
from toolpoint.vibration.damped_modes import solve_as_damped, upper_poles

# Relative difference of a frequency, and of a damping ratio, from which a file contradicts its own reference.
FREQUENCY_TOLERANCE, DAMPING_TOLERANCE = 0.01, 0.3


def question_reference(machine: Machine) -> list[Doubt]:
    """Return a doubt for every measured reference that the machine's modes at the reference pose contradict.

    Each measured frequency is set beside one mode of the machine, so that the differences are least together; modes that the
    test did not show are no contradiction. A machine that cannot be solved there raises none: its use says why.
    """
    measured = [reference for reference in machine.description.reference if reference.is_measured]
    if not measured:
        return []
    try:
        frequency, ratio = _modes(machine)
    except (ToolpointError, np.linalg.LinAlgError):
        return []
    return [doubt for reference in measured for doubt in _contradictions(reference, frequency, ratio)]


def _modes(machine: Machine) -> tuple[FloatArray, FloatArray]:
    """Return natural frequencies ``|s| / 2 pi`` (n,), Hz, and damping ratios (n,)."""
    point = next(iter(machine.description.points), None)
    system = assemble(machine, outputs=None if point is None else [f"{point}:+x"])
    poles = upper_poles(solve_as_damped(system))
    size = np.abs(poles)
    return size / (2 * np.pi), -poles.real / np.maximum(size, 1e-300)


def _contradictions(reference: ReferenceDescription, frequency: FloatArray, ratio: FloatArray) -> list[Doubt]:
    """Return the doubts of one reference against frequencies (n,), Hz, and ratios (n,) of the machine."""
    measured_frequency = np.array(reference.frequencies)
    log_distance = np.abs(np.log(np.outer(measured_frequency, 1 / np.maximum(frequency, 1e-9))))
    rows, columns = linear_sum_assignment(log_distance)
    deviation = {int(i): float(frequency[j] / measured_frequency[i] - 1) for i, j in zip(rows, columns, strict=True)}
    doubts = []
    if contradicted := [i for i, difference in deviation.items() if abs(difference) > FREQUENCY_TOLERANCE]:
        figures = ", ".join(f"{measured_frequency[i]:.4g} Hz ({100 * deviation[i]:+.1f} %)" for i in contradicted)
        doubts.append(Doubt(f"reference {reference.name}", f"the machine's modes differ from those measured at {figures}",
                            "the file was changed, or the test is of another machine: update it to the test",
                            figure=max(abs(deviation[i]) for i in contradicted)))
    if unmatched := [f"{measured_frequency[i]:.4g} Hz" for i in range(len(measured_frequency)) if i not in deviation]:
        doubts.append(Doubt(f"reference {reference.name}",
                            f"the machine has no mode for those measured at {', '.join(unmatched)}",
                            "give it the freedoms that move in them"))
    damping_deviation = {int(i): float(ratio[j] / reference.damping_ratio[i] - 1) for i, j in zip(rows, columns, strict=True)
                         if i < len(reference.damping_ratio) and reference.damping_ratio[i] > 0 and i not in contradicted}
    if contradicted := [i for i, difference in damping_deviation.items() if abs(difference) > DAMPING_TOLERANCE]:
        figures = ", ".join(f"{measured_frequency[i]:.4g} Hz ({100 * ratio[dict(zip(rows, columns, strict=True))[i]]:.2g} % "
                            f"for {100 * reference.damping_ratio[i]:.2g} %)" for i in contradicted)
        doubts.append(Doubt(f"reference {reference.name}", f"the machine's damping differs from that measured at {figures}",
                            "correct the damping of its joints, or state a damping ratio",
                            figure=max(abs(damping_deviation[i]) for i in contradicted)))
    return doubts
