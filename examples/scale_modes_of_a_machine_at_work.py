"""Modes of a machine at work, scaled by one driving-point response, as a page (as `toolpoint operational --blow`)."""

import tempfile

import numpy as np
from scipy import signal

from toolpoint.pages import operational_page
from toolpoint.studies import study_operational
from toolpoint.vibration import Record, SecondOrderSystem, eigen, frequency_response


def main() -> float:
    """Return the static compliance of the point by the scaled modes, over that of the machine."""
    dofs, rate = ["column:+x", "spindle:+x"], 80.0
    stiffness = 1e6 * np.array([[3.0, -1.0], [-1.0, 2.0]])
    machine = SecondOrderSystem(np.diag([200.0, 100.0]), stiffness, damping=2e-4 * stiffness, outputs=dofs, inputs=dofs)
    rng, motion = np.random.default_rng(1), []
    for pole in eigen.solve_damped(machine).poles:
        z = np.exp(pole / rate)
        motion.append(signal.lfilter([1, -2, 1], [1, -2 * z.real, abs(z) ** 2], rng.standard_normal(56_000))[8000:])
    work = Record(np.array(motion).T @ eigen.solve_undamped(machine).shape.T, rate, dofs, "acceleration")
    blow = frequency_response.direct(machine, np.arange(5.0, 40.0, 0.05)).selected(["spindle:+x"], ["spindle:+x"])
    study = study_operational(work, blow=blow)
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(operational_page(study).save(folder))
    modes = study.modes
    compliance = frequency_response.modal(modes, np.array([1e-3]), ["spindle:+x"], inputs=["spindle:+x"]).values[0, 0, 0].real
    return float(compliance * (stiffness[1, 1] - stiffness[0, 1] ** 2 / stiffness[0, 0]))


if __name__ == "__main__":
    main()
