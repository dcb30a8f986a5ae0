"""Poses, probability, best speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cutting.cutting_cases import altintas, benchmark, random_problem
from toolpoint import Frf, Modes
from toolpoint.cutting import CuttingCoefficients, Engagement, FloquetDeterminant, MillingProblem, Tool, stability
from toolpoint.cutting.advice.best_speed import from_chart, from_chatter_frequency, from_cuts, most_informative
from toolpoint.cutting.advice.probability import coefficient_parameters, modal_parameters, probability
from toolpoint.cutting.stability.chain import chart_poses, limits_of

SPEEDS = np.linspace(8000, 16000, 33)


def test_poses_and_directions_equal_single_charts() -> None:
    """A batch of poses gives pose by pose what single calls give; a faulty pose is kept with its reason."""
    rng = np.random.default_rng(2)
    single = [random_problem(rng, modes=2).dynamics for _ in range(3)]
    batch = Modes(np.stack([m.frequency for m in single]), np.stack([m.damping_ratio for m in single]),  # type: ignore
                  np.stack([m.shape for m in single]), single[0].dofs)  # type: ignore
    problem = benchmark(Engagement.down(0.3), 2)
    angles = [0.0, 0.6]
    limit = limits_of(chart_poses(problem, batch, SPEEDS[::8], feed_angles=angles), 5)
    for i, modes in enumerate(single):
        for j, angle in enumerate(angles):
            want = stability.chart(problem.changed(dynamics=modes, feed_angle=angle), SPEEDS[::8], depth_max=0.01).limit
            assert limit[i, j] == pytest.approx(want, rel=1e-9)
    faulty = Modes([900.0], [0.0], np.ones((2, 1)), single[0].dofs)  # type: ignore[union-attr]
    mixed = chart_poses(problem, [single[0], faulty], SPEEDS[:3])  # type: ignore[list-item]
    assert isinstance(mixed[1][0], str) and "damping" in mixed[1][0]
    limit = limits_of(mixed, 3)
    assert np.isnan(limit[1]).all() and not np.isnan(limit[0]).any()


def test_probability_tends_to_the_chart_and_names_what_matters() -> None:
    """Without uncertainty P is the chart; with only kt uncertain, kt explains nearly all of the limit's variance."""
    problem = benchmark(Engagement.down(0.05), 2)
    depths = np.linspace(1e-4, 4e-3, 20)
    none = probability(problem, coefficient_parameters(0.0), SPEEDS, depths=depths, rng=np.random.default_rng(0), samples=3)
    assert np.array_equal(none.probability > 0.5, stability.chart(problem, SPEEDS, depth_max=4e-3).stable(depths))
    parameters = [coefficient_parameters(0.1)[0], coefficient_parameters(0.005)[1]]
    varied = probability(problem, parameters, SPEEDS, depths=depths, rng=np.random.default_rng(1), samples=60)
    assert (varied.probability >= 0).all() and (varied.probability <= 1).all() and (varied.error < 0.07).all()
    share = varied.importance()
    assert next(iter(share)) == "kt" and 0.7 < share["kt"] <= 1.05
    assert (varied.depth_at(0.95) <= varied.depth_at(0.5)).all()


def test_samples_of_coefficients_share_charts_and_differ_little_from_their_own() -> None:
    """A straight edge: K_t times c is c times the depth; a chart of the nearest K_n/K_t serves in place of each sample's."""
    problem = benchmark(Engagement.down(0.5), 2)
    depths, charts = np.linspace(2e-5, 2e-3, 60), []
    shared = probability(problem, coefficient_parameters(0.1), SPEEDS[::6], depths=depths, rng=np.random.default_rng(4),
                         samples=40, progress=lambda done, total: charts.append(total))
    assert charts[-1] < 25
    for s in range(0, 40, 4):
        kt, kn = shared.factors[s]
        k = problem.coefficients
        alone = stability.chart(problem.changed(coefficients=replace(k, kt=kt * k.kt, kn=kn * k.kn)), SPEEDS[::6],
                                depth_max=2e-3)
        np.testing.assert_allclose(shared.limit[s], np.minimum(alone.limit, 2e-3), rtol=0.03)
        assert (shared.stable[s] != alone.stable(depths)).mean() < 0.02


def test_uncertain_stiffness_scales_the_limit() -> None:
    """All stiffnesses times c (with the masses) multiply the limit by c: the parameters enter as they say."""
    problem = benchmark(Engagement.down(0.05), 2)
    changed = problem
    for parameter in modal_parameters(problem):
        if parameter.name.startswith("stiffness"):
            changed = parameter.change(changed, 1.3)
    a, b = (stability.chart(p, SPEEDS[:5], FloquetDeterminant(), depth_max=0.006).limit for p in (problem, changed))
    finite = np.isfinite(b)
    assert finite.any() and b[finite] == pytest.approx(1.3 * a[finite], rel=1e-6)
    stiffer = modal_parameters(problem)[0].change(problem, 1.02).plane
    assert np.linalg.norm(stiffer.response(np.array([0.0]))) == pytest.approx(
        np.linalg.norm(problem.plane.response(np.array([0.0]))), rel=1e-9)


