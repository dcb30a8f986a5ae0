r"""Common factor of all masses from the driving points.

Shapes that were scaled by driving points (modal A, or unit modal mass) are absolute: of a machine whose modes have
:math:`a_r = v_r^T (2 s_r M + C) v_r`, the measured shape is :math:`\alpha_r v_r` with

.. math:: \ln |\alpha_r^2 a_r| = \ln (g\,m) + e_r

where m is the factor by which all masses (and with them all stiffnesses) of the machine are too large, g the common gain error
of force and response, and :math:`e_r` the noise of the driving points in mode r (Ewins, Modal Testing, 2nd ed., sections 2.4
and 4.4). Poles and the ratios of shapes do not determine m: only this does, and no better than the calibration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint._rounding import NORMAL_QUANTILE_95, with_uncertainty
from toolpoint.vibration import Modes
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.unit_factor import scale_words

# Least standard deviation of the logarithm of a squared scale: modes outside the tested band contribute to every residue.
_SCALE_FLOOR = 3e-3
_MIN_SCATTER_PVALUE = 1e-3  # p-value of chi-squared below which the modes scatter by more than their noise
_DEFAULT_CALIBRATION = 0.05  # relative standard deviation of the gain where none is stated
# Least logarithm of the factor that is doubted: where no calibration is stated; and always, in standard deviations.
_MIN_MASS_ERROR, _DOUBT_DEVIATIONS = 0.10, 3.0


def scale_deviations(modes: Modes) -> FloatArray | None:
    """Return the standard deviation (k,) of the logarithm of every mode's squared scale; inf where no driving point moves.

    None where the shapes were not scaled or their noise is not known.
    """
    if modes.scaling == "unscaled" or modes.shape_variance is None:
        return None
    rows = [point.row for point in driving_points(modes.dofs, modes.input_dofs)]
    if not rows:
        return None
    power = np.abs(modes.shape[rows]) ** 2
    # The scale is a least-squares mean over the driving points, weighed by their power; of complex noise only the half along
    # the motion changes a size.
    along = 0.5 if np.iscomplexobj(modes.shape) else 1.0
    total = power.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = along * (power * modes.shape_variance[rows]).sum(axis=0) / total**2
    return np.where(total > 0, np.sqrt(noise + _SCALE_FLOOR**2), np.inf)


@dataclass(frozen=True, eq=False)
class MassScale:
    """Common factor of all masses, by the driving points.

    factor : g m of the module's equation, masses of the machine times gain of the test, over their true value; deviation : its
    relative standard deviation (noise, and the scatter between modes where that is larger); calibration : stated relative
    standard deviation of the gain, None where none is; masses : largest stated relative standard deviation of a mass.
    """

    factor: float
    deviation: float
    calibration: float | None
    masses: float = 0.0

    @property
    def doubt(self) -> Doubt | None:
        """Doubt about masses or calibration where the factor is more than three standard deviations from one, else None."""
        gain = _DEFAULT_CALIBRATION if self.calibration is None else self.calibration
        log_error = abs(np.log(self.factor))
        expected = np.sqrt(self.deviation**2 + gain**2 + self.masses**2)
        if log_error < _DOUBT_DEVIATIONS * expected or (self.calibration is None and log_error < _MIN_MASS_ERROR):
            return None
        assumed = "" if self.calibration is not None else f" ({100 * gain:.0f} % is taken for it: calibration_deviation)"
        return Doubt("masses", f"at the driving points all modes together move {np.sqrt(self.factor):.3g} times as far as the "
                     "masses as stated let them, so that masses are "
                     f"{with_uncertainty(1 / self.factor, NORMAL_QUANTILE_95 * self.deviation / self.factor)} times those"
                     f"{scale_words(self.factor)}, beyond the calibration of force and response{assumed}: stiffnesses go with "
                     "the masses",
                     "check masses, units, sensitivities", figure=float(log_error))

    @property
    def note(self) -> str:
        """Sentence on the masses: how many times the stated ones, or those of the fit, they are by the driving points."""
        words = with_uncertainty(1 / self.factor, NORMAL_QUANTILE_95 * self.deviation / self.factor)
        if self.calibration is None:
            ending = "; with calibration_deviation in the component file the fit takes that into account" if self.masses else ""
            return (f"by the driving points all masses are {words} times those stated if force and response are calibrated "
                    f"exactly{ending}")
        return (f"by the driving points all masses are {words} times those of the fit; their common factor is known as well "
                f"as the masses as stated and a calibration within {196 * self.calibration:.2g} % (95 %) tell")


def mean_scale(logarithms: FloatArray, deviations: FloatArray, calibration: float | None) -> MassScale | None:
    """Return the mean of the modes' scales, weighted by their inverse variances; None where no mode has one.

    logarithms : (k,) of the squared scales, the left side of the module's equation; deviations : (k,) their standard
    deviations, infinite where a mode has none. Where the modes scatter by more than their noise, the deviation of the mean
    grows with it.
    """
    has_scale = np.isfinite(deviations)
    if not has_scale.any():
        return None
    weight = 1 / deviations[has_scale] ** 2
    mean = float((weight * logarithms[has_scale]).sum() / weight.sum())
    chi2, freedom = float((weight * (logarithms[has_scale] - mean) ** 2).sum()), int(has_scale.sum()) - 1
    widening = chi2 / freedom if freedom > 0 and stats.chi2.sf(chi2, freedom) < _MIN_SCATTER_PVALUE else 1.0
    return MassScale(float(np.exp(mean)), float(np.sqrt(widening / weight.sum())), calibration)


def scale_root(deviations: FloatArray, calibration: float) -> FloatArray:
    """Return the inverse Cholesky factor (k, k) of the covariance of the logarithms of the squared scales.

    deviations : (k,) by noise, infinite where a mode has no scale: its row and column are zero. calibration : standard
    deviation of the gain, common to all modes.
    """
    has_scale = np.isfinite(deviations)
    result = np.zeros((len(deviations), len(deviations)))
    covariance = np.diag(deviations[has_scale] ** 2) + calibration**2
    result[np.ix_(has_scale, has_scale)] = np.linalg.inv(np.linalg.cholesky(covariance))
    return result
