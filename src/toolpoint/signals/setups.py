"""Roving hammer and roving accelerometer: responses of several set-ups assembled into one Frf."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.frf import Frf


def join_setups(parts: Iterable[Frf]) -> Frf:
    """Return one Frf from set-ups that together measure every output for every input.

    All must share frequency lines, quantity and window decay. A response that is in several set-ups (a fixed sensor
    measured again) is averaged, weighted by its variance where all state one; the notes give the largest difference.

    Raises
    ------
    ToolpointError
        Where axes, quantity or decay differ, or a response is missing.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import join_setups
    >>> from toolpoint.vibration import Frf
    >>> setups = [Frf([10.0, 20.0], np.full((2, 1, 1), 1e-8), [f"{point}:+z"], ["1:+z"]) for point in (1, 2, 3)]
    >>> join_setups(setups)
    Frf(3 outputs, 1 inputs, 10..20 Hz, 2 lines, receptance m/N)
    """
    frfs = list(parts)
    if not frfs:
        fail("join_setups", "no set-ups", "must be at least one Frf")
    first = frfs[0]
    for number, frf in enumerate(frfs):
        _check_same_lines(number, frf, first)
    rows = tuple(dict.fromkeys(dof for frf in frfs for dof in frf.outputs))
    columns = tuple(dict.fromkeys(dof for frf in frfs for dof in frf.inputs))
    shape = (first.frequency.size, len(rows), len(columns))
    has_variance = all(frf.variance is not None for frf in frfs)
    values: ComplexArray = np.zeros(shape, complex)
    weights = np.zeros(shape)
    largest_change = np.zeros(shape[1:])
    for frf in frfs:
        entries = np.ix_(range(shape[0]), [rows.index(dof) for dof in frf.outputs], [columns.index(d) for d in frf.inputs])
        weight = np.ones(frf.values.shape)
        if has_variance and frf.variance is not None:
            weight = 1 / np.maximum(frf.variance, 1e-300)
        has_values = weights[entries] > 0
        earlier = np.where(has_values, values[entries] / np.where(has_values, weights[entries], 1.0), frf.values)
        size = (np.abs(earlier) ** 2).mean(axis=0)
        change_of_setup = np.sqrt((np.abs(frf.values - earlier) ** 2).mean(axis=0) / np.where(size > 0, size, 1.0))
        largest_change[entries[1][0], entries[2][0]] = np.maximum(largest_change[entries[1][0], entries[2][0]], change_of_setup)
        values[entries] += frf.values * weight
        weights[entries] += weight
    _check_complete(weights, rows, columns)
    return replace(first, values=np.asarray(values / weights, complex), outputs=rows, inputs=columns, draws=None,
                   variance=1 / weights if has_variance else None, coherence=_lowest_coherence(frfs, rows, columns),
                   notes=_notes(frfs, largest_change, rows, columns))


def join_bands(parts: Iterable[Frf]) -> list[Frf]:
    """Return set-ups with those of the same outputs and inputs over other bands joined along their lines, the lowest first.

    Raises ToolpointError where bands of one response overlap: the data do not say which one holds there.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import join_bands
    >>> from toolpoint.vibration import Frf
    >>> bands = [Frf(lines, np.full((2, 1, 1), 1e-8), ["1:+z"], ["1:+z"]) for lines in ([30.0, 40.0], [10.0, 20.0])]
    >>> join_bands(bands)
    [Frf(1 outputs, 1 inputs, 10..40 Hz, 4 lines, receptance m/N)]
    """
    groups: dict[tuple[tuple[Dof, ...], tuple[Dof, ...]], list[Frf]] = {}
    for frf in parts:
        groups.setdefault((frf.outputs, frf.inputs), []).append(frf)
    return [joined for group in groups.values() for joined in _join_lines(group)]


def _join_lines(group: list[Frf]) -> list[Frf]:
    """Return bands of one response as one Frf where they do not overlap; equal lines stay separate set-ups."""
    ordered = sorted(group, key=lambda frf: float(frf.frequency[0]))
    lines = [frf.frequency for frf in ordered]
    is_separate = all(lower[-1] < upper[0] for lower, upper in pairwise(lines))
    if len(group) == 1 or not is_separate:
        if len(group) > 1 and any(lower.size != upper.size or not np.allclose(lower, upper) for lower,
                                  upper in pairwise(lines)):
            spans = ", ".join(f"{part[0]:g} .. {part[-1]:g} Hz" for part in lines)
            fail("join_bands", f"bands {spans} of {group[0].outputs[0]} / {group[0].inputs[0]} overlap",
                 "must follow one another", remedy="cut them first: frf.between(low, high)")
        return group
    first = ordered[0]
    for frf in ordered[1:]:
        if frf.quantity != first.quantity or abs(frf.decay - first.decay) > 1e-9 * max(abs(first.decay), 1):
            fail("join_bands", f"one band is {frf.quantity} with decay {frf.decay:g}",
                 f"must be {first.quantity} with decay {first.decay:g}")
    stacked: dict[str, Any] = {
        name: None if any(getattr(frf, name) is None for frf in ordered)
        else np.concatenate([getattr(frf, name) for frf in ordered]) for name in ("coherence", "variance")}
    drawn = [frf.draws for frf in ordered if frf.draws is not None]
    # Draws of one index belong together: all bands of one file were drawn at once.
    stacked["draws"] = (np.concatenate(drawn, axis=1) if len(drawn) == len(ordered) and len({len(part) for part in drawn}) == 1
                        else None)
    return [replace(first, frequency=np.concatenate(lines), values=np.concatenate([frf.values for frf in ordered]), **stacked,
                    notes=tuple(dict.fromkeys(note for frf in ordered for note in frf.notes)))]


def by_reciprocity(frf: Frf) -> Frf:
    """Return the responses with outputs and inputs exchanged (Maxwell): a roving hammer as a roving sensor.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import by_reciprocity
    >>> from toolpoint.vibration import Frf
    >>> by_reciprocity(Frf([10.0, 20.0], np.zeros((2, 1, 3)), ["9:+z"], ["1:+z", "2:+z", "3:+z"]))
    Frf(3 outputs, 1 inputs, 10..20 Hz, 2 lines, receptance m/N)
    """
    return replace(frf, values=np.swapaxes(frf.values, -1, -2), outputs=frf.inputs, inputs=frf.outputs,
                   coherence=_transpose(frf.coherence), variance=_transpose(frf.variance),
                   draws=None if frf.draws is None else np.swapaxes(frf.draws, -1, -2))


def _transpose(array: FloatArray | None) -> FloatArray | None:
    return None if array is None else np.swapaxes(array, -1, -2)


def _check_same_lines(number: int, frf: Frf, first: Frf) -> None:
    """Refuse a set-up with other poses, lines, quantity or window decay than the first."""
    if frf.values.ndim != 3:
        fail("join_setups", f"set-up {number} of several poses", "must be one pose")
    if frf.frequency.shape != first.frequency.shape or not np.allclose(frf.frequency, first.frequency, rtol=1e-9):
        fail("join_setups", f"set-up {number} has other frequency lines ({frf!r})", f"must be those of {first!r}",
             remedy="interpolate it first: frf.interpolated(frequency)")
    if frf.quantity != first.quantity or abs(frf.decay - first.decay) > 1e-9 * max(abs(first.decay), 1):
        fail("join_setups", f"set-up {number} is {frf.quantity} with decay {frf.decay:g}",
             f"must be {first.quantity} with decay {first.decay:g}")


def _check_complete(weights: np.ndarray, rows: tuple[Dof, ...], columns: tuple[Dof, ...]) -> None:
    """Refuse set-ups that leave a response unmeasured."""
    missing_entries = np.argwhere(weights.max(axis=0) == 0)
    if missing_entries.size:
        row, column = missing_entries[0]
        fail("join_setups", f"{len(missing_entries)} of {len(rows) * len(columns)} responses are missing, the first "
             f"{rows[row]} / {columns[column]}", "every output must be measured for every input")


def _lowest_coherence(frfs: list[Frf], rows: tuple[Dof, ...], columns: tuple[Dof, ...]) -> np.ndarray | None:
    """Return the lowest coherence of every response, None where a set-up has none."""
    if any(frf.coherence is None for frf in frfs):
        return None
    lowest = np.ones((frfs[0].frequency.size, len(rows), len(columns)))
    for frf in frfs:
        entries = np.ix_(range(lowest.shape[0]), [rows.index(dof) for dof in frf.outputs],
                    [columns.index(dof) for dof in frf.inputs])
        lowest[entries] = np.minimum(lowest[entries], np.asarray(frf.coherence))
    return lowest


def _notes(frfs: list[Frf], spread: np.ndarray, rows: tuple[Dof, ...], columns: tuple[Dof, ...]) -> tuple[str, ...]:
    """Return the notes of all set-ups, and the largest difference between them where it is above 5 %."""
    notes = list(dict.fromkeys(note for frf in frfs for note in frf.notes))
    if spread.max() > 0.05:
        row, column = np.unravel_index(int(np.argmax(spread)), spread.shape)
        notes.append(f"set-ups differ by up to {100 * spread.max():.0f} % at {rows[row]} / {columns[column]}: the "
                     "structure or the sensor's mass changed between them")
    return tuple(notes)
