"""Description of a machine file without its machine: for a part whose mesh is wanted, not its reduction."""

from __future__ import annotations

from pathlib import Path

from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.document import parse
from toolpoint.io.yaml.machine_file import describe_document
from toolpoint.machine.description import MachineDescription


@door("machine file")
def read_description(path: str | Path) -> MachineDescription:
    """Return what a YAML machine file describes, without building it: its meshes are read, and nothing is reduced.

    Raises FileFaults with every fault of the file.

    >>> from importlib.resources import files
    >>> sorted(read_description(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml").axes)
    ['X', 'Y', 'Z']
    """
    document = parse(Path(path))
    description = describe_document(document)
    if document.faults or description is None:
        raise FileFaults(str(path), document.text, document.faults)
    return description
