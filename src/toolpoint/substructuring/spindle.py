r"""Receptance coupling of a shaft to a spindle that answers in both planes at once, against a work that gives way too.

The section where the shaft begins has a deflection and a slope in the planes of x and y, a shift and a turn along the shaft:
A, 6x6. The work's deflections along x and y are W^T under the wrench on that section, and B under forces on the work. Of the
free shaft, :math:`Z_c` is the dynamic stiffness at its base with the other sections condensed, :math:`K_{rr}` that of the
others, :math:`C = K_{rr}^{-1} K_{rb}`; along its axis the shaft is a rigid mass, since bars answer far above the band:

.. math:: u_b = (I + A Z_c)^{-1} (W f - A C^T F),\quad u_r = K_{rr}^{-1} F - C u_b,\quad w_b = -Z_c u_b - C^T F

for forces F on the shaft and f on the work; the work follows by :math:`W^T w_b + B f`. Nothing of A, W or B is left out, so a
machine with a coupled tool is the machine with that tool as a body of it. Source: the equations of `receptance`, joined.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, complexes, fail, floats, increasing, nonnegative
from toolpoint._notebook import NotebookText
from toolpoint.substructuring.receptance import DEFAULT_DRAW_COUNT, PlaneReceptance, is_uncertain_shaft
from toolpoint.substructuring.shaft import ShaftDescription
from toolpoint.substructuring.shaft_stiffness import station_stiffness

SECTION_FREEDOMS = 6  # deflection and slope of a section in the planes of x and y, shift and turn along the shaft
BENDING_FREEDOMS = 4  # those in the planes of x and y


@dataclass(frozen=True, eq=False)
class SpindleReceptance(NotebookText):
    """Receptance of the section where a tool begins, in both planes, and of the work.

    Parameters
    ----------
    frequency : (n_f,) floats
        Hz, increasing.
    values : (n_f, 8, 8) complex, or (n_f, 6, 6) where the work is rigid
        Over deflection and slope (from base to tip) in x, those in y, shift and turn along z, then the work's deflections along
        x and y; per force (N) and moment (N m).
    draws : (n_draws, n_f, 8, 8) complex, optional
        Equally likely values.
    notes : sequence of str

    Examples
    --------
    >>> SpindleReceptance(np.array([100.0, 200.0]), np.zeros((2, 6, 6)))
    SpindleReceptance(100..200 Hz, 2 lines, rigid work)
    """

    frequency: FloatArray
    values: ComplexArray
    draws: ComplexArray | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "frequency", nonnegative("frequency", increasing("frequency", floats("frequency", self.frequency))))
        size = np.shape(self.values)[-1]
        if size not in (SECTION_FREEDOMS, SECTION_FREEDOMS + 2):
            fail("values", f"{size} columns", "must be 6 of the section, or 8 with the work's two")
        put(self, "values", complexes("values", self.values, (self.frequency.size, size, size)))
        if self.draws is not None:
            put(self, "draws", complexes("draws", self.draws, (None, self.frequency.size, size, size)))
        put(self, "notes", tuple(self.notes))

    @property
    def has_work(self) -> bool:
        """Whether the work gives way."""
        return self.values.shape[-1] > SECTION_FREEDOMS

    def __repr__(self) -> str:
        work = "work that gives way" if self.has_work else "rigid work"
        return f"SpindleReceptance({self.frequency[0]:g}..{self.frequency[-1]:g} Hz, {self.frequency.size} lines, {work})"


@dataclass(frozen=True, eq=False)
class CoupledTip:
    """Tip of a tool: its receptance in every plane that is known, and the deflection along x by a force along y, (n_f,), with
    its draws (n_draws, n_f), None where nothing is known of it."""

    tips: tuple[PlaneReceptance, ...]
    cross: ComplexArray | None = None
    cross_draws: ComplexArray | None = None


def couple_spindle(spindle: SpindleReceptance, shaft: ShaftDescription, *, generator: np.random.Generator | None = None
                   ) -> CoupledTip:
    """Couple a shaft to a spindle; return the receptance of its tip against the work.

    Every draw of the spindle is joined with a shaft drawn within its own deviations, as in `couple_tool`.

    Raises ToolpointError for a shaft with deviations without a generator, and for a line at an undamped resonance.

    Examples
    --------
    A rod of 20 mm x 100 mm on a rigid spindle, over a work that is as soft as 1 um/N along x:

    >>> from toolpoint.substructuring import SegmentDescription, ShaftDescription
    >>> rod = ShaftDescription({"rod": SegmentDescription(length=0.1, diameter=0.02)})
    >>> values = np.zeros((1, 8, 8))
    >>> values[0, 6, 6] = 1e-6
    >>> tip = couple_spindle(SpindleReceptance(np.array([0.0]), values), rod).tips[0]
    >>> print(f"{1e6 * tip.values[0, 0, 0].real:.4f} um/N")
    1.2065 um/N
    """
    is_uncertain = is_uncertain_shaft(shaft)
    if is_uncertain and generator is None:
        fail("generator", "None", "a shaft with deviations needs a numpy Generator to draw them",
             remedy="for example numpy.random.default_rng(1)")
    values, drawn = _couple(spindle.frequency, spindle.values, shaft), None
    draws = spindle.draws
    if draws is None and is_uncertain:
        draws = np.broadcast_to(spindle.values, (DEFAULT_DRAW_COUNT, *spindle.values.shape))
    if draws is not None:
        drawn = np.stack([_couple(spindle.frequency, draw, shaft.drawn(generator) if is_uncertain and generator else shaft)
                          for draw in draws])
    tips = [PlaneReceptance(spindle.frequency, values[:, part, part], plane, None if drawn is None else drawn[:, :, part, part],
                            spindle.notes) for plane, part in (("x", slice(0, 2)), ("y", slice(2, 4)))]
    return CoupledTip(tuple(tips), values[:, 0, 2], None if drawn is None else drawn[:, :, 0, 2])


def _couple(frequency: FloatArray, spindle: ComplexArray, shaft: ShaftDescription) -> ComplexArray:
    """Return the receptance of the tip over its bending freedoms, (n_f, 4, 4), its deflections against those of the work."""
    compliance, carried, condensed = _free_shaft(frequency, shaft)
    base, size = spindle[:, :SECTION_FREEDOMS, :SECTION_FREEDOMS], spindle.shape[-1]
    by_tip = np.swapaxes(carried, -1, -2)  # (n_f, 6, 4)
    # Motion of the base by forces on the tip and on the work, (n_f, 6, 4 + 2).
    driven = np.concatenate([-base @ by_tip, spindle[:, :SECTION_FREEDOMS, SECTION_FREEDOMS:]], axis=-1)
    moved = np.linalg.solve(np.eye(SECTION_FREEDOMS) + base @ condensed, driven)
    tip = -carried @ moved
    tip[:, :, :BENDING_FREEDOMS] += compliance
    if size == SECTION_FREEDOMS:
        return tip
    wrench = -condensed @ moved
    wrench[:, :, :BENDING_FREEDOMS] -= by_tip
    work = spindle[:, SECTION_FREEDOMS:, :SECTION_FREEDOMS] @ wrench
    work[:, :, BENDING_FREEDOMS:] += spindle[:, SECTION_FREEDOMS:, SECTION_FREEDOMS:]
    # Tool against work: deflections are differences, and a force on the tool is met by one on the work.
    against = np.eye(BENDING_FREEDOMS, BENDING_FREEDOMS + 2)
    against[0, 4] = against[2, 5] = -1.0
    return np.asarray(against @ np.concatenate([tip, work], axis=1) @ against.T)


def _free_shaft(frequency: FloatArray, shaft: ShaftDescription) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return of a free shaft its tip's compliance with the base held, (n_f, 4, 4), -du_tip/du_base, (n_f, 4, 6), and its
    condensed stiffness at the base, (n_f, 6, 6)."""
    stiffness = station_stiffness(shaft, frequency, {}).matrix
    others, by_base = stiffness[:, 2:, 2:], stiffness[:, 2:, :2]
    unit = np.zeros((others.shape[-1], 2))
    unit[-2:] = np.eye(2)
    try:
        solved = np.linalg.solve(others, np.concatenate([np.broadcast_to(unit, (*others.shape[:-1], 2)), by_base], axis=-1))
    except np.linalg.LinAlgError:
        fail("frequency", "a line at an undamped resonance of the tool", "must not be one",
             remedy="give the tool a loss factor")
    condensed = np.zeros((frequency.size, SECTION_FREEDOMS, SECTION_FREEDOMS), complex)
    condensed[:, :BENDING_FREEDOMS, :BENDING_FREEDOMS] = _both_planes(
        stiffness[:, :2, :2] - stiffness[:, :2, 2:] @ solved[:, :, 2:])
    omega_squared = (2 * np.pi * frequency) ** 2
    condensed[:, 4, 4], condensed[:, 5, 5] = -omega_squared * shaft.mass, -omega_squared * shaft.polar_inertia
    carried = np.concatenate([_both_planes(solved[:, -2:, 2:]), np.zeros((frequency.size, BENDING_FREEDOMS, 2))], axis=-1)
    return _both_planes(solved[:, -2:, :2]), carried, condensed


def _both_planes(matrix: ComplexArray) -> ComplexArray:
    """Return a round shaft's 2x2 of one plane as the 4x4 of both."""
    result = np.zeros((matrix.shape[0], BENDING_FREEDOMS, BENDING_FREEDOMS), complex)
    result[:, :2, :2] = result[:, 2:, 2:] = matrix
    return result
