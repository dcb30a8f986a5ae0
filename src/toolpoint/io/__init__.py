"""Files in and out: one module per format; units are converted here. The verbs below are loaded on first use."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from toolpoint.io.frf_files import read as read_frf
    from toolpoint.io.frf_writing import write as write_frf
    from toolpoint.io.geometry_files import read as read_geometry
    from toolpoint.io.hdf5 import write as write_nouns
    from toolpoint.io.matrix_files import read_matrices
    from toolpoint.io.mesh_files import read_mesh
    from toolpoint.io.mode_files import read as read_modes
    from toolpoint.io.program.controller_records import read as read_servo_data
    from toolpoint.io.program.gcode import read as read_program
    from toolpoint.io.program.gcode import read_path
    from toolpoint.io.record_files import read as read_record
    from toolpoint.io.record_files import read_all as read_records
    from toolpoint.io.yaml.component_file import read as read_components
    from toolpoint.io.yaml.drive_file import read as read_drives
    from toolpoint.io.yaml.machine_file import read as read_machine
    from toolpoint.io.yaml.machine_file import write as write_machine
    from toolpoint.io.yaml.robot_file import read as read_datasheet
    from toolpoint.io.yaml.robot_file import read_robot_machine
    from toolpoint.io.yaml.shaft_file import read as read_shaft

__all__ = ["read_components", "read_datasheet", "read_drives", "read_frf", "read_geometry", "read_machine", "read_matrices",
           "read_mesh", "read_modes", "read_path", "read_program", "read_record", "read_records", "read_robot_machine",
           "read_servo_data", "read_shaft", "write_frf", "write_machine", "write_nouns"]

_HOME = {
    "read_datasheet": ("yaml.robot_file", "read"), "read_robot_machine": ("yaml.robot_file", "read_robot_machine"),
    "read_components": ("yaml.component_file", "read"), "read_drives": ("yaml.drive_file", "read"),
    "read_frf": ("frf_files", "read"), "read_geometry": ("geometry_files", "read"),
    "read_machine": ("yaml.machine_file", "read"), "read_modes": ("mode_files", "read"),
    "read_mesh": ("mesh_files", "read_mesh"), "read_matrices": ("matrix_files", "read_matrices"),
    "read_path": ("program.gcode", "read_path"), "read_program": ("program.gcode", "read"),
    "read_servo_data": ("program.controller_records", "read"),
    "read_record": ("record_files", "read"), "read_records": ("record_files", "read_all"),
    "read_shaft": ("yaml.shaft_file", "read"),
    "write_frf": ("frf_writing", "write"), "write_machine": ("yaml.machine_file", "write"), "write_nouns": ("hdf5", "write"),
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        module, verb = _HOME[name]
        return getattr(importlib.import_module(f"toolpoint.io.{module}"), verb)
    raise AttributeError(f"module 'toolpoint.io' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
