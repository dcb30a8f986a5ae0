"""Search of the residual for a resonance that no model order showed: a weak mode beside a strong one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.modal_identification.band import noise_level
from toolpoint.modal_identification.basis import pole_terms, real_rows
from toolpoint.modal_identification.fit.dense_lines import AveragedLines
from toolpoint.modal_identification.fit.refinement import Data, PoleFit

MAX_SEARCHED_LINES = 2000  # lines on which every trial pole is tried; on more of them each is tried on averaged lines about it
MIN_CANDIDATE_GAIN = 3.0  # residual energy explained per unknown, over the noise
MIN_SEARCHED_MISFIT = 1e-4  # of a response's rms: smaller misfits are not searched
EXCLUDED_HALF_WIDTHS = 4.0  # about a pole that was tried in vain
MIN_DAMPING_RATIO_SPREAD = 2.0  # largest over median damping, from which trial poles of both are used


@dataclass(frozen=True, eq=False)
class Candidate:
    """Pole (in units of `Data.scale`), its participation, and its gain per unknown (1 for noise)."""

    pole: complex
    participation: ComplexArray
    gain: float


def search(data: Data, fit: PoleFit, residual: ComplexArray, *, trial_pole: complex | None = None, tried: Sequence[complex] = ()
           ) -> Candidate | None:
    """Return the pole that explains most of the residual, or None where the residual is noise.

    Trial poles with the median damping of the fit are laid over the band a half width apart (or one at `trial_pole`), and once
    more with its largest damping where that is well above: the residual of two broad modes fitted as one is as broad. The
    gain of each is the residual energy that it explains, less what other modes and outside terms can, over the noise (third
    differences along the lines; misfits below a ten-thousandth of a response are not searched).

    `residual`: residual over its standard deviation, (n_f, n_sampled, n_inputs), as `estimate.residual` gives it; `tried`:
    poles that came to nothing, about which no other is looked for.
    """
    # Poles of a fit that is not complete yet may have any damping: a candidate is looked for with that of a structure.
    ratios = np.clip(-fit.poles.real / np.abs(fit.poles), 1e-3, 0.1)
    median_ratio, largest_ratio = float(np.median(ratios)), float(ratios.max())
    candidate = _best_candidate(data, fit, residual, trial=_trial_poles(data, median_ratio, trial_pole, tried),
                                ratio=median_ratio, is_given=trial_pole is not None)
    if trial_pole is not None or largest_ratio < MIN_DAMPING_RATIO_SPREAD * median_ratio:
        return candidate
    broad = _best_candidate(data, fit, residual, trial=_trial_poles(data, largest_ratio, None, tried), ratio=largest_ratio)
    return max((candidate_of_two for candidate_of_two in (candidate, broad) if candidate_of_two is not None),
               key=lambda candidate_of_two: candidate_of_two.gain, default=None)


def _trial_poles(data: Data, ratio: float, trial_pole: complex | None, tried: Sequence[complex]) -> ComplexArray:
    """Return the trial poles."""
    if trial_pole is not None:
        return np.array([trial_pole])
    grid = _pole_grid(data, ratio)
    return grid[np.all([np.abs(grid.imag - pole.imag) > EXCLUDED_HALF_WIDTHS * abs(pole.real) for pole in tried],
                       axis=0)] if tried else grid


def _best_candidate(data: Data, fit: PoleFit, residual: ComplexArray, *, trial: ComplexArray, ratio: float,
                    is_given: bool = False
          ) -> Candidate | None:
    """Return the best of the trial poles with this damping ratio, None where it is no more than noise (unless `is_given`)."""
    if trial.size == 0:
        return None
    if not is_given and data.p.size > MAX_SEARCHED_LINES:
        gram, moments = AveragedLines.of(data, fit.poles, residual, ratio=ratio).moments(trial, ratio)
    else:
        gram, moments = _moments(data, fit, residual, trial)
    size = np.einsum("gaa->g", gram)
    # A trial pole beside a known one keeps next to nothing of its columns: the gain of what is left is bounded, where the
    # inverse would be rounding.
    gram = gram + 1e-9 * np.maximum(size, 1e-300)[:, None, None] * np.eye(2)
    factors = np.linalg.solve(gram, moments)
    gain = (factors * moments).sum(axis=1) / _noise_power(data, fit, residual)
    # Trial poles that known modes span have lost their columns: what they would explain is rounding.
    mean = np.where(size > 1e-6 * size.max(), gain.mean(axis=1) / 2, 0.0)
    best = int(np.argmax(mean))
    # The best of many trials of noise alone: a mean of n gains of chi-squared kind scatters by one over the root of n.
    if not is_given and mean[best] < max(MIN_CANDIDATE_GAIN, 1 + 12 / np.sqrt(gain.shape[1])):
        return None
    residue = (factors[best, 0] + 1j * factors[best, 1]).reshape(residual.shape[1:])
    direction = np.linalg.svd(residue, full_matrices=False)[2][0]
    return Candidate(complex(trial[best]), direction / direction[np.argmax(np.abs(direction))], float(mean[best]))


def _moments(data: Data, fit: PoleFit, residual: ComplexArray, trial: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return of every trial pole its Gram matrix (n, 2, 2) and moments with the residual less the known modes."""
    columns = data.columns(pole_terms(data.p, trial))
    known_basis = np.linalg.qr(data.columns(pole_terms(data.p, fit.poles)))[0]
    # What the known modes can explain by other shapes is no evidence of a further one.
    columns = columns - known_basis @ (known_basis.T @ columns)
    rows = real_rows(residual.reshape(residual.shape[0], -1))
    pairs = columns.reshape(-1, trial.size, 2)
    return np.einsum("fga,fgb->gab", pairs, pairs), (columns.T @ rows).reshape(trial.size, 2, -1)


def _pole_grid(data: Data, ratio: float) -> ComplexArray:
    """Return trial poles over the band, a half width apart."""
    omega_min, omega_max = data.frf.omega[0] / data.scale, data.frf.omega[-1] / data.scale
    steps = max(int(np.log(omega_max / omega_min) / ratio), 2)
    natural = np.geomspace(omega_min, omega_max, min(steps, 2000))
    return natural * (-ratio + 1j * np.sqrt(1 - ratio**2))


def _noise_power(data: Data, fit: PoleFit, residual: ComplexArray) -> FloatArray:
    """Return the noise power of every sampled response, at least that of a ten-thousandth of its rms."""
    flat = residual.reshape(residual.shape[0], -1)
    noise = (noise_level(flat.real) ** 2 + noise_level(flat.imag) ** 2) / 2
    sampled = np.unique(np.linspace(0, fit.weight.shape[0] - 1, residual.shape[1]).astype(int))
    power = np.einsum("foi,foi->oi", data.values[:, sampled], data.values[:, sampled]) * fit.weight[sampled] ** 2
    return np.maximum(noise, MIN_SEARCHED_MISFIT**2 * power.reshape(-1) / data.values.shape[0])
