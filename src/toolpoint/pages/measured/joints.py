"""The page of a joint study: where the joints are, how free and how stiff, and the machine of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.joint_identification import JointIdentification
from toolpoint.machine import build
from toolpoint.plot import AnimatedShapes, Chart, Notes, Report, Scene, ShapeView, Table
from toolpoint.plot.figures.machines.joint_views import joint_views
from toolpoint.plot.shape_view.hulls import HULL_WORDS, with_hulls
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies.measured.bisector_steps import BisectorSteps
from toolpoint.studies.measured.joint_study import JointStudy
from toolpoint.studies.measured.machine_check import HEADER

HEADER_OF_JOINTS = ["joint", "kind", "free", "position, mm (95 %)", "stiffness (95 %)",
                    "loss factor (95 %)", "status"]
HEADER_OF_STEPS = ["joint", "mode", "axis", "turn, share of the largest", "passes the joint above, mm",
                   "uncompensated, mm"]


def joints_page(result: JointStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a joint study: doubts first, joints, measured shapes, and the machine or why there is none.

    Examples
    --------
    Runs in ``examples/find_joints_of_a_machine.py``.
    """
    joints, components, geometry = result.joints, result.components, result.geometry
    report = Report(f"Joints of {components.name}", f"{_answer(result)}\n\n{result.status}", subtitle=components.order_text)
    doubts = list(dict.fromkeys([*result.doubts, *(text for text in warnings if not text.startswith("doubtful"))]))
    report = report.with_doubts(*doubts)
    report = report.with_section("Joints", Table(HEADER_OF_JOINTS, _joint_rows(joints)), Chart(
        joint_views(geometry.points, components.points, joints.joints),
        "Crosses: joints; lines: their free directions; areas: hulls of the measured points (dots) of each component."),
        *([Notes(result.joints.notes, "note")] if result.joints.notes else []))
    scene = with_hulls(Scene.of_points(geometry.points, geometry.lines, components=components.points))
    steps = result.steps()
    report = report.with_section(
        "Axes mode by mode", Table(HEADER_OF_STEPS, [row for step in steps for row in step.rows()],
                                    "Each component against the one before it, whose motion is undone; axes by perpendicular "
                                    "bisectors; the last column has those of the motion as it was measured"),
        "Where a mode hardly turns a component its axis says little; perpendicular bisectors count all axes alike. The joints "
        "above weigh every mode by its uncertainty.", *_compensated_view(result, scene, steps))
    shapes = AnimatedShapes.from_modes(result.modes, geometry.points)
    report = report.with_section("Measured mode shapes", ShapeView(scene, shapes, "measured", caption=HULL_WORDS))
    report = report.with_assumptions(
        "Components are rigid and their points lie where the geometry says; joints are linear springs at one place each.",
        "Damping is by the law that the notes name.")
    if result.machine is None or result.checked is None:
        return report.with_section("No machine", Notes([result.no_machine_reason], "warning"))
    machine = build(result.machine)
    drawn, moved = machine_shapes(machine, {}, min(12, machine.size))
    return report.with_section("The machine of these joints", result.checked.status, Table(HEADER, result.checked.rows()),
                               ShapeView(drawn, moved, "model"))


def _compensated_view(result: JointStudy, scene: Scene, steps: Sequence[BisectorSteps]) -> list[ShapeView]:
    """Return the shapes with the motion of the component before undone, each component on its own; none without steps."""
    retraced = [step for step in steps if not step.reason]
    if not retraced:
        return []
    row = {point: k for k, point in enumerate(result.geometry.points)}
    shape = np.zeros((len(retraced[0].frequency), len(row), 3), complex)
    is_known = np.zeros(len(row), bool)
    for step in retraced:
        places = [row[point] for point in step.points]
        shape[:, places], is_known[places] = step.shape.transpose(2, 0, 1), True
    shapes = AnimatedShapes(retraced[0].frequency, result.modes.damping_ratio, shape, (), is_known)
    return [ShapeView(scene, shapes, "compensated", "compensated shapes",
                      caption="Each component without the motion of the one before it, as its axes above are found.")]


def _answer(result: JointStudy) -> str:
    """Return which joint is soft, and the kind of every joint; their numbers stand in the table."""
    words = [f"{joint.parent} – {joint.child} {joint.kind}" for joint in result.joints.joints]
    kinds = f"{len(words)} joint{'s' if len(words) != 1 else ''}: {', '.join(words)}."
    softest, checked = result.softest, result.checked
    if softest is None or checked is None:
        return f"{kinds} Which of them is soft is not said, as there is no machine: {result.no_machine_reason}"
    share = "Most" if softest[1] > 1 / 2 else "The largest part"
    return (f"{share} of the strain energy of the lowest mode ({checked.frequency[0]:.2f} Hz), {100 * softest[1]:.0f} %, "
            f"lies in the joint {softest[0]}. {kinds}")


def _joint_rows(joints: JointIdentification) -> list[list[str]]:
    return [[f"{joint.parent} - {joint.child}", joint.kind, joint.free_text, joint.position_text, joint.stiffness_text,
             joint.damping_text, joint.status] for joint in joints.joints]
