"""Demo of a project: a virtual mill, its hammer records as files of volts, with two bad hits and a wrong channel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint import io
from toolpoint._check import FloatArray, ToolpointError
from toolpoint.machine import Machine, assemble
from toolpoint.studies.machines.virtual_test import (
    Hammer,
    Imperfections,
    MeasuringPoints,
    hammer_records,
    surface_points,
    true_modes,
)
from toolpoint.vibration import Dof, Modes, Record
from toolpoint.vibration.damped_modes import solve_as_damped

DEMO_POINTS, DEMO_SEED = 44, 7
FORCE_SENSITIVITY, MOTION_SENSITIVITY = 2.25e-3, 10.2e-3  # V/N; V/(m/s^2): 100 mV/g
DEMO_HAMMER = Hammer(contact=0.004, force=3000.0, hits=3, block=3.0, sample_rate=800.0)
DOUBLE_HIT_RECORD, WEAK_HIT_RECORD, TURNED_RECORD = 5, 11, 17  # numbers of the records with a slip
PROJECT_TEXT = """# A virtual mill, from its hammer records to advice: toolpoint run {folder}
toolpoint: 1
name: Demo mill
tests:
  structure: {{test: records/structure.yaml, date: 2026-11-02}}
components: components.yaml
geometry: points.csv
cuts:
  face: {{diameter: 50 mm, teeth: 5, immersion: 0.6, tangential: 1900 MPa, normal: 700 MPa, coefficient_deviation: 8 %,
         speeds: 500 2500 rpm}}
goals:
  as tested: {{speed: 1200 rpm, depth: 7.5 mm}}
  table at the side: {{speed: 1200 rpm, depth: 4 mm, pose: {{X: 250 mm, Z: -150 mm}}}}
changes:
  bolt the column: {{joint: bed_column, stiffness: 30 %, cost: 1}}
  wider guide of the head: {{joint: column_head, stiffness: 30 %, cost: 3}}
  better feet: {{joint: ground_bed, stiffness: 30 %, cost: 1}}
workspace:
  - {{X: -250 mm}}
  - {{X: 250 mm, Z: -150 mm}}
"""


def write_demo(folder: str | Path, *, turned: bool = True) -> Path:
    """Write the project of a virtual mill with the raw records of its hammer test, and return its project file.

    `turned` : whether one sensor is mounted the wrong way round. Raises ToolpointError for a folder that is there.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     place = write_demo(f"{folder}/mill")
    ...     print(place.name, len(list((place.parent / "records").glob("*.csv"))), "records")
    project.yaml 44 records
    """
    place = Path(folder)
    if place.exists() and any(place.iterdir()):
        raise ToolpointError(f"{place}: is not empty; nothing was written; name another folder")
    (place / "records").mkdir(parents=True, exist_ok=True)
    machine = demo_machine()
    rng = np.random.default_rng(DEMO_SEED)
    points = surface_points(machine, DEMO_POINTS, rng)
    struck = _write_records(place / "records", machine, points, rng=rng, turned=turned)
    (place / "records" / "structure.yaml").write_text(_test_text(struck), encoding="utf-8")
    (place / "components.yaml").write_text(_component_text(machine, points), encoding="utf-8")
    rows = [f"{name},{','.join(f'{value:.6f}' for value in position)}" for name, position in points.coordinates.items()]
    (place / "points.csv").write_text("\n".join(["point,x,y,z", *rows]) + "\n", encoding="utf-8")
    (place / "project.yaml").write_text(PROJECT_TEXT.format(folder=place.name), encoding="utf-8")
    return place / "project.yaml"


def demo_machine() -> Machine:
    """Return the true mill, which the project does not know."""
    return io.read_machine(Path(__file__).with_name("demo_mill.yaml"))


def _write_records(folder: Path, machine: Machine, points: MeasuringPoints, *, rng: np.random.Generator, turned: bool) -> Dof:
    """Write a record a point, force and three accelerations in volts; return the struck Dof."""
    system = assemble(machine, outputs=["tip:+x"])
    ratios = solve_as_damped(system).damping_ratio
    modes = true_modes(machine, points, ratios)
    struck = _struck(modes)
    for number, point in enumerate(points.places):
        slips = Imperfections(noise=0.005, double_hits=(1,) if number == DOUBLE_HIT_RECORD else (),
                              weak_hits=(2,) if number == WEAK_HIT_RECORD else ())
        record = hammer_records(modes, struck, [f"{point}:+{way}" for way in "xyz"], rng=rng, hammer=DEMO_HAMMER,
                                imperfections=slips)
        if turned and number == TURNED_RECORD:
            record = replace(record, samples=record.samples * np.array([1.0, -1.0, 1.0, 1.0]))
        _write_volts(folder / f"P{point}.csv", record)
    return struck


def _struck(modes: Modes) -> Dof:
    """Return the Dof that moves in all modes."""
    share = np.abs(modes.shape) / np.abs(modes.shape).max(axis=0)
    return modes.dofs[int(np.argmax(share.min(axis=1)))]


def _write_volts(path: Path, record: Record) -> None:
    """Write a record as a data logger does: time and volts, four digits."""
    volts: FloatArray = record.samples * np.array([FORCE_SENSITIVITY, *[MOTION_SENSITIVITY] * (record.samples.shape[1] - 1)])
    time = np.arange(len(volts)) / record.sample_rate
    lines = ["time [s],ch1 [V],ch2 [V],ch3 [V],ch4 [V]"]
    lines += [f"{second:.5f}," + ",".join(f"{value:.4g}" for value in row)
              for second, row in zip(time.tolist(), volts.tolist(), strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _test_text(struck: Dof) -> str:
    """Return the test file: channels with their sensitivities, the files, where was struck."""
    lines = ["toolpoint: 1", "test: Demo mill, hammer on one point, sensor roving", "channels:",
             f'  - {{channel: "1", quantity: force, dof: "{struck}", sensitivity: 2.25 mV/N}}']
    lines += [f'  - {{channel: "{number}", quantity: acceleration, dof: "*:+{way}", sensitivity: 10.2 mV/(m/s^2)}}'
              for number, way in zip((2, 3, 4), "xyz", strict=True)]
    return "\n".join([*lines, "records:", f'  - {{files: ["P*.csv"], pattern: "P{{output}}", struck: "{struck}"}}']) + "\n"


def _component_text(machine: Machine, points: MeasuringPoints) -> str:
    """Return the component file of a tester who knows the parts' masses within 5 %."""
    description = machine.description
    lines = ["toolpoint: 1", "name: Demo mill from its test",
             "parents: {bed: ground, column: bed, head: column, table: bed}", "components:"]
    for name, body in description.bodies.items():
        assert body.shape is not None and body.shape.size is not None
        lines += [f"  {name}:", f"    points: {points.components[name]}",
                  f"    body: {{mass: {body.mass:g} kg, centre: {list(body.centre)}, shape: {{kind: box, "
                  f"size: {list(body.shape.size)}}}}}", "    uncertainty: {mass: 5 %}"]
    lines += ["axes:", "  X: {moves: table, along: -x, limits: [-0.3, 0.3]}",
              "  Z: {moves: head, along: z, limits: [-0.25, 0.25]}", "points:", "  tip: {body: head, at: [0, -0.15, 1.25]}",
              "  work: {body: table, at: [0, -0.25, 0.86]}", "tool: tip", "table: work", "coordinate_deviation: 1 mm"]
    return "\n".join(lines) + "\n"
