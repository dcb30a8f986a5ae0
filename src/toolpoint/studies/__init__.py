"""Questions asked of machines and measurements: named studies, each one call that returns a result. Loaded on first use."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from toolpoint.studies.calibration import CuttingTest, calibrate
    from toolpoint.studies.chatter_map import chatter_map as map_chatter
    from toolpoint.studies.drive_experiment import run_drives
    from toolpoint.studies.joint_study import study_joints
    from toolpoint.studies.lobes_study import chart_lobes
    from toolpoint.studies.machine_modes import solve_modes
    from toolpoint.studies.machine_report import study_machine, study_modes
    from toolpoint.studies.measured_comparison import compare_with_test, gather_test
    from toolpoint.studies.measured_response import study_responses
    from toolpoint.studies.measured_update import Measurement, update_machine
    from toolpoint.studies.pose_map import pose_map as map_frequencies
    from toolpoint.studies.sensitivity_study import study_sensitivity
    from toolpoint.studies.servo_data import judge_servo_data
    from toolpoint.studies.servo_map import map_servo
    from toolpoint.studies.simulated_cut import simulate_cut
    from toolpoint.studies.tool_dynamics import machine_dynamics, modal_dynamics, response_dynamics, separate_dynamics
    from toolpoint.studies.turning_study import TurningCut, chart_turning
    from toolpoint.studies.uncertain_cut import Uncertainty

__all__ = [
    "CuttingTest",
    "Measurement",
    "TurningCut",
    "Uncertainty",
    "calibrate",
    "chart_lobes",
    "chart_turning",
    "compare_with_test",
    "gather_test",
    "judge_servo_data",
    "machine_dynamics",
    "map_chatter",
    "map_frequencies",
    "map_servo",
    "modal_dynamics",
    "response_dynamics",
    "run_drives",
    "separate_dynamics",
    "simulate_cut",
    "solve_modes",
    "study_joints",
    "study_machine",
    "study_modes",
    "study_responses",
    "study_sensitivity",
    "update_machine",
]

_NAMES: dict[str, tuple[str, ...]] = {
    "calibration": ("CuttingTest", "calibrate"), "joint_study": ("study_joints",), "lobes_study": ("chart_lobes",),
    "machine_modes": ("solve_modes",), "machine_report": ("study_machine", "study_modes"),
    "measured_comparison": ("compare_with_test", "gather_test"), "measured_response": ("study_responses",),
    "measured_update": ("Measurement", "update_machine"), "sensitivity_study": ("study_sensitivity",),
    "simulated_cut": ("simulate_cut",), "servo_map": ("map_servo",), "servo_data": ("judge_servo_data",),
    "drive_experiment": ("run_drives",),
    "tool_dynamics": ("machine_dynamics", "response_dynamics", "modal_dynamics", "separate_dynamics"),
    "turning_study": ("TurningCut", "chart_turning"), "uncertain_cut": ("Uncertainty",),
}
_HOME = {name: (module, name) for module, names in _NAMES.items() for name in names} | {
    # Where module and function have one name, the room exports a verb: the module would hide the function.
    "map_chatter": ("chatter_map", "chatter_map"), "map_frequencies": ("pose_map", "pose_map")}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        module, verb = _HOME[name]
        return getattr(importlib.import_module(f"toolpoint.studies.{module}"), verb)
    raise AttributeError(f"module 'toolpoint.studies' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
