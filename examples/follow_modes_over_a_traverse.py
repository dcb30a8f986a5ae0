"""Modes while an axis travels, and the joint that softens on the way (as `toolpoint traverse`)."""

import tempfile

import numpy as np

from toolpoint.machine import assemble, build
from toolpoint.machine import description as d
from toolpoint.pages.measured.traverse import traverse_page
from toolpoint.studies import TraverseStudy, TraverseWindow, study_traverse
from toolpoint.vibration import Record, eigen

RATE, DOFS = 100.0, ("bed:+x", "head:+x")


def main() -> float:
    """Return the factor of the upper joint's stiffness from the first to the last of six speeds; the true one is 0.75."""
    inertia = d.InertiaDescription(1.0, 1.0, 1.0)
    bodies = {"bed": d.BodyDescription(600.0, inertia=inertia), "head": d.BodyDescription(200.0, inertia=inertia)}
    joints = {"lower": d.JointDescription("ground", "bed", stiffness={"x": 1e7}),
              "upper": d.JointDescription("bed", "head", stiffness={"x": 5e6})}
    machine = build(d.MachineDescription("slide", bodies, joints, points={name: d.PointDescription(name) for name in bodies}))
    rng, windows = np.random.default_rng(0), []
    for factor, speed in zip(np.linspace(1.0, 0.75, 6), np.linspace(0.0, 30.0, 6), strict=True):
        modes = eigen.solve_undamped(assemble(machine.with_values({"joints.upper.stiffness.x": 5e6 * factor}), outputs=DOFS))
        samples = 0.0
        for f, shape in zip(modes.frequency, modes.shape.T, strict=True):
            poles = 2 * np.pi * f * (-0.015 + 1j)
            ring = np.exp(poles * np.arange(1500) / RATE).imag
            samples = samples + np.convolve(rng.standard_normal(12_000), ring)[1500:12_000, None] * shape / np.abs(shape).max()
        noisy = samples + 0.03 * samples.std(axis=0) * rng.standard_normal(samples.shape)
        windows.append(TraverseWindow(Record(noisy, RATE, DOFS, "acceleration"), float(speed)))
    study: TraverseStudy = study_traverse(windows, quantity="speed, m/min", machine=machine, poses=[{}] * 6)
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(traverse_page(study).save(folder))
    return study.joints[0].factor


if __name__ == "__main__":
    main()
