"""Targets of a fit: measured quantities, their uncertainty, and which of them count."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import Array, FloatArray, fail, floats, one_of, positive
from toolpoint.updating.measured.frf_noise import Whitening, check_correlation
from toolpoint.vibration import Dof, Frf, Modes
from toolpoint.vibration.damped_modes import upper_poles
from toolpoint.vibration.line_noise import line_noise

FRF_KINDS = ("real and imaginary", "log")


@dataclass(frozen=True, eq=False)
class Targets:
    """Measured modes and receptances with the residuals they enter by.

    Every residual is a difference divided by its standard deviation. Standard deviations come from the measurement
    (`Modes.covariance`, `Modes.shape_variance`, `Frf.variance`) where it has them, otherwise from the numbers here, which
    are then assumptions: standard errors of the fit follow what the residuals show (`fits.error_spread`; modes alone: the
    root of the reduced chi-square), but never below those that the measurement's own deviations give.

    Parameters
    ----------
    modes : Modes, optional
        One pose, any scaling, at Dofs that the model has.
    frf : Frf, optional
        Any quantity; compared as receptance.
    frequency, damping, shape, mac : bool
        Which parts of the modes count. Residuals: ln f - ln f_m; likewise zeta (see
        `damping_residual`); the shape of unit length minus its best
        multiple of the model's; 1 - MAC.
    frequency_sd, damping_sd : float
        Relative standard deviations.
    shape_sd : float
        Standard deviation of a shape's entries as part of the shape's root mean square.
    mac_sd : float
    shape_covariance : (n_modes, n_dofs, n_dofs) floats, optional
        Covariance :math:`E\\, e e^H` of the entries of each shape, in the units of the shapes; counts instead of
        `Modes.shape_variance`. Points of one rigid body have common errors: taken as independent, each point would count anew.
    frf_kind : str
        ``real and imaginary`` (H - H_m), or ``log`` (ln H - ln H_m: logarithm of size and phase), which weighs
        antiresonances like resonances and forgives a shift of a peak.
    frf_sd : float
        Standard deviation of each line as part of the response's root mean square (real and imaginary) or of its own
        size (log), where the Frf carries no variance; its noise is added.
    frf_noise : (n_f, n_outputs, n_inputs) floats, optional
        Standard deviation of every line (of the absolute error), as receptance. Where left out (and the Frf carries no
        variance) by the scatter of the lines, alike at all lines of the quantity that was measured: what an accelerometer
        adds grows as :math:`1/\\omega^2` in the receptance.
    frf_quantity : str
        The quantity that was measured; that of `frf` where left out.
    line_correlation : (n_f, n_f) floats, optional
        Correlation of the errors of different lines (windows and zero padding make neighbours alike), 1 on the diagonal.
    channel_correlation : (n_outputs, n_outputs) complex, optional
        Hermitian correlation of the errors of different outputs (a noisy force is common to all of them), 1 on the
        diagonal. Both from repeated measurements: `frf_noise.correlations`.
    lowest_mac : float
        Pairs below are called doubtful in the result.

    >>> modes = Modes([100.0, 250.0], [0.01, 0.02], [[1.0, 0.5]], ["tool:+x"])
    >>> Targets(modes, frequency_sd=0.002).assumed  # the modes carry no covariance, so the deviation is an assumption
    True
    """

    modes: Modes | None = None
    frf: Frf | None = None
    frequency: bool = True
    damping: bool = False
    shape: bool = False
    mac: bool = False
    frequency_sd: float = 0.005
    damping_sd: float = 0.1
    shape_sd: float = 0.05
    mac_sd: float = 0.05
    frf_kind: str = "real and imaginary"
    frf_sd: float = 0.05
    lowest_mac: float = 0.5
    line_correlation: FloatArray | None = None
    channel_correlation: Array | None = None
    frf_noise: FloatArray | None = None
    frf_quantity: str = ""
    shape_covariance: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.modes is None and self.frf is None:
            fail("Targets", "neither modes nor frf", "must have at least one of them")
        for name in ("frequency_sd", "damping_sd", "shape_sd", "mac_sd", "frf_sd"):
            positive(f"Targets.{name}", getattr(self, name))
        one_of("Targets.frf_kind", self.frf_kind, FRF_KINDS)
        if self.modes is not None:
            self._check_modes(self.modes)
            object.__setattr__(self, "modes", _with_frequencies_of_poles(self.modes))
        if self.shape_covariance is not None:
            self._check_shape_covariance(self.shape_covariance)
        if self.frf is not None:
            if self.frf.values.ndim != 3:
                fail("Targets.frf", repr(self.frf), "must be one pose", remedy="use at_pose(i)")
            if not np.abs(self.frf.values).max() > 0:
                fail("Targets.frf", "zero everywhere", "must hold a response")
            if self.frf_noise is None and self.frf.variance is None:
                object.__setattr__(self, "frf_noise", _noise_of_lines(self.frf))
            object.__setattr__(self, "frf_quantity", self.frf_quantity or self.frf.quantity)
            object.__setattr__(self, "frf", self.frf.converted_to("receptance"))
            self._check_correlations(self.frf)
        elif self.line_correlation is not None or self.channel_correlation is not None:
            fail("Targets", "a correlation without frf", "belongs to measured responses")
        else:
            object.__setattr__(self, "frf_noise", None)

    def _check_correlations(self, frf: Frf) -> None:
        for name, size in (("line_correlation", frf.frequency.size), ("channel_correlation", len(frf.outputs))):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, check_correlation(f"Targets.{name}", value, size))

    def _check_shape_covariance(self, covariance: FloatArray) -> None:
        if self.modes is None:
            fail("Targets.shape_covariance", "given without modes", "belongs to measured shapes")
        count, size = self.modes.count, len(self.modes.dofs)
        covariance_given = floats("Targets.shape_covariance", covariance, (count, size, size))
        lowest = [float(np.linalg.eigvalsh(part)[0]) for part in covariance_given]
        if min(lowest) <= 0:
            fail("Targets.shape_covariance", f"that of mode {int(np.argmin(lowest)) + 1} is not positive",
                 "must be positive definite", remedy="add the variance of what single points err by to its diagonal")
        object.__setattr__(self, "shape_covariance", covariance_given)

    def _check_modes(self, modes: Modes) -> None:
        if modes.frequency.ndim != 1:
            fail("Targets.modes", repr(modes), "must be one pose", remedy="use at_pose(i)")
        if (modes.frequency <= 0).any():
            fail("Targets.modes", "a mode at 0 Hz", "must be above zero", remedy="leave rigid-body modes out: modes.selected")
        if not (np.abs(modes.shape) > 0).any(axis=0).all():
            fail("Targets.modes", "a shape that is zero at all Dofs", "must move somewhere")
        if not (self.frequency or self.damping or self.shape or self.mac):
            fail("Targets", "modes of which nothing counts", "must use frequency, damping, shape or mac")

    @property
    def _knows_shape_errors(self) -> bool:
        return self.shape_covariance is not None or (self.modes is not None and self.modes.shape_variance is not None)

    @property
    def assumed(self) -> bool:
        """Whether any standard deviation in use is an assumption and not the measurement's own."""
        modes, frf = self.modes, self.frf
        from_modes = modes is not None and (
            ((self.frequency or self.damping) and modes.covariance is None)
            or (self.shape and not self._knows_shape_errors) or self.mac)
        return from_modes or (frf is not None and frf.variance is None)

    @property
    def measured(self) -> bool:
        """Whether any standard deviation in use is the measurement's own."""
        modes, frf = self.modes, self.frf
        from_modes = modes is not None and (((self.frequency or self.damping) and modes.covariance is not None)
                                            or (self.shape and self._knows_shape_errors))
        return from_modes or (frf is not None and frf.variance is not None)

    @property
    def weights(self) -> tuple[str, ...]:
        """Origin of the weights, in words."""
        modes, frf, lines = self.modes, self.frf, []
        if modes is not None and (self.frequency or self.damping):
            both = "measured 2x2 covariance of frequency and damping of each mode, whitened by Cholesky"
            lines.append("poles: " + ("assumed standard deviations" if modes.covariance is None else both
                                      if self.frequency and self.damping else "measured variances"))
        if modes is not None and self.shape:
            words = "measured covariance of the points" if self.shape_covariance is not None else (
                ("measured" if self._knows_shape_errors else "assumed") + " standard deviations")
            lines.append(f"shapes: {words}")
        if modes is not None and self.mac:
            lines.append("MAC: assumed standard deviation")
        if frf is not None:
            parts = ("lines", self.line_correlation), ("outputs", self.channel_correlation)
            correlated_parts = [words for words, value in parts if value is not None]
            lines.append("responses: " + ("assumed" if frf.variance is None else "measured") + " standard deviation of each "
                         "line, " + (f"measured correlation between {' and '.join(correlated_parts)}" if correlated_parts
                                     else "lines independent"))
        return tuple(lines)

    @property
    def dofs(self) -> tuple[Dof, ...]:
        """Dofs of the measured shapes."""
        return () if self.modes is None else self.modes.dofs

    def pole_whitening(self) -> FloatArray:
        """Return W, (n_modes, 2, 2), with W (ln f - ln f_m, damping residual) uncorrelated of unit variance."""
        modes = self.modes
        assert modes is not None
        scale = np.stack([1 / modes.frequency, self.damping_residual(modes.damping_ratio)[1]], axis=-1)
        if modes.covariance is None:
            zeta = np.maximum(np.abs(modes.damping_ratio), 1e-4)
            covariance: FloatArray = np.zeros((modes.count, 2, 2))
            covariance[:, 0, 0], covariance[:, 1, 1] = self.frequency_sd**2, (self.damping_sd * zeta * scale[:, 1])**2
        else:
            covariance = modes.covariance * scale[:, :, None] * scale[:, None, :]
        used = [i for i, on in enumerate((self.frequency, self.damping)) if on]
        result = np.zeros((modes.count, 2, 2))
        for r, matrix in enumerate(covariance):
            part = matrix[np.ix_(used, used)]
            if used and np.linalg.eigvalsh(part)[0] <= 0:
                fail("Targets.modes", f"covariance of mode {r + 1} is not positive", "must be positive definite",
                     remedy="remove the covariance, then the assumed standard deviations count")
            if used:
                result[r][np.ix_(used, used)] = np.linalg.inv(np.linalg.cholesky(part))
        return result

    def damping_residual(self, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the residuals of damping ratios (n_modes,) and their slopes: ln (zeta + e)/(zeta_m + e), e = zeta_m/1000.

        A logarithm, because dampers start wrong by factors; e lets a model without damping in. Where the measured ratio is
        not positive, the plain difference.
        """
        assert self.modes is not None
        measured = self.modes.damping_ratio
        little = 1e-3 * measured
        usable = (measured > 0) & (ratio + little > 0)
        shifted_ratio = np.where(usable, ratio + little, 1.0)
        return (np.where(usable, np.log(shifted_ratio / np.where(usable, measured + little, 1.0)), ratio - measured),
                np.where(usable, 1 / shifted_ratio, 1.0))

    def shape_deviation(self) -> FloatArray:
        """Return the standard deviation of every entry of the shapes of unit length, (n_dofs, n_modes)."""
        modes = self.modes
        assert modes is not None
        length = np.linalg.norm(modes.shape, axis=0)
        floor = self.shape_sd / np.sqrt(len(modes.dofs))
        if modes.shape_variance is None:
            return np.full(modes.shape.shape, floor)
        return np.maximum(np.sqrt(modes.shape_variance) / length, 1e-3 * floor)

    def shape_whitening(self) -> FloatArray | None:
        """Return W, (n_modes, n_dofs, n_dofs), with W times the error of a shape of unit length uncorrelated of unit variance.

        None where the errors of the entries are taken as independent.
        """
        if self.shape_covariance is None:
            return None
        assert self.modes is not None
        length = np.linalg.norm(self.modes.shape, axis=0)
        return np.linalg.inv(np.linalg.cholesky(self.shape_covariance)) * length[:, None, None]

    def noise_of_lines(self) -> FloatArray:
        """Return the standard deviation of every line (of the absolute error), (n_f, n_outputs, n_inputs)."""
        assert self.frf is not None
        if self.frf.variance is not None:
            return np.sqrt(self.frf.variance)
        assert self.frf_noise is not None
        return self.frf_noise

    def frf_deviation(self) -> FloatArray:
        """Return the standard deviation of real and of imaginary part of every line, (n_f, n_outputs, n_inputs)."""
        frf = self.frf
        assert frf is not None
        size = np.abs(frf.values)
        power = (size**2).mean(axis=0)
        tiny = 1e-6 * max(float(np.sqrt(power.max())), 1e-300)
        noise = self.noise_of_lines()
        if frf.variance is not None:
            # E|e|^2 is shared by both parts; lines without any noise at all would decide alone.
            return np.maximum(noise / np.sqrt(2), tiny)
        # The structure's own part: noise of the lowest lines may be the largest number of a receptance that was accelerance.
        level = np.sqrt(np.maximum(power - (noise**2).mean(axis=0), 0.0))
        base = size if self.frf_kind == "log" else np.broadcast_to(level, size.shape)
        # Where noise is larger than the assumption it counts: lines that hold nothing else must not weigh like others.
        return np.hypot(self.frf_sd * np.maximum(base, tiny), noise / np.sqrt(2))

    def frf_whitening(self) -> Whitening | None:
        """Return what makes the errors over their standard deviations independent; None where they count as such."""
        if self.line_correlation is None and self.channel_correlation is None:
            return None
        return Whitening.of(self.line_correlation, self.channel_correlation)


def _with_frequencies_of_poles(modes: Modes) -> Modes:
    """Return modes whose frequency and damping ratio are the size and the decay of their poles, as responses show them.

    Modes of structural damping state :math:`\\omega` and :math:`\\eta / 2` of :math:`s^2 = -\\omega^2 (1 + i \\eta)`: their
    poles are larger by :math:`(1 + \\eta^2)^{1/4}`, 0.25 % at a loss factor of 0.1.
    """
    if modes.damping != "structural" or modes.scaling != "unit modal mass":
        return modes
    poles = upper_poles(modes)
    return replace(modes, frequency=np.abs(poles) / (2 * np.pi), damping_ratio=-poles.real / np.abs(poles), damping="viscous")


def _noise_of_lines(frf: Frf) -> FloatArray:
    """Return the standard deviation of every line, alike in the quantity that was measured, as receptance."""
    ones = replace(frf, values=np.ones(frf.values.shape, complex), variance=None).converted_to("receptance")
    return np.asarray(line_noise(frf.values) * np.abs(ones.values))
