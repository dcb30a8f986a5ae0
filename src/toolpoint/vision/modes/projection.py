r"""Shapes for known poles: least squares of the displacement, or of the pixels, on damped exponentials.

:math:`d(t) = \Re \sum_r \phi_r e^{s_r t} + c + v t + \text{lines}`: rest, drift and lamp lines are known columns. Rows that
a rolling shutter reads later by :math:`\tau` have :math:`\phi_r e^{s_r \tau}`, which is taken back. Poles may lie above half
the frame rate (from an accelerometer beside the camera): sampled exponentials are what they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, complexes, fail
from toolpoint.vision.displacement.result import DisplacementField

MAX_DECAY_BASIS_CONDITION = 1e4  # of the normalised columns
# Parts of a decay and least frames of one, by which first frames are left out; ratio of a part's residual to that of the
# second half from which it holds more than noise.
TRANSIENT_PARTS, MIN_TRANSIENT_FRAMES, MIN_TRANSIENT_RATIO = 48, 4, 1.05


@dataclass(frozen=True, eq=False)
class DecayBasis:
    """Known functions of time: cosine and sine of every pole, then rest, drift and lines.

    columns : (frames, n); poles : (r,), rad/s; inverse : (n, n) of the Gram matrix, the covariance for white noise of one;
    weights : (n, frames), pseudo-inverse.
    """

    columns: FloatArray
    poles: ComplexArray
    inverse: FloatArray
    weights: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """Covariance of (Re, Im) of every pole's amplitude for white noise of one, (r, 2, 2)."""
        return np.stack([self.inverse[2 * r:2 * r + 2, 2 * r:2 * r + 2] for r in range(self.poles.size)])

    def amplitudes(self, values: FloatArray) -> ComplexArray:
        """Return the complex amplitudes (r, ...) of histories (frames, ...)."""
        count = 2 * self.poles.size
        flat = self.weights[:count] @ values.reshape(len(values), -1)
        return (flat[0::2] + 1j * flat[1::2]).reshape(self.poles.size, *values.shape[1:])

    def residual(self, values: FloatArray) -> FloatArray:
        """Return histories less what the functions explain."""
        flat = values.reshape(len(values), -1)
        return (flat - self.columns @ (self.weights @ flat)).reshape(values.shape)


def decay_basis(poles: ComplexArray, times: FloatArray, lines: Sequence[float] = (), *, drift: bool = True, skip: int = 0
                ) -> DecayBasis:
    """Return the functions of poles (rad/s) and lines (Hz) at these times (s), fitted without the first `skip` of them.

    Amplitudes are those at the first time, also where the first frames are left out of the fit.

    Raises
    ------
    ToolpointError
        For poles that the frames cannot tell apart (equal, or aliases of each other).
    """
    s = complexes("poles", np.atleast_1d(poles))
    waves = np.exp(s * (times[:, None] - times[0]))
    # Re(phi e^{st}) = Re phi Re e - Im phi Im e
    parts = np.stack([waves.real, -waves.imag], axis=-1).reshape(times.size, -1)
    offsets = [np.ones_like(times)] + ([np.linspace(-1, 1, times.size)] if drift else [])
    line_columns = [wave(2 * np.pi * f * times) for f in lines for wave in (np.cos, np.sin)]
    columns = np.concatenate([parts, np.stack([*offsets, *line_columns], axis=1)], axis=1)
    size = np.linalg.norm(columns, axis=0)
    condition = np.linalg.cond(columns / size)
    if condition > MAX_DECAY_BASIS_CONDITION:
        fail("poles", ", ".join(f"{abs(p) / 2 / np.pi:.4g} Hz" for p in s), "the frames cannot tell them apart",
             remedy="leave one out, or film longer; at this frame rate two of them may be aliases of each other")
    fitted = np.linalg.pinv(columns[skip:] / size) / size[:, None]
    weights = np.concatenate([np.zeros((len(fitted), skip)), fitted], axis=1)
    return DecayBasis(columns, s, weights @ weights.T, weights)


