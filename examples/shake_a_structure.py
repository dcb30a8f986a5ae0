"""Shake a structure at two points at once, in time, and compare its measured responses with those of its modes."""

import numpy as np

from toolpoint import Dof, Modes, Record
from toolpoint.signals import shaker_test
from toolpoint.vibration import frequency_response
from toolpoint.vibration.simulation.time_response import modal_superposition


def main() -> float:
    """Return the largest error of the responses against their largest value, as a share."""
    labels = [Dof(i, "+x") for i in (1, 2, 3)]
    modes = Modes([40.0, 95.0], [0.03, 0.02], np.array([[0.1, 0.2], [0.15, -0.1], [0.2, 0.1]]), labels)
    forces = Record(np.random.default_rng(4).standard_normal((200_000, 2)), 1000.0, labels[::2], ("force",) * 2, ("N",) * 2)
    motion = modal_superposition(modes, forces, labels, kind="velocity")
    both = Record(np.hstack([forces.samples, motion.samples]), 1000.0, (*forces.channels, *motion.channels),
                  (*forces.quantities, *motion.quantities), (*forces.units, *motion.units))
    frf = shaker_test(both, 0.5).between(20, 150)
    exact = frequency_response.modal(modes, frf.frequency, labels, inputs=labels[::2], quantity="mobility")
    error = float(np.abs(frf.values - exact.values).max() / np.abs(exact.values).max())
    print(f"{frf!r}: off by {100 * error:.2g} % of the peak; coherence at least {frf.coherence.min():.3f}")
    return error


if __name__ == "__main__":
    main()
