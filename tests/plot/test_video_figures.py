"""Figures of videos: spectra of long records keep their peaks up to the highest frequency."""

from __future__ import annotations

import numpy as np

from toolpoint.plot.figures.video import MAX_SPECTRUM_LINES, largest_of_neighbours


def test_the_largest_of_neighbours_keeps_every_peak_and_the_end() -> None:
    values = np.full(10_007, 1e-3)
    peaks = [3, 5000, 10_006]
    values[peaks] = 1.0
    neighbours = -(-values.size // MAX_SPECTRUM_LINES)
    lines = largest_of_neighbours(values, neighbours)
    assert lines.size <= MAX_SPECTRUM_LINES
    assert set(peaks) <= set(lines.tolist())
    assert (np.diff(lines) > 0).all()


def test_few_lines_stay_all() -> None:
    assert largest_of_neighbours(np.arange(5.0), 1).tolist() == [0, 1, 2, 3, 4]