def test_cuts_with_known_outcome_narrow_the_chart() -> None:
    """A deep stable cut raises P(stable) there; the best cut proposed is one that is likely stable."""
    problem = benchmark(Engagement.down(0.05), 2)
    depths = np.linspace(1e-4, 4e-3, 20)
    prior = probability(problem, [*modal_parameters(problem, 0.01, 0.2), *coefficient_parameters(0.15)], SPEEDS, depths=depths,
                        rng=np.random.default_rng(3), samples=60)
    test = most_informative(prior)
    i, d = int(np.argmin(np.abs(SPEEDS - test.speed))), int(np.argmin(np.abs(depths - test.depth)))
    assert 0.2 < prior.probability[i, d] < 0.8
    after = prior.after_cuts([(test.speed, test.depth, True)])
    assert after.probability[i, d] > prior.probability[i, d] and after.weights.sum() == pytest.approx(1)
    advice = from_cuts(prior, [(test.speed, test.depth, True)], 0.8)
    assert advice.depth > 0
    assert ("deeper cuts were not looked at" in advice.reason) == (advice.depth == depths[-1])
    shallow = probability(problem, coefficient_parameters(0.1), SPEEDS[:3], depths=depths[:2], rng=np.random.default_rng(3),
                          samples=3)
    assert "deeper cuts were not looked at" in from_cuts(shallow, []).reason


def test_best_speed() -> None:
    """From the chart: inside the best lobe; from the chatter frequency: tooth passing at f/k."""
    problem = benchmark(Engagement.down(0.05), 2)
    chart = stability.chart(problem, np.linspace(8000, 16000, 81), depth_max=4e-3)
    advice = from_chart(chart)
    assert chart.limit[np.argmin(np.abs(chart.speeds - advice.speed))] >= advice.depth
    assert not advice.reason.endswith(("beyond", "speeds"))
    first = from_chatter_frequency(930.0, 2, 30000.0)[0]
    assert first.speed == pytest.approx(60 * 930 / 2)
    limit = stability.chart(problem, [first.speed * 0.98, first.speed * 0.8], depth_max=0.02).limit
    assert limit[0] > limit[1] or np.isinf(limit[0])


def test_the_margin_of_speed_holds_on_a_coarse_chart_too() -> None:
    """The cut advised from speeds 3.5 % apart is stable 2 % beside its own; where the chart shows no margin it says so."""
    chart = stability.chart(altintas(), np.arange(13000.0, 16001.0, 500.0))
    advice = from_chart(chart)
    assert advice.reason.endswith("the chart is coarse here: chart more speeds")
    beside = stability.chart(altintas(), advice.speed * np.array([0.98, 1.02])).limit
    at = chart.limit[np.argmin(np.abs(chart.speeds - advice.speed))]
    assert advice.depth < 0.9 * at and (advice.depth < beside).all()
    assert from_chart(stability.chart(altintas(), np.array([13900.0, 13950.0, 14000.0]))).reason.endswith("look beyond")


def test_a_limit_is_trusted_less_its_stated_error() -> None:
    chart = stability.chart(altintas(), np.linspace(13000.0, 15000.0, 41))
    rough = replace(chart, error=np.full(chart.error.shape, 1e-3))
    assert from_chart(rough).depth == pytest.approx(from_chart(chart).depth - 0.9e-3, rel=0.02)


def test_cuts_that_contradict_each_other_are_both_unlikely() -> None:
    """Each alone is possible: together they are not, since the deeper cut of the same speed is the harder one."""
    problem = benchmark(Engagement.down(0.05), 2)
    speed = [10000.0]
    limit = float(stability.chart(problem, speed, depth_max=0.02).limit[0])
    prior = probability(problem, coefficient_parameters(0.2), speed, depths=np.linspace(0.02, 2, 100) * limit,
                        rng=np.random.default_rng(0), samples=100)
    deep, shallow = (10000.0, 1.1 * limit, True), (10000.0, 0.95 * limit, False)
    assert min(prior.likelihoods([deep])[0], prior.likelihoods([shallow])[0]) > 0.1
    assert max(prior.likelihoods([deep, shallow])) < 0.1
    impossible = prior.likelihoods([(10000.0, 0.1 * limit, False)] * 2)
    assert impossible.max() < 1e-12  # twice the same impossible outcome does not make it likely


@pytest.mark.slow
def test_samples_of_a_helix_on_measured_lines_share_its_chart_and_differ_little_from_their_own() -> None:
    lines = np.arange(100.0, 2500.0, 4.0)
    r = lines / 800.0
    frf = Frf(lines, (5e-8 / (1 - r**2 + 0.06j * r))[:, None, None], ["tool:+x"], ["tool:+x"])
    problem = MillingProblem(Tool(0.016, 4, helix=0.5), Engagement.down(0.5), CuttingCoefficients(8e8, 2.5e8), frf, "tool:+x",
                             "same")
    speeds, depths, charts = np.array([5000.0, 8000.0]), np.linspace(1e-4, 3e-3, 30), []
    shared = probability(problem, coefficient_parameters(0.1), speeds, depths=depths, rng=np.random.default_rng(4), samples=4,
                         progress=lambda done, total: charts.append(total))
    assert charts == [1]
    for s in range(4):
        kt, kn = shared.factors[s]
        k = problem.coefficients
        alone = stability.chart(problem.changed(coefficients=replace(k, kt=kt * k.kt, kn=kn * k.kn)), speeds, depth_max=3e-3)
        np.testing.assert_allclose(shared.limit[s], np.minimum(alone.limit, 3e-3), rtol=0.05)
