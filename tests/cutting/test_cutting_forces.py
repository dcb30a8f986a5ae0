"""Force laws, chip thickness, literature table, calibration."""

from __future__ import annotations

import numpy as np
import pytest

from cutting.cutting_cases import benchmark
from toolpoint import Dof, Record, ToolpointError
from toolpoint.cutting import CuttingCoefficients, Engagement, Tool
from toolpoint.cutting.cut.total_energy import TotalEnergy
from toolpoint.cutting.force.calibration import average_force, instantaneous, revolution
from toolpoint.cutting.force.laws import (
    Kienzle,
    LinearEdge,
    exact_chip,
    oblique_coefficients,
    rigid_forces,
)
from toolpoint.cutting.force.materials import literature, materials

MATERIAL = CuttingCoefficients(767e6, 168.8e6, 222e6, 27.7e3, 26.6e3, 0.7e3)


def test_kienzle_at_one_millimetre_and_its_tangent() -> None:
    """At h = 1 mm the specific force is kc1.1; the linearised law touches it with equal slope."""
    law = Kienzle(1500e6, 0.22, 500e6, 0.4)
    assert law.per_length(np.array(1e-3))[0] == pytest.approx(1500e6 * 1e-3)
    assert law.per_length(np.array(0.25e-3))[0] == pytest.approx(1500e6 * 0.25e-3 * 0.25**-0.22)
    line = LinearEdge(law.linearised(1e-4))
    for h, order in ((1e-4, 1e-12), (1.01e-4, 1e-4)):
        assert line.per_length(np.array(h))[:2] == pytest.approx(law.per_length(np.array(h))[:2], rel=order)


def test_total_energy_is_work_per_volume() -> None:
    """Cutting power equals energy times the volume removed, and the forces keep their ratios."""
    problem = benchmark(Engagement.slot(), feed_per_tooth=1e-4, tool=Tool(0.02, 4))
    law = TotalEnergy(800e6, 0.0, 0.3, 0.1)
    run = rigid_forces(problem, 2e-3, np.linspace(0, 2 * np.pi, 2000, endpoint=False), law=law)
    volume_rate = 1e-4 * 4 * 100 * 0.02 * 2e-3
    assert run.power(6000.0).mean() == pytest.approx(800e6 * volume_rate, rel=1e-4)
    assert law.per_length(np.array(1e-4)) / law.per_length(np.array(1e-4))[0] == pytest.approx([1, 0.3, 0.1])


def test_orthogonal_cut_is_merchants() -> None:
    """Without inclination K_t = tau cos(b - a)/(sin phi cos(phi + b - a)) and K_a = 0."""
    tau, phi, beta, alpha = 300e6, 0.5, 0.6, 0.1
    c = oblique_coefficients(tau, phi, beta, rake=alpha)
    assert c.kt == pytest.approx(tau * np.cos(beta - alpha) / np.sin(phi) / np.cos(phi + beta - alpha))
    assert c.ka == pytest.approx(0, abs=1e-3)
    assert oblique_coefficients(tau, phi, beta, rake=alpha, inclination=0.5).ka > 0


def test_exact_chip_lies_on_the_previous_path() -> None:
    """The end of the chip lies on the previous tooth's trochoid, and f sin(phi) is its limit for small feed."""
    radius, feed, teeth = 0.01, 2e-3, 2
    phi = np.linspace(0.2, 2.9, 30)
    h = exact_chip(phi, radius, feed, teeth=teeth)
    turn = np.linspace(-1, np.pi + 1, 400001)  # angle of the previous tooth
    for p, thickness in zip(phi[::6], h[::6]):
        centre = -feed + feed * teeth / (2 * np.pi) * (turn - p)
        x, y = centre + radius * np.sin(turn), radius * np.cos(turn)
        point = (radius - thickness) * np.array([np.sin(p), np.cos(p)])
        assert np.hypot(x - point[0], y - point[1]).min() < 1e-7
    small = exact_chip(phi, radius, 1e-7, teeth=teeth)
    assert small == pytest.approx(1e-7 * np.sin(phi), rel=1e-4)


def test_up_and_down_forces_mirror() -> None:
    """Down- and up-milling of equal width need the same power."""
    turn = np.linspace(0, 2 * np.pi, 3001)[:-1]
    powers = [rigid_forces(benchmark(arc, feed_per_tooth=1e-4), 1e-3, turn).power(6000.0).mean()
              for arc in (Engagement.down(0.3), Engagement.up(0.3))]
    assert powers[0] == pytest.approx(powers[1], rel=1e-3)


def test_literature_has_ranges_and_sources() -> None:
    """Every material has a source; one alloy spreads by a factor of two; an unknown one suggests the nearest."""
    for name in materials():
        found = literature(name)
        assert found.source and found.kt[0] > 0
    low, high = literature("Al 7075").kt
    assert high / low > 2
    with pytest.raises(ToolpointError, match="Al 6082"):
        literature("Al 6082")


