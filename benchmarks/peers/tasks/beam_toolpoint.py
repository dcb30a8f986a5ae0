from toolpoint.bodies import beam as beams
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.vibration import eigen


def solve(data):
    side, modulus, density = (float(data[name]) for name in ("side", "modulus", "density"))
    section = beams.rectangle(side, side, modulus, density=density).slender
    placeholder = BodyDescription(mass=1.0, inertia=InertiaDescription(1, 1, 1))
    description = MachineDescription("cantilever", {"beam": placeholder},
                                     {"clamp": JointDescription("ground", "beam", child_interface="root")},
                                     points={"tip": PointDescription("beam", interface="tip")})
    machine = build(description, {"beam": beams.beam(section, float(data["length"]), 20, modes=16)})
    f = eigen.solve_undamped(assemble(machine)).frequency[[0, 2, 4]]
    return {"f": f, "z": 0 * f}
