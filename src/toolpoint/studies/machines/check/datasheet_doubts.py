"""Doubts about a robot's datasheet: reducers that contradict each other, angles of its table in the other unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine.robot.datasheet import RobotDatasheet
from toolpoint.studies.machines.check.robot_doubts import question_whole_robot
from toolpoint.studies.machines.check.size_doubts import angle_slip

MIN_BENDING_TO_TORSION, MAX_BENDING_TO_TORSION = 0.3, 200.0  # stiffness of a reducer against bending over that against torsion
MAX_REDUCER_RATIO = 100.0  # times that a stiffness may be below the smallest, or above the largest, of the other reducers
MIN_TABLE_SLIPS = 3  # angles in degrees taken as rad: from here on the whole table is doubted, not each angle
MAX_DAMPING_TIME_RATIO = 60.0  # damping over torsion (s) against the other reducers, which differ by a few times
MAX_DAMPER_TO_SPRING_MOMENT = 2.0  # moment of the damper over that of the spring of a reducer, at 10 Hz
MIN_REDUCER_TORSION, MAX_REDUCER_TORSION = 100.0, 5e7  # N m/rad of a reducer's torsion: wrists of some kg, bases of some t


def question_datasheet(sheet: RobotDatasheet) -> tuple[Doubt, ...]:
    """Return doubts about numbers of a datasheet that are possible but probably in another unit.

    Table and reducers come first; the robot as a whole is questioned only where these raise no doubt.
    """
    parts = (*_question_table(sheet), *_question_reducers(sheet))
    # What a part explains is not said of the whole again.
    return parts or tuple(question_whole_robot(sheet))


def _question_table(sheet: RobotDatasheet) -> Iterator[Doubt]:
    """Yield doubts about angles, travel and lengths of the Denavit-Hartenberg table."""
    angles = {f"axes.{axis.name}.{key}": float(getattr(axis, key)) for axis in sheet.axes for key in ("alpha", "theta")}
    slips = {path: words for path, angle in angles.items() if (words := angle_slip(abs(angle)))}
    turned = sum(angle != 0 for angle in angles.values())
    if len(slips) >= MIN_TABLE_SLIPS and len(slips) > turned / 2:
        path, words = next(iter(slips.items()))
        yield Doubt("axes", f"{len(slips)} of {turned} angles of the table (theta, alpha) are quarter turns in the other unit, "
                    f"as {path.removeprefix('axes.')}: {angles[path]:.5g} rad, {words}", "write their unit: -90 deg",
                    figure=float(len(slips)))
    else:
        for path, words in slips.items():
            yield Doubt(path, f"{angles[path]:.5g} rad ({np.degrees(angles[path]):.5g} degrees), {words}",
                        "write its unit: -90 deg", figure=angles[path])
    for axis in sheet.axes:
        # No axis of a robot travels so little: its limits are in another unit.
        if axis.upper - axis.lower < np.radians(10):
            yield Doubt(f"axes.{axis.name}", f"travels {np.degrees(axis.upper - axis.lower):.3g} degrees",
                        "check the unit of lower and upper", figure=axis.upper - axis.lower)
        for key in ("a", "d"):
            # No arm has a link of five metres: the table is in millimetres.
            if (length := abs(float(getattr(axis, key)))) > 5.0:
                yield Doubt(f"axes.{axis.name}.{key}", f"{length:.4g} m, longer than arms of robots are",
                            "check its unit (a number without one is in m)", figure=length)


def _question_reducers(sheet: RobotDatasheet) -> Iterator[Doubt]:
    """Yield doubts about torsion, bending and damping of each reducer, beside the others and by themselves."""
    rows = {name: {"torsion": float(part.torsion[0]), "bending": float(part.bending or 0.0)}
            for name, part in sheet.catalogue.items()}
    for name, row in rows.items():
        path, said = f"catalogue.{name}", set[str]()
        for key, value in row.items():
            others = [other[key] for label, other in rows.items() if label != name]
            factor = max(min(others) / value, value / max(others)) if others else 1.0
            if factor > MAX_REDUCER_RATIO:
                said.add(key)
                yield Doubt(f"{path}.{key}", f"{value:.4g} N m/rad, {factor:.2g} times outside those of the other reducers",
                            "check its unit (10^4 N m/rad is 1e4)", figure=factor)
        ratio = row["bending"] / row["torsion"]
        if not said and not MIN_BENDING_TO_TORSION <= ratio <= MAX_BENDING_TO_TORSION:
            # Of two numbers that contradict each other, the torsion is doubted where it is no reducer's.
            key = ("bending" if ratio < MIN_BENDING_TO_TORSION or MIN_REDUCER_TORSION <= row["torsion"] <= MAX_REDUCER_TORSION
                   else "torsion")
            yield Doubt(f"{path}.{key}", f"bending of {row['bending']:.4g} beside a torsion of {row['torsion']:.4g} N m/rad is "
                        f"{ratio:.2g} times as much, {MIN_BENDING_TO_TORSION:g}-{MAX_BENDING_TO_TORSION:g} is usual",
                        "check the unit of both",
                        figure=ratio)
        elif not said and not MIN_REDUCER_TORSION <= row["torsion"] <= MAX_REDUCER_TORSION:
            yield Doubt(f"{path}.torsion", f"{row['torsion']:.4g} N m/rad, of no robot's reducer", "check its unit",
                        figure=row["torsion"])
        moment_ratio = 2 * np.pi * 10 * float(sheet.catalogue[name].damping) / row["torsion"]
        others = [float(part.damping) / rows[label]["torsion"] for label, part in sheet.catalogue.items()
                  if label != name and part.damping]
        damping_time = float(sheet.catalogue[name].damping) / row["torsion"]
        factor = max(min(others) / damping_time, damping_time / max(others)) if others and damping_time else 1.0
        if factor > MAX_DAMPING_TIME_RATIO and "torsion" not in said:
            yield Doubt(f"{path}.damping",
                        f"{sheet.catalogue[name].damping:.4g} N m s/rad: over its torsion {factor:.2g} times "
                        "apart from the other reducers", "check its unit", figure=factor)
        elif moment_ratio > MAX_DAMPER_TO_SPRING_MOMENT and "torsion" not in said:
            yield Doubt(f"{path}.damping",
                        f"{sheet.catalogue[name].damping:.4g} N m s/rad: at 10 Hz {moment_ratio:.2g} times the "
                        "moment of the spring", "check its unit", figure=moment_ratio)
