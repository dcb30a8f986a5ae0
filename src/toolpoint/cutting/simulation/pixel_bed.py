r"""PixelBed: material as a grid of pixels that the edges remove, force from the pixels each edge meets (dexel option)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, FloatArray, count, fail, floats, positive
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.force.laws import ForceLaw, law_of


@dataclass(eq=False)
class PixelBed:
    """Work material as layers of square pixels in the plane of the cut, equal layers along the depth from the tip up.

    Parameters
    ----------
    origin : 2 floats
        Lower left corner, m.
    pixel : float
        Side of a pixel, m; the chip thickness should span several.
    material : (n_layers, n_x, n_y) bool
        True where there is material. The array is changed by cutting: this is the one object here with a state.
    """

    origin: tuple[float, float]
    pixel: float
    material: Array

    @classmethod
    def block(cls, corner_min: tuple[float, float], corner_max: tuple[float, float], pixel: float, *,
              layers: int = 1) -> PixelBed:
        """Return a full rectangular block from `corner_min` to `corner_max`, m; a helical edge needs some layers."""
        step = positive("pixel", pixel)
        size = [int(np.ceil((b - a) / step)) for a, b in zip(corner_min, corner_max)]
        size = [count("layers", layers), *size]
        # A bed of that many pixels takes gigabytes: the remedy is a coarser one, not a machine that swaps.
        if min(size) < 1 or math.prod(size) > 4e8:
            fail("pixel", " x ".join(map(str, size)) + " pixels", "must be 1 to 4e8 pixels",
                 remedy="take a larger pixel or a smaller block")
        return cls((float(corner_min[0]), float(corner_min[1])), step, np.ones(size, bool))

    def area(self) -> float:
        """Return the area of the material left, mean of all layers, m^2."""
        return float(self.material.sum()) * self.pixel**2 / self.material.shape[0]

    def swept(self, layer: int, centre: FloatArray, angle: float, *, turn: float, radius: float) -> float:
        """Remove from a layer what an edge sweeps from `angle` - `turn` to `angle`; return the area removed, m^2.

        `centre` is the cutter's centre; angles are clockwise from y. The sector reaches from the centre to `radius`.
        """
        # Corners of the sector for its bounding box alone: a step is a few degrees, so five points of its arc leave out less
        # than a pixel.
        around = np.linspace(angle - turn, angle, 5)
        corner = np.array([[0.0, 0.0], *([radius * np.sin(a), radius * np.cos(a)] for a in around)])
        place = (corner + centre - self.origin) / self.pixel
        index_min = np.maximum(np.floor(place.min(0)).astype(int), 0)
        index_max = np.minimum(np.ceil(place.max(0)).astype(int) + 1, self.material.shape[1:])
        if (index_max <= index_min).any():
            return 0.0
        part = self.material[layer, index_min[0]:index_max[0], index_min[1]:index_max[1]]
        if not part.any():
            return 0.0
        x = self.origin[0] + (np.arange(index_min[0], index_max[0]) + 0.5) * self.pixel - centre[0]
        y = self.origin[1] + (np.arange(index_min[1], index_max[1]) + 0.5) * self.pixel - centre[1]
        distance_squared = x[:, None] ** 2 + y[None, :] ** 2
        angle_behind = (angle - np.arctan2(x[:, None], y[None, :])) % (2 * np.pi)
        hit = part & (distance_squared <= radius**2) & (angle_behind <= turn)
        part &= ~hit
        return float(hit.sum()) * self.pixel**2


@dataclass(frozen=True, eq=False)
class PixelCut:
    """Forces of a cut through a pixel bed.

    Parameters
    ----------
    time : (n,) floats
        s.
    force : (n, 3) floats
        Force on the tool, N.
    chip : (n,) floats
        Mean chip thickness of the edge in cut over the step, m.
    removed : (n,) floats
        Volume removed in the step, m^3.
    """

    time: FloatArray
    force: FloatArray
    chip: FloatArray
    removed: FloatArray


def cut(problem: MillingProblem, bed: PixelBed, start: tuple[float, float], *, speed: float, depth: float,
        revolutions: float, steps: int = 360, law: ForceLaw | None = None) -> PixelCut:
    r"""Feed a rigid cylindrical cutter along +x through the bed and return its forces.

    Over a step an edge removes the area A of pixels while it turns by :math:`\Delta\phi`; its mean chip thickness is
    :math:`h = A/(R \Delta\phi)` and the force law gives the force. The engagement follows from the material itself, so
    any geometry of the bed can be cut; the bed is changed. Every layer of the bed is cut by the edges at its own height,
    where a helical edge lags and a tilted cutter has its own radius.

    Parameters
    ----------
    problem : MillingProblem
        Tool (run-out, unequal pitch and helix included, sharp corner), coefficients and feed; its engagement is not used.
    bed : PixelBed
    start : 2 floats
        Centre of the cutter at time zero, m.
    speed : float
        rev/min.
    depth, revolutions, steps
        m; number of revolutions; steps in one.
    """
    positive("speed", speed)
    depth = positive("depth", depth, 1.0)
    count("steps", steps, 16)
    if problem.feed_per_tooth <= 0:
        fail("MillingProblem.feed_per_tooth", "0", "must be above zero", remedy="problem.changed(feed_per_tooth=...)")
    layers, tool = bed.material.shape[0], problem.tool
    if tool.has_helix and layers == 1:
        fail("problem", "a helical tool in a bed of one layer", "needs a bed of some layers",
             remedy="PixelBed.block(..., layers=12)")
    if tool.corner_radius > 0:
        fail("Tool.corner_radius", f"{tool.corner_radius:g} m", "must be 0 in a pixel bed", remedy="rigid_forces knows corners")
    law, n = law or law_of(problem), int(revolutions * steps)
    turn, slice_ = 2 * np.pi / steps, depth / layers
    height = (np.arange(layers) + 0.5) * slice_
    lag, radius = tool.angles(height), tool.edge_radius(height)
    force, chip, removed = np.zeros((n, 3)), np.zeros(n), np.zeros(n)
    feed = problem.feed_per_tooth * tool.teeth
    position = floats("start", start, (2,))
    for k in range(n):
        # At the end of the step: what the edge sweeps is where it has been, and the next step begins there.
        centre = position + np.array([feed * (k + 1) / steps, 0.0])
        for layer, j in np.ndindex(lag.shape):
            angle = float((k + 1) * turn - lag[layer, j])
            area = bed.swept(layer, centre, angle, turn=turn, radius=float(radius[layer, j]))
            if area == 0:
                continue
            h = area / (float(radius[layer, j]) * turn)
            t, m, a = (law.per_length(np.array(h)) * slice_).tolist()
            s, c = np.sin(angle - turn / 2), np.cos(angle - turn / 2)
            force[k] += [-(t * c + m * s), t * s - m * c, a]
            chip[k] = max(chip[k], h)
            removed[k] += area * slice_
    return PixelCut(np.arange(1, n + 1) * 60 / speed / steps, force, chip, removed)
