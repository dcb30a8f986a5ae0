"""A hammer calibrated by blows on a mass that hangs freely (as `toolpoint devices --hammer TEST --mass 1.25kg`)."""

import numpy as np

from toolpoint.signals.record_set import RecordSet
from toolpoint.studies import calibrate_on_mass
from toolpoint.vibration import Record

RATE, MASS, TRUE_FACTOR = 10_000.0, 1.25, 1.12  # Hz, kg, of the force over its reading


def main() -> float:
    """Return the factor that the blows tell."""
    force = np.zeros(46_000)
    for start, peak in zip((7000, 17_000, 27_000, 37_000), (150.0, 180.0, 200.0, 220.0), strict=True):
        force[start:start + 8] = peak * np.sin(np.pi * np.arange(8) / 8)
    samples = np.column_stack([force / TRUE_FACTOR, force / MASS])
    samples += 1e-4 * samples.max(axis=0) * np.random.default_rng(0).standard_normal(samples.shape)
    blows = Record(samples, RATE, ["mass:+x", "mass:+x"], ["force", "acceleration"], ["N", "m/s^2"])
    result = calibrate_on_mass(RecordSet((blows,), ("blows",)), MASS, duration=0.8, sensitivity="2.25 mV/N")
    print(result.table())
    return result.factor


if __name__ == "__main__":
    main()
