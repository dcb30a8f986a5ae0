"""STL triangle meshes, binary and text: read."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.door import door

# Fifty bytes a triangle, packed: so read in one call, where a loop over millions of them would take minutes.
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@door("STL file")
def read(path: str | Path) -> FloatArray:
    r"""Return the triangle corners of an STL file, in the file's own length unit, shape (t, 3, 3).

    Raises ToolpointError for a file that is missing, cut off, or no STL file.

    >>> import tempfile
    >>> facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "plate.stl")
    ...     _ = file.write_text(f"solid plate\n{facet}endsolid plate\n")
    ...     read(file).shape
    (1, 3, 3)
    """
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise ToolpointError(f"mesh.file: {path} cannot be read ({error.strerror}); paths are relative to the machine file"
                             ) from None
    if len(raw) >= 84:
        count = int.from_bytes(raw[80:84], "little")
        if len(raw) == 84 + 50 * count:
            return _finite(np.frombuffer(raw, _RECORD, count, 84)["corners"].astype(float), path)
    if raw.lstrip()[:5].lower() != b"solid":
        raise ToolpointError(f"mesh.file: {path} is no STL file, or is cut off ({len(raw)} bytes); export it again")
    vertices = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", raw)
    if not vertices or len(vertices) % 3 or b"endsolid" not in raw:
        raise ToolpointError(f"mesh.file: {path} is cut off after {len(vertices)} corners; export it again")
    try:
        return _finite(np.array(vertices, dtype="S").astype(float).reshape(-1, 3, 3), path)
    except ValueError:
        raise ToolpointError(f"mesh.file: {path} has corners that are no numbers; export it again") from None


def _finite(corners: FloatArray, path: Path) -> FloatArray:
    if not np.isfinite(corners).all():
        raise ToolpointError(f"mesh.file: {path} has corners that are not finite; export it again")
    return corners
