"""Two states of one machine, of whatever kind: two tests, or two machine files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.machine import Machine
from toolpoint.studies.measured.identification import modes_of_test
from toolpoint.studies.measured.machine_states import compare_machines
from toolpoint.studies.measured.state_comparison import ComparedState, StateComparison, compare_states, state_of_test
from toolpoint.vibration import Frf, Modes

MeasuredNouns = tuple[Modes | None, Frf | None]


def compare_two_states(
    older: tuple[str, Any], newer: tuple[str, Any], *, band: tuple[float, float] | None = None,
    pose: Mapping[str, float] | None = None, count: int = 6, lowest_mac: float = 0.5, rng: np.random.Generator,
) -> StateComparison:
    """Return how two states differ, each with its name: two machines, or two tests as (saved modes or None, responses or None).

    Parameters
    ----------
    band : (float, float), optional
        Hz, of two tests: lines from which modes are identified and responses compared.
    pose : mapping, optional
        Of two machines, m or rad.
    count : int
        Modes of two machines.
    lowest_mac : float
        Pairs of modes below are left single.
    rng : numpy.random.Generator
        Draws the noise.

    Raises
    ------
    ToolpointError
        For states of two kinds, or without a common point.

    Examples
    --------
    >>> one = Modes([80.0, 120.0], 0.02, [[0.1, 0.05], [0.02, -0.1]], ["tool:+x", "tool:+y"])
    >>> other = Modes([78.0, 120.0], 0.02, [[0.1, 0.05], [0.02, -0.1]], ["tool:+x", "tool:+y"])
    >>> result = compare_two_states(("May", (one, None)), ("June", (other, None)), rng=np.random.default_rng(1))
    >>> result.change.round(4).tolist()
    [-0.025, 0.0]
    """
    if isinstance(older[1], Machine) != isinstance(newer[1], Machine):
        raise ToolpointError("older, newer: a machine and a test; must be two of a kind")
    if isinstance(older[1], Machine):
        return compare_machines(older, newer, pose=pose, count=count, lowest_mac=lowest_mac, rng=rng)
    return compare_states(_test_state(older, band), _test_state(newer, band), lowest_mac=lowest_mac, rng=rng)


def _test_state(named: tuple[str, MeasuredNouns], band: tuple[float, float] | None) -> ComparedState:
    name, (saved, responses) = named
    modes, _ = modes_of_test(saved, responses, band=band)
    return state_of_test(name, modes, responses if responses is None or band is None else responses.between(*band))
