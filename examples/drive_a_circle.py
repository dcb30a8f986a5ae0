"""Contour error, torque and loops of a servo on a circle, its page, and the gains that meet a goal.

As `toolpoint drive SERVO --circle 50,4000`, then with `--deviation 20um`.
"""

import tempfile
from importlib import resources

from toolpoint.io import read_drives
from toolpoint.machine.description.project_plan import ContourGoal
from toolpoint.pages.servos.drive_experiment import circle_page, drive_page
from toolpoint.studies import run_drives, study_circle


def main() -> float:
    """Return the circular deviation, um; the published servo's quadrant glitches are 70 um."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical_servo.yaml") as path:
        drives, text = read_drives(path), path.read_text(encoding="utf-8")
    result = run_drives(drives, circle=(0.05, 4.0 / 60))
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(drive_page(result, source_text=text).save(folder))
    goal = study_circle(drives, ContourGoal(radius=0.05, feed=4.0 / 60, deviation=20e-6))
    print(goal.table())
    with tempfile.TemporaryDirectory() as folder:
        print(circle_page(goal, source_text=text).save(folder))
    assert result.circle is not None
    return 1e6 * result.circle.deviation


if __name__ == "__main__":
    main()