@dataclass(frozen=True, eq=False)
class PointShapes:
    """Complex shapes of windows.

    shape : (n, 2, r) right and down, pixels at the start of the decay; covariance : (n, 2, 2) of a real or imaginary part for
    a basis covariance of one; basis : DecayBasis; scatter : (n,) residual over the stated noise, about one; common : (2,)
    variance of an error that all windows share (`DisplacementField.common`), beside theirs.
    """

    shape: ComplexArray
    covariance: FloatArray
    basis: DecayBasis
    scatter: FloatArray
    common: FloatArray = dataclass_field(default_factory=lambda: np.zeros(2))

    def deviation(self) -> FloatArray:
        """Return the standard deviation of |error| per entry, (n, 2, r)."""
        trace = np.trace(self.basis.covariance, axis1=1, axis2=2)
        return np.sqrt(np.einsum("ni,r->nir", np.einsum("nii->ni", self.covariance) + self.common, trace))


def point_shapes(field: DisplacementField, poles: ComplexArray, first: int = 0, *, stop: int | None = None,
                 lines: Sequence[float] = (), skip: int = 0) -> PointShapes:
    """Return the shapes of all windows for these poles from frame `first` to `stop`, phases at the first row's exposure.

    The first `skip` frames are left out of the fit (`count_transient_frames`).

    >>> from scipy import ndimage
    >>> from toolpoint.vision import choose_points, clip_of, measure, scan
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> field = measure(scanned, choose_points(scanned.reference, scanned.survey, 4, side=15))
    >>> shapes = point_shapes(field, np.array([-3.0 + 2j * np.pi * 20.0]))
    >>> right, down = np.abs(shapes.shape[:, :, 0]).T
    >>> bool(np.allclose(right, 0.5, atol=0.05) and (down < 0.05).all())  # the amplitude that was put in, pixels
    True
    """
    part = field.values[first:stop]
    times = np.arange(len(part)) / field.frame_rate
    basis = decay_basis(poles, times, lines, skip=skip)
    values = part.astype(float)
    amplitude = np.moveaxis(basis.amplitudes(values), 0, -1)
    amplitude = amplitude * np.exp(-basis.poles * field.delay[:, None])[:, None, :]
    return PointShapes(amplitude, field.covariance, basis, _scatter(field, basis, first), field.common)


def count_transient_frames(field: DisplacementField, poles: ComplexArray, first: int, *, stop: int | None = None) -> int:
    """Return how many first frames hold motion that the poles do not explain: modes that die before they can be identified.

    Least squares would give their motion to the shapes of the known poles, far beyond the stated noise. Frames are left out
    until the residual has fallen to that of the second half, but never beyond the time constant of the fastest known pole.
    """
    values, sigma, _, _ = field.measured()
    part = values[first:stop] / sigma
    times = np.arange(len(part)) / field.frame_rate
    length = max(len(part) // TRANSIENT_PARTS, MIN_TRANSIENT_FRAMES)
    max_skip = min(len(part) // 4, int(field.frame_rate / max(float(-poles.real.min()), 1e-12)))
    skip = 0
    while skip + length <= max_skip:
        residual = decay_basis(poles, times, skip=skip).residual(part)
        level = np.sqrt((residual[len(part) // 2:] ** 2).mean())
        residual_ratio = np.sqrt((residual[skip:skip + length] ** 2).mean()) / level
        # The deviation of a mean square of n values is sqrt(2 / n), half of it that of the root.
        if residual_ratio < max(MIN_TRANSIENT_RATIO, 1 + 5 * np.sqrt(0.5 / (length * part.shape[1]))):
            break
        skip += length
    return skip


def _scatter(field: DisplacementField, basis: DecayBasis, first: int) -> FloatArray:
    """Return the residual of each window over its stated noise, (n,), about one."""
    values, sigma, window, _ = field.measured()
    scaled_residual = basis.residual(values[first:first + len(basis.columns)]) / sigma
    freedom = len(scaled_residual) - basis.columns.shape[1]
    chi_squared = (scaled_residual**2).sum(axis=0) / max(freedom, 1)
    total, count = np.zeros(len(field.windows.corners)), np.zeros(len(field.windows.corners))
    np.add.at(total, window, chi_squared)
    np.add.at(count, window, 1.0)
    return np.sqrt(np.where(count > 0, total / np.maximum(count, 1), 1.0))
