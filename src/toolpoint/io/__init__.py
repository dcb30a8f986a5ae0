"""Files in and out: one module per format; units are converted here. The verbs below are loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.io.binary.hdf5 import write as write_nouns
    from toolpoint.io.fmu import write as write_unit
    from toolpoint.io.machine_poses import check_pose, lay_grid, read_machine_at
    from toolpoint.io.matrices.matrix_files import read_matrices
    from toolpoint.io.measured.blow_folder import BlowFolder
    from toolpoint.io.measured.driven_axis_files import AxisColumns
    from toolpoint.io.measured.driven_axis_files import read as read_driven_axis
    from toolpoint.io.measured.frf_files import read as read_frf
    from toolpoint.io.measured.frf_writing import check_writable
    from toolpoint.io.measured.frf_writing import write as write_frf
    from toolpoint.io.measured.geometry_files import read as read_geometry
    from toolpoint.io.measured.geometry_files import read_lines, read_test_geometry
    from toolpoint.io.measured.listened_files import read as read_listened
    from toolpoint.io.measured.live_input import LiveInput, open_input, open_microphone
    from toolpoint.io.measured.mode_files import read as read_modes
    from toolpoint.io.measured.noun_writing import check_name as check_noun_name
    from toolpoint.io.measured.noun_writing import write as write_noun
    from toolpoint.io.measured.record_files import read as read_record
    from toolpoint.io.measured.record_files import read_all as read_records
    from toolpoint.io.measured.test_nouns import (
        hold_records,
        read_described_records,
        read_hammer_test,
        read_measured,
        read_test_nouns,
    )
    from toolpoint.io.meshes.mesh_files import read_mesh
    from toolpoint.io.meshes.step_part import read_step
    from toolpoint.io.meshes.surface_file import read_surface
    from toolpoint.io.multibody.model_files import write as write_multibody
    from toolpoint.io.page_pictures import write_pictures
    from toolpoint.io.page_tables import write_tables
    from toolpoint.io.point_table import read_places
    from toolpoint.io.program.gcode import read as read_program
    from toolpoint.io.program.gcode import read_path
    from toolpoint.io.program.path.radius_compensation import CutterRadii
    from toolpoint.io.program.rewriting import SpeedAndFeed
    from toolpoint.io.program.rewriting import write as write_program
    from toolpoint.io.servo_data.controller_records import read as read_servo_data
    from toolpoint.io.template_files import list_templates, write_template
    from toolpoint.io.two_states import read_two_states
    from toolpoint.io.urdf import read_robot
    from toolpoint.io.yaml.component_file import read as read_components
    from toolpoint.io.yaml.described_machine import read_description
    from toolpoint.io.yaml.drive_file import read as read_drives
    from toolpoint.io.yaml.drive_file import write_gains
    from toolpoint.io.yaml.file_kinds import json_schema, kind_of, read_kind, read_tool
    from toolpoint.io.yaml.machine_file import read as read_machine
    from toolpoint.io.yaml.machine_file import write as write_machine
    from toolpoint.io.yaml.machine_file import write_cutting
    from toolpoint.io.yaml.plan_file import read as read_plan
    from toolpoint.io.yaml.project_file import find_parts_without_cut, line_of_tried, read_tried
    from toolpoint.io.yaml.project_file import read as read_project
    from toolpoint.io.yaml.project_parts import enter_part, name_cut
    from toolpoint.io.yaml.robot_file import read as read_datasheet
    from toolpoint.io.yaml.robot_file import read_robot_machine
    from toolpoint.io.yaml.shaft_file import read as read_shaft
    from toolpoint.io.yaml.testing.choice_file import read as read_choice
    from toolpoint.io.yaml.testing.plan_writing import write_geometry as write_points
    from toolpoint.io.yaml.testing.plan_writing import write_test as write_planned_test
    from toolpoint.io.yaml.testing.test_file import write as write_test

__all__ = [
    "AxisColumns",
    "BlowFolder",
    "CutterRadii",
    "LiveInput",
    "SpeedAndFeed",
    "check_noun_name",
    "check_pose",
    "check_writable",
    "enter_part",
    "find_parts_without_cut",
    "hold_records",
    "json_schema",
    "kind_of",
    "lay_grid",
    "line_of_tried",
    "list_templates",
    "name_cut",
    "open_input",
    "open_microphone",
    "read_choice",
    "read_components",
    "read_datasheet",
    "read_described_records",
    "read_description",
    "read_driven_axis",
    "read_drives",
    "read_frf",
    "read_geometry",
    "read_hammer_test",
    "read_kind",
    "read_lines",
    "read_listened",
    "read_machine",
    "read_machine_at",
    "read_matrices",
    "read_measured",
    "read_mesh",
    "read_modes",
    "read_path",
    "read_places",
    "read_plan",
    "read_program",
    "read_project",
    "read_record",
    "read_records",
    "read_robot",
    "read_robot_machine",
    "read_servo_data",
    "read_shaft",
    "read_step",
    "read_surface",
    "read_test_geometry",
    "read_test_nouns",
    "read_tool",
    "read_tried",
    "read_two_states",
    "write_cutting",
    "write_frf",
    "write_gains",
    "write_machine",
    "write_multibody",
    "write_noun",
    "write_nouns",
    "write_pictures",
    "write_planned_test",
    "write_points",
    "write_program",
    "write_tables",
    "write_template",
    "write_test",
    "write_unit",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "binary.hdf5": ("write as write_nouns",),
    "fmu": ("write as write_unit",),
    "machine_poses": ("check_pose", "lay_grid", "read_machine_at"),
    "matrices.matrix_files": ("read_matrices",),
    "measured.blow_folder": ("BlowFolder",),
    "measured.driven_axis_files": ("AxisColumns", "read as read_driven_axis"),
    "measured.frf_files": ("read as read_frf",),
    "measured.frf_writing": ("check_writable", "write as write_frf"),
    "measured.geometry_files": ("read as read_geometry", "read_lines", "read_test_geometry"),
    "measured.listened_files": ("read as read_listened",),
    "measured.live_input": ("LiveInput", "open_input", "open_microphone"),
    "measured.mode_files": ("read as read_modes",),
    "measured.noun_writing": ("check_name as check_noun_name", "write as write_noun"),
    "measured.record_files": ("read as read_record", "read_all as read_records"),
    "two_states": ("read_two_states",),
    "measured.test_nouns": ("hold_records", "read_described_records", "read_hammer_test", "read_measured", "read_test_nouns"),
    "meshes.mesh_files": ("read_mesh",),
    "meshes.step_part": ("read_step",),
    "meshes.surface_file": ("read_surface",),
    "multibody.model_files": ("write as write_multibody",),
    "page_pictures": ("write_pictures",),
    "page_tables": ("write_tables",),
    "point_table": ("read_places",),
    "program.gcode": ("read as read_program", "read_path"),
    "program.path.radius_compensation": ("CutterRadii",),
    "program.rewriting": ("SpeedAndFeed", "write as write_program"),
    "servo_data.controller_records": ("read as read_servo_data",),
    "template_files": ("list_templates", "write_template"),
    "urdf": ("read_robot",),
    "yaml.component_file": ("read as read_components",),
    "yaml.described_machine": ("read_description",),
    "yaml.drive_file": ("read as read_drives", "write_gains"),
    "yaml.file_kinds": ("json_schema", "kind_of", "read_kind", "read_tool"),
    "yaml.machine_file": ("read as read_machine", "write as write_machine", "write_cutting"),
    "yaml.plan_file": ("read as read_plan",),
    "yaml.project_file": ("find_parts_without_cut", "read as read_project", "read_tried", "line_of_tried"),
    "yaml.project_parts": ("enter_part", "name_cut"),
    "yaml.robot_file": ("read as read_datasheet", "read_robot_machine"),
    "yaml.shaft_file": ("read as read_shaft",),
    "yaml.testing.choice_file": ("read as read_choice",),
    "yaml.testing.plan_writing": ("write_geometry as write_points", "write_test as write_planned_test"),
    "yaml.testing.test_file": ("write as write_test",),
})
