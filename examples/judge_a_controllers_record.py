"""Friction and gain of the position loop from a controller's record (as `toolpoint servo-data FILE`): an axis that we know."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint.io import read_servo_data
from toolpoint.pages.servos.servo_data import servo_data_page
from toolpoint.studies import judge_servo_data


def main() -> float:
    """Return the gain of the position loop, 1/s: 25 was put in, with dry friction of 1.2 A and a weight of 3 A."""
    time = np.arange(0, 4, 2e-3)
    speed = 50 * np.sign(np.sin(np.pi * time + 1e-9)) * np.where(time < 2, 1.0, 0.5)
    current = 3 + 1.2 * np.sign(speed) + 4e-3 * speed
    rows = "\n".join(f"{t:.3f};{v:.4f};{i:.4f};{v / 25:.6f}" for t, v, i in zip(time, speed, current, strict=True))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "record.csv"
        path.write_text("time [s];v set Z (mm/s);current Z (A);following error Z (mm)\n" + rows + "\n", encoding="utf-8")
        result = judge_servo_data(read_servo_data(path))
        print(result.table())
        print(servo_data_page(result).save(folder))
    return result.axes[0].velocity_gain


if __name__ == "__main__":
    main()
