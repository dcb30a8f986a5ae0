"""Setup of a program from what a person gives: the cut with nothing stood in for, the stock, limits, tools by number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.cutting.build import find_material
from toolpoint.cutting.description import PARAMETERS, CuttingDescription
from toolpoint.drives.description import DriveDescription
from toolpoint.drives.program.jerk_profile import JerkLimits
from toolpoint.machine import Machine
from toolpoint.material_removal import Stock
from toolpoint.studies.machining.setup import MachiningSetup

FILE_LENGTH_UNIT = 1e-3  # m: STL files do not say their unit; mm is usual


def cuts_of_options(machine: Machine | None, values: Mapping[str, Any]) -> CuttingDescription:
    """Return the cut of a machine file with the given values in place, or that of the values alone.

    Nothing is taken from an example: raises ToolpointError for a diameter, a number of teeth or coefficients that are
    missing, and for a material that the table does not know.

    Examples
    --------
    >>> cuts_of_options(None, {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8}).tool.teeth
    4
    """
    if values.get("material"):
        find_material(values["material"])
    described = None if machine is None else machine.description.cutting
    if described is not None:
        return described.with_values(values)
    needed = ["diameter", "teeth", *([] if values.get("material") else ["tangential", "normal"])]
    absent = [PARAMETERS[key].option for key in needed if key not in values]
    if absent:
        raise ToolpointError("cut: " + ", ".join(f"`{name}`" for name in absent) + " missing; give them, or a machine "
                                                                                    "file with "
                             "a section 'cutting' (coefficients also by `material`)")
    return CuttingDescription.of(diameter=values["diameter"], teeth=values["teeth"]).with_values(values)


def stock_of(kind: str, numbers: tuple[float, ...] = (), triangles: FloatArray | None = None) -> Stock:
    """Return a stock: ``box`` of two corners (6 lengths), ``cylinder`` of diameter, bottom, top and, where not at zero, its
    centre (3 or 5 lengths), m; or the mesh of triangles of a file, mm.

    Examples
    --------
    >>> stock_of("cylinder", (0.04, -0.01, 0.0)).words
    'cylinder 40 x 40 x 10 mm, top at z 0 mm'
    """
    if triangles is not None:
        return Stock.mesh(FILE_LENGTH_UNIT * triangles)
    if kind == "box" and len(numbers) == 6:
        return Stock.box(np.array(numbers[:3]), np.array(numbers[3:]))
    if kind == "cylinder" and len(numbers) in (3, 5):
        x, y = numbers[3:] if len(numbers) == 5 else (0.0, 0.0)
        return Stock.cylinder(numbers[0], numbers[1], numbers[2], centre=(x, y))
    fail("stock", f"{kind} of {len(numbers)} lengths", "must be box=X1,Y1,Z1,X2,Y2,Z2 or "
                                                       "cylinder=DIAMETER,BOTTOM,TOP[,X,Y] in mm")


def describe_machining(stock: Stock, cut: CuttingDescription, **values: Any) -> MachiningSetup:
    """Return the setup of a program, with the values of `MachiningSetup`; the cut's own arc plays no part.

    part : triangles of a file, mm.

    Examples
    --------
    >>> cut = cuts_of_options(None, {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8})
    >>> describe_machining(stock_of("cylinder", (0.04, -0.01, 0.0)), cut, speed=9000.0).shape_of(1).kind
    'cylindrical'
    """
    faces = values.pop("part", None)
    values |= {} if faces is None else {"part": FILE_LENGTH_UNIT * faces}
    tools = {number: _without_arc(other) for number, other in values.pop("cuts", {}).items()}
    return MachiningSetup(stock, _without_arc(cut), tools, **values)


def limits_of_drives(drives: DriveDescription) -> JerkLimits:
    """Return the limits of the set points of a drive file.

    Examples
    --------
    Give them as `planned` of the setup: ``describe_machining(stock, cut, planned=limits_of_drives(drives))``.

    >>> from toolpoint.drives.description import LimitsDescription
    >>> LimitsDescription(speed=0.5, acceleration=3.0, jerk=100.0).speed
    0.5
    """
    return JerkLimits(drives.limits.speed, drives.limits.acceleration, drives.limits.jerk)


def _without_arc(cut: CuttingDescription) -> CuttingDescription:
    return cut.replaced(immersion=None, entry=None, exit=None, direction="slot")
