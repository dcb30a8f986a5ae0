"""Check of the frame rate: poles from beside the camera must fit the decay, or fit it at another rate."""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray
from toolpoint._doubt import Doubt
from toolpoint.vision.modes.decay import FreeDecay

# Share of the motion that poles may leave, and rates that are tried: from a quarter of the stated one to four times it.
MAX_UNEXPLAINED_FRACTION, MAX_RATE_RATIO, MAX_TRIED_RATES = 0.03, 4.0, 4000


def doubt_rate(decay: FreeDecay, poles: ComplexArray) -> tuple[Doubt, ...]:
    """Return a doubt where poles (rad/s) of a record leave much of the motion: of the frame rate, where another one fits."""
    unexplained_fraction = motion_left(decay, poles, decay.frame_rate)
    if unexplained_fraction < MAX_UNEXPLAINED_FRACTION:
        return ()
    # Two rates are told apart by half a cycle of the fastest pole within the decay.
    step = 0.4 * decay.frame_rate / len(decay.components) / (float(np.abs(poles).max()) / (2 * np.pi))
    count = int(min(MAX_TRIED_RATES, 2 * np.log(MAX_RATE_RATIO) / step))
    rates = decay.frame_rate * np.exp(np.linspace(-np.log(MAX_RATE_RATIO), np.log(MAX_RATE_RATIO), count))
    unexplained = np.array([motion_left(decay, poles, float(rate)) for rate in rates])
    best_rate = int(np.argmin(unexplained))
    remark = (f"the record's poles explain {100 * (1 - unexplained_fraction):.0f} % of the motion at "
              f"{decay.frame_rate:g} frames/s")
    if unexplained[best_rate] < 0.5 * unexplained_fraction:
        return (Doubt("frame rate", f"{remark} and {100 * (1 - unexplained[best_rate]):.0f} % at {rates[best_rate]:.4g}",
                      "state the camera's own rate; a record of another set-up does this too",
                      figure=abs(float(rates[best_rate]) / decay.frame_rate - 1)),)
    return (Doubt("record", f"{remark}: it lacks modes that the video shows, or it is of another state of the machine",
                  "take the poles from the video", figure=unexplained_fraction),)


def motion_left(decay: FreeDecay, poles: ComplexArray, frame_rate: float) -> float:
    """Return the share of a decay's motion, less the noise, that poles do not explain at a frame rate (Hz)."""
    n, k = decay.components.shape
    waves = np.exp(poles * (np.arange(n) / frame_rate)[:, None])
    columns = np.concatenate([waves.real, waves.imag, np.ones((n, 1)), np.linspace(-1, 1, n)[:, None]], axis=1)
    columns = columns / np.linalg.norm(columns, axis=0)
    fitted = columns @ np.linalg.lstsq(columns, decay.components, rcond=1e-8)[0]
    power = float((decay.components**2).sum())
    return (power - float((fitted**2).sum()) - (n - columns.shape[1]) * k) / max(power - n * k, 1e-9)
