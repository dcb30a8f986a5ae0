"""Checks of measured responses: reciprocity, the mass of the sensor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, floats, nonnegative
from toolpoint.vibration.dof import Dof, positions
from toolpoint.vibration.frf import Frf


@dataclass(frozen=True)
class Reciprocity:
    """Agreement of H(a, b) with H(b, a).

    agreement : assurance criterion, 1 where they are equal up to scale; ratio : size of H(b, a) over that of H(a, b), negative
    where the signs differ.
    """

    first: Dof
    second: Dof
    agreement: float
    ratio: float

    @property
    def holds(self) -> bool:
        """Whether both agree within ten per cent."""
        return self.agreement > 0.9 and 0.9 < abs(self.ratio) < 1.1 and self.ratio > 0


def reciprocity(frf: Frf) -> list[Reciprocity]:
    """Return the comparison of every pair of Dofs that are both outputs and inputs (Maxwell).

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import reciprocity
    >>> from toolpoint.vibration import Frf
    >>> frf = Frf([10.0, 20.0], np.array([[[1, 2], [-2, 3]], [[1, 4], [-4, 3]]]) * 1e-8, ["1:+x", "2:+x"], ["1:+x", "2:+x"])
    >>> pair = reciprocity(frf)[0]
    >>> round(pair.agreement, 9), round(pair.ratio, 9), pair.holds
    (1.0, -1.0, False)
    """
    shared = [dof for dof in frf.outputs if dof in frf.inputs]
    result = []
    for i, first in enumerate(shared):
        for second in shared[i + 1:]:
            a = frf.values[..., frf.outputs.index(first), frf.inputs.index(second)].reshape(-1)
            b = frf.values[..., frf.outputs.index(second), frf.inputs.index(first)].reshape(-1)
            cross, power = complex(np.vdot(a, b)), float(np.vdot(a, a).real * np.vdot(b, b).real)
            scale = np.sqrt(float(np.vdot(b, b).real) / max(float(np.vdot(a, a).real), 1e-300))
            result.append(Reciprocity(first, second, abs(cross) ** 2 / max(power, 1e-300),
                                      float(np.copysign(scale, cross.real))))
    return result


def mass_loading(frf: Frf, mass: float) -> FloatArray:
    r"""Return the relative change that a sensor of `mass` (kg) makes at each driving point, (n_f, n_points).

    A mass m at a driving point with true accelerance A gives :math:`A/(1 + m A)`, so the change is about
    :math:`|m A_{measured}|`; above a few per cent on a resonance, the frequency there is that of structure plus sensor.
    Source: Ewins, Modal Testing, 2nd ed., section 3.10.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import mass_loading
    >>> from toolpoint.vibration import Frf
    >>> frf = Frf([10.0, 20.0], np.full((2, 1, 1), 2.0), ["tool:+x"], ["tool:+x"], "accelerance")
    >>> mass_loading(frf, 0.01).tolist()
    [[0.02], [0.02]]
    """
    nonnegative("mass", floats("mass", mass))
    inside = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1])).converted_to("accelerance")
    shared = [dof for dof in inside.outputs if dof in inside.inputs]
    direct = [inside.values[:, inside.outputs.index(dof), inside.inputs.index(dof)] for dof in shared]
    return np.abs(np.array(direct).T * mass) if shared else np.zeros((inside.frequency.size, 0))


def without_mass(frf: Frf, dof: Dof | str, mass: float) -> Frf:
    r"""Return the responses without the mass (kg) of a sensor fixed at `dof`, which must be output and input.

    Removing m is adding -m, a structural modification that is exact for all responses measured with the sensor at p:
    :math:`A = A' + A'_{:p}\, \frac{m}{1 - m A'_{pp}}\, A'_{p:}` in accelerances.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import without_mass
    >>> from toolpoint.vibration import Frf
    >>> frf = Frf([10.0, 20.0], np.full((2, 1, 1), 2.0), ["tool:+x"], ["tool:+x"], "accelerance")
    >>> without_mass(frf, "tool:+x", 0.1).values[0, 0, 0].real.round(9).tolist()  # 2 / (1 - 0.1 * 2)
    2.5
    """
    row, column = positions("outputs", [dof], frf.outputs)[0], positions("inputs", [dof], frf.inputs)[0]
    inside = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    lines = inside.converted_to("accelerance")

    shift = 1 / np.abs(1 - mass * lines.values[:, row, column])
    # First order in the response itself: squared for all, and once more where the mass sits on both sides.
    scale = np.broadcast_to((shift**2)[:, None, None], lines.values.shape).copy()
    scale[:, row, column] *= shift**2

    def bare(values: ComplexArray) -> ComplexArray:
        column_values, row_values = values[..., column, None], values[..., row, None, :]
        factor = mass / (1 - mass * values[..., row, column])
        return np.asarray(values + column_values * row_values * factor[..., None, None])

    corrected = Frf(lines.frequency, bare(lines.values), lines.outputs, lines.inputs, "accelerance", decay=frf.decay,
                    notes=(*frf.notes, f"sensor mass of {mass:g} kg at {dof} taken out"), coherence=lines.coherence,
                    variance=None if lines.variance is None else lines.variance * scale,
                    draws=None if lines.draws is None else bare(lines.draws))
    return corrected.converted_to(frf.quantity)


def free_of_masses(frf: Frf, masses: Mapping[str, float]) -> Frf:
    """Return the responses without the masses (kg, by Dof) that sensors add at driving points; notes say what stays.

    A mass at a Dof where no force acts, or whose response was not measured, cannot be taken off, and is named.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals.checks import free_of_masses
    >>> from toolpoint.vibration import Frf
    >>> frf = Frf([10.0, 20.0], np.full((2, 1, 1), 2.0), ["tool:+x"], ["tool:+x"], "accelerance")
    >>> free_of_masses(frf, {"tool:+x": 0.1, "table:+x": 0.1}).notes[-1].split(":")[0]
    'sensor mass of 0.1 kg at table'
    """
    freed, notes = frf, list[str]()
    for text, mass in masses.items():
        dof = Dof.parse(text)
        if mass and dof in frf.outputs and dof in frf.inputs:
            freed = without_mass(freed, dof, mass)
        elif mass:
            notes.append(f"sensor mass of {mass:g} kg at {dof} stays in the responses: no driving point was measured there")
    return replace(freed, notes=(*freed.notes, *notes))
