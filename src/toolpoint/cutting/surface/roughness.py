"""Roughness parameters of profiles (ISO 4287 / 21920-2) and of areas (ISO 25178-2)."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, count, fail, floats, positive


def profile_parameters(profile: FloatArray, spacing: float, sampling_length: float | None = None) -> dict[str, float]:
    """Return Ra, Rq, Rp, Rv, Rz, Rt, Rsk, Rku, RSm, Rdq of a roughness profile, SI units.

    Ra .. Rz are means over the sampling lengths, Rt is over the whole profile, each about its own mean line.

    Parameters
    ----------
    profile : (n,) floats
        Heights after filtering, m.
    spacing : float
        m.
    sampling_length : float, optional
        m (usually the cutoff); the whole profile as one where left out.
    """
    z, step = floats("profile", profile, (None,)), positive("spacing", spacing)
    n = z.size if sampling_length is None else round(positive("sampling_length", sampling_length) / step)
    if n < 3 or n > z.size:
        fail("sampling_length", f"{n} samples", f"must be 3 to {z.size} samples")
    parts = z[:z.size // n * n].reshape(-1, n)
    parts = parts - parts.mean(1, keepdims=True)
    rq = np.sqrt((parts**2).mean(1))
    safe = np.where(rq > 0, rq, 1.0)
    centred = z - z.mean()
    return {
        "Ra": float(np.abs(parts).mean()), "Rq": float(rq.mean()),
        "Rp": float(parts.max(1).mean()), "Rv": float(-parts.min(1).mean()),
        "Rz": float(np.ptp(parts, axis=1).mean()), "Rt": float(np.ptp(z)),
        "Rsk": float(((parts**3).mean(1) / safe**3).mean()), "Rku": float(((parts**4).mean(1) / safe**4).mean()),
        "RSm": mean_width(centred, step), "Rdq": float(np.sqrt(np.mean(np.gradient(z, step) ** 2))),
    }


def mean_width(profile: FloatArray, spacing: float, height: float = 0.1) -> float:
    """Return RSm, the mean width of profile elements, m; peaks and valleys below `height` of Rz are passed over."""
    z = np.asarray(profile, float)
    level = height * np.ptp(z) / 2
    state, starts = 0, []
    for i in range(z.size):
        if z[i] > level and state <= 0:
            if state < 0:
                start = i
                while start > 0 and z[start - 1] > 0:
                    start -= 1
                a, b = (z[start - 1], z[start]) if start > 0 else (z[0], z[1])
                starts.append(start - b / (b - a) if b != a else float(start))
            state = 1
        elif z[i] < -level:
            state = -1
    return float(np.mean(np.diff(starts)) * spacing) if len(starts) > 1 else float("nan")


def areal_parameters(surface: FloatArray, spacing: tuple[float, float] = (1.0, 1.0)) -> dict[str, float]:
    """Return Sa, Sq, Sp, Sv, Sz, Ssk, Sku, Sdq of an areal surface about its mean, SI units.

    Parameters
    ----------
    surface : (n, m) floats
        Heights after filtering, m.
    spacing : 2 floats
        m along the two axes.
    """
    z = floats("surface", surface, (None, None))
    z = z - z.mean()
    sq = float(np.sqrt((z**2).mean()))
    safe = sq if sq > 0 else 1.0
    slope = np.gradient(z, *spacing)
    return {"Sa": float(np.abs(z).mean()), "Sq": sq, "Sp": float(z.max()), "Sv": float(-z.min()), "Sz": float(np.ptp(z)),
            "Ssk": float((z**3).mean() / safe**3), "Sku": float((z**4).mean() / safe**4),
            "Sdq": float(np.sqrt((slope[0] ** 2 + slope[1] ** 2).mean()))}


def spectrum(profile: FloatArray, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Return (wavelength, amplitude) of a profile's spectral lines, m, longest first; the mean is removed."""
    z = floats("profile", profile, (None,))
    count("profile", z.size, 4)
    amplitude = 2 * np.abs(np.fft.rfft(z - z.mean()))[1:] / z.size
    return z.size * positive("spacing", spacing) / np.arange(1, amplitude.size + 1), amplitude
