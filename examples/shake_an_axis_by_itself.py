"""Modes of an axis that its own set-point noise shakes, in closed loop under loads (as `toolpoint axis-test`)."""

import tempfile

import numpy as np
from scipy import signal

from toolpoint.pages.measured.driven_axis import driven_axis_page
from toolpoint.signals import driven_axis_test
from toolpoint.studies import DrivenAxisStudy, study_driven_axis
from toolpoint.vibration import Record

RATE, W = 500.0, 2 * np.pi * 42.0


def main() -> float:
    """Return the frequency of the axis, Hz: 200 kg on a spring at 42 Hz, held by a velocity controller."""
    a, b, *_ = signal.cont2discrete((np.array([[0.0, 1.0], [-W**2, -0.04 * W]]), np.array([[0.0], [1 / 200.0]]), np.eye(2),
                                     np.zeros((2, 1))), 1 / RATE)
    rng, count = np.random.default_rng(0), 60_000
    noise, load = rng.standard_normal(count), 40.0 * rng.standard_normal(count)
    state, force, velocity = np.zeros(2), np.empty(count), np.empty(count)
    for n in range(count):
        force[n] = 3000.0 * (0.02 * noise[n] - state[1])
        following = a @ state + b[:, 0] * (force[n] + load[n])
        # A force that is held for a step goes with the mean velocity of that step: anything else is a delay.
        velocity[n], state = (state[1] + following[1]) / 2, following
    record = Record(np.column_stack([force, velocity]), RATE, ["table:+y", "table:+y"], ["force", "velocity"])
    study: DrivenAxisStudy = study_driven_axis({"standing": driven_axis_test(noise, record, 0.5, band=(20.0, 80.0))})
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(driven_axis_page(study).save(folder))
    frequency = study.states[0].modes.modes.frequency
    return float(frequency[np.abs(frequency - 42.0).argmin()])


if __name__ == "__main__":
    main()
