"""The problem type: tool, engagement, coefficients, directions, and what bad input says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from cutting.cutting_cases import altintas, benchmark, one_mode
from toolpoint import Frf, Modes, ToolpointError, ToolpointWarning
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, TurningProblem, stability
from toolpoint.cutting.cut.coefficients import chip_direction, force_direction, mean_matrix
from toolpoint.vibration import frequency_response

MATERIAL = CuttingCoefficients(6e8, 2e8)


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 1.5), st.floats(0.05, 1.6), st.integers(1, 8))
def test_mean_matrix_is_the_integral(entry: float, arc: float, teeth: int) -> None:
    """The closed form of the mean directional matrix equals the numerical integral."""
    got = mean_matrix(MATERIAL, entry, entry + arc, teeth=teeth)
    for i in range(2):
        for j in range(2):
            def part(p: float, i: int = i, j: int = j) -> float:
                return float(force_direction(MATERIAL, np.array(p))[i] * chip_direction(np.array(p))[j])
            want = teeth / (2 * np.pi) * quad(part, entry, entry + arc)[0]
            assert got[i, j] == pytest.approx(want, rel=1e-9, abs=1e-3)


def test_engagement_follows_the_convention() -> None:
    """Down-milling engages from acos(2a/D - 1) to pi, up-milling from 0 to acos(1 - 2a/D); both arcs are equal."""
    down, up = Engagement.down(0.05), Engagement.up(0.05)
    assert down.entry == pytest.approx(np.arccos(-0.9)) and down.exit == pytest.approx(np.pi)
    assert up.entry == 0 and up.exit == pytest.approx(np.arccos(0.9))
    assert down.arc == pytest.approx(up.arc)
    assert Engagement.down(1).arc == pytest.approx(Engagement.slot().arc)


def test_runout_makes_edge_radii_differ_and_their_mean_stays() -> None:
    """An offset changes the edges' radii by rho cos; over equal teeth the sum of changes is zero."""
    radii = Tool(0.02, 4, runout=10e-6, runout_angle=0.4).edge_radius(0.0)
    assert radii.mean() == pytest.approx(0.01, rel=1e-12) and np.ptp(radii) > 1e-5


@pytest.mark.parametrize(("make", "text"), [
    (lambda: CuttingCoefficients(-6e8, 2e8), "must not be negative"),
    (lambda: CuttingCoefficients(6e8, -2e8), "must not be negative"),
    (lambda: CuttingCoefficients(6e8, 2e8, edge_t=-1), "must not be negative"),
    (lambda: CuttingCoefficients(0, 2e8), "above zero"),
    (lambda: Tool(0.02, 0), "Tool.teeth"),
    (lambda: Tool(-0.02, 2), "Tool.diameter"),
    (lambda: Tool(0.02, 2, helix=30), "rad"),
    (lambda: Tool(0.02, 2, pitch=[1.0, 1.0]), "2 pi"),
    (lambda: Tool(0.02, 2, corner_radius=0.02), "corner_radius"),
    (lambda: Engagement.down(1.2), "cannot be wider than the diameter"),
    (lambda: Engagement.up(0), "immersion"),
    (lambda: Engagement(2.0, 1.0), "entry"),
    (lambda: stability.chart(benchmark(Engagement.slot()), [0.0]), "speeds"),
    (lambda: stability.chart(benchmark(Engagement.slot()), [5000.0, -1]), "speeds"),
    (lambda: stability.chart(benchmark(Engagement.slot()), [5000.0], depth_max=0), "depth_max"),
    (lambda: benchmark(Engagement.slot(), x="spindle:+x"), "no spindle"),
    (lambda: benchmark(Engagement.slot(), process_damping=-1.0), "process_damping"),
    (lambda: MillingProblem(Tool(0.02, 2), Engagement.slot(), MATERIAL, 3), "dynamics"),  # type: ignore[arg-type]
    (lambda: TurningProblem(1e9, one_mode(), process_damping=1e3), "cutting speed"),
])
def test_bad_input_names_what_is_wrong(make, text: str) -> None:  # type: ignore[no-untyped-def]
    """Each bad input raises a ToolpointError whose message names it."""
    with pytest.raises(ToolpointError, match=text):
        make()


