"""Questions about machines and measurements: named studies, each one call that returns a result. Loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.machine.description.variation import Factor, Option, Swap
    from toolpoint.studies.accuracy.accuracy_metric import AccuracyMetric
    from toolpoint.studies.accuracy.cut_course import WorkBlock
    from toolpoint.studies.accuracy.joint_servos import servos_of
    from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_path
    from toolpoint.studies.accuracy.moving_structure import ToolStance
    from toolpoint.studies.accuracy.tool_paths import along_points, arc, lay_path, line, plane_frame, sides_of, square
    from toolpoint.studies.citation import Citation, cite_package
    from toolpoint.studies.cuts.chatter_map import chatter_map as map_chatter
    from toolpoint.studies.cuts.coupling.machine_spindle import bases_of_machine
    from toolpoint.studies.cuts.described_cut import cut_on
    from toolpoint.studies.cuts.forces.calibration import CuttingTest, calibrate
    from toolpoint.studies.cuts.forces.material_table import materials_table
    from toolpoint.studies.cuts.lobes_study import chart_lobes
    from toolpoint.studies.cuts.measured_response import study_responses
    from toolpoint.studies.cuts.simulated_cut import simulate_cut
    from toolpoint.studies.cuts.tool_coupling import bases_from_gauge, bases_of_responses, study_tool
    from toolpoint.studies.cuts.tool_dynamics import machine_dynamics, modal_dynamics, response_dynamics, separate_dynamics
    from toolpoint.studies.cuts.turning.study import TurningCut, chart_turning, describe_turning
    from toolpoint.studies.cuts.uncertain_cut import Uncertainty, propose_speeds
    from toolpoint.studies.cuts.work_dynamics import machine_work, with_work
    from toolpoint.studies.drift.drift_study import study_drift
    from toolpoint.studies.drift.mode_changes import Repeatability
    from toolpoint.studies.environment import core_count, examine_environment
    from toolpoint.studies.execute import Dask, Serial, choose_engine
    from toolpoint.studies.finite_elements.machine_study import study_example_mill, study_finite_elements
    from toolpoint.studies.finite_elements.matrix_modes import solve_matrix_modes
    from toolpoint.studies.finite_elements.tuned_damper import tune_damper
    from toolpoint.studies.first_look import study_machine_and_responses
    from toolpoint.studies.listening.listen import SpindleRange, listen
    from toolpoint.studies.listening.live_listening import HeardWindow, decisive_window, follow_cut, question_windows
    from toolpoint.studies.listening.tried_cuts import hear_tried
    from toolpoint.studies.live_testing.blow_tone import BlowTone, sound_blow
    from toolpoint.studies.live_testing.blow_verdict import BlowVerdict
    from toolpoint.studies.live_testing.live_session import follow_blows
    from toolpoint.studies.live_testing.live_tap import LiveProgress, LiveTap
    from toolpoint.studies.live_testing.mass_calibration import MassCalibration, calibrate_on_mass
    from toolpoint.studies.machines.base_reaction_study import study_base_reactions
    from toolpoint.studies.machines.campbell import map_speeds
    from toolpoint.studies.machines.check.file_check import question_part
    from toolpoint.studies.machines.check.machine_check import check_machine
    from toolpoint.studies.machines.element_sensitivity import study_elements
    from toolpoint.studies.machines.full_mesh_modes import compare_full_mesh
    from toolpoint.studies.machines.machine_modes import solve_modes
    from toolpoint.studies.machines.machine_report import study_machine, study_modes
    from toolpoint.studies.machines.machine_responses import state_space_of_machine, study_responses_of_machine
    from toolpoint.studies.machines.next_test import rank_tests
    from toolpoint.studies.machines.pose_map import pose_map as map_frequencies
    from toolpoint.studies.machines.response_map import response_map as map_responses
    from toolpoint.studies.machines.sensitivity_study import study_sensitivity
    from toolpoint.studies.machines.spring_ways import spring_ways
    from toolpoint.studies.machines.stiffness_map import stiffness_map as map_stiffness
    from toolpoint.studies.machines.virtual_test import list_points
    from toolpoint.studies.machining.compare_record import compare_record, spindle_signal
    from toolpoint.studies.machining.described_setup import cuts_of_options, describe_machining, limits_of_drives, stock_of
    from toolpoint.studies.machining.five_axes.run_five_axes import run_five_axes
    from toolpoint.studies.machining.run_program import run_program
    from toolpoint.studies.machining.setup import CuttingLimits, MachiningSetup
    from toolpoint.studies.machining.thin_walls.clamped_part import describe_part
    from toolpoint.studies.machining.thin_walls.measured_work import MeasuredWork
    from toolpoint.studies.machining.tilted_stages import compare_stages, run_stages
    from toolpoint.studies.machining.tool_tips import ToolTips
    from toolpoint.studies.measured.component_places import place_test
    from toolpoint.studies.measured.described_test import study_described_records
    from toolpoint.studies.measured.hammer_study import study_hammer_records
    from toolpoint.studies.measured.identification import identify_modes, modes_of_test
    from toolpoint.studies.measured.joint_study import study_joints
    from toolpoint.studies.measured.measured_comparison import compare_with_test, gather_test
    from toolpoint.studies.measured.measured_update import Measurement, pair_measurements, update_machine
    from toolpoint.studies.measured.model_correlation import with_measured_points
    from toolpoint.studies.measured.operational_study import OperationalStudy, study_operational
    from toolpoint.studies.measured.shaker_study import study_shaker_records
    from toolpoint.studies.measured.two_states import compare_two_states
    from toolpoint.studies.moving.driven_axis_study import DrivenAxisStudy, study_driven_axis
    from toolpoint.studies.moving.mode_tracks import TraverseWindow, cut_windows
    from toolpoint.studies.moving.traverse_study import TraverseStudy, study_traverse
    from toolpoint.studies.robots.datasheet_study import study_datasheet
    from toolpoint.studies.robots.motion_map import map_motion
    from toolpoint.studies.robots.place_map import PlaceQuantity, map_places, place_grid
    from toolpoint.studies.robots.published_head import study_published_head
    from toolpoint.studies.robots.reach_study import study_pose, study_reach
    from toolpoint.studies.robots.regions import plane_directions, search_regions, study_region
    from toolpoint.studies.robots.turns import choose_turns, compare_branches
    from toolpoint.studies.robots.workspace import study_workspace
    from toolpoint.studies.screening.answers import DepthLimit, PeriodicError, ResponsePeak
    from toolpoint.studies.screening.conclusions import draw_conclusions
    from toolpoint.studies.screening.designs import one_at_a_time
    from toolpoint.studies.screening.effects import rank_changes
    from toolpoint.studies.screening.improve import improve as improve_machine
    from toolpoint.studies.screening.metrics import NamedMetrics
    from toolpoint.studies.screening.planned import improve_by_plan, run_plan
    from toolpoint.studies.screening.robot_demo import run_demo as run_robot_demo
    from toolpoint.studies.screening.screen import screen
    from toolpoint.studies.servos.circle_study import study_circle
    from toolpoint.studies.servos.drive_experiment import run_drives
    from toolpoint.studies.servos.drive_structure import question_structure, structure_of
    from toolpoint.studies.servos.drive_tuning import TuningTarget, tune_drives
    from toolpoint.studies.servos.driven_responses import study_driven_responses
    from toolpoint.studies.servos.servo_data import judge_servo_data
    from toolpoint.studies.servos.servo_map import map_servo
    from toolpoint.studies.servos.step_test import StepSetting, step_drives
    from toolpoint.studies.testing.modal_test_plan import plan_test
    from toolpoint.studies.testing.shaker_stand import describe_shaker, stand_shaker
    from toolpoint.studies.testing.tap_study import study_tap
    from toolpoint.studies.video.filmed_machine import magnify_motion, study_videos
    from toolpoint.studies.video.interfaces import rank_interfaces
    from toolpoint.studies.video.record_poles import poles_of
    from toolpoint.studies.video.video_study import study_video
    from toolpoint.studies.video.video_update import seen_places, update_from_videos
    from toolpoint.studies.video.virtual_update import FILMED_TRUTH, update_from_virtual_videos
    from toolpoint.studies.video.virtual_video import film_machine

__all__ = [
    "FILMED_TRUTH",
    "AccuracyMetric",
    "BlowTone",
    "BlowVerdict",
    "Citation",
    "CuttingLimits",
    "CuttingTest",
    "Dask",
    "DepthLimit",
    "DrivenAxisStudy",
    "Factor",
    "HeardWindow",
    "LiveProgress",
    "LiveTap",
    "MachiningSetup",
    "MassCalibration",
    "MeasuredWork",
    "Measurement",
    "MillingSetup",
    "NamedMetrics",
    "OperationalStudy",
    "Option",
    "PeriodicError",
    "PlaceQuantity",
    "Repeatability",
    "ResponsePeak",
    "Serial",
    "SpindleRange",
    "StepSetting",
    "Swap",
    "ToolStance",
    "ToolTips",
    "TraverseStudy",
    "TraverseWindow",
    "TuningTarget",
    "TurningCut",
    "Uncertainty",
    "WorkBlock",
    "along_points",
    "arc",
    "bases_from_gauge",
    "bases_of_machine",
    "bases_of_responses",
    "calibrate",
    "calibrate_on_mass",
    "chart_lobes",
    "chart_turning",
    "check_machine",
    "choose_engine",
    "choose_turns",
    "cite_package",
    "compare_branches",
    "compare_full_mesh",
    "compare_record",
    "compare_stages",
    "compare_two_states",
    "compare_with_test",
    "core_count",
    "cut_on",
    "cut_windows",
    "cuts_of_options",
    "decisive_window",
    "describe_machining",
    "describe_part",
    "describe_shaker",
    "describe_turning",
    "draw_conclusions",
    "examine_environment",
    "film_machine",
    "follow_blows",
    "follow_cut",
    "gather_test",
    "hear_tried",
    "identify_modes",
    "improve_by_plan",
    "improve_machine",
    "judge_servo_data",
    "lay_path",
    "limits_of_drives",
    "line",
    "list_points",
    "listen",
    "machine_dynamics",
    "machine_work",
    "magnify_motion",
    "map_chatter",
    "map_frequencies",
    "map_motion",
    "map_places",
    "map_responses",
    "map_servo",
    "map_speeds",
    "map_stiffness",
    "materials_table",
    "mill_path",
    "modal_dynamics",
    "modes_of_test",
    "one_at_a_time",
    "pair_measurements",
    "place_grid",
    "place_test",
    "plan_test",
    "plane_directions",
    "plane_frame",
    "poles_of",
    "propose_speeds",
    "question_part",
    "question_structure",
    "question_windows",
    "rank_changes",
    "rank_interfaces",
    "rank_tests",
    "response_dynamics",
    "run_drives",
    "run_five_axes",
    "run_plan",
    "run_program",
    "run_robot_demo",
    "run_stages",
    "screen",
    "search_regions",
    "seen_places",
    "separate_dynamics",
    "servos_of",
    "sides_of",
    "simulate_cut",
    "solve_matrix_modes",
    "solve_modes",
    "sound_blow",
    "spindle_signal",
    "spring_ways",
    "square",
    "stand_shaker",
    "state_space_of_machine",
    "step_drives",
    "stock_of",
    "structure_of",
    "study_base_reactions",
    "study_circle",
    "study_datasheet",
    "study_described_records",
    "study_drift",
    "study_driven_axis",
    "study_driven_responses",
    "study_elements",
    "study_example_mill",
    "study_finite_elements",
    "study_hammer_records",
    "study_joints",
    "study_machine",
    "study_machine_and_responses",
    "study_modes",
    "study_operational",
    "study_pose",
    "study_published_head",
    "study_reach",
    "study_region",
    "study_responses",
    "study_responses_of_machine",
    "study_sensitivity",
    "study_shaker_records",
    "study_tap",
    "study_tool",
    "study_traverse",
    "study_video",
    "study_videos",
    "study_workspace",
    "tune_damper",
    "tune_drives",
    "update_from_videos",
    "update_from_virtual_videos",
    "update_machine",
    "with_measured_points",
    "with_work",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "toolpoint.machine.description.variation": ("Factor", "Option", "Swap"),
    "accuracy.accuracy_metric": ("AccuracyMetric",), "accuracy.cut_course": ("WorkBlock",),
    "accuracy.joint_servos": ("servos_of",),
    "accuracy.milling_accuracy": ("MillingSetup", "mill_path"),
    "accuracy.moving_structure": ("ToolStance",),
    "accuracy.tool_paths": ("along_points", "arc", "lay_path", "line", "plane_frame", "sides_of", "square"),
    "cuts.chatter_map": ("chatter_map as map_chatter",),
    "cuts.described_cut": ("cut_on",),
    "cuts.forces.calibration": ("CuttingTest", "calibrate"),
    "cuts.forces.material_table": ("materials_table",),
    "cuts.lobes_study": ("chart_lobes",),
    "cuts.measured_response": ("study_responses",),
    "cuts.simulated_cut": ("simulate_cut",),
    "cuts.coupling.machine_spindle": ("bases_of_machine",),
    "cuts.tool_coupling": ("bases_from_gauge", "bases_of_responses", "study_tool"),
    "cuts.work_dynamics": ("machine_work", "with_work"),
    "cuts.tool_dynamics": ("machine_dynamics", "modal_dynamics", "response_dynamics", "separate_dynamics"),
    "cuts.turning.study": ("TurningCut", "chart_turning", "describe_turning"),
    "cuts.uncertain_cut": ("Uncertainty", "propose_speeds"),
    "drift.drift_study": ("study_drift",),
    "drift.mode_changes": ("Repeatability",),
    "citation": ("Citation", "cite_package"),
    "environment": ("core_count", "examine_environment"),
    "execute": ("Dask", "Serial", "choose_engine"),
    "finite_elements.machine_study": ("study_example_mill", "study_finite_elements"),
    "finite_elements.matrix_modes": ("solve_matrix_modes",),
    "finite_elements.tuned_damper": ("tune_damper",),
    "first_look": ("study_machine_and_responses",),
    "listening.listen": ("SpindleRange", "listen"),
    "listening.live_listening": ("HeardWindow", "decisive_window", "follow_cut", "question_windows"),
    "listening.tried_cuts": ("hear_tried",),
    "live_testing.blow_tone": ("BlowTone", "sound_blow"),
    "live_testing.blow_verdict": ("BlowVerdict",), "live_testing.live_session": ("follow_blows",),
    "live_testing.live_tap": ("LiveProgress", "LiveTap"),
    "live_testing.mass_calibration": ("MassCalibration", "calibrate_on_mass"),
    "machines.base_reaction_study": ("study_base_reactions",),
    "machines.campbell": ("map_speeds",),
    "machines.check.machine_check": ("check_machine",),
    "machines.element_sensitivity": ("study_elements",),
    "machines.full_mesh_modes": ("compare_full_mesh",),
    "machines.machine_modes": ("solve_modes",),
    "machines.machine_report": ("study_machine", "study_modes"),
    "machines.machine_responses": ("state_space_of_machine", "study_responses_of_machine"),
    "machines.next_test": ("rank_tests",),
    "machines.pose_map": ("pose_map as map_frequencies",),
    "machines.response_map": ("response_map as map_responses",),
    "machines.sensitivity_study": ("study_sensitivity",),
    "machines.spring_ways": ("spring_ways",),
    "machines.stiffness_map": ("stiffness_map as map_stiffness",),
    "machines.virtual_test": ("list_points",),
    "machining.compare_record": ("compare_record", "spindle_signal"),
    "machining.described_setup": ("cuts_of_options", "describe_machining", "limits_of_drives", "stock_of"),
    "machining.run_program": ("run_program",),
    "machining.setup": ("CuttingLimits", "MachiningSetup"),
    "machining.five_axes.run_five_axes": ("run_five_axes",),
    "machining.tilted_stages": ("compare_stages", "run_stages"),
    "machining.thin_walls.clamped_part": ("describe_part",),
    "machining.thin_walls.measured_work": ("MeasuredWork",),
    "machining.tool_tips": ("ToolTips",),
    "measured.component_places": ("place_test",),
    "measured.described_test": ("study_described_records",),
    "measured.hammer_study": ("study_hammer_records",),
    "measured.shaker_study": ("study_shaker_records",),
    "measured.identification": ("identify_modes", "modes_of_test"),
    "measured.joint_study": ("study_joints",),
    "measured.measured_comparison": ("compare_with_test", "gather_test"),
    "measured.measured_update": ("Measurement", "pair_measurements", "update_machine"),
    "measured.model_correlation": ("with_measured_points",),
    "measured.operational_study": ("OperationalStudy", "study_operational"),
    "measured.two_states": ("compare_two_states",),
    "moving.driven_axis_study": ("DrivenAxisStudy", "study_driven_axis"),
    "moving.mode_tracks": ("TraverseWindow", "cut_windows"),
    "moving.traverse_study": ("TraverseStudy", "study_traverse"),
    "robots.motion_map": ("map_motion",),
    "robots.datasheet_study": ("study_datasheet",),
    "machines.check.file_check": ("question_part",),
    "robots.place_map": ("PlaceQuantity", "map_places", "place_grid"),
    "robots.reach_study": ("study_pose", "study_reach"),
    "robots.regions": ("plane_directions", "search_regions", "study_region"),
    "robots.published_head": ("study_published_head",),
    "robots.turns": ("choose_turns", "compare_branches"),
    "robots.workspace": ("study_workspace",),
    "screening.answers": ("DepthLimit", "PeriodicError", "ResponsePeak"),
    "screening.conclusions": ("draw_conclusions",), "screening.designs": ("one_at_a_time",),
    "screening.effects": ("rank_changes",), "screening.improve": ("improve as improve_machine",),
    "screening.metrics": ("NamedMetrics",),
    "screening.planned": ("improve_by_plan", "run_plan"),
    "screening.robot_demo": ("run_demo as run_robot_demo",), "screening.screen": ("screen",),
    "servos.circle_study": ("study_circle",), "servos.drive_experiment": ("run_drives",),
    "servos.driven_responses": ("study_driven_responses",), "servos.drive_structure": ("question_structure", "structure_of"),
    "servos.servo_data": ("judge_servo_data",), "servos.servo_map": ("map_servo",),
    "servos.step_test": ("StepSetting", "step_drives"),
    "servos.drive_tuning": ("TuningTarget", "tune_drives"),
    "testing.shaker_stand": ("describe_shaker", "stand_shaker"),
    "testing.modal_test_plan": ("plan_test",), "testing.tap_study": ("study_tap",),
    "video.filmed_machine": ("magnify_motion", "study_videos"), "video.interfaces": ("rank_interfaces",),
    "video.record_poles": ("poles_of",), "video.video_study": ("study_video",),
    "video.video_update": ("seen_places", "update_from_videos"),
    "video.virtual_update": ("FILMED_TRUTH", "update_from_virtual_videos"),
    "video.virtual_video": ("film_machine",),
})
