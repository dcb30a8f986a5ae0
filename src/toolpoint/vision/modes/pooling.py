"""Windows of a body pooled before identification, so that motion below the noise of each window stands out.

Singular values of many windows find a motion above the fourth root of their number; the weighted mean over a body finds it
above the square root. Windows that no body holds are pooled by tiles of the picture.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.points import BLIND_SIGHT
from toolpoint.vision.displacement.result import DisplacementField

# Tiles each way over the picture; windows from which a body may turn, and stretch.
TILES_PER_SIDE, MIN_TURN_WINDOWS, MIN_STRAIN_WINDOWS = 3, 3, 12


def pool_windows(field: DisplacementField, bodies: Mapping[str, Region]) -> FloatArray:
    """Return the motion of bodies and tiles (frames, m), uncorrelated channels in units of their noise."""
    channels = []
    values, sigma, window, direction = field.measured()
    for group in _groups(field, bodies):
        used = np.isin(window, group)
        places = field.windows.centres[window[used]]
        design = _terms(places, direction[used], group.size) / sigma[used][:, None]
        gram = design.T @ design
        eigenvalues, eigenvectors = np.linalg.eigh(gram)
        is_determined = eigenvalues > 1e-6 * eigenvalues.max()
        whiten = eigenvectors[:, is_determined] / np.sqrt(eigenvalues[is_determined])
        channels.append((values[:, used] / sigma[used]) @ design @ whiten)
    return np.concatenate(channels, axis=1) if channels else np.zeros((len(values), 0))


def _groups(field: DisplacementField, bodies: Mapping[str, Region]) -> list[IndexArray]:
    """Return the windows of every body, and of every tile of the picture those of none; a later body stands before others."""
    is_visible, centres = field.windows.sight > BLIND_SIGHT, field.windows.centres
    owner = np.full(len(centres), -1)
    for k, region in enumerate(bodies.values()):
        owner[region.holds(centres)] = k
    span = centres.max(axis=0) + 1
    tile = (centres * TILES_PER_SIDE / span).astype(int)
    group_numbers = np.where(owner < 0, len(bodies) + tile[:, 0] * TILES_PER_SIDE + tile[:, 1], owner)
    return [np.flatnonzero(is_visible & (group_numbers == k)) for k in np.unique(group_numbers[is_visible])]


def _terms(places: FloatArray, direction: FloatArray, windows: int) -> FloatArray:
    """Return the columns of a translation, and of a turn and strains where enough windows tell them."""
    columns = [direction[:, 0], direction[:, 1]]
    middle = places.mean(axis=0)
    a, b = ((places - middle) / max(float(np.ptp(places, axis=0).max()) / 2, 1.0)).T
    if windows >= MIN_TURN_WINDOWS:
        columns.append(direction[:, 1] * a - direction[:, 0] * b)
    if windows >= MIN_STRAIN_WINDOWS:
        columns += [direction[:, 0] * a, direction[:, 1] * b, direction[:, 0] * b + direction[:, 1] * a]
    return np.stack(columns, axis=1)
