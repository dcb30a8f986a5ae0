"""Sample of a drift: modes of a machine before and after its feet loosened, and its machine file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint import io
from toolpoint.machine import Machine, assemble
from toolpoint.samples.hammer_test import template_machine
from toolpoint.vibration import Modes, eigen

POINTS, MODE_COUNT = ("tip", "work", "nose"), 12
NOISE_FRACTION, SCATTER_FRACTION, FEET_FACTOR = 2e-4, 1e-3, 0.8  # of a frequency; of a frequency; of the feet's stiffness


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write machine file and three tests; return what was put in, and the commands."""
    machine, rng = template_machine(), np.random.default_rng(8)
    feet = {f"joints.feet.stiffness.{way}": FEET_FACTOR * k for way, k in machine.description.joints["feet"].stiffness.items()}
    io.write_machine(machine.description, folder / "machine.yaml")
    for name, state in (("january", machine), ("june", machine), ("november", machine.with_values(feet))):
        io.write_nouns(_test(state, rng), folder / f"{name}.h5")
    return [f"In november all feet have {100 * FEET_FACTOR:g} % of their stiffness; in june nothing had changed.",
            "Frequencies of two tests scatter by 0.1 %, their intervals hold 0.02 % of noise."], [
        "toolpoint drift june.h5 november.h5 --baseline january.h5 --machine machine.yaml"]


def _test(machine: Machine, rng: np.random.Generator) -> Modes:
    """Return the modes of a short test at three points."""
    labels = [f"{point}:+{way}" for point in POINTS for way in "xyz"]
    modes = eigen.solve_undamped(replace(assemble(machine, outputs=labels), damping=None)).selected(range(MODE_COUNT))
    scatter = np.hypot(NOISE_FRACTION, SCATTER_FRACTION / np.sqrt(2)) * rng.standard_normal(MODE_COUNT)
    covariance = np.array([np.diag([(NOISE_FRACTION * f) ** 2, 1e-6]) for f in modes.frequency])
    return Modes(modes.frequency * np.exp(scatter), np.full(MODE_COUNT, 0.03), modes.shape, modes.dofs, covariance=covariance)
