"""Simulation with the nut moving along its screw: the exact step interpolated between positions of the nut."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, count, fail, floats
from toolpoint._deprecation import rename_argument
from toolpoint.drives.axis.outputs import OUTPUTS
from toolpoint.drives.controller.loop_stability import check_stable
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.program.command import Command
from toolpoint.drives.simulation.arrays import StepArrays
from toolpoint.drives.simulation.exact_step import StepMatrices, step_matrices
from toolpoint.drives.simulation.simulate import ServoResult, prepare

_INTERPOLATED_FIELDS = ("core", "inputs", "shift", "jump", "gain", "direct", "load_direct")


@dataclass(frozen=True, eq=False)
class _Grid:
    """Matrices of a reference, and for every moving axis its positions (k,) and the matrices' changes from the reference."""

    reference: StepMatrices
    positions: tuple[FloatArray | None, ...]
    changes: tuple[dict[str, FloatArray], ...]

    def at(self, nut: FloatArray) -> StepArrays:
        """Return the matrices at nut positions: linear between the grid's positions, the axes' changes added up."""
        parts = {name: np.array(getattr(self.reference, name)) for name in _INTERPOLATED_FIELDS}
        for where, grid, change in zip(nut, self.positions, self.changes, strict=True):
            if grid is None:
                continue
            k = int(np.clip(np.searchsorted(grid, where) - 1, 0, grid.size - 2))
            share = float(np.clip((where - grid[k]) / (grid[k + 1] - grid[k]), 0.0, 1.0))
            for name in _INTERPOLATED_FIELDS:
                parts[name] += (1 - share) * change[name][k] + share * change[name][k + 1]
        return StepArrays(**{**self.reference.arrays._asdict(), **parts})


@rename_argument("every", "record_interval", since="0.2")
def simulate_moving_nut(
    servo_at: Callable[[Sequence[float]], Servo], start: Sequence[float], command: Command, *,
    moving: Sequence[bool] | None = None, positions: int = 17, substeps: int = 1, record_interval: int = 1,
    estimate: bool = True,
) -> ServoResult:
    """Return the histories of a servo whose screws change with the position of their nuts.

    Quasi-static: between two position samples the plant is that of the nut's place in their middle, where the matrices of
    the exact step are linear between `positions` places along the travelled way. With several axes their changes add up:
    exact for axes that share no structure, to second order otherwise. Momentum that the moving lumps would carry is left out.

    Parameters
    ----------
    servo_at : callable
        Takes the nut positions of all axes (m), returns the Servo there; its states keep their meaning, its control is
        that of the first.
    start : (n_axes,) floats
        Nut positions (m from the front bearing) where the tables stand at zero; they grow with the tables' travel.
    moving : (n_axes,) bools, optional
        Which nuts move; all where left out.
    positions : int
        Grid positions along the way of every axis.
    estimate : bool
        Run again with half as many positions, and say in the notes how much the outputs change: the interpolation's error
        is below that (it falls 2.3 times and more with each halving).

    Raises
    ------
    ToolpointError
        Where a nut would leave its screw, or the loops are unstable at one of the positions.

    Examples
    --------
    An axis whose plant is the same everywhere moves as a fixed one, whatever the number of positions:

    >>> from toolpoint.drives import (Controller, DriveAxis, PositionLoop, TorqueMotor, VelocityLoop, build_plant, rigid_axis)
    >>> plant = build_plant([DriveAxis("X", TorqueMotor(), rigid_axis(0.005, 2e-3))])
    >>> servo = Servo(plant, (Controller(PositionLoop(20.0), VelocityLoop(1.0, 0.05), lead=2e-3),))
    >>> command = Command(np.linspace(0.0, 1e-3, 41)[:, None], 1e-3)
    >>> result = simulate_moving_nut(lambda nut_positions: servo, [0.1], command, positions=3)
    >>> result.notes[0].split(";")[1].strip()
    'with 2 the outputs change by at most 0 nm'
    """
    count("positions", positions, 3)
    nut = floats("start", start, (command.position.shape[1],))
    is_moving = [True] * nut.size if moving is None else list(moving)
    result = _run(servo_at, nut, command, is_moving, positions, substeps, record_interval)
    if not estimate:
        return result
    coarse = _run(servo_at, nut, command, is_moving, (positions + 1) // 2, substeps, record_interval)
    names = [OUTPUTS.index(name) for name in ("scale", "table", "tool")]
    change = float(np.abs(result.outputs - coarse.outputs)[:, :, names].max())
    note = (f"screws follow their nuts in {positions} positions; with {(positions + 1) // 2} the outputs change by at most "
            f"{1e9 * change:.3g} nm; the error of interpolation is below that")
    return replace(result, notes=(*result.notes, note))


def _run(servo_at: Callable[[Sequence[float]], Servo], nut: FloatArray, command: Command, is_moving: list[bool], positions: int,
         substeps: int, record_interval: int) -> ServoResult:
    from toolpoint.drives.simulation.kernel import run

    servo = servo_at(nut.tolist())
    step = servo.controllers[0].sample_times.current / substeps
    grid = _grid(servo_at, servo, nut, command, is_moving, positions, step)
    ready = prepare(servo, command, substeps=substeps, record_interval=record_interval, matrices=grid.reference)
    chunk, failed = servo.counts.position * substeps, 0
    table = np.array([servo.plant.output(i, "table") for i in range(nut.size)])
    # Behind its last sample a command stands still.
    rates = np.vstack([command.velocity, np.zeros((1, nut.size))])
    for first in range(0, ready.steps, chunk):
        # Matrices hold for a whole sample: those of its middle leave an error of second order in the travel.
        half_travel = 0.5 * command.sample_time * rates[min(first // chunk, len(rates) - 1)]
        matrices = grid.at(nut + table @ grid.reference.outward(ready.motion.coordinates) + half_travel)
        unconverged = run(first, min(chunk, ready.steps - first), matrices, ready.laws, ready.control, ready.motion,
                          ready.histories)
        if unconverged < 0:
            return ready.result(unconverged)
        failed += unconverged
    return ready.result(failed)


def _grid(servo_at: Callable[[Sequence[float]], Servo], servo: Servo, nut: FloatArray, command: Command, is_moving: list[bool],
          positions: int, step: float) -> _Grid:
    reference = step_matrices(servo.plant, step, dense=True)
    travel_min, travel_max = command.position.min(axis=0), command.position.max(axis=0)
    # Overshoot and following error lie beside the commanded way.
    margin = 0.02 * (travel_max - travel_min) + 1e-4
    places: list[FloatArray | None] = []
    changes: list[dict[str, FloatArray]] = []
    for axis, moving in enumerate(is_moving):
        if not moving:
            places.append(None)
            changes.append({})
            continue
        along = np.linspace(nut[axis] + travel_min[axis] - margin[axis], nut[axis] + travel_max[axis] + margin[axis], positions)
        if along[0] <= 0:
            fail("start", f"nut of axis {axis} would reach {along[0]:g} m", "must stay above zero",
                 remedy="start further from the bearing")
        steps = []
        for where in along:
            servo_there = servo_at([*nut[:axis], float(where), *nut[axis + 1:]])
            # A loop that is stable at one end of the way may not be at the other, where the screw is longer.
            check_stable(servo_there)
            steps.append(step_matrices(servo_there.plant, step, dense=True))
        places.append(along)
        # Differences to one reference add up over the axes; whole matrices would not.
        changes.append({name: np.array([getattr(m, name) - getattr(reference, name) for m in steps])
                        for name in _INTERPOLATED_FIELDS})
    return _Grid(reference, tuple(places), tuple(changes))
