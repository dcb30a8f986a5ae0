"""DisplacementField: what a method returns, displacement of windows over time with its uncertainty and doubts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail, frozen
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.vibration import Dof, Record
from toolpoint.vision.displacement.points import BLIND_SIGHT, EDGE_SIGHT, FULL_SIGHT, SIGHTS, Windows
from toolpoint.vision.view import View


@dataclass(frozen=True, eq=False)
class DisplacementField(NotebookText):
    """Displacement of windows of the picture, pixels.

    Parameters
    ----------
    windows : Windows
    values : (frames, n, 2) floats
        Right and down from the reference; of a window that sees across an edge only, the part along its normal; zero where
        blind.
    covariance : (n, 2, 2) floats
        Of one frame's values, pixels squared, from the noise of the sensor and the texture.
    frame_rate : float
        Hz.
    row_delay : float
        Time between rows, s.
    lost_frames : (n,) ints
        Frames in which a window was not followed.
    method : str
    doubts : tuple of str
    start : float
        Time of the first frame, s.
    common : (2,) floats
        Variance of an error that all windows share in a frame, right and down, pixels squared: of the camera's motion that was
        taken off.

    >>> from scipy import ndimage
    >>> from toolpoint.vision import choose_points, clip_of, measure, scan
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> field = measure(scanned, choose_points(scanned.reference, scanned.survey, 4, side=15))
    >>> field.values.shape, field.frame_rate  # frames, windows, right and down
    ((60, 4, 2), 200.0)
    """

    windows: Windows
    values: FloatArray
    covariance: FloatArray
    frame_rate: float
    row_delay: float
    lost_frames: IndexArray
    method: str
    doubts: tuple[Doubt, ...] = field(default=())
    start: float = 0.0
    common: FloatArray = field(default_factory=lambda: np.zeros(2))

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values))

    @property
    def time(self) -> FloatArray:
        """Time of every frame's first row, s."""
        return self.start + np.arange(len(self.values)) / self.frame_rate

    @property
    def delay(self) -> FloatArray:
        """Time of each window after the first row, s, (n,)."""
        return self.windows.centres[:, 1] * self.row_delay

    @property
    def quality(self) -> list[str]:
        """Sight of each window: ``both directions``, ``across the edge only`` or ``blind``."""
        return [SIGHTS[sight] for sight in self.windows.sight]

    def selected(self, keep: np.ndarray) -> DisplacementField:
        """Return these windows."""
        return replace(self, windows=self.windows.selected(keep), values=self.values[:, keep],
                       covariance=self.covariance[keep], lost_frames=self.lost_frames[keep])

    def changed(self, values: FloatArray, *doubts: Doubt) -> DisplacementField:
        """Return the field with other values and further doubts."""
        return replace(self, values=values, doubts=tuple(dict.fromkeys((*self.doubts, *doubts))))

    def measured(self) -> tuple[FloatArray, FloatArray, IndexArray, FloatArray]:
        """Return every measured direction as a channel.

        Returns values (frames, m), standard deviations (m,), window of each (m,), unit direction of each (m, 2). A window
        that sees both ways gives right and down, one at an edge the direction of its normal.
        """
        sight, normal = self.windows.sight, self.windows.normal
        both, edge = np.flatnonzero(sight == FULL_SIGHT), np.flatnonzero(sight == EDGE_SIGHT)
        window = np.concatenate([np.repeat(both, 2), edge])
        direction = np.concatenate([np.tile(np.eye(2), (both.size, 1)), normal[edge]])
        values = np.einsum("tni,ni->tn", self.values[:, window], direction)
        sigma = np.sqrt(np.einsum("ni,nij,nj->n", direction, self.covariance[window], direction))
        return values, sigma, window, direction

    def record(self, view: View | None = None, *, windows: IndexArray | None = None) -> Record:
        """Return the measured directions as a Record: metres where the view knows its scale, else pixels.

        Windows are points 1, 2, ..; directions are those of the view, or across the edge as a vector. Channels are sampled
        `delay` after the record's times where the shutter rolls.
        """
        view = view or View()
        part = self if windows is None else self.selected(windows)
        if not (part.windows.sight > BLIND_SIGHT).any():
            fail("record", "no window that sees motion", "must be one at least", remedy="add texture, light or focus")
        values, _, window, direction = part.measured()
        factor = 1.0 if view.scale is None else view.scale
        labels = [_label(int(w) + 1, d, view) for w, d in zip(window, direction, strict=True)]
        # A direction that the machine counts the other way is labelled with its sign.
        return Record(values * factor, self.frame_rate, tuple(labels), ("displacement",) * len(labels),
                      units=("px" if view.scale is None else "m",) * len(labels), start=self.start, name=self.method)

    @property
    def summary(self) -> str:
        """Windows by what they see, frames and method, in words."""
        count, kinds = len(self.windows.sight), [int((self.windows.sight == sight).sum())
                                                 for sight in (FULL_SIGHT, EDGE_SIGHT, BLIND_SIGHT)]
        sights = zip(kinds, ("both directions", "the direction across an edge alone", "nothing"), strict=True)
        return (f"{count} windows in {len(self.values)} frames by {self.method}: "
                + ", ".join(f"{number} see {words}" for number, words in sights if number))

    def __repr__(self) -> str:
        return f"DisplacementField({self.summary})"


def _label(point: int, direction: FloatArray, view: View) -> Dof:
    if abs(direction[0]) == 1.0 or abs(direction[1]) == 1.0:
        return Dof(point, view.right if direction[0] else view.down)
    vector = direction @ view.axes
    x, y, z = (float(v) for v in vector / np.linalg.norm(vector))
    return Dof(point, "edge", (x, y, z))
