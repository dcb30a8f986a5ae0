"""Drives: friction, motor, ball screw, controllers, set points, servo simulation, contour and circular test, loops."""

from toolpoint.drives.ball_screw import Coupling, Screw, ball_screw_axis, four_dof_axis
from toolpoint.drives.command import Command
from toolpoint.drives.contact import Contact
from toolpoint.drives.contour import contour_error
from toolpoint.drives.control import Controller, CurrentLoop, Encoders, PositionLoop, VelocityLoop
from toolpoint.drives.filters import low_pass, low_pass_1, notch
from toolpoint.drives.friction import Coulomb, LuGre, MaxwellSlip, Stribeck, TwoExponential, Viscous
from toolpoint.drives.friction_identification import identified_friction, plausibility, variants
from toolpoint.drives.jerk_profile import JerkLimits, Quintic, seven_phase
from toolpoint.drives.limits import check_limits
from toolpoint.drives.loop_identification import measured_loop
from toolpoint.drives.loops import loops
from toolpoint.drives.mechanics import Mechanics
from toolpoint.drives.metrology import circular_test, positioning, quadrant_peaks
from toolpoint.drives.motor import Inverter, SynchronousMotor, TorqueMotor
from toolpoint.drives.moving_nut import simulate_moving_nut
from toolpoint.drives.path import Path
from toolpoint.drives.planner import planned, smoothed, straight_move
from toolpoint.drives.plant import Axis, Structure, plant
from toolpoint.drives.servo import Servo
from toolpoint.drives.simple_axes import linear_motor_axis, rack_axis, rigid_axis, two_mass_axis
from toolpoint.drives.simulate import simulate, simulate_many
from toolpoint.drives.step_response import step_figures
from toolpoint.drives.tuning import tuned

__all__ = [
    "Axis", "Command", "Contact", "Controller", "Coulomb", "Coupling", "CurrentLoop", "Encoders", "Inverter", "JerkLimits",
    "LuGre", "MaxwellSlip", "Mechanics", "Path", "PositionLoop", "Quintic", "Screw", "Servo", "Stribeck", "Structure",
    "SynchronousMotor", "TorqueMotor", "TwoExponential", "VelocityLoop", "Viscous", "ball_screw_axis", "check_limits",
    "circular_test", "contour_error", "four_dof_axis", "identified_friction", "linear_motor_axis", "loops", "low_pass",
    "low_pass_1", "measured_loop", "notch", "planned", "plant", "plausibility", "positioning", "quadrant_peaks", "rack_axis",
    "rigid_axis", "seven_phase", "simulate", "simulate_many", "simulate_moving_nut", "smoothed",
    "step_figures", "straight_move", "tuned", "two_mass_axis", "variants",
]
