r"""Devices fastened to a machine at one place: a rank-one change of its responses by the dynamic stiffness of the device.

A device that resists the motion of its base with Z gives :math:`G_{cc} - g_{cp} Z g_{pc} / (1 + Z g_{pp})`, exactly and at once
for all directions c of the cut (Sherman, Morrison).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.studies.finite_elements.machine_cut import PLANE
from toolpoint.vibration import Dof, Frf, Modes, frequency_response


@dataclass(frozen=True, eq=False)
class FittingPlace:
    """Receptances, m/N, about a place and direction p where a device may be fitted.

    lines : (n_f,) Hz; cut : (n_f, 2, 2) of the tool against the work in x and y; to_cut : (n_f, 2) motion there for a force at
    p; from_cut : (n_f, 2) motion of p for forces there; itself : (n_f,) of p.
    """

    lines: FloatArray
    cut: ComplexArray
    to_cut: ComplexArray
    from_cut: ComplexArray
    itself: ComplexArray

    @property
    def omega(self) -> FloatArray:
        """Angular frequency of the lines, rad/s."""
        return 2 * np.pi * self.lines

    def with_device(self, stiffness: ComplexArray) -> ComplexArray:
        """Return the receptances (n_f, 2, 2) of the cut with a device of this dynamic stiffness (n_f,), N/m, at p."""
        factor = stiffness / (1 + stiffness * self.itself)
        return self.cut - np.einsum("fi,f,fj->fij", self.to_cut, factor, self.from_cut)

    def frf(self, values: ComplexArray) -> Frf:
        """Return values (n_f, 2, 2) as the response of tool against work."""
        return Frf(self.lines, values, PLANE, PLANE)


def fitting_place(modes: Modes, place: Dof | str, lines: FloatArray) -> FittingPlace:
    """Return the receptances about a place and direction on lines (n_f,), Hz.

    modes : with damping, at the place and at the tool against the work (`PLANE`). Raises ToolpointError for lines that are too
    far apart.
    """
    p = place if isinstance(place, Dof) else Dof.parse(place)
    _check_lines(modes, lines)
    labels = [*PLANE, p]
    values = frequency_response.modal(modes, lines, outputs=labels, inputs=labels).values
    return FittingPlace(np.asarray(lines, float), values[:, :2, :2], values[:, :2, 2], values[:, 2, :2], values[:, 2, 2])


def _check_lines(modes: Modes, lines: FloatArray) -> None:
    """Refuse lines (Hz) farther apart than half the half-power width of a mode between them."""
    inside = np.flatnonzero((modes.frequency > lines[0]) & (modes.frequency < lines[-1]))
    upper = np.searchsorted(lines, modes.frequency[inside])
    gap, width = lines[upper] - lines[upper - 1], 2 * (modes.damping_ratio * modes.frequency)[inside]
    worst_pair = int(np.argmax(gap / np.maximum(width, 1e-300))) if inside.size else 0
    if inside.size and gap[worst_pair] > 0.5 * width[worst_pair]:
        fail("lines",
             f"{gap[worst_pair]:.3g} Hz apart at mode {inside[worst_pair] + 1}, whose half-power width is "
             f"{width[worst_pair]:.3g} Hz",
             "must be two within it, or more", remedy="take closer lines about the modes")


def damper_stiffness(omega: FloatArray, mass: float, natural: float, *, ratio: float) -> ComplexArray:
    r"""Return the dynamic stiffness of a sprung mass at its base, N/m.

    :math:`-\omega^2 m \kappa / (\kappa - \omega^2 m)`, :math:`\kappa = k + i \omega c`; natural : its own angular frequency,
    rad/s; ratio : its damping ratio.
    """
    spring = mass * (natural**2 + 2j * ratio * natural * omega)
    return -(omega**2) * mass * spring / (spring - omega**2 * mass)
