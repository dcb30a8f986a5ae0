"""Pages: a result of a study turned into one self-contained report, only when it is asked for. Each is loaded on first use."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from toolpoint.pages.cuts.calibration import calibration_page
    from toolpoint.pages.cuts.chatter_map import chatter_map_page
    from toolpoint.pages.cuts.lobes import lobes_page
    from toolpoint.pages.cuts.simulated_cut import simulation_page
    from toolpoint.pages.cuts.tool_coupling import tool_coupling_page
    from toolpoint.pages.cuts.turning import turning_page
    from toolpoint.pages.machines.campbell import campbell_page
    from toolpoint.pages.machines.finite_elements import finite_element_page
    from toolpoint.pages.machines.frequency_map import map_page
    from toolpoint.pages.machines.machine import machine_page
    from toolpoint.pages.machines.machine_responses import responses_page
    from toolpoint.pages.machines.sensitivity import sensitivity_page
    from toolpoint.pages.measured.correlation import correlation_page
    from toolpoint.pages.measured.hammer_records import hammer_page
    from toolpoint.pages.measured.identification import identification_page
    from toolpoint.pages.measured.joints import joints_page
    from toolpoint.pages.measured.update import update_page
    from toolpoint.pages.robots.accuracy import accuracy_page
    from toolpoint.pages.robots.places import place_page
    from toolpoint.pages.robots.robot import robot_page
    from toolpoint.pages.robots.screening import screening_page
    from toolpoint.pages.servos.drive_experiment import drive_page
    from toolpoint.pages.servos.servo_data import servo_data_page
    from toolpoint.pages.servos.servo_map import servo_map_page
    from toolpoint.pages.testing.tap import tap_page
    from toolpoint.pages.testing.test_plan import plan_page
    from toolpoint.pages.video import video_page

__all__ = [
    "accuracy_page", "calibration_page", "campbell_page", "chatter_map_page", "correlation_page", "drive_page",
    "finite_element_page", "hammer_page",
    "identification_page", "joints_page", "lobes_page", "machine_page", "map_page", "place_page",
    "plan_page",
    "responses_page", "robot_page", "screening_page", "sensitivity_page", "servo_data_page", "servo_map_page",
    "simulation_page", "tap_page", "tool_coupling_page", "turning_page", "update_page", "video_page",
]

_HOME = {
    "accuracy_page": "robots.accuracy", "calibration_page": "cuts.calibration", "campbell_page": "machines.campbell",
    "chatter_map_page": "cuts.chatter_map", "correlation_page": "measured.correlation",
    "drive_page": "servos.drive_experiment", "finite_element_page": "machines.finite_elements",
    "identification_page": "measured.identification", "joints_page": "measured.joints", "lobes_page": "cuts.lobes",
    "machine_page": "machines.machine", "map_page": "machines.frequency_map", "place_page": "robots.places",
    "responses_page": "machines.machine_responses", "robot_page": "robots.robot", "screening_page": "robots.screening",
    "sensitivity_page": "machines.sensitivity", "servo_data_page": "servos.servo_data",
    "servo_map_page": "servos.servo_map", "simulation_page": "cuts.simulated_cut",
    "tool_coupling_page": "cuts.tool_coupling", "turning_page": "cuts.turning", "update_page": "measured.update",
    "video_page": "video", "hammer_page": "measured.hammer_records", "tap_page": "testing.tap",
    "plan_page": "testing.test_plan",
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(f"toolpoint.pages.{_HOME[name]}"), name)
    raise AttributeError(f"module 'toolpoint.pages' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
