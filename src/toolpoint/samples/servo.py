"""Sample of a controller's record: set speed, current and following error of an axis that moves to and fro."""

from __future__ import annotations

from pathlib import Path

import numpy as np

VELOCITY_GAIN, FRICTION_A, WEIGHT_A, VISCOUS_A = 25.0, 1.2, 3.0, 4e-3  # 1/s; A; A; A s/mm
SAMPLE_TIME_S, _TRACE_DURATION_S, _TRAVERSE_SPEED = 2e-3, 4.0, 50.0  # speed in mm/s, half of it in the second half


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write the record; return what was put in, and the commands."""
    time = np.arange(0, _TRACE_DURATION_S, SAMPLE_TIME_S)
    speed = _TRAVERSE_SPEED * np.sign(np.sin(np.pi * time + 1e-9)) * np.where(time < _TRACE_DURATION_S / 2, 1.0, 0.5)
    current = WEIGHT_A + FRICTION_A * np.sign(speed) + VISCOUS_A * speed
    current += 0.02 * np.random.default_rng(3).standard_normal(time.size)
    rows = [f"{t:.3f};{v:.4f};{i:.4f};{v / VELOCITY_GAIN:.6f}" for t, v, i in zip(time, speed, current, strict=True)]
    head = "time [s];v set Z (mm/s);current Z (A);following error Z (mm)"
    (folder / "trace.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return [f"Gain of the position loop {VELOCITY_GAIN:g} 1/s; dry friction {FRICTION_A:g} A, weight {WEIGHT_A:g} A, "
            f"{VISCOUS_A:g} A per mm/s; noise of the current 0.02 A."], ["toolpoint servo-data trace.csv"]
