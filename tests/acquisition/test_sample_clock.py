"""Lost samples by the clock: late blocks are none, a step of the deficit is."""

from __future__ import annotations

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from toolpoint.acquisition import SampleClock

RATE = 48_000.0


def counted(losses: dict[int, int], *, seed: int, late: float, drift: float, blocks: int = 1200) -> tuple[int, int]:
    """Return the samples that a clock finds lost, and the block at which it first does; blocks of 10 ms come late at random."""
    rng, clock, total, first, gone = np.random.default_rng(seed), SampleClock(RATE), 0, -1, 0
    arrival = 0.0
    for k in range(blocks):
        gone += losses.get(k, 0)
        due = 0.01 * (k + 1) * (1 + drift) + gone / RATE
        delay = late if rng.random() < 0.02 else rng.exponential(0.0005)
        arrival = max(arrival, due + delay)  # a block never overtakes the one before it: they come in a burst
        lost = clock.count(480, arrival)
        if lost and first < 0:
            first = k
        total += lost
    return total, first


@given(seed=st.integers(0, 10_000), late=st.floats(0.0, 0.3), drift=st.floats(-2e-4, 2e-4))
def test_late_blocks_and_another_quartz_are_no_loss(seed, late, drift):
    assert counted({}, seed=seed, late=late, drift=drift) == (0, -1)


@example(seed=1282, late=0.046875, lost=900, place=707)  # all blocks of its window before the loss came late
@given(seed=st.integers(0, 10_000), late=st.floats(0.0, 0.2), lost=st.integers(900, 48_000), place=st.integers(330, 800))
def test_a_loss_is_found_within_three_windows_and_measured(seed, late, lost, place):
    total, first = counted({place: lost}, seed=seed, late=late, drift=5e-5)
    assert abs(total - lost) < 0.006 * RATE
    assert place <= first <= place + 3 * 115
