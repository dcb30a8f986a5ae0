"""Modes of a structure that drifts between points: their intervals hold what other bands say; noise alone changes nothing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.modal_identification import identify
from toolpoint.modal_identification.judgement.steadiness import inflate_covariance, judge_steadiness
from toolpoint.vibration import Frf, Modes

F, ZETA = np.array([180.0, 260.0, 420.0]), np.array([0.03, 0.02, 0.025])
LINES = np.arange(60.0, 700.0, 1.0)


def responses(rng, drift, noise=2e-3, points=6):
    """Three modes at six points; the sensor that is moved shifts every frequency by `drift` (one sigma) at every point."""
    shape = rng.normal(size=(points, 3)) + 2 * np.eye(points, 3)
    values = np.empty((LINES.size, points), complex)
    for p in range(points):
        f = F * (1 + drift * rng.normal(size=3))
        values[:, p] = (shape[p] * shape[0] / (f**2 - LINES[:, None] ** 2 + 2j * ZETA * f * LINES[:, None])).sum(axis=1)
    size = noise * np.sqrt((np.abs(values) ** 2).mean() / 2)
    values = values + size * (rng.normal(size=values.shape) + 1j * rng.normal(size=values.shape))
    return Frf(LINES, values[:, :, None], [f"{p}:+x" for p in range(points)], ["0:+x"])


def test_noise_alone_is_not_judged_and_changes_no_interval():
    result = identify(responses(np.random.default_rng(0), 0.0))
    assert result.steadiness is None and not result.smooth
    assert result.modes.count == 3 and not result.doubtful.any()


def test_a_drift_widens_the_intervals_and_is_said():
    result = identify(responses(np.random.default_rng(1), 4e-3))
    assert result.steadiness is not None
    before = result.modes.covariance - result.steadiness.moved[:, :, None] ** 2 * np.eye(2)
    known = np.diagonal(result.modes.covariance, axis1=1, axis2=2).min(axis=1) > 0  # nearly equal modes may cancel each other
    least = np.linalg.eigvalsh(before[known])[:, 0]
    assert known.sum() >= 3 and (least > -1e-9 * np.trace(before[known], axis1=1, axis2=2)).all()
    assert any("doubled" in line or "vanish" in line for line in result.advice)


@pytest.mark.slow
def test_intervals_of_a_drifting_structure_hold_what_other_points_say():
    """Two halves of the points of one structure; by the fit's covariance alone about a half of the differences are held."""
    inside, alone, cancelled = [], [], 0
    for seed in range(10):
        frf = responses(np.random.default_rng(seed), 4e-3, points=12)
        first, second = (identify(frf.selected(list(range(k, 12, 2)), [0])) for k in (0, 1))
        for i in np.flatnonzero(~first.doubtful):
            j = int(np.argmin(np.abs(second.modes.frequency - first.modes.frequency[i])))
            change = abs(first.modes.frequency[i] - second.modes.frequency[j])
            if change > first.modes.damping_ratio[i] * first.modes.frequency[i] or second.doubtful[j]:
                continue
            variance = [r.modes.covariance[k, 0, 0] for r, k in ((first, i), (second, j))]
            moved = [0.0 if r.steadiness is None else r.steadiness.moved[k, 0] ** 2 for r, k in ((first, i), (second, j))]
            inside.append(change < 1.96 * np.sqrt(sum(variance)))
            # Nearly equal modes may cancel each other: where nothing is left of the fit's own variance, it holds nothing.
            left = sum(variance) - sum(moved)
            cancelled += left <= 0
            alone += [change < 1.96 * np.sqrt(left)] if left > 0 else []
    assert len(inside) > 20 and cancelled < 0.1 * len(inside)
    assert np.mean(inside) > 0.88 and np.mean(alone) < 0.7


def fixed(frequency, ratio, shape):
    return Modes(np.array(frequency), np.array(ratio), np.array(shape, float), ["1:+x", "2:+x"], "unscaled",
                 covariance=np.tile(np.diag([0.01, 1e-6]), (len(frequency), 1, 1)))


def test_changes_are_those_of_the_partners_and_missing_modes_are_unsteady():
    modes = fixed([100.0, 200.0, 300.0], [0.02, 0.02, 0.02], [[1, 1, 1], [1, -1, 0]])
    frf = responses(np.random.default_rng(0), 0.0)
    answers = iter([fixed([101.0, 200.0], [0.021, 0.02], [[1, 1], [1, -1]])] * 2 + [None])

    def again(part):
        answer = next(answers)
        if answer is None:
            raise ToolpointError("no mode found")
        return answer

    steadiness = judge_steadiness(frf, modes, again, points=False)
    # The band begins at 60 Hz: an eighth of it cuts mode 1 off, the last band shows nothing.
    np.testing.assert_array_equal(steadiness.n_expected, [1, 3, 3])
    np.testing.assert_array_equal(steadiness.n_detected, [1, 2, 0])
    np.testing.assert_allclose(steadiness.moved[0], [1.0, 0.001], rtol=0.1)  # less what fewer lines explain
    np.testing.assert_array_equal(steadiness.unsteady, [False, False, True])
    np.testing.assert_allclose(inflate_covariance(modes, steadiness).covariance[0], np.diag([1.01, 2e-6]), rtol=0.1)
    assert judge_steadiness(frf.between(100, 150), modes, again, points=False) is None
    assert inflate_covariance(replace(modes, covariance=None), steadiness).covariance is None


@pytest.mark.slow
def test_real_bands_agree_within_their_intervals(capsys):
    if not (Path(__file__).parents[3] / "shared" / "data" / "tool_holder_frf").exists():
        pytest.skip("measured data ../shared/data/tool_holder_frf is not beside the project")
    from benchmarks.modal_identification import real_bands

    real_bands.main(["--bands", "4"])  # six pairs of bands; the bar runs all eight
    last = capsys.readouterr().out.splitlines()[-1]
    frequency, damping = (float(last.split(name)[1].split(" %")[0]) for name in ("frequency ", "damping "))
    assert frequency >= 85 and damping >= 85
