"""Power of the spindle over the time of a program, in the parts of shearing and of edges, as it would be recorded."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.drives.program.planner import plan_motion
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.errors.servo_course import lengths_of_places
from toolpoint.studies.machining.loads import CutLoads, place_loads
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup

# Longer programs are taken in wider steps: alignment is a transform of all samples, again at each pace.
MAX_COURSE_SAMPLES = 400_000
_HALF_FEED = 0.5  # of the feed, at which loads are taken again: what stays is of the edges


@dataclass(frozen=True, eq=False)
class SpindleLoad:
    """Load of the spindle at even times, (n,) each: shearing and edge part (W, or N m), speed (rev/min), segment index.

    step : s.
    """

    step: float
    shearing: FloatArray
    edges: FloatArray
    speed: FloatArray
    block: np.ndarray

    @property
    def time(self) -> FloatArray:
        """Times from the start of the program, s."""
        return np.arange(self.block.size) * self.step

    @property
    def total(self) -> FloatArray:
        """Both parts together."""
        return self.shearing + self.edges


def spindle_load(laid: ProgramPath, removed: RemovedMaterial, loads: CutLoads, *, setup: MachiningSetup, step: float,
                 as_torque: bool = False) -> SpindleLoad:
    """Return the load of the spindle every `step` s, at the speed along the path where a planner gives it.

    The power of shearing follows the feed, that of the edges does not.
    """
    half = place_loads(removed, replace(laid, feed=_HALF_FEED * laid.feed), setup)
    edges = np.maximum(2 * half.power - loads.power, 0.0)
    block = laid.moves.block[removed.piece]
    slope = (loads.power - edges) / np.where(laid.feed[block] > 0, laid.feed[block], 1.0)
    place, speed_along, segment = _motion(laid, setup, max(step, float(laid.time.sum()) / MAX_COURSE_SAMPLES))
    length = lengths_of_places(laid, removed)
    shearing = np.interp(place, length, slope, left=0.0, right=0.0) * speed_along
    edge_power = np.where(speed_along > 0, np.interp(place, length, edges, left=0.0, right=0.0), 0.0)
    spindle = laid.speed[segment]
    scale = 30 / (np.pi * np.maximum(spindle, 1e-9)) if as_torque else np.ones(place.size)
    return SpindleLoad(max(step, float(laid.time.sum()) / MAX_COURSE_SAMPLES), shearing * scale, edge_power * scale, spindle,
                       segment)


def _motion(laid: ProgramPath, setup: MachiningSetup, step: float) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Return arc length (m), speed along the path (m/s) and segment at even times."""
    ends = np.cumsum(laid.path.lengths)
    if setup.planned is not None:
        place = plan_motion(laid.path, setup.planned).progress(step, laid.path)
    else:
        finish = np.cumsum(laid.time)
        stop = finish - laid.path.dwell
        knots = np.stack([finish - laid.time, stop], axis=1).reshape(-1)
        lengths = np.stack([ends - laid.path.lengths, ends], axis=1).reshape(-1)
        place = np.interp(np.arange(int(finish[-1] / step) + 1) * step, knots, lengths)
    segment = np.minimum(np.searchsorted(ends, place, side="right"), laid.path.count - 1)
    return place, np.gradient(place, step) if place.size > 1 else np.zeros(place.size), segment
