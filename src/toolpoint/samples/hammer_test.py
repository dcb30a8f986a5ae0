"""Sample of a hammer test of a machine: records of every point, geometry, components; two bad blows."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np

from toolpoint import io
from toolpoint.machine import Machine
from toolpoint.machine.description import MachineDescription, PointDescription
from toolpoint.studies.machines.virtual_test import Imperfections, MeasuringPoints, hammer_records, surface_points, true_modes
from toolpoint.vibration import Dof, Modes

_POINT_COUNT, _MACHINE_DAMPING_RATIO = 30, 0.03
_SUPPLIER_STIFFNESS = {"joints.column_foot.stiffness.rx": 130e6}  # N m/rad; the truth is 184.64e6
_SAMPLE_DOUBLE_HIT, _SAMPLE_WEAK_HIT = 7, 19  # one blow each
# Components as a tester sees them: mass, kg; centre and size of a box, m; and the bodies of the machine that ride on each.
_PARTS = {"base": (6354, (0, 1.282, -0.679), (1.161, 1.821, 0.81), ("base", "saddle", "table")),
         "column": (2805, (0, 1.869, 0.355), (0.94, 0.99, 2.469), ("column", "head")),
         "magazine": (300, (-0.553, 1.89, 1.265), (0.831, 0.92, 0.932), ("magazine",))}

# Where the tool is and what it is against, as the tester measured it with a tape.
_TOOL_AND_TABLE = """points:
  tip: {body: column, at: [0, 0.75, 0.25]}
  work: {body: base, at: [0, 0.75, 0]}
tool: tip
table: work
"""


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write a record a point, the points' places and the components; return what was put in, and the commands."""
    rng = np.random.default_rng(4)
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = io.read_machine(path)
    points = surface_points(machine, _POINT_COUNT, rng)
    modes = true_modes(machine, points, _MACHINE_DAMPING_RATIO)
    struck = _driving_point(modes)
    (folder / "records").mkdir()
    for number, name in enumerate(points.places, start=1):
        faults = Imperfections(noise=0.01, double_hits=(1,) if number == _SAMPLE_DOUBLE_HIT else (),
                               weak_hits=(2,) if number == _SAMPLE_WEAK_HIT else ())
        record = hammer_records(modes, struck, [f"{name}:+{way}" for way in "xyz"], rng=rng, imperfections=faults)
        io.write_noun(record, folder / "records" / f"point_{number:02d}.uff")
    rows = [f"{name},{x:.5f},{y:.5f},{z:.5f}" for name, (x, y, z) in points.coordinates.items()]
    (folder / "points.csv").write_text("\n".join(["point,x,y,z", *rows]) + "\n", encoding="utf-8")
    (folder / "parts.yaml").write_text(_components(points), encoding="utf-8")
    io.write_machine(_model(machine, points), folder / "model.yaml")
    listed = ", ".join(f"{f:.2f}" for f in modes.frequency)
    return [f"A published machining centre of three bodies with modes at {listed} Hz, {100 * _MACHINE_DAMPING_RATIO:g} % of "
            f"damping "
            f"each, struck at {struck}; three blows a point, noise 1 %.",
            f"In record {_SAMPLE_DOUBLE_HIT} a blow is double, in record {_SAMPLE_WEAK_HIT} one is weak.",
            "model.yaml is the machine as its drawing and a supplier's data sheet have it: its column's foot is 30 % too soft "
            "(130 in place of 184.64 MN m/rad)."], [
        "toolpoint frf records/*.uff --save test.h5",
        "toolpoint identify test.h5 --geometry points.csv -m modes.h5",
        "toolpoint joints test.h5 --geometry points.csv --components parts.yaml --machine found.yaml",
        "toolpoint check found.yaml", "toolpoint report found.yaml", "toolpoint next-test found.yaml",
        "toolpoint correlate model.yaml modes.h5 --geometry points.csv",
        "toolpoint update model.yaml --modes modes.h5 --machine updated.yaml"]


def _model(machine: Machine, points: MeasuringPoints) -> MachineDescription:
    """Return the machine with the measured points, and a stiffness as a supplier states it."""
    stated = machine.with_values(_SUPPLIER_STIFFNESS).description
    measured = {str(name): PointDescription(body, tuple(place)) for name, (body, place) in points.places.items()}
    return replace(stated, points={**stated.points, **measured}, reference=(), assumptions=(),
                   name="Machining centre as drawn, its column foot from a data sheet")


def template_machine(name: str = "three-axis-vertical") -> Machine:
    """Return the machine of a template."""
    with tempfile.TemporaryDirectory() as place:
        return io.read_machine(io.write_template(Path(place) / "machine.yaml", "machine", name))


def _driving_point(modes: Modes) -> Dof:
    """Return the degree of freedom that moves in all modes: its least share of a mode's largest motion is the largest."""
    share = np.abs(modes.shape) / np.abs(modes.shape).max(axis=0)
    return modes.dofs[int(np.argmax(share.min(axis=1)))]


def _components(points: MeasuringPoints) -> str:
    """Return the tester's component file: which points ride on which component, what carries what, and the masses."""
    lines = ["toolpoint: 1", "name: machining centre, from its test", f"chain: [ground, {', '.join(_PARTS)}]", "components:"]
    for name, (mass, centre, size, bodies) in _PARTS.items():
        ridden = [point for point, (body, _) in points.places.items() if body in bodies]
        lines += [f"  {name}:", f"    points: {ridden}",
                  f"    body: {{mass: {mass} kg, centre: {list(centre)}, shape: {{kind: box, size: {list(size)}}}}}"]
    return "\n".join([*lines, _TOOL_AND_TABLE])
