"""Drives: friction, motor, ball screw, controllers, set points, servo simulation, contour and circular test, loops."""

from toolpoint.drives.accuracy.contour import contour_error
from toolpoint.drives.accuracy.metrology import circular_test, positioning, quadrant_peaks
from toolpoint.drives.axis.ball_screw import Coupling, Screw, ball_screw_axis, four_dof_axis
from toolpoint.drives.axis.mechanics import Mechanics
from toolpoint.drives.axis.motor import Inverter, SynchronousMotor, TorqueMotor
from toolpoint.drives.axis.plant import Axis, Structure, plant
from toolpoint.drives.axis.simple_axes import linear_motor_axis, rack_axis, rigid_axis, two_mass_axis
from toolpoint.drives.controller.filters import low_pass, low_pass_1, notch
from toolpoint.drives.controller.loops import loops
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.controller.settings import Controller, CurrentLoop, Encoders, PositionLoop, VelocityLoop
from toolpoint.drives.controller.step_response import step_figures
from toolpoint.drives.controller.tuning import tuned
from toolpoint.drives.friction.contact import Contact
from toolpoint.drives.friction.identification import identified_friction, plausibility, variants
from toolpoint.drives.friction.laws import Coulomb, LuGre, MaxwellSlip, Stribeck, TwoExponential, Viscous
from toolpoint.drives.program.command import Command
from toolpoint.drives.program.jerk_profile import JerkLimits, Quintic, seven_phase
from toolpoint.drives.program.limits import check_limits
from toolpoint.drives.program.path import Path
from toolpoint.drives.program.planner import planned, smoothed, straight_move
from toolpoint.drives.simulation.loop_identification import measured_loop
from toolpoint.drives.simulation.moving_nut import simulate_moving_nut
from toolpoint.drives.simulation.simulate import simulate, simulate_many

__all__ = [
    "Axis", "Command", "Contact", "Controller", "Coulomb", "Coupling", "CurrentLoop", "Encoders", "Inverter", "JerkLimits",
    "LuGre", "MaxwellSlip", "Mechanics", "Path", "PositionLoop", "Quintic", "Screw", "Servo", "Stribeck", "Structure",
    "SynchronousMotor", "TorqueMotor", "TwoExponential", "VelocityLoop", "Viscous", "ball_screw_axis", "check_limits",
    "circular_test", "contour_error", "four_dof_axis", "identified_friction", "linear_motor_axis", "loops", "low_pass",
    "low_pass_1", "measured_loop", "notch", "planned", "plant", "plausibility", "positioning", "quadrant_peaks", "rack_axis",
    "rigid_axis", "seven_phase", "simulate", "simulate_many", "simulate_moving_nut", "smoothed",
    "step_figures", "straight_move", "tuned", "two_mass_axis", "variants",
]
