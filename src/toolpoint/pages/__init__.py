"""Pages: a result of a study turned into one self-contained report, only when it is asked for. Each is loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.pages.cuts.calibration import calibration_page
    from toolpoint.pages.cuts.chatter_map import chatter_map_page
    from toolpoint.pages.cuts.listening import listening_page
    from toolpoint.pages.cuts.lobes import lobes_page
    from toolpoint.pages.cuts.simulated_cut import simulation_page
    from toolpoint.pages.cuts.tool_coupling import tool_coupling_page
    from toolpoint.pages.cuts.turning import turning_page
    from toolpoint.pages.first_look import first_look_page
    from toolpoint.pages.machines.campbell import campbell_page
    from toolpoint.pages.machines.demo import demo_page, head_source_page, workspace_page
    from toolpoint.pages.machines.driven_responses import driven_responses_page
    from toolpoint.pages.machines.element_sensitivity import element_page
    from toolpoint.pages.machines.finite_elements import finite_element_page
    from toolpoint.pages.machines.frequency_map import map_page
    from toolpoint.pages.machines.machine import machine_page
    from toolpoint.pages.machines.machine_responses import responses_page
    from toolpoint.pages.machines.sensitivity import sensitivity_page
    from toolpoint.pages.machining.program import machining_page, stages_page
    from toolpoint.pages.measured.correlation import correlation_page
    from toolpoint.pages.measured.drift import drift_page
    from toolpoint.pages.measured.driven_axis import driven_axis_page
    from toolpoint.pages.measured.hammer_records import hammer_page
    from toolpoint.pages.measured.identification import identification_page
    from toolpoint.pages.measured.joints import joints_page
    from toolpoint.pages.measured.operational import operational_page
    from toolpoint.pages.measured.shaker_records import records_page, shaker_page
    from toolpoint.pages.measured.state_comparison import state_comparison_page
    from toolpoint.pages.measured.traverse import traverse_page
    from toolpoint.pages.measured.update import update_page
    from toolpoint.pages.project.program import project_program_page
    from toolpoint.pages.project.project import project_page
    from toolpoint.pages.robots.accuracy import accuracy_page
    from toolpoint.pages.robots.places import place_page
    from toolpoint.pages.robots.robot import robot_page
    from toolpoint.pages.robots.screening import screening_page
    from toolpoint.pages.servos.drive_experiment import circle_page, drive_page
    from toolpoint.pages.servos.servo_data import servo_data_page
    from toolpoint.pages.servos.servo_map import servo_map_page
    from toolpoint.pages.servos.servo_tests import step_page, tuning_page
    from toolpoint.pages.testing.shaker_stand import shaker_stand_page
    from toolpoint.pages.testing.tap import tap_page
    from toolpoint.pages.testing.test_plan import plan_page
    from toolpoint.pages.video import video_page

__all__ = [
    "accuracy_page",
    "calibration_page",
    "campbell_page",
    "chatter_map_page",
    "circle_page",
    "correlation_page",
    "demo_page",
    "drift_page",
    "drive_page",
    "driven_axis_page",
    "driven_responses_page",
    "element_page",
    "finite_element_page",
    "first_look_page",
    "hammer_page",
    "head_source_page",
    "identification_page",
    "joints_page",
    "listening_page",
    "lobes_page",
    "machine_page",
    "machining_page",
    "map_page",
    "operational_page",
    "place_page",
    "plan_page",
    "project_page",
    "project_program_page",
    "records_page",
    "responses_page",
    "robot_page",
    "screening_page",
    "sensitivity_page",
    "servo_data_page",
    "servo_map_page",
    "shaker_page",
    "shaker_stand_page",
    "simulation_page",
    "stages_page",
    "state_comparison_page",
    "step_page",
    "tap_page",
    "tool_coupling_page",
    "traverse_page",
    "tuning_page",
    "turning_page",
    "update_page",
    "video_page",
    "workspace_page",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "cuts.calibration": ("calibration_page",),
    "cuts.chatter_map": ("chatter_map_page",),
    "cuts.listening": ("listening_page",),
    "cuts.lobes": ("lobes_page",),
    "cuts.simulated_cut": ("simulation_page",),
    "cuts.tool_coupling": ("tool_coupling_page",),
    "cuts.turning": ("turning_page",),
    "first_look": ("first_look_page",),
    "machines.campbell": ("campbell_page",),
    "machines.demo": ("demo_page", "head_source_page", "workspace_page"),
    "machines.driven_responses": ("driven_responses_page",),
    "machines.finite_elements": ("finite_element_page",),
    "machines.frequency_map": ("map_page",),
    "machines.machine": ("machine_page",),
    "machines.machine_responses": ("responses_page",),
    "machines.element_sensitivity": ("element_page",),
    "machines.sensitivity": ("sensitivity_page",),
    "machining.program": ("machining_page", "stages_page"),
    "measured.correlation": ("correlation_page",),
    "measured.drift": ("drift_page",),
    "measured.driven_axis": ("driven_axis_page",),
    "measured.hammer_records": ("hammer_page",),
    "measured.shaker_records": ("records_page", "shaker_page"),
    "measured.identification": ("identification_page",),
    "measured.joints": ("joints_page",),
    "measured.operational": ("operational_page",),
    "measured.state_comparison": ("state_comparison_page",),
    "measured.traverse": ("traverse_page",),
    "measured.update": ("update_page",),
    "project.program": ("project_program_page",),
    "project.project": ("project_page",),
    "robots.accuracy": ("accuracy_page",),
    "robots.places": ("place_page",),
    "robots.robot": ("robot_page",),
    "robots.screening": ("screening_page",),
    "servos.drive_experiment": ("circle_page", "drive_page"),
    "servos.servo_data": ("servo_data_page",),
    "servos.servo_map": ("servo_map_page",),
    "servos.servo_tests": ("step_page", "tuning_page"),
    "testing.shaker_stand": ("shaker_stand_page",),
    "testing.tap": ("tap_page",),
    "testing.test_plan": ("plan_page",),
    "video": ("video_page",),
})
