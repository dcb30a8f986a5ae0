"""The page of a joint study: where the joints are, how free and how stiff, and the machine of them."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.joint_identification import JointEstimate, JointIdentification
from toolpoint.machine import build
from toolpoint.pages.remarks import with_warnings
from toolpoint.plot import AnimatedShapes, Chart, Report, Scene, ShapeView, Table
from toolpoint.plot.figures.joint_views import joint_views
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies.measured.joint_study import HEADER, JointStudy

HEADER_OF_JOINTS = ["joint", "kind", "free", "position mm (95 %)", "stiffness N m/rad or N/m (95 %)", "status"]


def joints_page(result: JointStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a joint study."""
    joints, components, geometry = result.joints, result.components, result.geometry
    report = Report(f"Joints of {components.name}", joints.status, subtitle=" - ".join(components.chain))
    report = report.with_section("Joints", Table(HEADER_OF_JOINTS, _joint_rows(joints)), Chart(
        joint_views(geometry.points, components.points, joints.joints),
        "Crosses: joints; lines: their free directions; dots: measured points by component."))
    scene = Scene.of_points(geometry.points, geometry.lines, components=components.points)
    shapes = AnimatedShapes.from_modes(result.modes, geometry.points)
    report = report.with_section("Measured mode shapes", ShapeView(scene, shapes, "measured"))
    if result.machine is not None:
        machine = build(result.machine)
        drawn, moved = machine_shapes(machine, {}, min(12, machine.size))
        report = report.with_section("The machine of these joints", Table(HEADER, result.rows()),
                                     ShapeView(drawn, moved, "model"))
    doubts = [*warnings, *joints.doubts, *(text for joint in joints.joints for text in joint.doubts)]
    return with_warnings(report, doubts, "Doubts")


def _joint_rows(joints: JointIdentification) -> list[list[str]]:
    rows = []
    for joint in joints.joints:
        rows.append([f"{joint.parent} - {joint.child}", joint.kind, ", ".join(joint.freedoms), joint.position_text,
                     _stiffness_text(joint), joint.status])
    return rows


def _stiffness_text(joint: JointEstimate) -> str:
    if joint.stiffness is None or joint.stiffness_interval is None:
        return ""
    return ", ".join(f"{way} {k:.4g} ± {width:.2g}" for way, k, width in zip(
        joint.freedoms, joint.stiffness, joint.stiffness_interval, strict=True))