def _mean_forces(problem, feeds, depth):  # type: ignore[no-untyped-def]
    turn = np.linspace(0, 2 * np.pi, 20001)[:-1]
    return np.array([rigid_forces(problem.changed(feed_per_tooth=f), depth, turn).force.mean(0) for f in feeds])


def test_average_forces_give_back_the_coefficients() -> None:
    """Mean forces of an exact model return all six coefficients."""
    problem = benchmark(Engagement.down(0.5)).changed(coefficients=MATERIAL)
    feeds = np.array([0.05, 0.1, 0.15, 0.2]) * 1e-3
    fit = average_force(problem, feeds, _mean_forces(problem, feeds, 1e-3), depth=1e-3)
    want = np.concatenate([MATERIAL.cutting, MATERIAL.edge])
    assert fit.values == pytest.approx(want, rel=5e-3)
    with pytest.raises(ToolpointError, match="at least two"):
        average_force(problem, feeds[:1], np.zeros((1, 3)), depth=1e-3)


@pytest.mark.slow
def test_calibration_intervals_cover_the_truth() -> None:
    """Five feeds, noise 2 %, run-out: the 95 % intervals hold the truth in about 95 % of the cases."""
    tool = Tool(0.016, 4, helix=np.radians(30), runout=12e-6, runout_angle=0.7)
    problem = benchmark(Engagement.slot(), tool=tool).changed(coefficients=MATERIAL)
    feeds = np.array([0.04, 0.08, 0.12, 0.16, 0.2]) * 1e-3
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    clean = np.array([rigid_forces(problem.changed(feed_per_tooth=f), 2e-3, turn, slices=10).force for f in feeds])
    truth = np.concatenate([MATERIAL.cutting, MATERIAL.edge, [12e-6, 0.7]])
    rng = np.random.default_rng(8)
    start = problem.changed(tool=tool.with_runout(0.0))
    held = []
    for _ in range(25):
        noisy = clean + 0.02 * np.abs(clean).max() * rng.standard_normal(clean.shape)
        fit = instantaneous(start, feeds, turn, forces=noisy, depth=2e-3, slices=10)
        held.append((fit.interval[:, 0] <= truth) & (truth <= fit.interval[:, 1]))
        assert fit.status == "converged"
    assert 0.9 <= np.mean(held) <= 0.99
    assert fit.values[:4] == pytest.approx(truth[:4], rel=0.1)
    two = problem.changed(tool=Tool(0.016, 2, helix=np.radians(30), runout=12e-6, runout_angle=0.7))
    clean = np.array([rigid_forces(two.changed(feed_per_tooth=f), 2e-3, turn, slices=10).force for f in feeds])
    noisy = clean + 0.02 * np.abs(clean).max() * rng.standard_normal(clean.shape)
    assert "poorly determined" in instantaneous(two.changed(tool=two.tool.with_runout(0.0)), feeds, turn, forces=noisy,
                                                depth=2e-3).status
    assert "runout" in fit.table() and "kt" in repr(fit)


@pytest.mark.slow
def test_phase_of_each_record_is_found() -> None:
    """Records that begin at any angle: phases up to whole pitches of the teeth, the same ones for all records."""
    tool = Tool(0.016, 3, helix=np.radians(30), runout=10e-6, runout_angle=-1.0)
    problem = benchmark(Engagement.down(0.6), tool=tool).changed(coefficients=MATERIAL)
    feeds, begin = np.array([0.06, 0.12, 0.18]) * 1e-3, np.array([0.3, 2.9, 5.1])
    turn = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    forces = np.array([rigid_forces(problem.changed(feed_per_tooth=f), 2e-3, turn + b, slices=60).force
                       for f, b in zip(feeds, begin)])
    forces = forces + 0.01 * np.abs(forces).max() * np.random.default_rng(1).standard_normal(forces.shape)
    start = problem.changed(tool=tool.with_runout(0.0))
    fit = instantaneous(start, feeds, turn, forces=forces, depth=2e-3, phase="each", slices=30)
    found = dict(zip(fit.names, fit.values))
    turned = np.array([found[f"phase_{i}"] for i in (1, 2, 3)]) - begin
    pitches = turned / (2 * np.pi / 3)
    assert pitches == pytest.approx(np.round(pitches), abs=0.01)
    assert np.ptp(np.round(pitches)) % 3 == 0
    assert found["kt"] == pytest.approx(767e6, rel=0.02) and found["runout"] == pytest.approx(10e-6, rel=0.05)
    for bad, words in (("all", "must be False"), ("each", "equal steps")):
        with pytest.raises(ToolpointError, match=words):
            instantaneous(start, feeds, turn / 2, forces=forces, depth=2e-3, phase=bad)


def test_a_force_record_is_averaged_over_revolutions() -> None:
    """Samples of whole revolutions fold on one."""
    rate, speed = 10000.0, 3000.0
    t = np.arange(4000) / rate
    values = np.sin(2 * np.pi * 50 * t)[:, None]
    record = Record(values, rate, (Dof("tool", "x"),), ("force",))
    angle, mean = revolution(record, speed)
    assert mean[:, 0] == pytest.approx(np.sin(angle), abs=1e-3)
