"""Records of controllers: the fields that compiled code reads by name, in the simulation and in exported C."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

MAX_FILTERS, MAX_DELAY = 4, 8  # second-order stages of the torque filter; samples in a delay line
# Coefficients of (b0 + b1/z + b2/z^2)/(1 + a1/z + a2/z^2), as `Filter.coefficients` gives them.
FILTER_FIELDS = ("filter_b0", "filter_b1", "filter_b2", "filter_a1", "filter_a2")


class SampleTimes(NamedTuple):
    """Sample time of every loop, s; that of the velocity loop twice where there is no current loop."""

    current: float
    velocity: float
    position: float


class SampleCounts(NamedTuple):
    """Steps for each sample of every loop."""

    current: int
    velocity: int
    position: int


# Parameters of one axis. Flags and counts are whole numbers; `filter_*` hold a coefficient of every stage.
PARAMETERS = np.dtype([
    ("position_gain", float), ("velocity_feedforward", float), ("lead", float),
    ("inertia_feedforward", float), ("friction_feedforward", float), ("friction_velocity", float),
    ("scale_feedback", np.int64), ("angle_resolution", float), ("scale_resolution", float),
    ("velocity_gain", float), ("velocity_integral", float), ("torque_limit", float), ("torque_constant", float),
    ("velocity_delay", np.int64), ("difference", np.int64), ("velocity_sample_time", float),
    ("damping_gain", float), ("damps_tool", np.int64),
    ("filter_count", np.int64), *((name, float, MAX_FILTERS) for name in FILTER_FIELDS),
    ("has_current_loop", np.int64), ("current_gain", float), ("current_integral", float), ("decoupling", np.int64),
    ("model_inductance_d", float), ("model_inductance_q", float), ("model_flux", float), ("model_pole_pairs", float),
    ("current_limit", float), ("voltage_limit", float), ("current_delay", np.int64), ("current_sample_time", float),
    ("six_pulse", np.int64), ("carrier", float), ("pole_pairs", float),
], align=True)

# State of one axis. `filter_first` and `filter_second` are the memories of every stage; delay lines begin with the newest
# value; `held_*` is the rotor at the last current sample.
CONTROL_STATE = np.dtype([
    ("speed_set", float), ("torque_feedforward", float), ("following_error", float),
    ("speed_integral", float), ("last_angle", float), ("last_stretch", float),
    ("filter_first", float, MAX_FILTERS), ("filter_second", float, MAX_FILTERS),
    ("torque_line", float, MAX_DELAY), ("torque_set", float), ("current_set", float),
    ("integral_d", float), ("integral_q", float), ("voltage_line_d", float, MAX_DELAY), ("voltage_line_q", float, MAX_DELAY),
    ("voltage_d", float), ("voltage_q", float), ("held_angle", float), ("held_speed", float),
], align=True)

# Set point of one axis: m, m/s, m/s^2.
SET_POINT = np.dtype([("position", float), ("velocity", float), ("acceleration", float)], align=True)
