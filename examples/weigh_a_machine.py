"""Static equilibrium: what a machine's joints carry, and how far its tool sags under the weight of its parts."""

from toolpoint.machine import build, static_equilibrium
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
)


def main() -> float:
    """Return the reaction of the foundation over the machine's weight."""
    up = FrameDescription((0.0, 0.0, 0.5))
    body = BodyDescription(shape=ShapeDescription("box", size=(0.2, 0.2, 1.0)), density=7200.0, frame=up)
    joint = JointDescription("ground", "ram", FrameDescription((0.0, 0.0, 0.0)), stiffness={"x": 1e8, "z": 5e7, "ry": 1e7})
    machine = MachineDescription(name="ram", bodies={"ram": body}, joints={"foundation": joint}, gravity=(0.0, 0.0, -9.80665),
                                 points={"tip": PointDescription("ram", (0.0, 0.0, 1.0))})
    rest = static_equilibrium(build(machine))
    sag, carried = -1e6 * rest.points['tip'][2], rest.reactions['foundation'][2]
    print(f"the tip sags by {sag:.2f} um, the foundation carries {carried:.0f} N")
    return float(carried / (7200.0 * 0.04 * 9.80665))


if __name__ == "__main__":
    main()
