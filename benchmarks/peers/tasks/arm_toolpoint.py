from toolpoint.machine import build
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)


def solve(data):
    bodies, joints, axes, parent = {}, {}, {}, "ground"
    for k, (axis, place) in enumerate(zip(data["axes"].tolist(), data["places"].tolist(), strict=True)):
        body = f"link{k}"
        bodies[body] = BodyDescription(mass=1.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
        joints[f"joint{k}"] = JointDescription(parent, body, FrameDescription(tuple(place)), {"r" + axis: 1e6})
        axes[f"q{k}"], parent = AxisDescription(f"joint{k}", "r" + axis), body
    flange = {"flange": PointDescription(parent, tuple(data["flange"].tolist()))}
    machine = build(MachineDescription("arm", bodies, joints, axes, flange))
    displacements = machine.chain.displacements({f"q{k}": data["angles"][:, k] for k in range(len(axes))})[:, -1]
    return {"x": displacements[:, :3, :3] @ data["flange"] + displacements[:, :3, 3]}
