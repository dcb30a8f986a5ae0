"""Frf: frequency responses between labelled inputs and outputs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import (
    Array,
    BoolArray,
    ComplexArray,
    FloatArray,
    ToolpointError,
    complexes,
    fail,
    floats,
    increasing,
    nonnegative,
    one_of,
    scalar,
)
from toolpoint._notebook import NotebookText
from toolpoint.vibration.dof import Dof, check_labels, dofs, positions, summary

QUANTITIES = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s^2/N"}
DERIVATIVE_ORDER = {"receptance": 0, "mobility": 1, "accelerance": 2}


@dataclass(frozen=True, eq=False)
class Frf(NotebookText):
    """Frequency responses, time factor exp(+i w t).

    Parameters
    ----------
    frequency : (n_f,) floats
        Hz, strictly increasing, not negative.
    values : (..., n_f, n_outputs, n_inputs) complex
        SI: m/N, m/s/N or m/s^2/N (rad and N m for rotational Dofs). Leading axes are poses.
    outputs, inputs : sequences of Dof
        Labels of the responses and of the forces.
    quantity : str
        ``receptance``, ``mobility`` or ``accelerance``.
    coherence : like `values`, real, optional
        0 .. 1.
    variance : like `values`, real, optional
        Variance ``E|e|^2`` of each line, in the unit of the values squared.
    draws : (n_draws, n_f, n_outputs, n_inputs) complexes, optional
        Equally likely responses, in the unit of the values. They keep what lines have in common, a stiffness that is known to
        5 % say; the variance alone would take every line as independent of the others.
    decay : float
        Decay rate (1/s) that an exponential window added to the ring-down; identified poles are corrected by it.
    notes : sequence of str
        Doubts and remarks that travel with the data.

    Raises
    ------
    ToolpointError
        For wrong shapes, values that are not finite, a frequency axis that does not increase, repeated labels.

    Examples
    --------
    >>> from toolpoint.vibration import Frf
    >>> frf = Frf([10.0, 20.0], [[[1e-8]], [[2e-8]]], ["tool:+x"], ["tool:+x"])
    >>> frf.converted_to("accelerance")
    Frf(1 outputs, 1 inputs, 10..20 Hz, 2 lines, accelerance m/s^2/N)
    """

    frequency: FloatArray
    values: ComplexArray
    outputs: tuple[Dof, ...]
    inputs: tuple[Dof, ...]
    quantity: str = "receptance"
    coherence: FloatArray | None = None
    variance: FloatArray | None = None
    decay: float = 0.0
    notes: tuple[str, ...] = ()
    draws: ComplexArray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        frequency = nonnegative("Frf.frequency", increasing("Frf.frequency", floats("Frf.frequency", self.frequency)))
        # The commonest slip of callers, whose general message (three axes wanted) would not say what to do.
        if np.shape(self.values) == frequency.shape:
            fail("Frf.values", f"shape {frequency.shape}", "must be lines x outputs x inputs",
                 remedy="a single response is values[:, None, None]")
        values = complexes("Frf.values", self.values, (frequency.size, None, None))
        put(self, "frequency", frequency)
        put(self, "values", values)
        put(self, "outputs", check_labels("Frf.outputs", self.outputs, values.shape[-2]))
        put(self, "inputs", check_labels("Frf.inputs", self.inputs, values.shape[-1]))
        one_of("Frf.quantity", self.quantity, QUANTITIES)
        put(self, "coherence", _check_like_values("Frf.coherence", self.coherence, values))
        put(self, "variance", _check_like_values("Frf.variance", self.variance, values))
        if self.coherence is not None and self.coherence.max(initial=0.0) > 1 + 1e-9:
            fail("Frf.coherence", f"value {self.coherence.max():g}", "must be within 0 .. 1")
        if self.draws is not None:
            put(self, "draws", complexes("Frf.draws", self.draws, (None, *values.shape)))
        put(self, "decay", scalar("Frf.decay", self.decay))
        put(self, "notes", tuple(self.notes))

    @property
    def unit(self) -> str:
        """SI unit of the values."""
        return QUANTITIES[self.quantity]

    @property
    def omega(self) -> FloatArray:
        """Angular frequency, rad/s, shape (n_f,)."""
        return 2 * np.pi * self.frequency

    def converted_to(self, quantity: str) -> Frf:
        """Return the same responses as receptance, mobility or accelerance (multiplied by (i w)^k).

        A line at 0 Hz cannot be integrated: it is refused with the remedy to cut it away first.
        """
        one_of("quantity", quantity, QUANTITIES)
        power = DERIVATIVE_ORDER[quantity] - DERIVATIVE_ORDER[self.quantity]
        if power == 0:
            return self
        if power < 0 and self.frequency[0] == 0:
            fail("converted_to", f"{self.quantity} with a line at 0 Hz", f"{quantity} divides by the frequency",
                 remedy="cut the line away first, for example frf.between(0.1, ...)")
        factor = ((1j * self.omega) ** power)[:, None, None]
        variance = None if self.variance is None else self.variance * np.abs(factor) ** 2
        draws = None if self.draws is None else self.draws * factor
        return replace(self, values=self.values * factor, quantity=quantity, variance=variance, draws=draws)

    def between(self, frequency_min: float, frequency_max: float) -> Frf:
        """Return the lines with low <= frequency <= high (Hz)."""
        keep = (self.frequency >= frequency_min) & (self.frequency <= frequency_max)
        if not keep.any():
            fail("between", f"{frequency_min:g} .. {frequency_max:g} Hz",
                 f"must overlap {self.frequency[0]:g} .. {self.frequency[-1]:g} Hz")
        return self._select(keep, slice(None), slice(None))

    def selected(
        self, outputs: Iterable[Dof | str | int] | None = None, inputs: Iterable[Dof | str | int] | None = None
    ) -> Frf:
        """Return the responses between these outputs and inputs (labels or indices), in the order asked for."""
        rows = list(range(len(self.outputs))) if outputs is None else positions("outputs", outputs, self.outputs)
        columns = list(range(len(self.inputs))) if inputs is None else positions("inputs", inputs, self.inputs)
        return self._select(slice(None), rows, columns)

    def _select(self, lines: BoolArray | slice, rows: list[int] | slice, columns: list[int] | slice) -> Frf:
        """Return some lines, rows and columns of values, coherence and variance."""
        def part(array: Array) -> Array:
            return array[..., lines, :, :][..., rows, :][..., columns]

        def labels(all_labels: tuple[Dof, ...], indices: list[int] | slice) -> tuple[Dof, ...]:
            return all_labels[indices] if isinstance(indices, slice) else tuple(all_labels[i] for i in indices)

        return replace(
            self, frequency=self.frequency[lines], values=part(self.values),
            coherence=None if self.coherence is None else part(self.coherence),
            variance=None if self.variance is None else part(self.variance),
            draws=None if self.draws is None else part(self.draws),
            outputs=labels(self.outputs, rows), inputs=labels(self.inputs, columns),
        )

    def at_pose(self, index: int) -> Frf:
        """Return the responses of one pose of a batch."""
        if self.values.ndim == 3:
            fail("at_pose", "a single pose", "must be a batch")
        select = (lambda a: None if a is None else a[index])
        # The draws come first, the poses behind them.
        draws = None if self.draws is None else self.draws[:, index]
        return replace(self, values=self.values[index], coherence=select(self.coherence), variance=select(self.variance),
                       draws=draws)

    def at_draw(self, index: int) -> Frf:
        """Return one of the equally likely responses, without an uncertainty of its own."""
        if self.draws is None:
            fail("at_draw", "no draws", "must be responses with draws")
        return replace(self, values=self.draws[index], draws=None, coherence=None, variance=None)

    def interpolated(self, frequency: FloatArray) -> Frf:
        """Return values and draws at other frequencies inside the measured range (linear in real and imaginary part)."""
        lines = increasing("frequency", floats("frequency", frequency))
        if lines[0] < self.frequency[0] or lines[-1] > self.frequency[-1]:
            fail("frequency", f"{lines[0]:g} .. {lines[-1]:g} Hz",
                 f"must lie within {self.frequency[0]:g} .. {self.frequency[-1]:g} Hz", remedy="nothing is extrapolated")
        lower = np.clip(np.searchsorted(self.frequency, lines, side="right") - 1, 0, max(self.frequency.size - 2, 0))
        upper = np.minimum(lower + 1, self.frequency.size - 1)
        span = np.where(upper > lower, self.frequency[upper] - self.frequency[lower], 1.0)
        fraction = ((lines - self.frequency[lower]) / span)[:, None, None]

        def between(array: ComplexArray) -> ComplexArray:
            return np.asarray(array[..., lower, :, :] * (1 - fraction) + array[..., upper, :, :] * fraction)

        # Draws go along, a variance does not: that of an interpolated value would need the covariance of neighbouring
        # lines.
        draws = None if self.draws is None else between(self.draws)
        return replace(self, frequency=lines, values=between(self.values), coherence=None, variance=None, draws=draws)

    def noted(self, note: str) -> Frf:
        """Return the same responses with one more remark."""
        return replace(self, notes=(*self.notes, note))

    def __repr__(self) -> str:
        band = f"{self.frequency[0]:g}..{self.frequency[-1]:g} Hz, {self.frequency.size} lines"
        poses = "" if self.values.ndim == 3 else f"{'x'.join(map(str, self.values.shape[:-3]))} poses, "
        return (f"Frf({poses}{summary(self.outputs)} outputs, {summary(self.inputs)} inputs, {band}, "
                f"{self.quantity} {self.unit})")


def _check_like_values(name: str, array: FloatArray | None, values: ComplexArray) -> FloatArray | None:
    """Return an array that goes with the values after checking its shape and sign."""
    if array is None:
        return None
    checked = nonnegative(name, floats(name, array))
    if checked.shape != values.shape:
        fail(name, f"shape {checked.shape}", f"must be that of the values, {values.shape}")
    return checked


def join_frfs(parts: Iterable[Frf], axis: str = "outputs") -> Frf:
    """Return one Frf from several over the same frequency lines, side by side along `outputs` or `inputs`.

    Raises ToolpointError where frequency lines, quantity, the other labels or the window decay differ.
    """
    frfs = list(parts)
    if not frfs:
        fail("join_frfs", "no parts", "must be at least one Frf")
    one_of("axis", axis, ("outputs", "inputs"))
    reference, array_axis, other_axis = frfs[0], (-2 if axis == "outputs" else -1), ("inputs" if axis == "outputs"
                                                                                     else "outputs")
    for number, frf in enumerate(frfs[1:], start=1):
        if frf.frequency.shape != reference.frequency.shape or not np.allclose(frf.frequency, reference.frequency, rtol=1e-9):
            fail("join_frfs", f"part {number} has other frequency lines ({frf!r} beside {reference!r})",
                 "must be the same lines",
                 remedy="interpolate it first: frf.interpolated(frequency)")
        for attribute in ("quantity", "decay", other_axis):
            if getattr(frf, attribute) != getattr(reference, attribute):
                fail("join_frfs", f"part {number} has {attribute} {getattr(frf, attribute)}",
                     f"must be {getattr(reference, attribute)}")
    stacked = {
        name: None if any(getattr(frf, name) is None for frf in frfs)
        else np.concatenate([getattr(frf, name) for frf in frfs], axis=array_axis)
        for name in ("values", "coherence", "variance")
    }
    stacked["draws"] = _join_draws(frfs, array_axis)
    labels = tuple(label for frf in frfs for label in getattr(frf, axis))
    notes = tuple(dict.fromkeys(note for frf in frfs for note in frf.notes))
    changes: dict[str, Any] = {**stacked, axis: labels, "notes": notes}
    return replace(reference, **changes)


def _join_draws(frfs: list[Frf], axis: int) -> ComplexArray | None:
    """Return the draws of several parts side by side, as many as the part with the fewest has; None where a part has none."""
    draws = [frf.draws for frf in frfs if frf.draws is not None]
    if len(draws) < len(frfs):
        return None
    # Draw k of one part belongs to draw k of the others: taking some at random would lose what they share.
    return np.concatenate([part[:min(map(len, draws))] for part in draws], axis=axis)


def relative(frf: Frf, plus: str | int, minus: str | int, *, directions: Iterable[str] = ("x", "y", "z")) -> Frf:
    """Return the responses of point `plus` relative to point `minus` under equal and opposite forces.

    With T = [I, -I] over the two points' directions, G = T H T^T: what a cutting process between tool and table sees.
    The labels of the result carry the point ``"plus-minus"``, e.g. ``tool-table:+x``.
    """
    axes = list(directions)
    labels = [Dof(point, way) for point in (plus, minus) for way in axes]
    try:
        pair = frf.selected(labels, labels)
    except ToolpointError as error:
        raise ToolpointError(f"relative: both points are needed among outputs and inputs ({error})") from None
    sign = np.concatenate([np.eye(len(axes)), -np.eye(len(axes))], axis=1)
    values = sign @ pair.values @ sign.T
    draws = None if pair.draws is None else sign @ pair.draws @ sign.T
    labels_of_pair = dofs([Dof(f"{plus}-{minus}", way) for way in axes])
    return Frf(pair.frequency, values, labels_of_pair, labels_of_pair, pair.quantity, decay=pair.decay, notes=pair.notes,
               draws=draws)
