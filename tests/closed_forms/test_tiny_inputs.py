"""Inputs of one, two or three lines, and of zeros: no warning of NumPy and no foreign exception leaves an exported function."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint import cutting, modal_identification, studies, substructuring
from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.substructuring import PlaneReceptance, SegmentDescription, ShaftDescription
from toolpoint.vibration import Frf, Modes

ROD = ShaftDescription({"rod": SegmentDescription(0.1, 0.02)})
POLES = np.array([-1 + 30j, -2 + 60j])
KINDS = ("zeros", "ones", "noise", "one line of zeros")
SOLVERS = (cutting.ZeroOrder(), cutting.HillDeterminant(), cutting.FloquetDeterminant(), cutting.Collocation(),
           cutting.PanelArnoldi(), cutting.SemiDiscretization())


def quiet(call: Callable[[], Any]) -> Any:
    """Return what a call returns, None where it refuses by an error of toolpoint; anything else fails the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", ToolpointWarning)
        try:
            return call()
        except ToolpointError:
            return None


def values_of(kind: str, shape: tuple[int, ...], seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    values = {"zeros": np.zeros(shape, complex), "ones": np.ones(shape, complex)}.get(kind, noise)
    if kind == "one line of zeros":
        values[shape[0] // 2] = 0
    return values


@settings(max_examples=30)
@given(st.integers(1, 4), st.sampled_from(KINDS), st.sampled_from([0.0, 10.0]), st.sampled_from(["receptance", "accelerance"]),
       st.sampled_from([(1, 1), (3, 2)]), st.integers(0, 9))
def test_responses_of_few_lines_are_identified_or_refused(count, kind, start, quantity, shape, seed):
    outputs, inputs = ([f"{i + 1}:+x" for i in range(size)] for size in shape)
    frf = Frf(start + np.arange(count), values_of(kind, (count, *shape), seed), outputs, inputs, quantity)
    for call in (modal_identification.identify, modal_identification.cmif, modal_identification.mvmif,
                 modal_identification.quadrature, lambda one: modal_identification.residues(one, POLES)):
        quiet(lambda call=call: call(frf))


@settings(max_examples=25)
@given(st.integers(1, 4), st.sampled_from(KINDS), st.sampled_from([0.0, 10.0]), st.booleans(), st.integers(0, 9))
def test_spindles_of_few_lines_take_a_tool_or_are_refused(count, kind, start, has_draws, seed):
    values = 1e-8 * values_of(kind, (count, 2, 2), seed)
    draws = values * np.array([1.0, 1.1, 0.9])[:, None, None, None] if has_draws else None
    spindle = PlaneReceptance(start + 5.0 * np.arange(count), values, "x", draws=draws)
    study = quiet(lambda: studies.study_tool([spindle], ROD))
    if study is not None:
        quiet(study.table)
    quiet(lambda: substructuring.couple_tool(spindle, ROD))


@pytest.mark.parametrize("damping", [0.0, 0.01, 1.0])
@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: type(solver).__name__)
def test_modes_that_do_not_move_the_tool_have_no_chart(solver, damping):
    def chart() -> Any:
        modes = Modes([500.0], damping, np.zeros((2, 1)), ("tip:+x", "tip:+y"))
        problem = cutting.MillingProblem(cutting.Tool(0.012, 2), cutting.Engagement.slot(),
                                         cutting.CuttingCoefficients(6e8, 2e8), modes)
        return cutting.stability.chart(problem, np.array([8000.0]), solver)
    assert quiet(chart) is None


def test_the_peak_of_two_lines_is_the_larger_line():
    """A parabola needs three lines; with fewer, the peak is where it was measured."""
    values = np.array([1e-8, 3e-8])[:, None, None] * np.array([[1, 0.1], [0.1, 1]])
    study = quiet(lambda: studies.study_tool([PlaneReceptance([10.0, 15.0], values + 0j, "x")], ROD))
    from toolpoint.studies.cuts.coupling.peaks import peaks_of

    (peak,) = peaks_of(study.tips[0])
    size = np.abs(study.tips[0].values[:, 0, 0])
    assert peak.height == size.max() and peak.frequency == (10.0, 15.0)[int(size.argmax())]
