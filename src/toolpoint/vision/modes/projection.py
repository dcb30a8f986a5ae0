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

LARGEST_CONDITION = 1e4


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


def decay_basis(poles: ComplexArray, times: FloatArray, lines: Sequence[float] = (), *, drift: bool = True) -> DecayBasis:
    """Return the functions of poles (rad/s) and lines (Hz) at these times (s).

    Raises
    ------
    ToolpointError
        For poles that the frames cannot tell apart (equal, or aliases of each other).
    """
    s = complexes("poles", np.atleast_1d(poles))
    waves = np.exp(s * (times[:, None] - times[0]))
    # Re(phi e^{st}) = Re phi Re e - Im phi Im e
    parts = np.stack([waves.real, -waves.imag], axis=-1).reshape(times.size, -1)
    rest = [np.ones_like(times)] + ([np.linspace(-1, 1, times.size)] if drift else [])
    known = [wave(2 * np.pi * f * times) for f in lines for wave in (np.cos, np.sin)]
    columns = np.concatenate([parts, np.stack([*rest, *known], axis=1)], axis=1)
    size = np.linalg.norm(columns, axis=0)
    condition = np.linalg.cond(columns / size)
    if condition > LARGEST_CONDITION:
        fail("poles", ", ".join(f"{abs(p) / 2 / np.pi:.4g} Hz" for p in s), "the frames cannot tell them apart",
             remedy="leave one out, or film longer; at this frame rate two of them may be aliases of each other")
    weights = np.linalg.pinv(columns / size) / size[:, None]
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
                 lines: Sequence[float] = ()) -> PointShapes:
    """Return the shapes of all windows for these poles from frame `first` to `stop`, phases at the first row's exposure."""
    part = field.values[first:stop]
    times = np.arange(len(part)) / field.frame_rate
    basis = decay_basis(poles, times, lines)
    values = part.astype(float)
    amplitude = np.moveaxis(basis.amplitudes(values), 0, -1)
    amplitude = amplitude * np.exp(-basis.poles * field.delay[:, None])[:, None, :]
    return PointShapes(amplitude, field.covariance, basis, _scatter(field, basis, first), field.common)


def _scatter(field: DisplacementField, basis: DecayBasis, first: int) -> FloatArray:
    values, sigma, window, _ = field.measured()
    left = basis.residual(values[first:first + len(basis.columns)]) / sigma
    freedom = len(left) - basis.columns.shape[1]
    square = (left**2).sum(axis=0) / max(freedom, 1)
    total, count = np.zeros(len(field.windows.corners)), np.zeros(len(field.windows.corners))
    np.add.at(total, window, square)
    np.add.at(count, window, 1.0)
    return np.sqrt(np.where(count > 0, total / np.maximum(count, 1), 1.0))
