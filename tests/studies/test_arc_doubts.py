"""Arcs that the dexels leave open: doubted beyond half a degree, and carried to the limit of the place nearest to its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import studies
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.studies.machining.arc_doubts import question_arcs
from toolpoint.studies.machining.judged_places import JudgedPlaces
from toolpoint.vibration import Modes

CUT = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8)
SHOULDER = "S9000\nG0 X-10 Y-2 Z5\nG0 Z-2\nG1 X30 F1800\nG0 Z20"  # the left wall stands: the arc ends at 0 and within the work


@pytest.fixture(scope="module")
def judged() -> JudgedPlaces:
    tip = studies.modal_dynamics(Modes([700.0, 900.0], [0.02, 0.02], np.diag([2.0, 1.8]), ("tip:+x", "tip:+y")))
    setup = studies.describe_machining(studies.stock_of("box", (0, 0, -0.01, 0.02, 0.02, 0)), CUT, spacing=5e-4)
    study = studies.run_program(parse(SHOULDER, start=(0, 0, 0.05)), setup, tip, text=SHOULDER)
    assert study.judged is not None and np.isfinite(study.judged.margins.limit).any()
    return study.judged


def test_an_arc_beyond_half_a_degree_is_doubted_with_the_spacing_that_would_carry_it() -> None:
    assert question_arcs(np.radians(0.4), None, 1e-4) == ([], [])
    doubts, _ = question_arcs(np.radians(2.0), None, 1e-4)
    assert len(doubts) == 1 and doubts[0].what == "arcs of cut" and "within 2.0°" in doubts[0] and "0.025 mm" in doubts[0]


def test_the_limit_is_that_of_an_arc_longer_and_shorter_at_its_free_end(judged: JudgedPlaces) -> None:
    """The end on the wall stays; the note's ends are the engine's own."""
    error = np.radians(4.0)
    m = int(np.nanargmin(np.abs(np.log(judged.margins.limit / judged.arcs.depth))))
    entry, leave = float(judged.arcs.entry[m]), float(judged.arcs.exit[m])
    assert (entry < 1e-6) != (leave > np.pi - 1e-6)
    free = [(entry, leave + sign * error) if entry < 1e-6 else (entry + sign * error, leave) for sign in (-1, 1)]
    ends = [float(judged.solver.chart(0, 0, arc, angle=float(judged.arcs.angle[m]), speeds=np.array([9000.0]),
                                      depth=float(judged.arcs.depth[m])).limit[0]) for arc in free]
    _, notes = question_arcs(error, judged, 1e-4)
    assert f"between {1e3 * min(ends):.3g} and {1e3 * max(ends):.3g} mm" in notes[0]


def test_a_depth_between_the_two_limits_is_doubted(judged: JudgedPlaces) -> None:
    near = replace(judged, arcs=replace(judged.arcs, depth=1.001 * judged.margins.limit))
    assert [doubt.what for doubt in question_arcs(np.radians(0.1), near, 1e-4)[0]] == ["verdict"]
    far = replace(judged, arcs=replace(judged.arcs, depth=0.8 * judged.margins.limit))
    assert question_arcs(np.radians(0.1), far, 1e-4)[0] == []
