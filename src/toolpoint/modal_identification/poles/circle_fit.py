r"""Circle fit: a mode from its circle in the Nyquist plane of mobility.

Around a resonance the mobility of one mode is a circle through the origin, moved by the (nearly constant) part of the
other modes. With :math:`\theta` the angle seen from the centre,
:math:`\tan(\theta / 2) = (\omega_r^2 - \omega^2) / (2 \zeta \omega_r \omega)`, exact for viscous damping. The circle is
fitted in the algebraic sense, the angle by least squares. Source: Kennedy, Pancu (1947); Ewins, Modal Testing, 2nd ed.,
section 4.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.modal_identification.band import QUANTITY_POWERS
from toolpoint.modal_identification.poles.quadrature import quadrature
from toolpoint.modal_identification.poles.start import Start
from toolpoint.vibration.frf import Frf


@dataclass(frozen=True)
class CircleFit:
    """Circle fit of the modes that quadrature picking finds; `prominence` and `floor` as there.

    >>> from toolpoint.vibration import Modes, frequency_response
    >>> modes = Modes([100.0], [0.01], [[0.1]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(80.0, 120.0, 0.1), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> pole = CircleFit().start(frf).poles[0]
    >>> [round(float(value), 4) for value in (abs(pole) / (2 * np.pi), -pole.real / abs(pole))]
    [100.0, 0.01]
    """

    prominence: float = 0.1
    floor: float = 0.003
    refine: bool = False
    name: str = "circle fit"

    def start(self, frf: Frf) -> Start:
        """Return the poles with real participation."""
        picked = quadrature(frf, prominence=self.prominence, floor=self.floor)
        mobility = (frf.values * ((1j * frf.omega) ** (1 - QUANTITY_POWERS[frf.quantity]))[:, None, None]).reshape(
            frf.frequency.size, -1)
        poles, notes = [], []
        for r in range(picked.count):
            s = complex(picked.poles[r]) - frf.decay
            lines = _lines_about(frf, s)
            weight = np.outer(picked.shape[:, r], picked.participation_at(picked.input_dofs)[:, r]).reshape(-1)
            circle = _fit_pole(frf.omega[lines], mobility[lines] @ weight, s) if lines.size >= 5 else None
            if circle is None:
                notes.append(f"no circle at {picked.frequency[r]:.4g} Hz: the picked value is kept")
            poles.append(s if circle is None else circle)
        return Start(np.array(poles), picked.participation_at(picked.input_dofs).astype(complex), notes=tuple(notes))


@dataclass(frozen=True)
class Quadrature:
    """Quadrature picking as a method of `identify`; see `quadrature`.

    >>> from toolpoint.vibration import Modes, frequency_response
    >>> modes = Modes([100.0], [0.01], [[0.1]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(80.0, 120.0, 0.1), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> round(float(abs(Quadrature().start(frf).poles[0])) / (2 * np.pi), 2)
    100.0
    """

    prominence: float = 0.1
    floor: float = 0.003
    refine: bool = False
    name: str = "quadrature picking"

    def start(self, frf: Frf) -> Start:
        """Return the picked poles with real participation."""
        picked = quadrature(frf, prominence=self.prominence, floor=self.floor)
        return Start(picked.poles - frf.decay, picked.participation_at(picked.input_dofs).astype(complex))


def _lines_about(frf: Frf, pole: complex) -> Array:
    """Return the lines within 1.5 half widths of a pole."""
    # A circle needs several lines: of a sharp pole on coarse lines those beside it are taken, however far down they lie.
    width = max(-pole.real, 1.5 * float(np.median(np.diff(frf.omega))))
    return np.flatnonzero(np.abs(frf.omega - abs(pole)) <= 1.5 * width)


def circle(points: ComplexArray) -> tuple[complex, float]:
    """Return centre and radius of the circle that fits points best (algebraic distance)."""
    scale = float(np.abs(points).max())
    x, y = points.real / scale, points.imag / scale
    a, b, c = np.linalg.lstsq(np.stack([x, y, np.ones_like(x)], axis=1), x**2 + y**2, rcond=None)[0]
    return complex(a, b) / 2 * scale, float(np.sqrt(max(c + (a**2 + b**2) / 4, 0.0))) * scale


def _fit_pole(omega: FloatArray, mobility: ComplexArray, start: complex) -> complex | None:
    """Return the pole from the angles about the circle's centre; None where it is outside the lines or overdamped."""
    centre, radius = circle(mobility)
    if radius == 0:
        return None
    angle = np.unwrap(np.angle(mobility - centre))

    def model(x: FloatArray) -> FloatArray:
        natural, ratio = abs(start) * np.exp(x[0]), np.exp(x[1])
        return x[2] + 2 * np.arctan((natural**2 - omega**2) / (2 * ratio * natural * omega)) - angle

    ratio = -start.real / abs(start)
    nearest_line = int(np.argmin(np.abs(omega - abs(start))))
    fit = least_squares(model, [0.0, np.log(ratio), angle[nearest_line]], x_scale=[ratio, 0.3, 1.0])
    natural, ratio = abs(start) * np.exp(fit.x[0]), float(np.exp(fit.x[1]))
    # Beyond the lines the circle is extrapolated, and a mode with 30 % of damping draws no circle.
    if not omega[0] <= natural <= omega[-1] or ratio > 0.3:
        return None
    return complex(natural * (-ratio + 1j * np.sqrt(1 - ratio**2)))
