"""Where synthesis and measurement part, the band is named; where they agree, nothing is said."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.modal_identification.judgement.parting import parting_remarks
from toolpoint.vibration import Frf, Modes, frequency_response

LINES = np.arange(10.0, 1200.0, 1.0)


def measured(seed: int, noise: float, kept: list[int]) -> tuple[Frf, np.ndarray]:
    """Responses of five modes with noise, and the synthesis of some of them."""
    rng = np.random.default_rng(seed)
    shape = rng.standard_normal((6, 5)) + np.sign(rng.standard_normal((6, 5)))
    modes = Modes(np.array([150.0, 320.0, 560.0, 790.0, 1010.0]), np.full(5, 0.01), shape, [f"{k}:+x" for k in range(1, 7)])
    clean = frequency_response.modal(modes, LINES).selected(range(6), [0]).converted_to("accelerance")
    part = frequency_response.modal(modes.selected(kept), LINES).selected(range(6), [0]).converted_to("accelerance")
    level = noise * np.sqrt((np.abs(clean.values) ** 2).mean())
    pair = rng.standard_normal(clean.values.shape) + 1j * rng.standard_normal(clean.values.shape)
    return Frf(LINES, clean.values + level * pair / np.sqrt(2), clean.outputs, clean.inputs, "accelerance"), part.values


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("missing", [1, 3])
def test_a_missing_mode_is_named_with_its_band(seed, missing) -> None:
    frf, synthesis = measured(seed, 0.01, [k for k in range(5) if k != missing])
    remark = parting_remarks(frf, synthesis)[0]
    assert f"most at {[150, 320, 560, 790, 1010][missing]}"[:-1] in remark and "--band" in remark


@pytest.mark.parametrize("noise", [0.001, 0.02, 0.1])
def test_all_modes_leave_nothing_to_say(noise) -> None:
    assert [parting_remarks(*measured(seed, noise, list(range(5)))) for seed in range(10)] == [[]] * 10
