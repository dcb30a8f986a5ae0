"""Modes of a machine at work from its accelerations alone, with a motor's line that is no mode (as `toolpoint operational`)."""

import numpy as np
from scipy import signal

from toolpoint.modal_identification import identify_operational
from toolpoint.vibration import Record, SecondOrderSystem, eigen


def main() -> float:
    """Return the largest deviation of an identified from a true frequency over its 95 % half width."""
    dofs = ["column:+x", "spindle:+x"]
    stiffness = 1e6 * np.array([[3.0, -1.0], [-1.0, 2.0]])
    machine = SecondOrderSystem(np.diag([200.0, 100.0]), stiffness, damping=2e-4 * stiffness, outputs=dofs, inputs=dofs)
    truth = eigen.solve_damped(machine)
    rng, rate = np.random.default_rng(1), 80.0
    motion = []
    for pole in truth.poles:
        z = np.exp(pole / rate)
        motion.append(signal.lfilter([1, -2, 1], [1, -2 * z.real, abs(z) ** 2], rng.standard_normal(56_000))[8000:])
    acceleration = np.array(motion).T @ eigen.solve_undamped(machine).shape.T
    time = np.arange(48_000) / rate
    acceleration += acceleration.std() * np.cos(2 * np.pi * 16.4 * time)[:, None] * np.array([1.0, -0.6])
    found = identify_operational(Record(acceleration, rate, dofs, "acceleration"))
    print(found.table())
    assert found.modes.count == 2
    return float((np.abs(found.modes.frequency - truth.frequency) / found.modes.frequency_interval).max())


if __name__ == "__main__":
    main()
