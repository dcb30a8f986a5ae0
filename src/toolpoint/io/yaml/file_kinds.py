"""Kinds of toolpoint's YAML files: each by the keys that only it has, and its reader."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from toolpoint._check import one_of
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.door import check_regular
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.document import parse

# Kind, the key that gives it away, module of its reader, and how it is called.
KINDS: dict[str, tuple[str, str, str]] = {
    "components": ("components", "component_file", "components of a test"),
    "test": ("records", "testing.test_file", "a hammer test"),
    "project": ("tests", "project_file", "a project"),
    "shaft": ("segments", "shaft_file", "a shaft"),
    "plan": ("machine", "plan_file", "a screening plan"),
    "datasheet": ("members", "robot_file", "a robot's datasheet"),
}
ARC_KEYS = frozenset({"immersion", "entry", "exit", "direction"})  # of a section 'cutting'
# Kinds of files with the module that holds their JSON schema.
SCHEMAS: dict[str, str] = {"machine": "machine_schema", "servo": "drive_file", "choice": "testing.choice_file",
                           **{kind: module for kind, (_, module, _) in KINDS.items()}}


def json_schema(kind: str) -> dict[str, Any]:
    """Return the JSON schema of a kind of file, one of `SCHEMAS`, for editors that check YAML while it is typed.

    >>> "bodies" in json_schema("machine")["properties"]
    True
    """
    module = importlib.import_module(f"toolpoint.io.yaml.{SCHEMAS[one_of('kind', kind, SCHEMAS)]}")
    schema: dict[str, Any] = module.json_schema()
    return schema


def kind_of(path: str | Path) -> str:
    """Return the kind of a file: machine, servo, cut, or one of `KINDS`; ``machine`` where nothing else is recognised.

    >>> from importlib.resources import files
    >>> kind_of(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml")
    'machine'
    """
    file = Path(path)
    if file.suffix.lower() == ".urdf":
        return "machine"
    check_regular(file)
    data = parse(file).data
    if "bodies" in data or "joints" in data:
        return "machine"
    for kind, (key, *_) in KINDS.items():
        if key in data:
            return kind
    axes = data.get("axes")
    if isinstance(axes, dict) and any(isinstance(axis, dict) and "mechanics" in axis for axis in axes.values()):
        return "servo"
    return "cut" if set(data) == {"cutting"} else "machine"


def read_kind(path: str | Path, kind: str) -> tuple[str, Any]:
    """Read a file by the reader of its kind, whose faults it raises; return what it is in words, and what it describes.

    >>> from importlib.resources import files
    >>> words, sheet = read_kind(files("toolpoint.app") / "machines" / "milling_robot_datasheet.yaml", "datasheet")
    >>> words
    "a robot's datasheet, Milling robot"
    """
    if kind == "cut":
        return "a section 'cutting', to be pasted into a machine file", _read_cut(Path(path))
    if kind == "servo":
        from toolpoint.io.yaml import drive_file

        drives = drive_file.read(path)
        return f"a servo, {drives.name}, of the axes {', '.join(drives.axes)}", drives
    if kind == "machine":
        from toolpoint.io.yaml import machine_file

        machine = machine_file.read(path)
        return f"a machine, {machine.name}", machine
    module, words = KINDS[one_of("kind", kind, KINDS)][1:]
    part = importlib.import_module(f"toolpoint.io.yaml.{module}").read(path)
    name = getattr(part, "name", "") or getattr(part, "test", "")
    return f"{words}, {name}" if name else words, part


def read_tool(path: str | Path) -> CuttingDescription:
    """Return tool and coefficients of a file with a section 'cutting', for a program whose stock gives the arcs of cut.

    The file needs no arc of its own. Raises FileFaults with every fault of the file.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "drill.yaml")
    ...     _ = file.write_text("cutting: {diameter: 10 mm, teeth: 4, tangential: 800 MPa, normal: 300 MPa}")
    ...     read_tool(file).tool.teeth
    4
    """
    return _read_cut(Path(path), needs_arc=False)


def _read_cut(path: Path, *, needs_arc: bool = True) -> CuttingDescription:
    from toolpoint.io.yaml.cutting_schema import CuttingModel, cutting_of
    from toolpoint.io.yaml.document import validate

    document = parse(path)
    section = document.data.get("cutting")
    if "cutting" not in document.data:
        document.fault((), f"holds no section 'cutting', but {', '.join(document.data) or 'nothing'}; a tool is described by "
                       "its diameter, teeth and coefficients there")
        raise FileFaults(str(path), document.text, document.faults)
    if not needs_arc and isinstance(section, dict) and not ARC_KEYS & section.keys():
        section["direction"] = "slot"
    part: Any = validate(CuttingModel, section, ("cutting",), document=document)
    cut = None if part is None else cutting_of(part, document)
    if document.faults or cut is None:
        raise FileFaults(str(path), document.text, document.faults)
    return cut
