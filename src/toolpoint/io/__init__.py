"""Files in and out: one module per format; units are converted here. The verbs below are loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.io.binary.hdf5 import write as write_nouns
    from toolpoint.io.matrices.matrix_files import read_matrices
    from toolpoint.io.measured.frf_files import read as read_frf
    from toolpoint.io.measured.frf_writing import write as write_frf
    from toolpoint.io.measured.geometry_files import read as read_geometry
    from toolpoint.io.measured.mode_files import read as read_modes
    from toolpoint.io.measured.record_files import read as read_record
    from toolpoint.io.measured.record_files import read_all as read_records
    from toolpoint.io.meshes.mesh_files import read_mesh
    from toolpoint.io.meshes.step_part import read_step
    from toolpoint.io.program.gcode import read as read_program
    from toolpoint.io.program.gcode import read_path
    from toolpoint.io.servo_data.controller_records import read as read_servo_data
    from toolpoint.io.yaml.component_file import read as read_components
    from toolpoint.io.yaml.drive_file import read as read_drives
    from toolpoint.io.yaml.machine_file import read as read_machine
    from toolpoint.io.yaml.machine_file import write as write_machine
    from toolpoint.io.yaml.robot_file import read as read_datasheet
    from toolpoint.io.yaml.robot_file import read_robot_machine
    from toolpoint.io.yaml.shaft_file import read as read_shaft

__all__ = ["read_components", "read_datasheet", "read_drives", "read_frf", "read_geometry", "read_machine", "read_matrices",
           "read_mesh", "read_modes", "read_path", "read_program", "read_record", "read_records", "read_robot_machine",
           "read_servo_data", "read_shaft", "read_step", "write_frf", "write_machine", "write_nouns"]

__getattr__, __dir__ = export_lazily(__name__, {
    "measured.frf_files": ("read as read_frf",),
    "measured.frf_writing": ("write as write_frf",),
    "measured.geometry_files": ("read as read_geometry",),
    "binary.hdf5": ("write as write_nouns",),
    "matrices.matrix_files": ("read_matrices",),
    "meshes.mesh_files": ("read_mesh",),
    "measured.mode_files": ("read as read_modes",),
    "servo_data.controller_records": ("read as read_servo_data",),
    "program.gcode": ("read as read_program", "read_path"),
    "measured.record_files": ("read as read_record", "read_all as read_records"),
    "meshes.step_part": ("read_step",),
    "yaml.component_file": ("read as read_components",),
    "yaml.drive_file": ("read as read_drives",),
    "yaml.machine_file": ("read as read_machine", "write as write_machine"),
    "yaml.robot_file": ("read as read_datasheet", "read_robot_machine"),
    "yaml.shaft_file": ("read as read_shaft",),
})
