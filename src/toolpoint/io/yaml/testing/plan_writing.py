"""A planned hammer test as files: the test file for `toolpoint frf`, and the points with their coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.vibration import Dof

WAYS = ("+x", "+y", "+z")


def write_geometry(places: Mapping[str | int, FloatArray], points: Sequence[str | int], path: str | Path) -> None:
    """Write points as CSV (point,x,y,z in m), which `--geometry` reads; an existing file is never written over.

    >>> import tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "points.csv")
    ...     write_geometry({1: np.array([0.0, 0.0, 0.5])}, [1], file)
    ...     file.read_text().splitlines()
    ['point,x,y,z', '1,0,0,0.5']
    """
    lines = ["point,x,y,z", *(",".join([str(name), *(f"{float(v):.6g}" for v in places[name])]) for name in points)]
    _write(Path(path), "\n".join(lines) + "\n")


def write_test(name: str, struck: Sequence[Dof], path: str | Path, *, block: float, geometry: str | None = None) -> None:
    """Write the test file of a roving sensor of three directions; an existing file is never written over.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "test.yaml")
    ...     write_test("mill", [Dof.parse("tip:+x")], file, block=2.0)
    ...     file.exists()
    True
    """
    lines = ["# A planned hammer test: put your sensors' sensitivities in, measure, then: toolpoint frf THIS_FILE",
             "toolpoint: 1", f'test: "{name}"', f"block: {block:g} s",
             *([f'geometry: "{geometry}"'] if geometry else []), "channels:",
             '  - {channel: "1", quantity: force, sensitivity: 2.25 mV/N}  # yours',
             *(f'  - {{channel: "{k}", quantity: acceleration, dof: "*:{way}", sensitivity: 100 mV/g}}  # the sensor that is '
               'moved'
               for k, way in enumerate(WAYS, start=2)),
             "records:  # POINT is the place of the sensor; blows of one set-up end in _1, _2 ..",
             *(f'  - {{files: ["P*_at{str(dof).replace(":", "=")}_*.csv"], struck: "{dof}", pattern: "P{{output}}_at*"}}'
               for dof in struck)]
    _write(Path(path), "\n".join(lines) + "\n")


def _write(path: Path, text: str) -> None:
    if path.exists():
        raise ToolpointError(f"{path}: exists already; nothing was written; choose another name")
    if not path.parent.is_dir():
        raise ToolpointError(f"{path}: the folder {path.parent} does not exist; create it first")
    path.write_text(text, encoding="utf-8")
