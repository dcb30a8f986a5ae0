"""Responses with the drives on, beside the simulation in time: four servos (fast, slow and delayed loops), 4 to 45 Hz.

    python benchmarks/drives/drive_states.py

Friction is viscous alone, so that both are linear. The last line is the largest relative difference of amplitude and phase.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

import numpy as np

from benchmarks.frame import CommandLine


def main() -> None:
    """Print the difference of every servo and frequency, and the largest."""
    CommandLine(__doc__).parse_args()
    from drives.servo_cases import benchmark_servo, lugre, smooth
    from drives.test_drive_states import LOOPS, response, steady_motion
    from toolpoint.drives.controller.servo import Servo

    plant, worst = benchmark_servo(smooth(lugre())).plant, 0.0
    for name, loops in LOOPS.items():
        servo = Servo(plant, (loops,) * 2)
        for frequency in (4.0, 20.0, 45.0):
            error = abs(response(servo, "on", np.array([frequency]))[0] / steady_motion(servo, frequency) - 1)
            worst = max(worst, float(error))
            print(f"{name}, {frequency:g} Hz: {error:.2g}", flush=True)
    print(f"largest relative difference: {worst:.2g}")


if __name__ == "__main__":
    main()
