"""References of machine files: names that must be those of parts, the tree of joints, paths and covariance of `identified`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, suggestion
from toolpoint.io.yaml import machine_schema as schema
from toolpoint.io.yaml.document import Document, Key
from toolpoint.machine import description as d
from toolpoint.machine.description.faults import axis_faults, tree_faults

PART_WORDS = {"bodies": "body", "joints": "joint", "axes": "axis", "points": "point"}  # a part of a section, in messages


def check_references(document: Document, file_model: schema.MachineModel | None) -> None:
    """Find names that are none of the file's parts; file_model : the keys beside the parts, None where they have a fault."""
    document.data = {**document.data, **{
        section: {} for section in PART_WORDS if not isinstance(document.data.get(section), dict)}}
    _check_part_names(document)
    if file_model is not None:
        _check_other_names(document, file_model)


def _check_part_names(document: Document) -> None:
    """Find unknown names in axes, points, tool and table."""
    # In the raw data: a part with another fault still has its references checked.
    for name, entry in document.data["axes"].items():
        for i, drive in enumerate(entry.get("drives") or [] if isinstance(entry, dict) else []):
            if isinstance(drive, dict) and isinstance(drive.get("joint"), str):
                _check_name(document, ("axes", name, "drives", i, "joint"), drive["joint"], "joints")
    for section, key, target, extra in (("axes", "joint", "joints", ()), ("points", "body", "bodies", (d.GROUND,))):
        for name, entry in (document.data.get(section) or {}).items():
            if isinstance(entry, dict) and isinstance(entry.get(key), str):
                _check_name(document, (section, name, key), entry[key], target, extra=extra)
    for key in ("tool", "table"):
        if isinstance(document.data.get(key), str):
            _check_name(document, (key,), document.data[key], "points")


def _check_other_names(document: Document, file_model: schema.MachineModel) -> None:
    """Find unknown names in the task, the loads and the poses."""
    if file_model.task is not None:
        _check_name(document, ("task", "point"), file_model.task.point, "points")
        for i, name in enumerate(file_model.task.axes):
            _check_name(document, ("task", "axes", i), name, "axes")
    for i, load in enumerate(file_model.loads):
        _check_name(document, ("loads", i, "point"), load.point, "points")
    coordinates = () if file_model.task is None else tuple(file_model.task.coordinates)
    for i, pose in enumerate(file_model.poses):
        for name in pose:
            _check_name(document, ("poses", i, name), name, "axes", extra=coordinates)


def _check_name(document: Document, key: Key, name: str | None, section: str, *, extra: tuple[str, ...] = ()) -> None:
    """Find the fault of a name that is neither one of a section nor one of `extra`."""
    allowed = [*document.data[section], *extra]
    if name is not None and name not in allowed:
        hint = suggestion(name, allowed)
        listing = f"known: {', '.join(allowed) or 'none'}"
        document.fault(key, f"there is no {PART_WORDS[section]} {name!r}; {hint or listing}")


def check_tree(document: Document, converted: dict[str, dict[str, Any]], data: Mapping[str, Any]) -> None:
    """Find faults of the tree of joints and bodies; where the file has no other fault, of the axes too.

    converted : descriptions by section and name; data : the raw data.
    """
    # Only names matter here, so bodies that have other faults still count as present.
    def shell(section: str, make: Callable[[Mapping[str, Any]], Any]) -> dict[str, Any]:
        entries = data.get(section)
        return {n: make(e) for n, e in entries.items() if isinstance(e, dict)} if isinstance(entries, dict) else {}

    joints = shell("joints", lambda e: d.JointDescription(str(e.get("parent")), str(e.get("child")),
                                                          closes_loop=e.get("closes_loop") is True))
    complete = {n: j for n, j in joints.items() if {"parent", "child"} <= set(data["joints"][n])}
    is_complete = len(complete) == len(joints)
    faults = tree_faults(d.MachineDescription("", shell("bodies", lambda e: d.BodyDescription()), complete))
    for path, message in faults:
        if is_complete or not path.startswith("bodies"):
            document.fault(tuple(path.split(".")), message)
    if not document.faults:
        for path, message in axis_faults(d.MachineDescription("", {}, converted["joints"], converted["axes"])):
            document.fault(tuple(path.split(".")), message)


def check_identified(machine: d.MachineDescription, document: Document) -> None:
    """Find faults of the identified numbers: paths that are none, rows that are no triangle, a covariance that is none."""
    identified = machine.identified
    if identified is None:
        return
    for i, path in enumerate(identified.parameters):
        try:
            machine.value(path)
        except ToolpointError as error:
            document.fault(("identified", "parameters", i), f"identified: {error}")
    if [len(row) for row in identified.covariance] != list(range(1, len(identified.parameters) + 1)):
        document.fault(("identified", "covariance"), f"must have {len(identified.parameters)} rows of 1, 2, 3 ... numbers: the "
                       "lower triangle over the parameters")
        return
    matrix = identified.matrix
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    if (np.diag(matrix) < 0).any() or np.linalg.eigvalsh(matrix / np.outer(size, size))[0] < -1e-6:
        document.fault(("identified", "covariance"), "has a negative variance or eigenvalue; a covariance has none")
