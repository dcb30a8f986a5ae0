r"""Surface filters: the Gaussian profile filter of ISO 16610-21 (and areal -61), the 2RC filter, wavelets by lifting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from toolpoint._check import FloatArray, count, fail, floats, one_of, positive

ALPHA = float(np.sqrt(np.log(2) / np.pi))  # the filter passes half the amplitude at its cutoff


def gaussian(profile: FloatArray, spacing: float, cutoff: float, *, axis: int = -1, ends: str = "kept") -> FloatArray:
    r"""Return the low-pass (waviness side) of a profile or areal surface along one axis.

    :math:`s(x) = \exp(-\pi (x/\alpha\lambda_c)^2)/(\alpha\lambda_c)`, :math:`\alpha = \sqrt{\ln 2/\pi}`; the weights
    are cut at one cutoff each side and normalised to one. ISO 16610-21 (areal: apply along both axes, ISO 16610-61).

    Parameters
    ----------
    profile : (..., n, ...) floats
        m.
    spacing, cutoff : float
        m.
    axis : int
    ends : str
        ``kept``: at the ends the weights inside the profile are normalised (its length stays, ISO 16610-28);
        ``cut``: half a cutoff each side is left out; ``periodic``.
    """
    z = np.moveaxis(floats("profile", profile), axis, -1)
    step, wave = positive("spacing", spacing), positive("cutoff", cutoff)
    one_of("ends", ends, ("kept", "cut", "periodic"))
    n, half = z.shape[-1], int(np.ceil(wave / step))
    if wave < 2 * step:
        fail("cutoff", f"{wave:g} m", f"must be at least two samples, {2 * step:g} m")
    if 2 * half >= n and ends != "periodic":
        fail("cutoff", f"{wave:g} m", f"must be below half the profile, {n * step / 2:g} m")
    x = np.arange(-half, half + 1) * step
    weight = np.exp(-np.pi * (x / (ALPHA * wave)) ** 2)
    weight /= weight.sum()
    if ends == "periodic":
        kernel = np.zeros(n)
        np.add.at(kernel, np.arange(-half, half + 1) % n, weight)
        out = np.fft.irfft(np.fft.rfft(z) * np.fft.rfft(kernel), n)
        return np.moveaxis(out, -1, axis)
    size = 1 << int(np.ceil(np.log2(n + 2 * half + 1)))
    spectrum = np.fft.rfft(weight, size)
    raw = np.fft.irfft(np.fft.rfft(z, size) * spectrum, size)[..., half:half + n]
    share = np.fft.irfft(np.fft.rfft(np.ones(n), size) * spectrum, size)[half:half + n]
    out = raw / share
    if ends == "cut":
        edge = int(np.ceil(wave / 2 / step))
        out = out[..., edge:n - edge]
    return np.moveaxis(out, -1, axis)


def two_stage_rc(profile: FloatArray, spacing: float, cutoff: float, *, axis: int = -1) -> FloatArray:
    r"""Return the waviness side of a profile by the 2RC filter of older instruments: what two equal RC stages take off.

    The roughness side passes :math:`1/(1 + (\lambda/\lambda_c)^2/3)` of the amplitude of a wavelength, 75 % at the cutoff, and
    shifts its phase, as the stylus' electronics did: it runs along the profile from its first sample, where it is at rest. The
    first two cutoffs are its run-up. Between samples the profile is a line, for which the steps are exact.

    Parameters
    ----------
    profile : (..., n, ...) floats
        m.
    spacing, cutoff : float
        m.
    axis : int
        Along which the stylus runs.

    Source: ISO 3274:1975 (2CR wave filter without phase correction); ISO 16610-21 replaces it.

    Examples
    --------
    >>> x = np.arange(0, 40e-3, 5e-6)
    >>> wave = np.sin(2 * np.pi * x / 0.8e-3)
    >>> passed = wave - two_stage_rc(wave, 5e-6, 0.8e-3)
    >>> round(float(np.abs(passed[4000:]).max()), 3)  # at the cutoff
    0.75
    """
    z = np.moveaxis(floats("profile", profile), axis, -1)
    step, wave = positive("spacing", spacing), positive("cutoff", cutoff)
    if wave < 2 * step:
        fail("cutoff", f"{wave:g} m", f"must be at least two samples, {2 * step:g} m")
    corner = 2 * np.pi / wave / np.sqrt(3)  # rad/m, where a stage passes half the power
    # Between samples the profile is a straight line; of s^2/(s + c)^2 that is a (z - 1)^2/(z - a)^2 with a = exp(-c step). Two
    # stages in turn, each a bidiagonal system, need no module of signals, which takes 46 MB of memory to load.
    ratio = float(np.exp(-corner * step))
    rows = np.moveaxis(z, -1, 0).reshape(z.shape[-1], -1)
    # The first sample is where the stylus was set down: the stages are charged with it.
    roughness = ratio * np.diff(np.vstack([np.zeros((2, rows.shape[1])), rows - rows[0]]), n=2, axis=0)
    stage = np.vstack([np.ones(len(rows)), np.full(len(rows), -ratio)])
    for _ in range(2):
        roughness = solve_banded((1, 0), stage, roughness)
    roughness = np.moveaxis(roughness.reshape(z.shape[-1], *z.shape[:-1]), 0, -1)
    return np.moveaxis(z - roughness, -1, axis)


# Lifting steps of the biorthogonal 9/7 wavelet (Daubechies, Sweldens, J. Fourier Anal. Appl. 4 (1998) 247).
STEPS_97 = (-1.586134342059924, -0.052980118572961, 0.882911075530934, 0.443506852043971)
SCALE_97 = 1.230174104914001


@dataclass(frozen=True)
class Lifting:
    """Wavelet transform by lifting, any length, whole-sample symmetric ends; exact inverse by running the steps back.

    Parameters
    ----------
    levels : int
        Octaves.
    wavelet : str
        ``9/7`` or ``5/3``.
    """

    levels: int = 8
    wavelet: str = "9/7"

    def __post_init__(self) -> None:
        count("Lifting.levels", self.levels)
        one_of("Lifting.wavelet", self.wavelet, ("9/7", "5/3"))

    def forward(self, profile: FloatArray) -> list[FloatArray]:
        """Return [detail of level 1 (finest), ..., detail of the last level, approximation]."""
        approximation = np.array(floats("profile", profile, (None,)))
        if approximation.size < 2 ** (self.levels + 1):
            fail("profile", f"{approximation.size} samples",
                 f"must be at least {2 ** (self.levels + 1)} for {self.levels} levels")
        out = []
        for _ in range(self.levels):
            approximation, detail = self._split(approximation)
            out.append(detail)
        return [*out, approximation]

    def inverse(self, parts: Sequence[FloatArray]) -> FloatArray:
        """Return the profile from its parts."""
        approximation = np.array(parts[-1])
        for detail in reversed(parts[:-1]):
            approximation = self._merge(approximation, np.array(detail))
        return approximation

    def bands(self, profile: FloatArray) -> FloatArray:
        """Return the profile's parts at full length, finest first, their sum the profile; shape (levels + 1, n)."""
        parts = self.forward(profile)
        zero = [np.zeros_like(p) for p in parts]
        return np.array([self.inverse([*zero[:i], parts[i], *zero[i + 1:]]) for i in range(len(parts))])

    def _coefficients(self) -> tuple[tuple[float, ...], float]:
        return (STEPS_97, SCALE_97) if self.wavelet == "9/7" else ((-0.5, 0.25), float(np.sqrt(2)))

    def _split(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        even_samples, odd_samples = x[0::2].copy(), x[1::2].copy()
        steps, scale = self._coefficients()
        for i, a in enumerate(steps):
            if i % 2 == 0:
                odd_samples += a * (even_samples[:odd_samples.size] + _right_neighbours(even_samples, odd_samples.size))
            else:
                even_samples += a * (_left_neighbours(odd_samples, even_samples.size) + _padded(odd_samples, even_samples.size))
        return even_samples * scale, odd_samples / scale

    def _merge(self, even_samples: FloatArray, odd_samples: FloatArray) -> FloatArray:
        steps, scale = self._coefficients()
        even_samples, odd_samples = even_samples / scale, odd_samples * scale
        for i in reversed(range(len(steps))):
            if i % 2 == 0:
                odd_samples -= steps[i] * (even_samples[:odd_samples.size] + _right_neighbours(even_samples, odd_samples.size))
            else:
                even_samples -= steps[i] * (_left_neighbours(odd_samples, even_samples.size) + _padded(odd_samples,
                                                                                                       even_samples.size))
        out = np.empty(even_samples.size + odd_samples.size)
        out[0::2], out[1::2] = even_samples, odd_samples
        return out


def _right_neighbours(even_samples: FloatArray, n: int) -> FloatArray:
    return even_samples[1:n + 1] if even_samples.size > n else np.append(even_samples[1:], even_samples[-1])


def _left_neighbours(odd_samples: FloatArray, n: int) -> FloatArray:
    return np.concatenate([odd_samples[:1], odd_samples])[:n]


def _padded(odd_samples: FloatArray, n: int) -> FloatArray:
    return odd_samples if odd_samples.size == n else np.append(odd_samples, odd_samples[-1])


@dataclass(frozen=True, eq=False)
class Separation:
    """Roughness, waviness and form of one profile; their sum is the profile.

    Parameters
    ----------
    roughness, waviness, form : (n,) floats
        m.
    limits : (float, float)
        Wavelengths between roughness and waviness, and between waviness and form, as realised, m.
    """

    roughness: FloatArray
    waviness: FloatArray
    form: FloatArray
    limits: tuple[float, float]


def separate(profile: FloatArray, spacing: float, roughness_below: float, *, form_above: float,
              wavelet: str = "9/7") -> Separation:
    """Return roughness, waviness and form by the lifting wavelet scheme.

    A detail of level j holds wavelengths of about 2^j to 2^(j+1) samples; the limits are rounded to such octaves, and
    the realised ones are in the result. Source of the method: Jiang, Blunt, Stout, Proc. R. Soc. A 456 (2000) 2283.

    Parameters
    ----------
    profile : (n,) floats
    spacing : float
        m.
    roughness_below, form_above : float
        Wavelengths, m.
    """
    step = positive("spacing", spacing)
    roughness_limit, form_limit = positive("roughness_below", roughness_below), positive("form_above", form_above)
    if not 2 * step < roughness_limit < form_limit:
        fail("roughness_below", f"{roughness_limit:g} m, form_above {form_limit:g} m",
             f"must be two samples < roughness < form, {2 * step:g} m")
    first, last = (max(1, round(float(np.log2(limit / step))) - 1) for limit in (roughness_limit, form_limit))
    bands = Lifting(max(last, first + 1), wavelet).bands(profile)
    limits = (step * 2.0 ** (first + 1), step * 2.0 ** (max(last, first + 1) + 1))
    return Separation(bands[:first].sum(0), bands[first:-1].sum(0), bands[-1], limits)
