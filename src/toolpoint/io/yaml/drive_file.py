"""Drive files in YAML: mechanics, friction and control of the axes of a machine; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from toolpoint.drives.description import DriveDescription
from toolpoint.drives.faults import find_faults
from toolpoint.io.door import door
from toolpoint.io.yaml.description_schema import file_schema, model_of, read_described
from toolpoint.io.yaml.document import FILE_VERSION


@door("drive file")
def read(path: str | Path) -> DriveDescription:
    """Return the drives of a YAML file, SI; raises FileFaults with every fault of the file."""
    return read_described(Path(path), DriveDescription, FILE_VERSION, find_faults=find_faults)


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of drive files, for editors that check YAML while it is typed."""
    return file_schema(model_of(DriveDescription, version=True), "toolpoint drive file")
