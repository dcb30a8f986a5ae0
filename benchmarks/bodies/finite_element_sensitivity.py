"""Time of the sensitivities of 20 000 elements and 10 modes: frequencies by E and density, then MAC by its adjoints.

A ribbed casting of 20-node hexahedra on a foot. Shapes are smooth functions of place: the time does not hang on them, and the
modes of so many elements would take the time of another benchmark; `--modes` solves for them and times the MAC too.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.bodies.solid import CAST_IRON, Casting, Cuboid, Patch, SolidModel
from toolpoint.bodies.solid.sensitivity import frequency_sensitivity
from toolpoint.studies.finite_elements.shape_sensitivity import mac_sensitivity
from toolpoint.studies.finite_elements.whole_machine import GROUND, FiniteElementMachine, PatchJoint
from toolpoint.vibration import Dof


def casting(size: float) -> SolidModel:
    """Return a column of 0.8 x 0.6 x 2.0 m with inner plates, elements of at most `size` (m)."""
    a, b, wall = np.zeros(3), np.array([0.8, 0.6, 2.0]), 0.02
    boxes = [Cuboid(a, b), Cuboid(a + wall, b - wall, is_window=True)]
    boxes += [Cuboid(np.array([wall, wall, z]), np.array([0.8 - wall, 0.6 - wall, z + wall])) for z in (0.5, 1.0, 1.5)]
    boxes.append(Cuboid(np.array([0.39, wall, wall]), np.array([0.41, 0.6 - wall, 2.0 - wall])))
    return Casting(tuple(boxes), {"body": CAST_IRON}).meshed(size)


def main() -> None:
    """Print the times."""
    parser = CommandLine(__doc__)
    parser.add_argument("--size", type=float, default=0.02)
    parser.add_argument("--modes", action="store_true", help="solve for the modes, and time the sensitivity of MAC too")
    options = parser.parse_args()
    model = casting(options.size)
    print(f"{model.element_count} elements, {model.size} coordinates")
    rng = np.random.default_rng(0)
    waves = rng.normal(size=(3, 10))
    shapes = np.sin(model.dof_places @ waves) * rng.normal(size=10) / np.sqrt(model.mass_properties.mass)
    squares = (2 * np.pi * np.linspace(50, 500, 10)) ** 2
    frequency_sensitivity(casting(0.3), squares, np.zeros((casting(0.3).size, 10)))  # what is imported on the first call
    start = time.process_time()
    frequency_sensitivity(model, squares, shapes)
    seconds = time.process_time() - start
    print(f"frequencies: {seconds:.2f} CPU s, {1e3 * seconds / model.element_count:.3f} ms an element")
    if options.modes:
        foot = PatchJoint("foot", GROUND, "column", np.array([1e9, 1e9, 2e9, 3e8, 3e8, 3e8]),
                          Patch(np.array([0.4, 0.3, 0.0]), np.eye(3)[0], -np.eye(3)[1], 0.8, 0.6))
        machine = FiniteElementMachine({"column": model}, (foot,), {})
        start = time.process_time()
        pairs = machine.solve(16)
        print(f"modes: {time.process_time() - start:.1f} CPU s, {pairs.frequency[0]:.2f} .. {pairs.frequency[9]:.2f} Hz")
        nodes = rng.choice(len(model.nodes), 24, replace=False) + 1
        dofs = [Dof(int(node), way) for node in nodes for way in ("+x", "+y", "+z")]
        seen = machine.modes_at(pairs, dofs, 0.0).shape[:, :10]
        seen = seen + 0.1 * np.abs(seen).max(axis=0) * rng.normal(size=seen.shape)
        start = time.process_time()
        result = mac_sensitivity(machine, pairs, dofs, measured=seen, which=range(10))
        print(f"MAC: {time.process_time() - start:.1f} CPU s with the factorisation; sum over E and joint "
              f"{np.abs(sum(m for m, _ in result.by_part().values()) + sum(result.joints.values())).max():.1g}")
    print(f"{model.element_count} elements x 10 modes: {seconds:.2f} CPU s (bar 10 s for 20 000)")


if __name__ == "__main__":
    main()
