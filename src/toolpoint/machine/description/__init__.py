"""Description of a machine as plain frozen data: bodies, joints, axes, points; kinds of elastic bodies; changes of it.

Examples
--------
>>> box = ShapeDescription("box", (0.6, 0.4, 0.3))
>>> bodies = {"bed": BodyDescription(mass=900.0, inertia=InertiaDescription(20.0, 35.0, 40.0), draw=box),
...           "table": BodyDescription(mass=150.0, shape=box, frame=FrameDescription(at=(0.0, 0.0, 0.5)))}
>>> joints = {"feet": JointDescription("ground", "bed", stiffness={"x": 1e8, "y": 1e8, "z": 3e8}),
...           "slide": JointDescription("bed", "table", stiffness={"x": 5e7, "y": 2e8}, loss_factor=0.03)}
>>> machine = MachineDescription("slide on a bed", bodies, joints, {"X": AxisDescription("slide", "x", limits=(-0.2, 0.2))},
...                              points={"tip": PointDescription("table", (0.0, 0.0, 0.1))}, tool="tip",
...                              loads=(LoadDescription("tip", force=(0.0, 0.0, -500.0)),),
...                              reference=(ReferenceDescription("hammer test", (31.2, 48.7), source="measured, 2024"),))
>>> machine.axes["X"].is_rotary, machine.reference[0].is_measured
(False, True)
>>> IdentifiedDescription(("joints.feet.stiffness.x", "joints.feet.stiffness.y"), ((4.0,), (1.0, 9.0))).matrix.tolist()
[[4.0, 1.0], [1.0, 9.0]]
>>> DrivenDirection("slide", "x", factor=2.0).factor
2.0
"""

from toolpoint.machine.description.body import (
    ELASTIC_KINDS,
    ORIGIN_VECTOR,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    MeshDescription,
    ShapeDescription,
    SpinDescription,
    Vector,
)
from toolpoint.machine.description.machine import (
    GROUND,
    AxisDescription,
    CoordinateDescription,
    DrivenDirection,
    IdentifiedDescription,
    JointDescription,
    LoadDescription,
    MachineDescription,
    Matrix,
    PointDescription,
    ReferenceDescription,
    TaskDescription,
    parameters,
)

__all__ = [
    "ELASTIC_KINDS",
    "GROUND",
    "ORIGIN_VECTOR",
    "AxisDescription",
    "BodyDescription",
    "CoordinateDescription",
    "DrivenDirection",
    "FrameDescription",
    "IdentifiedDescription",
    "InertiaDescription",
    "JointDescription",
    "LoadDescription",
    "MachineDescription",
    "Matrix",
    "MeshDescription",
    "PointDescription",
    "ReferenceDescription",
    "ShapeDescription",
    "SpinDescription",
    "TaskDescription",
    "Vector",
    "parameters",
]
