"""Shaft files in YAML: tools, holders and gauges as round segments; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from toolpoint.io.door import door
from toolpoint.io.yaml.description_schema import file_schema, model_of, read_described
from toolpoint.io.yaml.document import FILE_VERSION
from toolpoint.substructuring.shaft import ShaftDescription


@door("shaft file")
def read(path: str | Path) -> ShaftDescription:
    r"""Return the shaft of a YAML file, SI; raises FileFaults with every fault of the file.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "gauge.yaml")
    ...     _ = file.write_text("toolpoint: 1\nname: gauge\nsegments:\n  rod: {length: 100 mm, diameter: 20 mm}\n")
    ...     read(file).length
    0.1
    """
    return read_described(Path(path), ShaftDescription, FILE_VERSION)


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of shaft files, for editors that check YAML while it is typed."""
    return file_schema(model_of(ShaftDescription, version=True), "toolpoint shaft file")
