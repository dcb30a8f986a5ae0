"""Windows of a body pooled before modes are asked for: what no single window sees stands out of their common motion.

Singular values of many windows find a motion above the fourth root of their number; the weighted mean over a body finds it
above the square root. Windows that no body holds are pooled by tiles of the picture.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.points import BLIND
from toolpoint.vision.displacement.result import DisplacementField

# Tiles each way over the picture; windows from which a body may turn, and stretch.
TILES, TURNING, STRETCHING = 3, 3, 12


def pool_windows(field: DisplacementField, bodies: Mapping[str, Region]) -> FloatArray:
    """Return the motion of bodies and tiles (frames, m), uncorrelated channels in units of their noise."""
    channels = []
    values, sigma, window, direction = field.measured()
    for at in _groups(field, bodies):
        used = np.isin(window, at)
        places = field.windows.centres[window[used]]
        design = _terms(places, direction[used], at.size) / sigma[used][:, None]
        gram = design.T @ design
        size, turn = np.linalg.eigh(gram)
        known = size > 1e-6 * size.max()
        whiten = turn[:, known] / np.sqrt(size[known])
        channels.append((values[:, used] / sigma[used]) @ design @ whiten)
    return np.concatenate(channels, axis=1) if channels else np.zeros((len(values), 0))


def _groups(field: DisplacementField, bodies: Mapping[str, Region]) -> list[IndexArray]:
    """Return the windows of every body, and of every tile of the picture those of none; a later body stands before others."""
    seen, centres = field.windows.sight > BLIND, field.windows.centres
    owner = np.full(len(centres), -1)
    for k, region in enumerate(bodies.values()):
        owner[region.holds(centres)] = k
    span = centres.max(axis=0) + 1
    tile = (centres * TILES / span).astype(int)
    free = np.where(owner < 0, len(bodies) + tile[:, 0] * TILES + tile[:, 1], owner)
    return [np.flatnonzero(seen & (free == k)) for k in np.unique(free[seen])]


def _terms(places: FloatArray, direction: FloatArray, windows: int) -> FloatArray:
    """Return the columns of a translation, and of a turn and strains where enough windows tell them."""
    columns = [direction[:, 0], direction[:, 1]]
    middle = places.mean(axis=0)
    a, b = ((places - middle) / max(float(np.ptp(places, axis=0).max()) / 2, 1.0)).T
    if windows >= TURNING:
        columns.append(direction[:, 1] * a - direction[:, 0] * b)
    if windows >= STRETCHING:
        columns += [direction[:, 0] * a, direction[:, 1] * b, direction[:, 0] * b + direction[:, 1] * a]
    return np.stack(columns, axis=1)
