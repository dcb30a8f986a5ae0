r"""Gear ratios of a robot from its datasheet, the torque they give, and the reducers chosen for them.

The motor's full speed makes the axis' largest one: :math:`R_t = n_{max} / \omega_{max}`; without the stage before it the
reducer has :math:`R_r = R_t / R_m`, and the axis :math:`T_t = R_t T_s` of the stall torque. Compare: load moments of the
datasheet.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import fail
from toolpoint.joints import Reducer, choose_reducer, reducer_of, reflect_inertia
from toolpoint.machine.robot.datasheet import RobotAxis, RobotDatasheet

# Decimals that sources print: a computed value that rounds to the printed one agrees with it.
_PRINTED_DECIMALS = {"total_ratio": 0, "reducer_ratio": 0, "torque": 0}


@dataclass(frozen=True)
class AxisGearing:
    """Gearing of an axis as the formulas give it.

    torque : N m at stall; moment : the datasheet's load moment, N m; reducer : its name, the nearest in ratio or the named one;
    reflected_inertia : kg m^2, of the rotor through the chosen ratios, None where the rotor is not known.
    """

    axis: str
    total_ratio: float
    reducer_ratio: float
    torque: float
    moment: float | None
    reducer: str
    nearest_reducer: str
    reflected_inertia: float | None
    disagreements: tuple[str, ...]

    @property
    def deviation(self) -> float | None:
        """Torque over load moment less one; None where there is no moment."""
        return None if self.moment is None else self.torque / self.moment - 1


def compute_gearing(sheet: RobotDatasheet) -> tuple[AxisGearing, ...]:
    """Return ratios, torques and reducers of all axes, each with what its source prints otherwise."""
    return tuple(_gearing(sheet, axis) for axis in sheet.axes)


def _gearing(sheet: RobotDatasheet, axis: RobotAxis) -> AxisGearing:
    if axis.motor not in sheet.motors:
        fail(f"axes.{axis.name}.motor", repr(axis.motor), f"must be of {', '.join(sheet.motors)}")
    motor = sheet.motors[axis.motor]
    total = motor.speed * np.pi / 30 / axis.largest_speed
    values = {"total_ratio": total, "reducer_ratio": total / axis.stage, "torque": total * motor.stall_torque}
    sizes = {} if axis.size is None else {"smallest_diameter": 0.97 * axis.size, "largest_diameter": 1.03 * axis.size}
    nearest_reducer = choose_reducer(sheet.catalogue, values["reducer_ratio"], **sizes)
    reducer = axis.reducer or nearest_reducer
    ratio = reducer_of(sheet.catalogue, reducer).ratio * axis.stage
    lines = []
    for name, digits in _PRINTED_DECIMALS.items():
        printed = getattr(axis.printed, name)
        # Half of the last printed digit is what a table can hide; more is another number.
        if printed is not None and abs(values[name] - printed) > 0.5 * 10.0**-digits + 1e-9:
            lines.append(f"{name.replace('_', ' ')} printed {printed:g}, follows {values[name]:.4g}")
    return AxisGearing(axis.name, total, values["reducer_ratio"], values["torque"], axis.load_moment, reducer, nearest_reducer,
                       None if motor.inertia is None else reflect_inertia(motor.inertia, ratio), tuple(lines))


def swap_reducer(sheet: RobotDatasheet, axis: str, reducer: str) -> RobotDatasheet:
    """Return the datasheet with another reducer of its catalogue on an axis."""
    reducer_of(sheet.catalogue, reducer)
    if axis not in [part.name for part in sheet.axes]:
        fail("axis", repr(axis), f"must be of {', '.join(part.name for part in sheet.axes)}")
    return replace(sheet, axes=tuple(replace(part, reducer=reducer) if part.name == axis else part for part in sheet.axes))


def reducers_of(sheet: RobotDatasheet) -> Mapping[str, Reducer]:
    """Return the reducer of every axis by the axis' name."""
    return {row.axis: reducer_of(sheet.catalogue, row.reducer) for row in compute_gearing(sheet)}
