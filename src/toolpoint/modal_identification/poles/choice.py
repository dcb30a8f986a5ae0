"""Poles chosen by hand: modes of the automatic identification that are removed, and poles that are added, before a refit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from toolpoint._check import ComplexArray, fail
from toolpoint._quantity import Quantity
from toolpoint.modal_identification.residues import residues
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

REMOVAL_HALF_WIDTHS, REMOVAL_FRACTION = 1.0, 0.005  # half widths, and fraction of a frequency, within which a mode is meant
MIN_POLE_DISTANCE = 0.2  # half widths: nearer, an added pole repeats a mode
MAX_POLE_SHIFT = 3.0  # half widths by which a refined pole may leave its place

Hertz = Annotated[float, Quantity("frequency", "Hz", above=0)]


@dataclass(frozen=True)
class AddedPole:
    """A pole that is added: frequency (Hz) and damping ratio.

    >>> pole = AddedPole(120.0, 0.02)
    >>> 2 * pole.damping_ratio * pole.frequency  # Hz, half-power bandwidth
    4.8
    """

    frequency: Hertz
    damping_ratio: Annotated[float, Quantity("ratio", "1", above=0, most=0.5)]


@dataclass(frozen=True)
class PoleChoice:
    """Changes of a person in the identified modes: `add` poles, `remove` modes by their frequency (Hz).

    >>> choice = PoleChoice().extended(add=[(120.0, 0.02)], remove=[87.5])
    >>> choice.add, choice.remove
    ((AddedPole(frequency=120.0, damping_ratio=0.02),), (87.5,))
    """

    add: tuple[AddedPole, ...] = ()
    remove: tuple[Hertz, ...] = ()

    def extended(self, add: Iterable[tuple[float, float]] = (), remove: Iterable[float] = ()) -> PoleChoice:
        """Return the choice with more poles (frequency in Hz, damping ratio) and modes to leave out (Hz)."""
        return PoleChoice((*self.add, *(AddedPole(*pole) for pole in add)), (*self.remove, *remove))

    @property
    def is_empty(self) -> bool:
        """Whether nothing is changed."""
        return not (self.add or self.remove)

    @property
    def remark(self) -> str:
        """Remark on the changes by hand, and on the meaning of the intervals."""
        parts = [f"added {', '.join(f'{pole.frequency:.5g} Hz' for pole in self.add)}"] if self.add else []
        parts += [f"removed {', '.join(f'{f:.5g} Hz' for f in self.remove)}"] if self.remove else []
        return (f"poles chosen by hand: {'; '.join(parts)}. The intervals hold for this choice as if it were given; whether it "
                "is right they do not say")


def poles_with(frf: Frf, modes: Modes, choice: PoleChoice) -> tuple[ComplexArray, ComplexArray]:
    """Return poles (rad/s) and participation (n_inputs, n) of modes with those that are added.

    A removed mode that an added pole stands next to is replaced by it; other removed modes stay, so that no neighbour wanders
    into their place when all are refined (see `remaining_modes`).

    Raises
    ------
    ToolpointError
        Where an added pole lies outside the band or repeats a mode or another one.
    """
    added = [_check_pole(frf, pole) for pole in choice.add]
    replaced = {k for k in _find_removed(modes, choice.remove)
                if any(abs(s - modes.poles[k]) < MAX_POLE_SHIFT * abs(modes.poles[k].real) for s in added)}
    kept = [i for i in range(modes.count) if i not in replaced]
    poles, participation = modes.poles[kept], modes.participation_at(frf.inputs)[:, kept]
    for s in added:
        for other in poles:
            if abs(s - other) < MIN_POLE_DISTANCE * abs(other.real):
                fail("choice.add", f"{abs(s) / (2 * np.pi):g} Hz", f"is there already as {abs(other) / (2 * np.pi):.5g} Hz",
                     remedy="leave it out, or remove that mode too")
        residue = residues(frf, np.array([s])).values[:, :, 0]  # a start; the refinement sees all poles
        poles = np.append(poles, s)
        participation = np.column_stack([participation, np.linalg.svd(residue)[2][0].conj()])
    return poles, participation


def remaining_modes(modes: Modes, automatic: Modes, choice: PoleChoice) -> list[int]:
    """Return the `modes` that remain when a choice removes some of `automatic`.

    Each of these goes with the mode nearest to it, unless an added pole took its place.

    Raises
    ------
    ToolpointError
        Where a removed frequency is no mode's, two of them mean one mode, or nothing is left.
    """
    added_modes = {int(np.argmin(np.abs(modes.frequency - pole.frequency))) for pole in choice.add}
    removed = set()
    for k in _find_removed(automatic, choice.remove):
        match = int(np.argmin(np.abs(modes.poles - automatic.poles[k])))
        if match not in added_modes:
            removed.add(match)
    kept = [i for i in range(modes.count) if i not in removed]
    if not kept:
        fail("choice.remove", f"all {modes.count} modes", "must leave at least one")
    return kept


def stray_remarks(modes: Modes, choice: PoleChoice) -> list[str]:
    """Return a line on every added pole that the responses did not hold where it was put."""
    remarks = []
    for pole in choice.add:
        k = int(np.argmin(np.abs(modes.frequency - pole.frequency)))
        shift = abs(float(modes.frequency[k]) - pole.frequency)
        if shift > MAX_POLE_SHIFT * max(pole.damping_ratio, float(modes.damping_ratio[k])) * pole.frequency:
            remarks.append(f"the pole added at {pole.frequency:.5g} Hz has gone to {modes.frequency[k]:.5g} Hz: the responses "
                         "hold no mode where it was put; leave it out")
    return remarks


def _find_removed(modes: Modes, frequencies: tuple[float, ...]) -> set[int]:
    """Return the modes that are meant by the removed frequencies."""
    removed: set[int] = set()
    for f in frequencies:
        k = int(np.argmin(np.abs(modes.frequency - f)))
        frequency = float(modes.frequency[k])
        if abs(frequency - f) > max(REMOVAL_HALF_WIDTHS * float(modes.damping_ratio[k]) * frequency, REMOVAL_FRACTION * f):
            fail("choice.remove", f"{f:g} Hz", f"must be the frequency of a mode; the nearest is {frequency:.5g} Hz")
        if k in removed:
            fail("choice.remove", f"{f:g} Hz", f"means the mode at {frequency:.5g} Hz a second time",
                 remedy="name each mode once")
        removed.add(k)
    return removed


def _check_pole(frf: Frf, pole: AddedPole) -> complex:
    """Return an added pole, rad/s, after checking frequency and damping."""
    lower, upper = float(frf.frequency[0]), float(frf.frequency[-1])
    if not lower <= pole.frequency <= upper:
        fail("choice.add", f"{pole.frequency:g} Hz", f"must be within the band, {lower:g} .. {upper:g} Hz",
             remedy="widen the band")
    if not 0 < pole.damping_ratio <= 0.5:
        fail("choice.add", f"damping ratio {pole.damping_ratio:g}", "must be above 0 and at most 0.5",
             remedy="it is a ratio: 0.02 is two per cent")
    w = 2 * np.pi * pole.frequency
    return complex(-pole.damping_ratio * w, w * np.sqrt(1 - pole.damping_ratio**2))