def test_modes_that_cannot_cut_are_refused() -> None:
    """Rigid-body and undamped modes have no finite answer and are refused."""
    rigid = Modes([0.0, 922], [0, 0.01], np.ones((1, 2)), ("tool:+x",))
    undamped = Modes([922.0], [0.0], np.ones((1, 1)), ("tool:+x",))
    for modes in (rigid, undamped):
        with pytest.raises(ToolpointError, match="dynamics"):
            MillingProblem(Tool(0.02, 2), Engagement.slot(), MATERIAL, modes)


def test_directions_are_found_or_asked_for() -> None:
    """One point with x and y is found by itself; several points need labels; a turned label turns the sign."""
    found = benchmark(Engagement.slot(), 2).plane
    named = benchmark(Engagement.slot(), 2, x="tool:+x", y="tool:+y").plane
    turned = benchmark(Engagement.slot(), 2, x="tool:-x", y="tool:+y").plane
    assert np.array_equal(found.residues, named.residues)
    assert np.allclose(turned.residues[:, 0, 0], named.residues[:, 0, 0])
    several = Modes([900.0], [0.01], np.ones((4, 1)), ("a:+x", "a:+y", "b:+x", "b:+y"))
    with pytest.raises(ToolpointError, match="give x="):
        MillingProblem(Tool(0.02, 2), Engagement.slot(), MATERIAL, several)
    assert "rigid along y" in " ".join(benchmark(Engagement.slot()).notes)
    assert "taken as that along x" in " ".join(benchmark(Engagement.slot(), y="same").notes)


def test_response_is_that_of_the_noun_and_turns_with_the_feed() -> None:
    """The plane's response equals the modal sum of `vibration`; turning by 90 degrees exchanges x and y."""
    problem = altintas()
    f = np.linspace(200, 2000, 50)
    x = frequency_response.modal(problem.dynamics[0], f).values[:, 0, 0]  # type: ignore[index]
    assert np.allclose(problem.plane.response(f)[:, 0, 0], x, rtol=1e-12)
    turned = problem.at_feed_angle(np.pi / 2).plane.response(f)
    assert np.allclose(turned[:, 1, 1], x, rtol=1e-9)


def test_an_frf_that_misses_the_band_warns_and_marks() -> None:
    """A measured FRF that ends on the resonance warns with the missing band, and the chart carries the remark."""
    f = np.arange(300.0, 930.0, 2)
    frf = frequency_response.modal(one_mode(), f)
    problem = MillingProblem(Tool(0.02, 2), Engagement.slot(), MATERIAL, frf)
    with pytest.warns(ToolpointWarning, match="missing"):
        chart = stability.chart(problem, np.array([5000.0]))
    assert any("missing" in note for note in chart.notes)


def test_an_accelerance_frf_is_integrated_and_a_single_direction_serves_both() -> None:
    """Accelerance in, the same plane as receptance; y='same' fills y without cross response."""
    f = np.arange(1.0, 4000.0, 2.0)
    frf = frequency_response.modal(one_mode(), f)
    one = MillingProblem(Tool(0.02, 2), Engagement.slot(), MATERIAL, frf, y="same").plane
    two = MillingProblem(Tool(0.02, 2), Engagement.slot(), MATERIAL, frf.converted_to("accelerance"), y="same").plane
    assert np.allclose(one.values, two.values)  # type: ignore[arg-type]
    assert np.allclose(one.values[:, 0, 0], one.values[:, 1, 1]) and not one.values[:, 0, 1].any()  # type: ignore[index]
    bad = Frf(f, np.full((f.size, 1, 1), 1j), ("tool:+x",), ("tool:+x",))
    assert "Frf" in repr(bad)


def test_coefficients_in_newton_per_square_millimetre_are_doubted() -> None:
    with pytest.warns(ToolpointWarning, match="multiply those in N/mm"):
        CuttingCoefficients(600, 200)


def test_modes_without_a_mode_are_refused() -> None:
    with pytest.raises(ToolpointError, match="no modes; must have at least one"):
        benchmark(Engagement.slot()).changed(dynamics=Modes(np.zeros(0), np.zeros(0), np.zeros((1, 0)), ("tool:+x",)))
