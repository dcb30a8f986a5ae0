"""Machines for multibody programs: the ending of the file's name says for which."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io.multibody import exudyn_script, mjcf
from toolpoint.machine import Machine

WRITERS = {".xml": mjcf.write, ".py": exudyn_script.write}


def write(machine: Machine, path: str | Path, pose: Mapping[str, float] | None = None) -> None:
    """Write a machine at a pose for MuJoCo (.xml) or as a script for Exudyn (.py); errors are those of `tree_links`.

    >>> import tempfile
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> table = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> guide = JointDescription("ground", "table", stiffness={"x": 1e7})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "slide.xml")
    ...     write(build(MachineDescription("slide", {"table": table}, {"guide": guide})), file)
    ...     file.read_text().count("<body ")
    1
    """
    kind = Path(path).suffix
    if kind not in WRITERS:
        raise ToolpointError(f"{path}: must end in .xml (MuJoCo) or .py (Exudyn)")
    WRITERS[kind](machine, path, pose)
