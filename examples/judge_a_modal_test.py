"""Judge a modal test before its modes are trusted: reciprocity, the mass of the sensor, mode indicators, complexity."""

import numpy as np

from toolpoint import Dof, Modes
from toolpoint.modal_identification import complexity_factor, identify, mvmif
from toolpoint.plot import nyquist
from toolpoint.signals import by_reciprocity
from toolpoint.signals.checks import mass_loading, without_mass
from toolpoint.vibration import frequency_response

SENSOR = 0.05


def measured_with_a_heavy_sensor():
    """Two modes of a 20 kg structure; the sensor at point 2 adds its mass."""
    labels = [Dof(1, "+x"), Dof(2, "+x")]
    modes = Modes([80.0, 130.0], [0.02, 0.015], np.array([[0.15, 0.2], [0.2, -0.15]]), labels)
    plain = frequency_response.modal(modes, np.arange(1.0, 250, 0.25), quantity="accelerance")
    return modes, plain, without_mass(plain, "2:+x", -SENSOR)  # a mass taken out, turned round, is a mass added


def main() -> float:
    """Return the error of the frequencies after the sensor's mass is taken out of the responses, as a share."""
    modes, plain, frf = measured_with_a_heavy_sensor()
    print(f"reciprocity: {np.abs(frf.values - by_reciprocity(frf).values).max():.1e} m/s^2/N apart")
    print(f"the sensor changes its driving point by up to {100 * mass_loading(frf, SENSOR)[:, 1].max():.0f} %")
    indicator = mvmif(frf)
    print(f"mode indicator: deepest at {indicator.frequency[np.argmin(indicator.values[:, 0])]:.1f} Hz")
    loaded, free = identify(frf), identify(without_mass(frf, "2:+x", SENSOR))
    print("with the sensor", loaded.modes.frequency, "without it", free.modes.frequency)
    print("complexity of the shapes:", complexity_factor(free.modes.shape))
    figure = nyquist(plain)
    assert len(figure.data) == 4
    return float(np.abs(free.modes.frequency / modes.frequency - 1).max())


if __name__ == "__main__":
    main()
