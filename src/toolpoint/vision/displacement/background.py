"""Background: what does not move shows how the camera moved; its motion is taken off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import BoolArray, FloatArray, fail
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.points import BLIND
from toolpoint.vision.displacement.result import DisplacementField

FEWEST_DIRECTIONS = 6
# Share of the picture's diagonal that background windows must span for a turn of the camera to be told.
SPREAD = 0.2


def background_windows(field: DisplacementField, regions: Sequence[Region]) -> BoolArray:
    """Return which windows lie wholly in regions that stand still, and see motion."""
    half = field.windows.side / 2
    centres = field.windows.centres
    inside = np.zeros(len(centres), bool)
    for region in regions:
        inside |= region.holds(centres - half) & region.holds(centres + half)
    return inside & (field.windows.sight > BLIND)


def without_shake(field: DisplacementField, still: BoolArray) -> DisplacementField:
    """Return the field less the motion of the camera, by windows that show the fixed background.

    In every frame a translation, and a turn where the background spans enough of the picture, by weighted least squares.

    Raises
    ------
    ToolpointError
        Where the background has fewer than six measured directions.
    """
    values, sigma, window, direction = field.measured()
    used = still[window]
    if used.sum() < FEWEST_DIRECTIONS:
        fail("background", f"{int(used.sum())} measured directions in it", f"must be {FEWEST_DIRECTIONS} at least",
             "a plain wall shows no motion: put a fixed pattern there, or use a stiff tripod")
    centres = field.windows.centres
    middle = centres[still].mean(axis=0)
    length = float(np.ptp(centres, axis=0).max())
    arm = (centres - middle) / max(length, 1.0)
    design = _rows(direction, arm[window])
    turns = float(np.ptp(arm[still], axis=0).max()) > SPREAD
    columns = slice(0, 3 if turns else 2)
    weighted = design[used][:, columns] / sigma[used][:, None]
    motion = np.linalg.lstsq(weighted, (values[:, used] / sigma[used]).T, rcond=None)[0]
    whole = np.zeros((3, len(values)))
    whole[columns] = motion
    shift = np.stack([whole[0][:, None] - whole[2][:, None] * arm[:, 1], whole[1][:, None] + whole[2][:, None] * arm[:, 0]],
                     axis=2)
    size = float(np.ptp(motion[:2], axis=1).max())
    return field.changed((field.values - shift).astype(np.float32),
                         *([f"camera shake of {size:.2f} px peak to peak taken off by the background"] if size > 0.1 else []))


def _rows(direction: FloatArray, arm: FloatArray) -> FloatArray:
    turn = -direction[:, 0] * arm[:, 1] + direction[:, 1] * arm[:, 0]
    return np.column_stack([direction, turn])
