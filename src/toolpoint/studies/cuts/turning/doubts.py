"""Doubts about measured lines for the width that is stable at every speed: their band, noise and spacing."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.stability.hill.noise import line_variance

_WHAT = "stable at every speed"
# Edges of a band, over its first and last frequency; noise (one standard deviation) or bend of a line over the least real part.
_TURNING_EDGE_FRACTION, _CURVE_TOLERANCE = 0.03, 0.05


def band_note(plane: PlaneDynamics) -> str:
    """Return a sentence with the measured band, Hz: modes outside it are not in the limits."""
    frequency_min, frequency_max = plane.span
    return (f"measured from {frequency_min:.4g} to {frequency_max:.4g} Hz: a mode outside this band, which may chatter at a "
            f"smaller width, is not "
            "in these limits")


def doubt_lines(plane: PlaneDynamics) -> list[Doubt]:
    """Return doubts on the least real part of a measured response of the chip thickness; none of modes."""
    if plane.is_modal:
        return []
    frequency, values = plane.lines
    real, size = values[:, 0, 0].real, np.abs(values[:, 0, 0])
    f = frequency[frequency > 0]
    real, size = real[frequency > 0], size[frequency > 0]
    doubts = _question_edges(f, real, size)
    if real.min() >= 0:
        return [*doubts, Doubt(_WHAT, "no line has a negative real part: every width is stable in this band alone",
                               "a wider band, or another direction, decides; check the sign of the response")]
    k = int(np.argmin(real))
    # Half the variance of complex noise is that of its real part.
    noise = float(np.sqrt(line_variance(plane)[frequency > 0][k, 0, 0] / 2)) / -float(real[k])
    bend = float(real[k - 1] + real[k + 1] - 2 * real[k]) / 8 / -float(real[k]) if 0 < k < f.size - 1 else 0.0
    if max(noise, bend) > _CURVE_TOLERANCE:
        share = max(noise, bend)
        why = (f"at its least real part ({f[k]:.4g} Hz) lines beside it do not lie on a curve, by {100 * share:.0f} % of it: "
               f"noise, or lines too far apart ({f[k] - f[k - 1]:.3g} Hz)")
        doubts.append(Doubt(_WHAT, why, "the least of noisy lines is too low, that of coarse ones too high: average more, "
                            "measure longer, or identify modes", figure=share))
    return doubts


def _question_edges(f: FloatArray, real: FloatArray, size: FloatArray) -> list[Doubt]:
    """Return a doubt where the least real part (m/N) or the largest magnitude lies at an edge of the measured band (f, Hz)."""
    edge_min, edge_max = f[0] * (1 + _TURNING_EDGE_FRACTION), f[-1] * (1 - _TURNING_EDGE_FRACTION)
    least_frequency, largest_frequency = float(f[int(np.argmin(real))]), float(f[int(np.argmax(size))])
    if not edge_min < least_frequency < edge_max:
        return [Doubt(_WHAT, f"the real part is least at the edge of the band ({least_frequency:.4g} Hz)",
                      "beyond it it may be less, and the width smaller: take or measure a wider band")]
    if not edge_min < largest_frequency < edge_max:
        return [Doubt(_WHAT, f"the response is largest at the edge of the band ({largest_frequency:.4g} Hz)",
                      "a mode beyond it decides perhaps: take or measure a wider band")]
    return []
