"""Doubts about a robot's datasheet: reducers that do not suit each other, angles of its table typed in the other unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine.robot.datasheet import RobotDatasheet
from toolpoint.studies.machines.check.robot_doubts import question_whole_robot
from toolpoint.studies.machines.check.size_doubts import angle_slip

BENDS_LEAST, BENDS_MOST = 0.3, 200.0  # times a reducer's torsion, that its bending is
FROM_OTHERS = 100.0  # times below the least or above the largest of the other reducers
WHOLE_TABLE = 3  # angles of another unit from which it is the table's
DAMPERS_APART = 60.0  # the same of damping over torsion: reducers of a robot differ by a few times
LOST = 2.0  # damper's moment over the spring's at 10 Hz
SOFTEST, STIFFEST = 100.0, 5e7  # N m/rad of a reducer's torsion: wrists of some kg, bases of some t


def question_datasheet(sheet: RobotDatasheet) -> tuple[Doubt, ...]:
    """Return doubts about the numbers of a datasheet that are possible and hardly meant."""
    parts = (*_table(sheet), *_reducers(sheet))
    # What a part explains is not said of the whole again.
    return parts or tuple(question_whole_robot(sheet))


def _table(sheet: RobotDatasheet) -> Iterator[Doubt]:
    angles = {f"axes.{axis.name}.{key}": float(getattr(axis, key)) for axis in sheet.axes for key in ("alpha", "theta")}
    slips = {path: words for path, angle in angles.items() if (words := angle_slip(abs(angle)))}
    turned = sum(angle != 0 for angle in angles.values())
    if len(slips) >= WHOLE_TABLE and len(slips) > turned / 2:
        path, words = next(iter(slips.items()))
        yield Doubt("axes", f"{len(slips)} of {turned} angles of the table (theta, alpha) are quarter turns in the other unit, "
                    f"as {path.removeprefix('axes.')}: {angles[path]:.5g} rad, {words}", "write their unit: -90 deg",
                    figure=float(len(slips)))
    else:
        for path, words in slips.items():
            yield Doubt(path, f"{angles[path]:.5g} rad ({np.degrees(angles[path]):.5g} degrees), {words}",
                        "write its unit: -90 deg", figure=angles[path])
    for axis in sheet.axes:
        if axis.upper - axis.lower < np.radians(10):
            yield Doubt(f"axes.{axis.name}", f"travels {np.degrees(axis.upper - axis.lower):.3g} degrees",
                        "check the unit of lower and upper", figure=axis.upper - axis.lower)
        for key in ("a", "d"):
            if (length := abs(float(getattr(axis, key)))) > 5.0:
                yield Doubt(f"axes.{axis.name}.{key}", f"{length:.4g} m, longer than arms of robots are",
                            "check its unit (a number without one is in m)", figure=length)


def _reducers(sheet: RobotDatasheet) -> Iterator[Doubt]:
    rows = {name: {"torsion": float(part.torsion[0]), "bending": float(part.bending or 0.0)}
            for name, part in sheet.catalogue.items()}
    for name, row in rows.items():
        path, said = f"catalogue.{name}", set[str]()
        for key, value in row.items():
            others = [other[key] for label, other in rows.items() if label != name]
            away = max(min(others) / value, value / max(others)) if others else 1.0
            if away > FROM_OTHERS:
                said.add(key)
                yield Doubt(f"{path}.{key}", f"{value:.4g} N m/rad, {away:.2g} times outside those of the other reducers",
                            "check its unit (10^4 N m/rad is 1e4)", figure=away)
        ratio = row["bending"] / row["torsion"]
        if not said and not BENDS_LEAST <= ratio <= BENDS_MOST:
            key = "bending" if ratio < BENDS_LEAST or SOFTEST <= row["torsion"] <= STIFFEST else "torsion"
            yield Doubt(f"{path}.{key}", f"bending of {row['bending']:.4g} beside a torsion of {row['torsion']:.4g} N m/rad is "
                        f"{ratio:.2g} times as much, {BENDS_LEAST:g}-{BENDS_MOST:g} is usual", "check the unit of both",
                        figure=ratio)
        elif not said and not SOFTEST <= row["torsion"] <= STIFFEST:
            yield Doubt(f"{path}.torsion", f"{row['torsion']:.4g} N m/rad, of no robot's reducer", "check its unit",
                        figure=row["torsion"])
        share = 2 * np.pi * 10 * float(sheet.catalogue[name].damping) / row["torsion"]
        others = [float(part.damping) / rows[label]["torsion"] for label, part in sheet.catalogue.items()
                  if label != name and part.damping]
        here = float(sheet.catalogue[name].damping) / row["torsion"]
        away = max(min(others) / here, here / max(others)) if others and here else 1.0
        if away > DAMPERS_APART and "torsion" not in said:
            yield Doubt(f"{path}.damping", f"{sheet.catalogue[name].damping:.4g} N m s/rad: over its torsion {away:.2g} times "
                        "apart from the other reducers", "check its unit", figure=away)
        elif share > LOST and "torsion" not in said:
            yield Doubt(f"{path}.damping", f"{sheet.catalogue[name].damping:.4g} N m s/rad: at 10 Hz {share:.2g} times the "
                        "moment of the spring", "check its unit", figure=share)
