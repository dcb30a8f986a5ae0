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
    measured again) is averaged, weighted by its variance where all state one; the notes say how far they differ.

    Raises
    ------
    ToolpointError
        Where axes, quantity or decay differ, or a response is missing.
    """
    frfs = list(parts)
    if not frfs:
        fail("join_setups", "no set-ups", "must be at least one Frf")
    first = frfs[0]
    for number, frf in enumerate(frfs):
        _alike(number, frf, first)
    rows = tuple(dict.fromkeys(dof for frf in frfs for dof in frf.outputs))
    columns = tuple(dict.fromkeys(dof for frf in frfs for dof in frf.inputs))
    shape = (first.frequency.size, len(rows), len(columns))
    stated = all(frf.variance is not None for frf in frfs)
    values: ComplexArray = np.zeros(shape, complex)
    weights = np.zeros(shape)
    spread = np.zeros(shape[1:])
    for frf in frfs:
        at = np.ix_(range(shape[0]), [rows.index(dof) for dof in frf.outputs], [columns.index(d) for d in frf.inputs])
        weight = np.ones(frf.values.shape)
        if stated and frf.variance is not None:
            weight = 1 / np.maximum(frf.variance, 1e-300)
        have = weights[at] > 0
        before = np.where(have, values[at] / np.where(have, weights[at], 1.0), frf.values)
        size = (np.abs(before) ** 2).mean(axis=0)
        change = np.sqrt((np.abs(frf.values - before) ** 2).mean(axis=0) / np.where(size > 0, size, 1.0))
        spread[at[1][0], at[2][0]] = np.maximum(spread[at[1][0], at[2][0]], change)
        values[at] += frf.values * weight
        weights[at] += weight
    _complete(weights, rows, columns)
    return replace(first, values=np.asarray(values / weights, complex), outputs=rows, inputs=columns,
                   variance=1 / weights if stated else None, coherence=_coherence(frfs, rows, columns),
                   notes=_notes(frfs, spread, rows, columns))


def join_bands(parts: Iterable[Frf]) -> list[Frf]:
    """Return set-ups with those of the same outputs and inputs over other bands joined along their lines, the lowest first.

    Raises ToolpointError where bands of one response overlap: which one holds there cannot be told.
    """
    groups: dict[tuple[tuple[Dof, ...], tuple[Dof, ...]], list[Frf]] = {}
    for frf in parts:
        groups.setdefault((frf.outputs, frf.inputs), []).append(frf)
    return [joined for group in groups.values() for joined in _along_lines(group)]


def _along_lines(group: list[Frf]) -> list[Frf]:
    ordered = sorted(group, key=lambda frf: float(frf.frequency[0]))
    lines = [frf.frequency for frf in ordered]
    apart = all(low[-1] < high[0] for low, high in pairwise(lines))
    if len(group) == 1 or not apart:
        if len(group) > 1 and any(low.size != high.size or not np.allclose(low, high) for low, high in pairwise(lines)):
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
    return [replace(first, frequency=np.concatenate(lines), values=np.concatenate([frf.values for frf in ordered]), **stacked,
                    notes=tuple(dict.fromkeys(note for frf in ordered for note in frf.notes)))]


def by_reciprocity(frf: Frf) -> Frf:
    """Return the responses with outputs and inputs changed over (Maxwell): a roving hammer seen as roving sensor."""
    return replace(frf, values=np.swapaxes(frf.values, -1, -2), outputs=frf.inputs, inputs=frf.outputs,
                   coherence=_turned(frf.coherence), variance=_turned(frf.variance))


def _turned(array: FloatArray | None) -> FloatArray | None:
    return None if array is None else np.swapaxes(array, -1, -2)


def _alike(number: int, frf: Frf, first: Frf) -> None:
    if frf.values.ndim != 3:
        fail("join_setups", f"set-up {number} of several poses", "must be one pose")
    if frf.frequency.shape != first.frequency.shape or not np.allclose(frf.frequency, first.frequency, rtol=1e-9):
        fail("join_setups", f"set-up {number} has other frequency lines ({frf!r})", f"must be those of {first!r}",
             remedy="interpolate it first: frf.interpolated(frequency)")
    if frf.quantity != first.quantity or abs(frf.decay - first.decay) > 1e-9 * max(abs(first.decay), 1):
        fail("join_setups", f"set-up {number} is {frf.quantity} with decay {frf.decay:g}",
             f"must be {first.quantity} with decay {first.decay:g}")


def _complete(weights: np.ndarray, rows: tuple[Dof, ...], columns: tuple[Dof, ...]) -> None:
    missing = np.argwhere(weights.max(axis=0) == 0)
    if missing.size:
        row, column = missing[0]
        fail("join_setups", f"{len(missing)} of {len(rows) * len(columns)} responses are missing, the first "
             f"{rows[row]} / {columns[column]}", "every output must be measured for every input")


def _coherence(frfs: list[Frf], rows: tuple[Dof, ...], columns: tuple[Dof, ...]) -> np.ndarray | None:
    if any(frf.coherence is None for frf in frfs):
        return None
    lowest = np.ones((frfs[0].frequency.size, len(rows), len(columns)))
    for frf in frfs:
        at = np.ix_(range(lowest.shape[0]), [rows.index(dof) for dof in frf.outputs],
                    [columns.index(dof) for dof in frf.inputs])
        lowest[at] = np.minimum(lowest[at], np.asarray(frf.coherence))
    return lowest


def _notes(frfs: list[Frf], spread: np.ndarray, rows: tuple[Dof, ...], columns: tuple[Dof, ...]) -> tuple[str, ...]:
    notes = list(dict.fromkeys(note for frf in frfs for note in frf.notes))
    if spread.max() > 0.05:
        row, column = np.unravel_index(int(np.argmax(spread)), spread.shape)
        notes.append(f"set-ups differ by up to {100 * spread.max():.0f} % at {rows[row]} / {columns[column]}: the "
                     "structure or the sensor's mass changed between them")
    return tuple(notes)
