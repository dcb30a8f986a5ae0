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
    k, bodies, joints, parent = float(data["stiffness"]), {}, {}, "ground"
    for number in range(int(data["count"])):
        body = f"mass{number}"
        bodies[body] = BodyDescription(mass=float(data["mass"]), inertia=InertiaDescription(1.0, 1.0, 1.0))
        joints[f"spring{number}"] = JointDescription(parent, body, stiffness={"x": k})
        parent = body
    machine = build(MachineDescription("chain", bodies, joints, points={"end": PointDescription(parent)}))
    f = eigen.solve_undamped(assemble(machine)).frequency
    return {"f": f, "z": 0 * f}
