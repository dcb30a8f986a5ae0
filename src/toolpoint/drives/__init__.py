"""Drives: friction, motor, ball screw, controllers, set points, servo simulation, contour and circular test, loops.

Names below are loaded on first use: reading a program or a drive file needs few of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.drives.accuracy.contour import contour_error, torque_comparison
    from toolpoint.drives.accuracy.metrology import circular_hysteresis, circular_test, positioning, quadrant_peaks
    from toolpoint.drives.axis.ball_screw import BallScrew, Coupling, ball_screw_axis, four_dof_axis
    from toolpoint.drives.axis.mechanics import Mechanics
    from toolpoint.drives.axis.motor import Inverter, SynchronousMotor, TorqueMotor
    from toolpoint.drives.axis.plant import DriveAxis, Structure, build_plant
    from toolpoint.drives.axis.simple_axes import linear_motor_axis, rack_axis, rigid_axis, two_mass_axis
    from toolpoint.drives.build import build_servo
    from toolpoint.drives.controller.filters import low_pass, low_pass_1, notch
    from toolpoint.drives.controller.loops import compute_loops
    from toolpoint.drives.controller.servo import Servo
    from toolpoint.drives.controller.settings import Controller, CurrentLoop, Encoders, PositionLoop, VelocityLoop
    from toolpoint.drives.controller.step_response import step_figures
    from toolpoint.drives.controller.tuning import tune
    from toolpoint.drives.description import DriveDescription
    from toolpoint.drives.friction.contact import Contact, ProgressiveSpring
    from toolpoint.drives.friction.identification import (
        check_plausibility,
        constant_velocity_points,
        friction_variants,
        identify_friction,
    )
    from toolpoint.drives.friction.laws import Coulomb, LuGre, MaxwellSlip, Stribeck, TwoExponential, Viscous
    from toolpoint.drives.program.command import Command
    from toolpoint.drives.program.jerk_profile import JerkLimits, Quintic, seven_phase
    from toolpoint.drives.program.limits import check_limits
    from toolpoint.drives.program.path import Path
    from toolpoint.drives.program.planner import plan_motion, smooth_command, straight_move
    from toolpoint.drives.simulation.loop_identification import measure_loop
    from toolpoint.drives.simulation.moving_nut import simulate_moving_nut
    from toolpoint.drives.simulation.simulate import simulate, simulate_many

__all__ = [
    "BallScrew", "Command", "Contact", "Controller", "Coulomb", "Coupling", "CurrentLoop", "DriveAxis", "DriveDescription",
    "Encoders", "Inverter", "JerkLimits", "LuGre", "MaxwellSlip", "Mechanics", "Path", "PositionLoop", "ProgressiveSpring",
    "Quintic", "Servo", "Stribeck", "Structure", "SynchronousMotor", "TorqueMotor", "TwoExponential", "VelocityLoop", "Viscous",
    "ball_screw_axis", "build_plant", "build_servo", "check_limits", "check_plausibility", "circular_hysteresis",
    "circular_test", "compute_loops", "constant_velocity_points", "contour_error", "four_dof_axis", "friction_variants",
    "identify_friction", "linear_motor_axis", "low_pass", "low_pass_1", "measure_loop", "notch", "plan_motion", "positioning",
    "quadrant_peaks", "rack_axis", "rigid_axis", "seven_phase", "simulate", "simulate_many", "simulate_moving_nut",
    "smooth_command", "step_figures", "straight_move", "torque_comparison", "tune", "two_mass_axis",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "accuracy.contour": ("contour_error", "torque_comparison"),
    "accuracy.metrology": ("circular_hysteresis", "circular_test", "positioning", "quadrant_peaks"),
    "axis.ball_screw": ("BallScrew", "Coupling", "ball_screw_axis", "four_dof_axis"),
    "axis.mechanics": ("Mechanics",),
    "axis.motor": ("Inverter", "SynchronousMotor", "TorqueMotor"),
    "axis.plant": ("DriveAxis", "Structure", "build_plant"),
    "axis.simple_axes": ("linear_motor_axis", "rack_axis", "rigid_axis", "two_mass_axis"),
    "build": ("build_servo",),
    "controller.filters": ("low_pass", "low_pass_1", "notch"),
    "controller.loops": ("compute_loops",),
    "controller.servo": ("Servo",),
    "controller.settings": ("Controller", "CurrentLoop", "Encoders", "PositionLoop", "VelocityLoop"),
    "controller.step_response": ("step_figures",),
    "controller.tuning": ("tune",),
    "description": ("DriveDescription",),
    "friction.contact": ("Contact", "ProgressiveSpring"),
    "friction.identification": ("check_plausibility", "constant_velocity_points", "friction_variants", "identify_friction"),
    "friction.laws": ("Coulomb", "LuGre", "MaxwellSlip", "Stribeck", "TwoExponential", "Viscous"),
    "program.command": ("Command",),
    "program.jerk_profile": ("JerkLimits", "Quintic", "seven_phase"),
    "program.limits": ("check_limits",),
    "program.path": ("Path",),
    "program.planner": ("plan_motion", "smooth_command", "straight_move"),
    "simulation.loop_identification": ("measure_loop",),
    "simulation.moving_nut": ("simulate_moving_nut",),
    "simulation.simulate": ("simulate", "simulate_many"),
})
