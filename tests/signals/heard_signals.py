"""Synthetic sounds of cuts whose lines are known in closed form."""

import numpy as np

RATE = 44100


def comb(spindle, teeth, seconds, rng, *, run_out=0.2, harmonics=8, rate=RATE):
    """Forced lines of a stable cut: tooth passings falling with their number, weaker orders of run-out between them."""
    time = np.arange(int(seconds * rate)) / rate
    total = np.zeros(time.size)
    for order in range(1, harmonics * teeth + 1):
        level = 1.0 if order % teeth == 0 else run_out
        total += level / (1 + order / teeth) * np.cos(2 * np.pi * order * spindle * time + rng.uniform(0, 6.28))
    return total


def side_bands(chatter, tooth, seconds, rng, *, reach=4, rate=RATE):
    """Lines of a Hopf cut at |f_c + k f_z|, the strongest at f_c."""
    time = np.arange(int(seconds * rate)) / rate
    total = np.zeros(time.size)
    for k in range(-reach, reach + 1):
        total += 0.4 ** abs(k) * np.cos(2 * np.pi * (chatter + k * tooth) * time + rng.uniform(0, 6.28))
    return total


def with_noise(samples, ratio, rng):
    """Add white noise of this standard deviation over that of the samples."""
    return samples + ratio * np.std(samples) * rng.normal(0, 1, samples.size)
