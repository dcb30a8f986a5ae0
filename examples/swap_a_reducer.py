"""The next ratio of the same series on the third axis of a robot: what it does to inertia and lowest frequency."""

from importlib import resources

from toolpoint.io import read_datasheet
from toolpoint.joints import next_ratio
from toolpoint.machine import build
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.robot.gearing import compute_gearing, swap_reducer
from toolpoint.machine.robot.model import robot_machine


def main() -> float:
    """Return the growth of the rotor's inertia at the joint over the square of the growth of the ratio: one."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot_datasheet.yaml") as path:
        sheet = read_datasheet(path)
    before = compute_gearing(sheet)[2]
    name = next_ratio(sheet.catalogue, before.reducer)
    assert name is not None
    other = swap_reducer(sheet, before.axis, name)
    after = compute_gearing(other)[2]
    for title, robot in ((before.reducer, sheet), (name, other)):
        machine = build(robot_machine(robot))
        print(f"{title}: lowest frequency {natural_frequencies(machine, {}, 1).min():.3f} Hz")
    assert before.reflected_inertia is not None and after.reflected_inertia is not None
    growth = sheet.catalogue[name].ratio / sheet.catalogue[before.reducer].ratio
    return after.reflected_inertia / before.reflected_inertia / growth**2


if __name__ == "__main__":
    main()
