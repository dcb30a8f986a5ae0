r"""Orthogonal cutting of one mode in closed form: the least stable width and the lobes' tips."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, count, fail, nonnegative, positive, scalar


def least_width(modal_stiffness: float, damping_ratio: float, cutting_stiffness: float, *, process_damping: float = 0.0,
                cutting_speed: float = np.inf, modal_mass: float | None = None) -> float:
    r"""Return the width below which the cut is stable at every spindle speed, m.

    :math:`b = 2 k z_e (1 + z_e)/K_f`, :math:`z_e = z + C b/(2 v \sqrt{k m})`: a quadratic in b, its smallest positive
    root; infinite where the process damping holds every width.

    Parameters
    ----------
    modal_stiffness : float
        k, N/m.
    damping_ratio : float
        z.
    cutting_stiffness : float
        K_f along the vibration, Pa.
    process_damping : float
        C, N/m.
    cutting_speed : float
        v, m/s.
    modal_mass : float, optional
        m, kg; needed with process damping.

    Source: Tlusty, Machine Dynamics, in Handbook of High-Speed Machining Technology, 1985; process damping as in
    Tyler, Schmitz, Int. J. Machine Tools Manufacture 60 (2012) 39.

    Examples
    --------
    >>> round(1e3 * least_width(modal_stiffness=2e7, damping_ratio=0.03, cutting_stiffness=1e9), 6)  # mm
    1.236
    """
    k, z = positive("modal_stiffness", modal_stiffness), positive("damping_ratio", damping_ratio, 1.0)
    kf = positive("cutting_stiffness", cutting_stiffness)
    c = float(nonnegative("process_damping", np.asarray(scalar("process_damping", process_damping))))
    if c == 0:
        return 2 * k * z * (1 + z) / kf
    if modal_mass is None:
        fail("modal_mass", "none", "must be given with process damping")
    share = c / (2 * cutting_speed * np.sqrt(k * positive("modal_mass", modal_mass)))
    # 2k (z + s b)(1 + z + s b) - K_f b = 0
    roots = np.roots([2 * k * share**2, 2 * k * share * (1 + 2 * z) - kf, 2 * k * z * (1 + z)])
    real = roots[(np.abs(roots.imag) < 1e-12 * np.abs(roots)) & (roots.real > 0)].real
    return float(real.min()) if real.size else float("inf")


def lobe_tips(natural_frequency: float, damping_ratio: float, lobes: int = 10) -> FloatArray:
    r"""Return the spindle speeds (rev/min) of the least width, lobe 0 first.

    There :math:`\omega_c = \omega_n \sqrt{1 + 2z}` and the waves lag by :math:`\epsilon = 2\pi - 2 \arctan(1/\sqrt{1 +
    2z})`: :math:`n = 60 f_c/(k + \epsilon/2\pi)`.
    """
    f, z = positive("natural_frequency", natural_frequency), positive("damping_ratio", damping_ratio, 1.0)
    ratio = np.sqrt(1 + 2 * z)
    lag = 2 * np.pi - 2 * np.arctan(1 / ratio)
    return 60 * f * ratio / (np.arange(count("lobes", lobes)) + lag / (2 * np.pi))
