"""Drive files in YAML: mechanics, friction and control of the axes of a machine; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from toolpoint.drives.description import DriveDescription, TorqueFilterDescription
from toolpoint.drives.faults import find_faults
from toolpoint.io.door import door
from toolpoint.io.yaml.description_schema import file_schema, model_of, read_described
from toolpoint.io.yaml.document import FILE_VERSION


@door("drive file")
def read(path: str | Path) -> DriveDescription:
    """Return the drives of a YAML file, SI; raises FileFaults with every fault of the file.

    >>> from importlib.resources import files
    >>> drives = read(files("toolpoint.app") / "machines" / "three_axis_vertical_servo_on_structure.yaml")
    >>> list(drives.axes)
    ['X', 'Y']
    """
    return read_described(Path(path), DriveDescription, FILE_VERSION, find_faults=find_faults)


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of drive files, for editors that check YAML while it is typed."""
    return file_schema(model_of(DriveDescription, version=True), "toolpoint drive file")


def write_gains(source: str | Path, drives: DriveDescription, path: str | Path) -> None:
    """Write the drive file `source` with the gains and torque filters of a description; all else, and comments, stay.

    Raises ToolpointError where the text that was written does not read as the description.

    >>> import tempfile
    >>> from dataclasses import replace
    >>> from importlib.resources import files
    >>> source = files("toolpoint.app") / "machines" / "three_axis_vertical_servo_on_structure.yaml"
    >>> drives = read(source)
    >>> axis = drives.axes["X"]
    >>> slower = replace(axis, position=replace(axis.position, gain=12.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_gains(source, replace(drives, axes={**drives.axes, "X": slower}), Path(folder, "slower.yaml"))
    ...     read(Path(folder, "slower.yaml")).axes["X"].position.gain
    12.0
    """
    yaml = YAML()
    yaml.preserve_quotes, yaml.width = True, 125
    yaml.indent(mapping=2, sequence=4, offset=2)
    data = yaml.load(Path(source).read_text(encoding="utf-8-sig"))
    for name, axis in drives.axes.items():
        section = data["axes"][name]
        section["position"]["gain"] = f"{axis.position.gain:.6g} 1/s"
        section["velocity"]["gain"] = f"{axis.velocity.gain:.6g} N*m*s/rad"
        if axis.velocity.integral_time is not None:
            section["velocity"]["integral_time"] = f"{1e3 * axis.velocity.integral_time:.6g} ms"
        if axis.velocity.filters:
            section["velocity"]["filters"] = [_filter_keys(part) for part in axis.velocity.filters]
    draft = Path(path).with_name(f".{Path(path).name}.draft")
    try:
        with draft.open("w", encoding="utf-8", newline="\n") as stream:
            yaml.dump(data, stream)
        read(draft)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def _filter_keys(part: TorqueFilterDescription) -> dict[str, Any]:
    units = {"frequency": ("Hz", 1.0), "time_constant": ("ms", 1e3)}
    keys: dict[str, Any] = {"kind": part.kind}
    for field in ("frequency", "damping", "depth", "time_constant"):
        value = getattr(part, field)
        if value:
            unit, scale = units.get(field, ("", 1.0))
            keys[field] = f"{scale * value:.6g} {unit}" if unit else float(f"{value:.6g}")
    return keys
