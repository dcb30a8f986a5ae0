"""Which of two joints loosened between two tests of a machine (as `toolpoint drift`)."""

import tempfile

import numpy as np

from toolpoint.machine import Machine, assemble, build
from toolpoint.machine import description as d
from toolpoint.pages.measured.drift import drift_page
from toolpoint.studies import study_drift
from toolpoint.vibration import Modes, eigen


def two_slides() -> Machine:
    """Return a machine of two bodies on two springs each."""
    inertia = d.InertiaDescription(1.0, 1.0, 1.0)
    bodies = {"bed": d.BodyDescription(500.0, inertia=inertia), "head": d.BodyDescription(200.0, inertia=inertia)}
    joints = {"lower": d.JointDescription("ground", "bed", stiffness={"x": 4e7, "y": 6e7}),
              "upper": d.JointDescription("bed", "head", stiffness={"x": 2e7, "y": 3e7})}
    points = {name: d.PointDescription(name) for name in bodies}
    return build(d.MachineDescription("two slides", bodies, joints, points=points))


def measured_modes(machine: Machine) -> Modes:
    """Return its modes as a test gives them, with intervals."""
    modes = eigen.solve_undamped(assemble(machine, outputs=["bed:+x", "bed:+y", "head:+x", "head:+y"]))
    variance = np.array([np.diag([(1e-4 * f) ** 2, 1e-6]) for f in modes.frequency])
    return Modes(modes.frequency, np.full(modes.count, 0.02), modes.shape, modes.dofs, covariance=variance)


def main() -> float:
    """Return the factor of the stiffness that the drift names; the true one is 0.85."""
    machine = two_slides()
    later = measured_modes(machine.with_values({"joints.upper.stiffness.x": 1.7e7}))
    study = study_drift(measured_modes(machine), [later], machine)
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(drift_page(study, machine.name).save(folder))
    assert study.parts[0][0] == "joint upper" and study.explanations[0].direction == "x"
    return study.explanations[0].factor


if __name__ == "__main__":
    main()
