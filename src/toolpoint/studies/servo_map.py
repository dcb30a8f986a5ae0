"""Servo loops over the workspace: margins, bandwidth and circular deviation at every pose, the structure in the loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.drives import Servo, Structure, circular_test, loops, simulate
from toolpoint.drives.controller.loops import LoopLevel, bandwidth
from toolpoint.drives.program.command import circle
from toolpoint.machine.assemble import assemble
from toolpoint.machine.model import Machine
from toolpoint.vibration import eigen

_LINES = 800


@dataclass(frozen=True, eq=False)
class ServoMap:
    """Position loops at many poses.

    poses : the poses; axes : names of the drives' axes; gain_margin (dB), phase_margin (deg), bandwidth (Hz, -3 dB) :
    (n_poses, n_axes) of the position loop; velocity_gain_margin (dB), velocity_phase_margin (deg) : of the velocity loop;
    circular_deviation : (n_poses,) deviation G of a circle at the tool point, m, not-a-number where none was run;
    stable : (n_poses,); failures : pose index to reason; failed poses hold not-a-number.
    """

    poses: tuple[Mapping[str, float], ...]
    axes: tuple[str, ...]
    gain_margin: FloatArray
    phase_margin: FloatArray
    bandwidth: FloatArray
    velocity_gain_margin: FloatArray
    velocity_phase_margin: FloatArray
    circular_deviation: FloatArray
    stable: np.ndarray
    failures: Mapping[int, str] = field(default_factory=dict)

    def worst(self) -> tuple[int, str]:
        """Return pose index and axis with the smallest phase margin of the velocity loop."""
        at = np.unravel_index(int(np.nanargmin(self.velocity_phase_margin)), self.velocity_phase_margin.shape)
        return int(at[0]), self.axes[int(at[1])]

    def __repr__(self) -> str:
        return (f"ServoMap({len(self.poses)} poses, axes {', '.join(self.axes)}, {int(self.stable.sum())} stable, "
                f"{len(self.failures)} failed)")


def structure_at(machine: Machine, pose: Mapping[str, float] | None, ends: Mapping[str, str], tools: Mapping[str, str]
                 ) -> Structure:
    """Return the machine's modes at a pose as the structure that the drives push against; see `servo_map`."""
    labels = list(dict.fromkeys([*ends.values(), *tools.values()]))
    modes = eigen.undamped(assemble(machine, pose, labels, modal_damping=False))
    if machine.description.damping_ratio is not None:
        modes = modes.with_damping(machine.description.damping_ratio)
    return Structure.from_modes(modes, dict(ends), dict(tools))


def circle_deviation(servo: Servo, radius: float, feed: float) -> float:
    """Return the circular deviation G (ISO 230-4, m) of the second turn at the tool point, first two axes; m and m/s.

    The command starts at the full feed, so the first turn is not judged; a third axis and more stand still.
    """
    turn = 2 * np.pi * radius / feed
    given = circle(radius, feed, servo.controllers[0].position.sample_time, 2 * turn, (-radius, 0.0))
    axes = len(servo.controllers)
    if axes < 2:
        fail("axes", f"{axes}", "must be at least two for a circle")
    pad = lambda v: np.pad(v, ((0, 0), (0, axes - 2)))
    command = replace(given, position=pad(given.position), velocity=pad(given.velocity), acceleration=pad(given.acceleration))
    result = simulate(servo, command, every=servo.counts[1])
    points = result.output("tool")[result.time > turn][:, :2] + np.array([radius, 0.0])
    return circular_test(points, radius).deviation


def servo_map(
    machine: Machine, poses: Sequence[Mapping[str, float]], ends: Mapping[str, str], tools: Mapping[str, str],
    servo_of: Callable[[Structure], Servo], test_circle: tuple[float, float] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ServoMap:
    """Return the margins of a servo whose structure is the machine at each pose.

    Parameters
    ----------
    machine : Machine
        With its driven directions free (a vanishing drive stiffness), so that the drives carry them.
    poses : sequence of mappings of axis name to m or rad
    ends : mapping of a drive's boundary (``x.table``) to the machine's Dof (``saddle:+x``)
    tools : mapping of axis name to the Dof of the tool point in its direction
    servo_of : callable
        Takes the Structure of a pose, returns the Servo (drives and control on that structure).
    test_circle : (float, float), optional
        Radius (m) and feed (m/s) of a circle simulated at every stable pose; the structure stays that of the pose.
    progress : callable, optional
        Called with the number of poses done and their number.
    """
    every = tuple(dict(pose) for pose in poses)
    if not every:
        fail("poses", "none", "must be at least one")
    rows: list[dict[str, list[float]] | None] = []
    failures: dict[int, str] = {}
    names: tuple[str, ...] = ()
    stable, deviation = np.zeros(len(every), bool), np.full(len(every), np.nan)
    for i, pose in enumerate(every):
        try:
            servo = servo_of(structure_at(machine, pose, ends, tools))
            found = loops(servo)
            names = tuple(found.position.closed.inputs)
            stable[i] = found.stable
            rows.append(_figures(found.position, found.velocity, len(names)))
            if test_circle is not None and found.stable:
                deviation[i] = circle_deviation(servo, *test_circle)
        except ToolpointError as error:
            failures[i] = str(error)
            if len(rows) == i:
                rows.append(None)
        if progress is not None:
            progress(i + 1, len(every))
    if not names:
        fail("poses", "every pose failed", failures[0])
    lost = {key: [np.nan] * len(names) for key in ("gain", "phase", "width", "velocity_gain", "velocity_phase")}
    table = {key: np.array([(row or lost)[key] for row in rows]) for key in lost}
    return ServoMap(every, names, table["gain"], table["phase"], table["width"], table["velocity_gain"],
                    table["velocity_phase"], deviation, stable, failures)


def _figures(position: LoopLevel, velocity: LoopLevel, axes: int) -> dict[str, list[float]]:
    outer, inner = [position.margins(k, _LINES) for k in range(axes)], [velocity.margins(k, _LINES) for k in range(axes)]
    top = 0.5 / float(position.closed.sample_time or 1.0)
    f = np.geomspace(1e-4, 0.999, _LINES) * top
    widths = [bandwidth(f, position.closed_response(f, k)) for k in range(axes)]
    return {"gain": [m.gain_db for m in outer], "phase": [m.phase for m in outer], "width": widths,
            "velocity_gain": [m.gain_db for m in inner], "velocity_phase": [m.phase for m in inner]}
