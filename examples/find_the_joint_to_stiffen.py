"""Rank the joints of a machine by how much the lowest frequency gains from one per cent more stiffness."""

from importlib import resources

from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble
from toolpoint.machine.derivatives import matrix_derivatives
from toolpoint.machine.description import parameters
from toolpoint.vibration import sensitivity


def main() -> str:
    """Return the path of the stiffness that matters most for the lowest mode."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical_drives.yaml") as path:
        machine = machine_file.read(path)
    paths = [p for p in parameters(machine.description) if ".stiffness." in p]
    slopes = sensitivity.frequencies(assemble(machine), matrix_derivatives(machine, paths), 1)[:, 0]
    gains = {p: 0.01 * machine.value(p) * slope for p, slope in zip(paths, slopes, strict=True)}
    ranked = sorted(gains, key=gains.__getitem__, reverse=True)
    for p in ranked[:5]:
        print(f"{p:40s} {1000 * gains[p]:8.2f} mHz per per cent")
    return ranked[0]


if __name__ == "__main__":
    main()
