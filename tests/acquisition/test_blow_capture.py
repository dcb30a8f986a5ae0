"""Blows cut out of a stream: the same however the stream is cut into blocks; nothing is spliced over a gap."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tapping import RATE, inputs, stream

from toolpoint._check import ToolpointError
from toolpoint.acquisition import BlowCapture, CapturedBlow, SampleBlock


def captured(volts: np.ndarray, sizes: list[int], *, gaps: tuple[int, ...] = (), limit: float | None = 10.0
             ) -> list[CapturedBlow]:
    capture, place, blows, k = BlowCapture(inputs(limit), RATE, 0.4), 0, [], 0
    while place < len(volts):
        size = sizes[k % len(sizes)]
        has_gap = any(place <= gap < place + size for gap in gaps)
        blows += capture.feed(SampleBlock(volts[place:place + size], place, place / RATE, has_overflow=has_gap))
        place, k = place + size, k + 1
    return blows


FORCES = (200.0, 150.0, 180.0)
VOLTS = stream(FORCES)


@settings(max_examples=25)
@given(sizes=st.lists(st.integers(7, 4000), min_size=1, max_size=5))
def test_blows_do_not_depend_on_the_blocks(sizes):
    expected = captured(VOLTS, [len(VOLTS) // 2])
    blows = captured(VOLTS, sizes)
    # The trigger is set by the noise of the first half second, which ends with a block.
    assert [blow.start for blow in blows] == pytest.approx([blow.start for blow in expected], abs=2)
    assert all(np.array_equal(blow.volts, VOLTS[blow.start:blow.stop]) for blow in blows) and len(blows) == 3


def test_every_blow_has_its_pretrigger_and_its_block():
    for k, blow in enumerate(captured(VOLTS, [50])):
        peak = blow.start + int(np.argmax(blow.volts[:, 0]))
        assert peak == pytest.approx((0.8 + 0.8 * k) * RATE + 5, abs=2)
        assert peak - blow.start > 0.02 * 0.4 * RATE and blow.stop - peak > 0.38 * RATE


def test_a_gap_tears_the_open_blow_and_clears_what_came_before():
    peak = round(0.8 * RATE)
    torn, *others = captured(VOLTS, [50], gaps=(peak + 400,))
    assert torn.is_torn and torn.set_aside == "samples were lost within the blow"
    assert not any(blow.is_torn for blow in others) and len(others) == 2
    # A gap just before a blow shortens its pretrigger: samples from before the gap are not part of it.
    second = captured(VOLTS, [10], gaps=(round(1.6 * RATE) - 20,))[1]
    assert second.start >= round(1.6 * RATE) - 20


def test_samples_at_the_end_of_the_range_are_an_overload():
    clipped = np.clip(VOLTS * [1.0, 0.1], -0.4, 0.4)
    assert [bool(blow.overloads) for blow in captured(clipped, [50], limit=0.4)] == [True, False, True]
    assert "channel 1 (force at tip:+x)" in captured(clipped, [50], limit=0.4)[0].set_aside


def test_noise_alone_is_no_blow():
    noise = 1e-3 * np.random.default_rng(1).standard_normal((20_000, 2))
    assert captured(noise, [64], limit=None) == []


def test_a_block_of_no_length_is_refused():
    with pytest.raises(ToolpointError, match="100 samples"):
        BlowCapture(inputs(), RATE, 0.001)
