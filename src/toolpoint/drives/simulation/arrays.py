"""Arrays of the compiled run: matrices of the step, laws, controllers, the motion it advances, histories."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.drives.controller.records import SampleCounts

MAX_LAW_PASSES = 60  # passes over the laws and products in the implicit equations of one step
# Where an excitation is added; the numbers are what the kernel compares with.
PLACES = ("none", "position", "speed", "torque", "current", "voltage")
SPEED, TORQUE, CURRENT, VOLTAGE = (PLACES.index(name) for name in ("speed", "torque", "current", "voltage"))

# Controller signals of every axis, in the order of the histories.
SIGNALS = ("speed_set", "torque_set", "current_set", "u_d", "u_q", "following_error")


class StepArrays(NamedTuple):
    """Matrices of one step of `step` s, by columns; see `exact_step.StepMatrices`."""

    step: float
    core: FloatArray
    pairs: FloatArray
    inputs: FloatArray
    shift: FloatArray
    jump: FloatArray
    scalars: FloatArray
    gain: FloatArray
    reading: FloatArray
    direct: FloatArray
    loads: FloatArray
    load_direct: FloatArray


class LawArrays(NamedTuple):
    """Records of the friction and contact laws (`LAW`), the viscous parts that stand in the matrices, factors of products."""

    records: np.ndarray
    viscous: FloatArray
    products: np.ndarray


class ControlArrays(NamedTuple):
    """Controllers: plant steps for each current, velocity and position sample; records of every axis; set points (n, n_axes);
    excitation (n, n_axes) and its place; force on the tables (n, n_axes), N, the last line held to the end."""

    counts: SampleCounts
    parameters: np.ndarray
    states: np.ndarray
    set_points: np.ndarray
    excitation: FloatArray
    place: int
    load: FloatArray


class MotionArrays(NamedTuple):
    """State that a run changes in place: coordinates, states of the laws (`LAW_STATE`), values of the laws now and a step
    before."""

    coordinates: FloatArray
    laws: np.ndarray
    values: FloatArray


class Histories(NamedTuple):
    """Records every `record_interval` plant steps: outputs (n, ...), controller signals (n, n_axes, 6), values of the laws (n,
    n_laws)."""

    record_interval: int
    outputs: FloatArray
    signals: FloatArray
    forces: FloatArray
