"""Search of the residual for a resonance that no model order showed: a weak mode beside a strong one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.modal_identification.band import noise_level
from toolpoint.modal_identification.basis import pole_terms, real_rows
from toolpoint.modal_identification.fit.dense_lines import DENSE, AveragedLines
from toolpoint.modal_identification.fit.refinement import Data, PoleFit

LEAST_GAIN = 3.0
FLOOR = 1e-4
NEAR = 4.0  # half widths about a pole that came to nothing
BROAD = 2.0  # largest over median damping from which both are tried


@dataclass(frozen=True, eq=False)
class Candidate:
    """A pole (in units of `Data.scale`), its participation, and what it gains per unknown (1 for noise)."""

    pole: complex
    participation: ComplexArray
    gain: float


def search(data: Data, fit: PoleFit, left: ComplexArray, *, at: complex | None = None, tried: Sequence[complex] = ()
           ) -> Candidate | None:
    """Return the pole that would explain most of the residual, or None where nothing but noise is left.

    Trial poles with the median damping of the fit are laid over the band a half width apart (or one at `at`), and once more
    with its largest damping where that is well above: what two broad modes leave that were taken for one is as broad. The
    gain of each is the residual energy that it explains, less what other modes and outside terms can, over the noise (third
    differences along the lines; misfits below a ten-thousandth of a response are not searched).

    `left`: residual over its standard deviation, (n_f, n_sampled, n_inputs), as `estimate.residual` gives it; `tried`: poles
    that came to nothing, about which no other is looked for.
    """
    ratios = np.clip(-fit.poles.real / np.abs(fit.poles), 1e-3, 0.1)
    middle, largest = float(np.median(ratios)), float(ratios.max())
    candidate = _best(data, fit, left, trial=_trial(data, middle, at, tried), ratio=middle, sure=at is not None)
    if at is not None or largest < BROAD * middle:
        return candidate
    broad = _best(data, fit, left, trial=_trial(data, largest, None, tried), ratio=largest)
    return max((each for each in (candidate, broad) if each is not None), key=lambda each: each.gain, default=None)


def _trial(data: Data, ratio: float, at: complex | None, tried: Sequence[complex]) -> ComplexArray:
    """Return the trial poles."""
    if at is not None:
        return np.array([at])
    trial = _grid(data, ratio)
    return trial[np.all([np.abs(trial.imag - pole.imag) > NEAR * abs(pole.real) for pole in tried], axis=0)] if tried else trial


def _best(data: Data, fit: PoleFit, left: ComplexArray, *, trial: ComplexArray, ratio: float, sure: bool = False
          ) -> Candidate | None:
    """Return the best of the trial poles with this damping ratio, None where it is no more than noise (unless `sure`)."""
    if trial.size == 0:
        return None
    if not sure and data.p.size > DENSE:
        gram, moments = AveragedLines.of(data, fit.poles, left, ratio=ratio).moments(trial, ratio)
    else:
        gram, moments = _moments(data, fit, left, trial)
    size = np.einsum("gaa->g", gram)
    gram = gram + 1e-9 * np.maximum(size, 1e-300)[:, None, None] * np.eye(2)
    factors = np.linalg.solve(gram, moments)
    gain = (factors * moments).sum(axis=1) / _floor(data, fit, left)
    mean = np.where(size > 1e-6 * size.max(), gain.mean(axis=1) / 2, 0.0)
    best = int(np.argmax(mean))
    if not sure and mean[best] < max(LEAST_GAIN, 1 + 12 / np.sqrt(gain.shape[1])):
        return None
    residue = (factors[best, 0] + 1j * factors[best, 1]).reshape(left.shape[1:])
    direction = np.linalg.svd(residue, full_matrices=False)[2][0]
    return Candidate(complex(trial[best]), direction / direction[np.argmax(np.abs(direction))], float(mean[best]))


def _moments(data: Data, fit: PoleFit, left: ComplexArray, trial: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return of every trial pole its Gram matrix (n, 2, 2) and moments with the residual, less what is known, on all lines."""
    columns = data.columns(pole_terms(data.p, trial))
    known = np.linalg.qr(data.columns(pole_terms(data.p, fit.poles)))[0]
    columns = columns - known @ (known.T @ columns)
    rows = real_rows(left.reshape(left.shape[0], -1))
    pairs = columns.reshape(-1, trial.size, 2)
    return np.einsum("fga,fgb->gab", pairs, pairs), (columns.T @ rows).reshape(trial.size, 2, -1)


def _grid(data: Data, ratio: float) -> ComplexArray:
    low, high = data.frf.omega[0] / data.scale, data.frf.omega[-1] / data.scale
    steps = max(int(np.log(high / low) / ratio), 2)
    natural = np.geomspace(low, high, min(steps, 2000))
    return natural * (-ratio + 1j * np.sqrt(1 - ratio**2))


def _floor(data: Data, fit: PoleFit, left: ComplexArray) -> FloatArray:
    """Return the noise power of every sampled response, at least that of a ten-thousandth of its rms."""
    flat = left.reshape(left.shape[0], -1)
    noise = (noise_level(flat.real) ** 2 + noise_level(flat.imag) ** 2) / 2
    some = np.unique(np.linspace(0, fit.weight.shape[0] - 1, left.shape[1]).astype(int))
    power = np.einsum("foi,foi->oi", data.values[:, some], data.values[:, some]) * fit.weight[some] ** 2
    return np.maximum(noise, FLOOR**2 * power.reshape(-1) / data.values.shape[0])
