"""Plane dynamics of two parts: a tool against a work that moves too, and two directions that were measured separately."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import Array, BoolArray, ComplexArray, fail
from toolpoint.cutting.cut.plane import PlaneDynamics


def against(tool: PlaneDynamics, work: PlaneDynamics) -> PlaneDynamics:
    """Return the response of the tool against the work when each has its own (their compliances add up)."""
    if not (tool.is_modal and work.is_modal):
        fail("dynamics", "a measured FRF for tool or work", "must be modes for both", remedy="add the FRFs before the call")
    return PlaneDynamics(np.concatenate([tool.poles, work.poles]), np.concatenate([tool.residues, work.residues]),
                         tool.static + work.static, notes=(*tool.notes, *work.notes),
                         structural=_structural_of(tool, work))


def from_pair(along_x: PlaneDynamics, along_y: PlaneDynamics) -> PlaneDynamics:
    """Return the response of two directions measured separately (their first component each), without cross response."""
    if along_x.is_modal != along_y.is_modal:
        fail("dynamics", "Modes for one direction and an Frf for the other", "must be the same kind",
             remedy="turn the modes into an Frf with frequency_response.modal")
    if not along_x.is_modal:
        (f, values), (f_of_y, values_of_y) = along_x.lines, along_y.lines
        if f.shape != f_of_y.shape or not np.allclose(f, f_of_y):
            fail("dynamics", "two FRFs with different lines", "must be the same lines", remedy="use frf.interpolated")
        values = values.copy()
        values[:, 1, 1] = values_of_y[:, 0, 0]
        variances = [along.variance for along in (along_x, along_y)]
        variance = None
        if variances[0] is not None and variances[1] is not None:
            variance = variances[0].copy()
            variance[:, 1, 1] = variances[1][:, 0, 0]
        return replace(along_x, values=values, notes=along_x.notes[:-1], variance=variance,
                       draws=_paired_draws(along_x, along_y, values))
    second = _move_x_to_y(along_y.residues)
    static = along_x.static + _move_x_to_y(along_y.static)
    return PlaneDynamics(np.concatenate([along_x.poles, along_y.poles]), np.concatenate([along_x.residues, second]),
                         static, notes=along_x.notes[:-1], structural=_structural_of(along_x, along_y))


def _paired_draws(along_x: PlaneDynamics, along_y: PlaneDynamics, values: ComplexArray) -> ComplexArray | None:
    """Return draws (n, n_f, 2, 2) of two directions that were measured separately, one of each in turn.

    A direction without draws stays as it stands in `values`; None where neither has any.
    """
    drawn = {k: plane.draws for k, plane in enumerate((along_x, along_y)) if plane.draws is not None}
    if not drawn:
        return None
    result = np.repeat(values[None], min(map(len, drawn.values())), axis=0)
    for k, draws in drawn.items():
        result[:, :, k, k] = draws[:len(result), :, 0, 0]
    return result


def _structural_of(*planes: PlaneDynamics) -> BoolArray:
    """Return the flags of structural damping of several planes one after the other."""
    return np.concatenate([np.zeros(plane.poles.size, bool) if plane.structural is None else plane.structural
                           for plane in planes])


def _move_x_to_y(matrix: Array) -> Array:
    out = np.zeros_like(matrix)
    out[..., 1, 1] = matrix[..., 0, 0]
    return out
