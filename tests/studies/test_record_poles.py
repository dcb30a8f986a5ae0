"""Poles of a record beside a video: those of another plane, too near to be told apart by the video, are left out."""

import numpy as np

from toolpoint.studies.video.record_poles import part_poles
from toolpoint.vibration import Modes
from toolpoint.vision.modes.decay import FreeDecay

RATE, FRAMES = 500.0, 250  # half a second: 2 Hz


def decay_of(modes, amplitudes, noise=0.02):
    """The decay of given modes in three components, with noise."""
    times = np.arange(FRAMES) / RATE
    rng = np.random.default_rng(2)
    waves = np.exp(modes.poles * times[:, None]).real
    components = waves @ np.asarray(amplitudes) + noise * rng.standard_normal((FRAMES, 3))
    return FreeDecay(components, np.eye(3), np.ones(3), 0, RATE)


def test_a_mode_of_the_other_plane_is_left_out_where_the_video_cannot_part_it():
    poles = Modes([13.0, 63.7, 64.2], [0.02, 0.015, 0.015], [[1.0, 1.0, 1.0]], ["tip:+x"])
    for present, absent in ((1, 2), (2, 1)):
        amplitudes = np.zeros((3, 3))
        amplitudes[0], amplitudes[present] = [5.0, 3.0, 1.0], [2.0, -1.0, 4.0]
        chosen, notes = part_poles(poles, decay_of(poles, amplitudes))
        assert chosen.frequency.tolist() == [13.0, poles.frequency[present]]
        assert len(notes) == 1 and notes[0].startswith(f"{poles.frequency[absent]:.2f} Hz of the record is left out")


def test_two_modes_that_the_video_shows_stay_and_so_does_one_that_is_alone():
    """Near ones that both move stay, whatever lies between them; a pole without a neighbour is judged elsewhere."""
    poles = Modes([40.0, 62.8, 64.2], [0.02, 0.015, 0.015], [[1.0, 1.0, 1.0]], ["tip:+x"])
    amplitudes = np.array([[0.0, 0.0, 0.0], [2.0, -1.0, 4.0], [1.0, 3.0, -2.0]])
    chosen, notes = part_poles(poles, decay_of(poles, amplitudes))
    assert chosen.count == 3 and not notes
