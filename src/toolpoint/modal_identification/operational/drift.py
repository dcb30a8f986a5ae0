"""Drift of operational modes: a frequency that rises or falls from block to block belongs to a machine that changes."""

from __future__ import annotations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.modal_identification.operational.mode_selection import SelectedModes

DRIFT_STANDARD_DEVIATIONS = 4.5  # of a linear trend over the blocks


def question_drift(selected: SelectedModes, blocks: int) -> tuple[Doubt, ...]:
    """Return a doubt about every mode whose frequency has a trend over the blocks of the record."""
    time = np.arange(blocks) - (blocks - 1) / 2
    changes = (selected.deviations * selected.poles.conj()).real / (np.abs(selected.poles) * 2 * np.pi)
    slope = time @ changes / (time**2).sum()
    remainder = changes - time[:, None] * slope
    deviation = np.sqrt((remainder**2).sum(axis=0) / (blocks - 2) / (time**2).sum())
    doubts = []
    for pole, trend, error in zip(selected.poles, slope, deviation, strict=True):
        if abs(trend) > DRIFT_STANDARD_DEVIATIONS * error:
            frequency = abs(pole) / (2 * np.pi)
            change = trend * blocks / frequency
            doubts.append(Doubt(
                f"mode at {frequency:.4g} Hz",
                f"its frequency changes by {100 * change:.2g} % from the first to the last block "
                f"({abs(trend) / error:.1f} standard deviations)",
                "an axis moved, the machine warmed up, or a part came loose: identify shorter parts of the record",
                figure=abs(float(change))))
    return tuple(doubts)
