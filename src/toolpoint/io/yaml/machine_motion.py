"""The moving parts of machine files: axes, the coordinates of the tool, assembly modes, directions, and where joints are."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io.quantities import units
from toolpoint.io.yaml import machine_schema as schema
from toolpoint.io.yaml.document import Document
from toolpoint.kinematics.axis import DIRECTIONS
from toolpoint.kinematics.task import ANGLES
from toolpoint.machine import description as d

UNLIMITED_SPAN = (float("-inf"), float("inf"))


def limits_of(name: str, value: Any, is_rotary: bool) -> tuple[float, float]:
    """Return lower and upper limit in m or rad; a pair, or a text like ``-30, 30 deg``."""
    if value is None:
        return UNLIMITED_SPAN
    lower, upper = units.quantities(value, units.ANGLE if is_rotary else units.LENGTH, 2)
    if not lower < upper:
        raise ToolpointError(f"{name}: {lower:g} .. {upper:g}; the lower limit must be below the upper; are they reversed?")
    return lower, upper


def axis_of(part: schema.AxisModel) -> d.AxisDescription:
    """Return the description of an axis; it names one joint and direction, or several under `drives`."""
    if part.drives and (part.joint or part.direction):
        raise ToolpointError("drives: given beside joint and direction; give one of them")
    if not part.drives and not (part.joint and part.direction):
        missing_key = "direction" if part.joint else "joint"
        raise ToolpointError(f"{missing_key}: '{missing_key}' is missing; an axis drives a joint in a direction, or several: "
                             f"drives")
    drives = tuple(d.DrivenDirection(drive.joint, drive.direction, drive.factor) for drive in part.drives)
    for i, drive in enumerate(drives):
        if drive.factor == 0 or not np.isfinite(drive.factor):
            raise ToolpointError(f"drives.{i}.factor: {drive.factor:g}; must be finite and not zero")
    axis = d.AxisDescription(part.joint, part.direction or "", UNLIMITED_SPAN, drives)
    kind = units.ANGLE if axis.is_rotary else units.LENGTH
    return d.AxisDescription(part.joint, part.direction or "", limits_of("limits", part.limits, axis.is_rotary), drives,
                             units.quantity(part.at_reference, kind))


def task_of(file_model: schema.MachineModel, document: Document) -> d.TaskDescription | None:
    """Return the description of the tool's coordinates; faults go to the document."""
    if file_model.task is None:
        return None
    coordinates: dict[str, d.CoordinateDescription] = {}
    for name, part in file_model.task.coordinates.items():
        kind = name if part is None or part.coordinate is None else part.coordinate
        if kind not in get_args(schema.Coordinate):
            document.fault(("task", "coordinates", name), f"{kind!r} is no coordinate of a tool; write coordinate: x, y, z, "
                                                          "tilt, azimuth or torsion")
            continue
        try:
            span = limits_of("limits", None if part is None else part.limits, kind in ANGLES)
        except (ToolpointError, units.UnitError) as error:
            document.fault(("task", "coordinates", name, "limits"), str(error))
            span = UNLIMITED_SPAN
        coordinates[name] = d.CoordinateDescription(kind, span)
    if len(coordinates) != len(file_model.task.axes):
        document.fault(("task", "coordinates"), f"{len(coordinates)} coordinates for {len(file_model.task.axes)} axes "
                                                f"({', '.join(file_model.task.axes)}); must be as many")
    return d.TaskDescription(file_model.task.point, file_model.task.axes, coordinates)


def assembly_modes_of(file_model: schema.MachineModel, document: Document) -> dict[str, dict[str, float]]:
    """Return start values of passive directions by assembly mode, m or rad; faults go to the document."""
    result: dict[str, dict[str, float]] = {}
    for mode, values in file_model.assembly_modes.items():
        result[mode] = {}
        for name, value in values.items():
            try:
                kind = units.ANGLE if "r" in name.rpartition(".")[2] else units.LENGTH
                result[mode][name] = units.quantity(value, kind)
            except units.UnitError as error:
                document.fault(("assembly_modes", mode, name), str(error))
    if file_model.assembly_mode and file_model.assembly_mode not in result:
        document.fault(("assembly_mode",), f"no {file_model.assembly_mode!r} among assembly_modes "
                       f"({', '.join(result) or 'none'})")
    return result


def direction_of(name: str, value: Any) -> d.Vector:
    """Return the unit vector of ``z``, ``-y`` or three numbers."""
    if isinstance(value, str) and value in DIRECTIONS and "r" not in value:
        unit = np.zeros(3)
        unit["xyz".index(value[-1])] = -1.0 if value[0] == "-" else 1.0
        return (float(unit[0]), float(unit[1]), float(unit[2]))
    try:
        vector = np.array(value, float)
    except (TypeError, ValueError):
        vector = np.zeros(0)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not np.linalg.norm(vector) > 0:
        raise ToolpointError(f"{name}: {value!r}; must be x, y, z, -x, -y, -z or three numbers that are not all zero")
    x, y, z = (float(v) for v in vector / np.linalg.norm(vector))
    return (x, y, z)


def place_joints(document: Document, parts: dict[str, dict[str, Any]]) -> None:
    """Give joints without a place that of the frame that parent and child share; others whose place matters are faults."""
    turned = {drive.joint for axis in parts["axes"].values() for drive in _drives(axis) if "r" in drive.direction}
    for name, part in parts["joints"].items():
        if part.at is not None or part.parent_interface or part.child_interface:
            continue
        shared = _shared_place(part, parts["bodies"])
        if shared is not None:
            parts["joints"][name] = part.model_copy(update={"at": shared})
        elif not _hangs_on_ground(part) and (name in turned or _has_freedom(part)):
            document.fault(("joints", name), f"'at' is missing; where is joint {name}? Write at: [x, y, z] in the machine "
                                             "frame (m, or with a unit); parent and child share no frame that would tell")


def _hangs_on_ground(part: schema.JointModel) -> bool:
    """Whether a joint holds the machine to the ground: without a place it is at 0, 0, 0, which `check` questions."""
    return part.parent == d.GROUND and not part.closes_loop


def _drives(axis: schema.AxisModel) -> list[Any]:
    return [*axis.drives, *([axis] if axis.joint and axis.direction else [])]


def _has_freedom(part: schema.JointModel) -> bool:
    """Whether a joint gives way anywhere: the place of one that is wholly locked does not matter."""
    return bool(part.free or part.passive or part.stiffness_matrix or part.stiffness.model_dump(exclude_none=True))


def _shared_place(part: schema.JointModel, bodies: dict[str, Any]) -> d.Vector | None:
    """Return the origin of the frame that both bodies state alike, on the ground that of the child, None where none does."""
    ends = (part.child,) if _hangs_on_ground(part) else (part.parent, part.child)
    frames = [bodies[body].frame.at for body in ends if body in bodies and "frame" in bodies[body].model_fields_set]
    return frames[0] if len(frames) == len(ends) and len(set(frames)) == 1 else None
