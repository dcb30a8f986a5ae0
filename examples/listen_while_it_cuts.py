"""A cut judged while it runs (as `toolpoint listen --live`): quiet, then chatter; a player stands in for the microphone."""

import numpy as np

from toolpoint import studies
from toolpoint.acquisition import RecordPlayer, list_devices

RATE = 16_000  # Hz


def main() -> float:
    """Return the chatter frequency that is heard, Hz: one of the side bands 533.6 Hz apart about 1417 Hz."""
    print(list_devices().table())
    rng, time = np.random.default_rng(0), np.arange(4 * RATE) / RATE
    cut = sum(np.cos(2 * np.pi * 533.6 * k * time + k) / k for k in range(1, 9))
    cut += sum(0.4 ** abs(k) * np.cos(2 * np.pi * (1417.0 + 533.6 * k) * time + k) for k in range(-2, 3))
    sound = np.concatenate([np.zeros(2 * RATE), cut]) + 0.05 * rng.standard_normal(6 * RATE)
    player = RecordPlayer([sound[:, None]], RATE, speed=None)
    windows = list(studies.follow_cut(player, teeth=4, speed=8004.0, window=3.0))
    for window in windows:
        print(window.words)
    return studies.decisive_window(windows).cut.line.frequency


if __name__ == "__main__":
    main()
