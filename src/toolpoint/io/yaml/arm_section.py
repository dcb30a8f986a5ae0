"""The section `arm` of machine files: a Denavit-Hartenberg table that gives joints, axes and body frames.

A row names its body and axis; the body's frame is the frame of its link, the joint's that of its joint (z along the axis). What
is read is the machine that the table makes: written back, it has joints and axes of its own and no table.
"""

from __future__ import annotations

from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.io.quantities import units
from toolpoint.io.yaml.document import Document, Key, validate
from toolpoint.io.yaml.machine_schema import ArmModel, ArmRowModel
from toolpoint.kinematics.arms.denavit_hartenberg import ArmRow, arm_frames
from toolpoint.machine import description as d
from toolpoint.machine.description.frames import describe_frame, frame
from toolpoint.spatial import transform as tf

LENGTHS, ANGLES = ("d", "a"), ("theta", "alpha")


def expand_arm(document: Document) -> None:
    """Put the joints, axes and body frames of the arm into the document's data; faults stand at their rows."""
    data = document.data
    part: ArmModel | None = validate(ArmModel, data["arm"], ("arm",), document=document)
    document.data = data = {**data, "joints": dict(data.get("joints") or {}), "axes": dict(data.get("axes") or {}),
                            "bodies": dict(data.get("bodies") or {})}
    if part is None or _mixed_units(part, document):
        return
    rows = [_row(row, ("arm", "rows", i), document) for i, row in enumerate(part.rows)]
    if any(row is None for row in rows) or not rows:
        return
    base = frame(d.FrameDescription(part.frame.at, part.frame.rotation))
    try:
        joints, links = arm_frames([row for row in rows if row is not None], part.convention, base)
    except ToolpointError as error:
        document.fault(("arm", "rows"), str(error))
        return
    for i, model in enumerate(part.rows):
        _add_row(data, part, i, place=(joints[i], links[i]), document=document)
        for name in model.coupled:
            if name not in [row.axis for row in part.rows]:
                document.fault(("arm", "rows", i, "coupled", name), f"no row has the axis {name!r}")


def _mixed_units(part: ArmModel, document: Document) -> bool:
    """Refuse a table in which some lengths (or angles) carry a unit and others none: 150 beside 250 mm is 150 m."""
    faults = False
    for columns, unit in ((LENGTHS, "m"), (ANGLES, "rad")):
        bare, written = [], []
        for i, row in enumerate(part.rows):
            for name in columns:
                value = getattr(row, name)
                if isinstance(value, str) and not _is_number(value):
                    written.append((i, name))
                elif float(value) != 0:
                    bare.append((i, name))
        if bare and written:
            faults = True
            for i, name in bare:
                bare_value = getattr(part.rows[i], name)
                document.fault(("arm", "rows", i, name), f"{bare_value!r} without a unit in a table whose other values carry "
                               f"one; "
                                                         f"write its unit too (a bare number is in {unit})")
    return faults


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _row(row: ArmRowModel, key: Key, document: Document) -> ArmRow | None:
    values: dict[str, Any] = {}
    for name in (*LENGTHS, *ANGLES):
        try:
            values[name] = units.quantity(getattr(row, name), units.LENGTH if name in LENGTHS else units.ANGLE)
        except units.UnitError as error:
            document.fault((*key, name), str(error))
            return None
    try:
        return ArmRow(row.axis, **values, slides=row.slides, coupled=row.coupled)
    except ToolpointError as error:
        document.fault(key, str(error))
        return None


def _add_row(data: dict[str, Any], part: ArmModel, i: int, *, place: tuple[Any, Any], document: Document) -> None:
    row, key = part.rows[i], ("arm", "rows", i)
    name = row.joint or f"joint_{row.axis}"
    body = data["bodies"].get(row.body)
    if not isinstance(body, dict):
        document.fault((*key, "body"), f"there is no body {row.body!r}")
        return
    for section, entry in (("joints", name), ("axes", row.axis)):
        if entry in data[section]:
            document.fault(key, f"{entry!r} is given under {section} too; the arm makes it")
            return
    within_body = {"at": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0)} | dict(body.get("frame") or {})
    within = frame(d.FrameDescription(_vector(within_body["at"], units.LENGTH), _vector(within_body["rotation"], units.ANGLE)))
    data["bodies"][row.body] = {**body, "frame": _plain(place[1] @ within)}
    parent = part.base if i == 0 else part.rows[i - 1].body
    data["joints"][name] = {"parent": parent, "child": row.body, **_plain(place[0]), "source": row.source, **{
        field: value for field in ("stiffness", "damping", "loss_factor") if (value := _given(row, field))}}
    way = "z" if row.slides else "rz"
    drives: list[dict[str, Any]] = [{"joint": name, "direction": way}]
    for other, following_row in enumerate(part.rows):
        if row.axis in following_row.coupled:
            drives.append({"joint": following_row.joint or f"joint_{following_row.axis}",
                           "direction": "z" if part.rows[other].slides else "rz",
                           "factor": following_row.coupled[row.axis]})
    data["axes"][row.axis] = {"drives": drives, **({} if row.limits is None else {"limits": row.limits})}


def _vector(value: Any, kind: units.Kind) -> d.Vector:
    x, y, z = units.quantities(value, kind, 3)
    return x, y, z


def _plain(place: Any) -> dict[str, list[float]]:
    described = describe_frame(tf.transform(place[:3, :3], place[:3, 3]))
    return {"at": list(described.at), "rotation": list(described.rotation)}


def _given(row: ArmRowModel, field: str) -> Any:
    value = getattr(row, field)
    return value if isinstance(value, float) else value.model_dump(exclude_none=True)
