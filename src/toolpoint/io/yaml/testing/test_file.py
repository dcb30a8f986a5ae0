"""Tests by hammer or shaker in YAML: channels, records, settings, decisions; read with all faults at once, and written."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.yaml.description_schema import file_schema, model_of, read_described
from toolpoint.io.yaml.document import FILE_VERSION
from toolpoint.signals.test_description import HammerTestDescription


@door("test file")
def read(path: str | Path) -> HammerTestDescription:
    """Return the hammer test of a YAML file, SI; raises FileFaults with every fault of the file."""
    return read_described(Path(path), HammerTestDescription, FILE_VERSION, find_faults=_find_faults)


def _find_faults(test: HammerTestDescription) -> list[tuple[tuple[str, ...], str]]:
    faults: list[tuple[tuple[str, ...], str]] = []
    if not any(part.files for part in test.records):
        faults.append((("records",), "no file; must name at least one record, or a pattern such as tip_*.csv"))
    if test.zoom and (len(test.zoom) != 2 or not test.zoom[0] < test.zoom[1]):
        faults.append((("zoom",), "must be two frequencies, the lower one first"))
    if test.excitation != "hammer" and test.resolution is None:
        faults.append((("resolution",), "missing; a shaker test needs the spacing of its lines, such as 0.5 Hz"))
    return faults


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of test files, for editors that check YAML while it is typed."""
    return file_schema(model_of(HammerTestDescription, version=True), "toolpoint test file")


def write(description: HammerTestDescription, path: str | Path, *, replace: bool = False) -> None:
    """Write a test to a YAML file that reads back to the same description; an existing file is only replaced where asked.

    >>> import tempfile
    """
    path = Path(path)
    if path.exists() and not replace:
        raise ToolpointError(f"{path}: exists already; nothing was written; choose another name")
    if not path.parent.is_dir():
        raise ToolpointError(f"{path}: the folder {path.parent} does not exist; create it first")
    path.write_text(text_of(description), encoding="utf-8")


def text_of(description: HammerTestDescription) -> str:
    """Return a test as the text of a YAML file."""
    lines = [f"toolpoint: {FILE_VERSION}", f"test: {_scalar(description.test)}"]
    units = {"block": " s", "sample_rate": " Hz", "resolution": " Hz"}
    is_shaken = description.excitation != "hammer"
    shaker = ["excitation", "resolution", *(["settle"] if description.settle else [])] if is_shaken else []
    for name in ("estimator", *shaker, "block", "window_end", "sample_rate", "geometry"):
        value = getattr(description, name)
        if value is not None:
            lines.append(f"{name}: {_scalar(value) + units.get(name, '')}")
    if description.zoom:
        lines.append(f"zoom: {_value(tuple(description.zoom))}")
    lines += ["channels:", *_entries(description.channels)] if description.channels else []
    lines += ["records:", *_entries(description.records)]
    if description.hits:
        lines += ["hits:", *(f"  {_scalar(name)}: {decision}" for name, decision in description.hits.items())]
    return "\n".join(lines) + "\n"


def _entries(parts: Any) -> list[str]:
    rows = []
    for part in parts:
        pairs = [(item.name, getattr(part, item.name)) for item in fields(part) if getattr(part, item.name) is not None]
        rows.append("  - {" + ", ".join(f"{name}: {_value(value)}" for name, value in pairs) + "}")
    return rows


def _value(value: Any) -> str:
    return "[" + ", ".join(map(_scalar, value)) + "]" if isinstance(value, tuple) else _scalar(value)


def _scalar(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return repr(float(value)) if isinstance(value, float) else str(value)
