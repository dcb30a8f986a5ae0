"""Records of friction and contact laws: the fields that compiled code reads by name, in the simulation and in exported C."""

from __future__ import annotations

import numpy as np

STATIC, BRISTLE, MAXWELL, CONTACT = range(4)
KINDS = {"STATIC": STATIC, "BRISTLE": BRISTLE, "MAXWELL": MAXWELL, "CONTACT": CONTACT}
MAX_ELEMENTS = 8  # blocks of a Maxwell-slip law
MAX_LAW_ITERATIONS = 60  # Newton steps of a law in one step of the plant; a bracket halves its width at worst

# Dry level g(v) = level + sum_i fall_size[i] exp(-|v/fall_velocity[i]|^fall_exponent[i]), common to all friction laws; then
# the numbers of each kind. Forces N (or torques N m), velocities m/s (or rad/s). A law that a load presses has load_arm |load|
# (m times N) on top of its level.
LAW = np.dtype([
    ("kind", np.int64), ("level", float), ("fall_size", float, 2), ("fall_velocity", float, 2), ("fall_exponent", float, 2),
    ("viscous", float), ("load_arm", float),
    ("bristle_stiffness", float), ("bristle_damping", float),
    ("attraction", float), ("elements", np.int64), ("element_stiffness", float, MAX_ELEMENTS),
    ("element_share", float, MAX_ELEMENTS),
    ("contact_stiffness", float), ("contact_reference", float), ("contact_preload", float),
    ("contact_cubic", float),
], align=True)

# Bristle deflection and its rate (LuGre); force and slip sign of every block and the velocity of the last step (Maxwell
# slip); `surroundings` is scratch of the solver: what the law last saw of the rest of the plant.
LAW_STATE = np.dtype([
    ("bristle", float), ("bristle_rate", float),
    ("block_force", float, MAX_ELEMENTS), ("block_slip", float, MAX_ELEMENTS), ("velocity", float),
    ("surroundings", float),
], align=True)
