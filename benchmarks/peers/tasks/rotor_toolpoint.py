from toolpoint.bodies import beam as beams
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.vibration import eigen


def solve(data):
    section = beams.ring(float(data["diameter"]), 0.0, float(data["modulus"]), density=float(data["density"]), poisson=0.3,
                         shear=0.9).slender
    shaft, bearing = beams.beam(section, float(data["length"]), 20, modes=16), {"y": 1e11, "z": 1e11, "ry": 1e-3, "rz": 1e-3}
    joints = {"root": JointDescription("ground", "shaft", stiffness={**bearing, "x": 1e11, "rx": 1e9}, child_interface="root"),
              "tip": JointDescription("ground", "shaft", FrameDescription((float(data["length"]), 0.0, 0.0)),
                                      {**bearing, "x": 1e-3, "rx": 1e-3}, child_interface="tip", closes_loop=True)}
    placeholder, points = BodyDescription(mass=1.0, inertia=InertiaDescription(1.0, 1.0, 1.0)), {
        "tip": PointDescription("shaft", interface="tip")}
    machine = build(MachineDescription("shaft", {"shaft": placeholder}, joints, points=points), {"shaft": shaft})
    f = eigen.solve_undamped(assemble(machine)).frequency
    return {"f": f, "z": 0 * f}
