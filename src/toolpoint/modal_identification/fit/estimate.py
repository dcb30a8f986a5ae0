"""Modes from starting poles: noise levels, refinement, removal of modes without evidence, scaling, covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.modal_identification.basis import (
    MIN_RESPONSE_POWER,
    factor,
    laplace,
    pole_terms,
    real_rows,
    scale_powers,
)
from toolpoint.modal_identification.fit.averaged_lines import average_lines
from toolpoint.modal_identification.fit.clusters import widening
from toolpoint.modal_identification.fit.completion import Candidate, search
from toolpoint.modal_identification.fit.dense_lines import MAX_UNAVERAGED_LINES
from toolpoint.modal_identification.fit.outside import pole_covariance, reduce_outside_terms
from toolpoint.modal_identification.fit.refinement import Data, PoleFit, evaluate, refine_poles, try_evaluate
from toolpoint.modal_identification.fit.twins import merge_twins
from toolpoint.modal_identification.judgement.identification import ModalModel
from toolpoint.modal_identification.poles.stabilization import MAX_POLE_DAMPING
from toolpoint.modal_identification.scaling import scale_shapes
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

MIN_RELATIVE_NOISE = 1e-8  # of a response's rms: smaller noise is rounding
UNMEASURED_WEIGHT = 1e-6  # of a response that is exactly zero, over that of the largest
MIN_NOISY_POWER = 1e-2  # of a residual over its noise, over the largest: below, it is counted as none
NOISE_WINDOW_COUNT = 16  # windows of the band over which the noise of the residual is smoothed
MIN_NOISE_VARIATION = 3.0  # largest over smallest power of the noise along the band, from which lines are weighted
MAX_SAMPLED_OUTPUTS = 48  # whose residual is computed
MAX_ADDED_MODES = 8  # from the residual
MAX_FAILED_CANDIDATES = 3  # in a row
MAX_REMAINING_GAIN = 3.0  # of a candidate after it is fitted: below, it is explained
VARIANCE_SMOOTHING_LINES = 100  # times responses, over which stated variances are averaged along the lines
ROUGH_TOLERANCE, FINE_TOLERANCE = 10.0, 1e-2  # gain of half a chi-squared at which steps end: first pass, others
WEAK_EVIDENCE_FACTOR = 10.0  # on the evidence limit: below, a mode is tested by a fit without it


@dataclass(frozen=True, eq=False)
class Estimate:
    """Converged fit with its data.

    `excess` is the residual over the stated variance (1 where none is stated); `spread` is the number of neighbouring lines
    that share their residual (1 for independent lines); `wider` are the factors on the covariance of every mode.
    """

    data: Data
    fit: PoleFit
    excess: float
    spread: float = 1.0
    wider: FloatArray | None = None


def starting_weight(frf: Frf) -> FloatArray:
    """Return one over the rms of each response; one that is exactly zero was not measured and gets next to no weight."""
    power = (np.abs(frf.values) ** 2).mean(axis=0)
    return np.where(power > 0, 1 / np.sqrt(scale_powers(power)), UNMEASURED_WEIGHT / np.sqrt(power.max()))


def estimate(frf: Frf, poles: ComplexArray, participation: ComplexArray, *, refine: bool = True, fixed: bool = False
             ) -> Estimate:
    """Return the fit from starting poles (rad/s, free of the window): refined, or with these poles as they are.

    fixed : refine exactly these poles; none is left out for lack of evidence, none added for what the residual shows.
    """
    is_dense = refine and not fixed and frf.frequency.size > MAX_UNAVERAGED_LINES
    if is_dense:  # averages show which modes there are; their values come from all lines
        poles, participation = _search_on_averages(frf, poles, participation)
    data = Data.of(frf, _stated_line_weight(frf))
    stated_weight = _stated_weight(frf, data.line_weight)
    # Before the first residual nothing is known of the noise: equal relative errors keep loud responses from deciding alone.
    weight = starting_weight(frf) if stated_weight is None else stated_weight
    fit = evaluate(data, poles / data.scale, participation, weight=weight)
    if not refine:
        return Estimate(data, fit if fixed else _drop_twins(data, fit), 1.0)
    if fixed:
        fit = _refine_with_noise(data, fit, stated_weight)
    else:
        fit = _refine_again(data, fit, stated_weight) if is_dense else _search_modes(data, fit, stated_weight)
    if frf.variance is None:
        line_weight = _residual_line_weight(data, fit)
        if line_weight is not None:
            data = Data.of(frf, line_weight)
            fit = (_refine_again(data, fit, None) if is_dense or fixed
                   else _drop_weak_modes(data, _refine_with_noise(data, fit, None), None))
    residual_weight = _residual_weight(data, fit)
    # The larger noise of the two counts: a stated variance does not hold what the model misses, the residual may be small by
    # chance.
    final_weight = residual_weight if stated_weight is None else np.minimum(stated_weight, residual_weight)
    # The median of the responses: a single faulty channel does not widen all intervals.
    excess = 1.0 if stated_weight is None else float(np.median((stated_weight / residual_weight) ** 2))
    fit = evaluate(data, fit.poles, fit.participation, weight=final_weight)
    spread = correlation_factor(residual(data, fit))
    data, fit, information = reduce_outside_terms(data, fit, spread)
    # Noise that is smooth along the lines shows in both: the larger factor counts.
    widening_of_modes = np.maximum(spread, widening(fit, frf.outputs))
    return Estimate(data, replace(fit, information=information), excess, spread, widening_of_modes)


def _search_on_averages(frf: Frf, poles: ComplexArray, participation: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return poles (rad/s) and participation of the modes that lines averaged in blocks give evidence for."""
    averaged, counts = average_lines(frf, poles)
    line_weight = _stated_line_weight(averaged)
    data = Data.of(averaged, np.sqrt(counts / counts.mean()) if line_weight is None else line_weight)
    stated_weight = _stated_weight(averaged, data.line_weight)
    weight = starting_weight(averaged) if stated_weight is None else stated_weight
    fit = _search_modes(data, evaluate(data, poles / data.scale, participation, weight=weight), stated_weight)
    return fit.poles * data.scale, fit.participation


def _search_modes(data: Data, fit: PoleFit, stated_weight: FloatArray | None) -> PoleFit:
    """Return the refined fit without modes that lack evidence, and with those that the residual shows."""
    return _add_missing_modes(data, _drop_weak_modes(data, _refine_with_noise(data, fit, stated_weight), stated_weight),
                              stated_weight)


def _refine_again(data: Data, fit: PoleFit, stated_weight: FloatArray | None) -> PoleFit:
    """Return the fit refined from poles that are nearly converged."""
    weight = stated_weight if stated_weight is not None else _residual_weight(data, fit)
    return refine_poles(data, fit.poles * data.scale, fit.participation, weight=weight, tolerance=FINE_TOLERANCE)


def _drop_twins(data: Data, fit: PoleFit) -> PoleFit:
    """Return the fit with its poles as they are, less twins of one mode and modes without evidence."""
    fit = evaluate(data, *merge_twins(fit), weight=fit.weight)
    fit = evaluate(data, fit.poles, fit.participation, weight=_residual_weight(data, fit))
    keep = _is_plausible(data, fit) & (fit.significance > _evidence_limit(fit.weight.shape[0]))
    return evaluate(data, fit.poles[keep], fit.participation[:, keep], weight=fit.weight) if keep.any() else fit


def _add_missing_modes(data: Data, fit: PoleFit, stated_weight: FloatArray | None) -> PoleFit:
    """Return the fit with modes that the orders missed and the residual shows, one after the other."""
    failed: list[complex] = []
    for _ in range(MAX_ADDED_MODES):
        candidate = search(data, fit, residual(data, fit), tried=failed)
        if candidate is None:
            break
        trial = _try_candidate(data, fit, candidate, stated_weight)
        if trial is not None:
            fit, failed = trial, []
        elif len(failed) == MAX_FAILED_CANDIDATES:
            break
        else:  # noise that is larger elsewhere in the band may come before a mode
            failed.append(candidate.pole)
    return fit


def _try_candidate(data: Data, fit: PoleFit, candidate: Candidate, stated_weight: FloatArray | None) -> PoleFit | None:
    """Return the fit with one more mode, None where there is no evidence for it, or it explains nothing."""
    poles = np.append(fit.poles, candidate.pole)
    extended = try_evaluate(data, poles, np.column_stack([fit.participation, candidate.participation]), weight=fit.weight)
    if extended is None:
        return None
    trial = _refine_with_noise(data, extended, stated_weight)
    remaining = search(data, trial, residual(data, trial), trial_pole=candidate.pole)
    is_explained = remaining is None or remaining.gain < max(MAX_REMAINING_GAIN, 0.05 * candidate.gain)
    is_evident = trial.significance.min() > _evidence_limit(fit.weight.shape[0])
    return trial if _is_plausible(data, trial)[-1] and is_explained and is_evident else None


def _is_plausible(data: Data, fit: PoleFit) -> np.ndarray:
    """Return for every mode whether it lies within the band and its damping is that of a structure."""
    size = np.abs(fit.poles) * data.scale
    margin = 0.01 * size
    is_inside = (size >= data.frf.omega[0] - margin) & (size <= data.frf.omega[-1] + margin)
    return is_inside & (np.abs(fit.poles.real) < 1.5 * MAX_POLE_DAMPING * np.abs(fit.poles))


def _evidence_limit(outputs: int) -> float:
    """Return the Wald statistic above which a mode is evident, for so many outputs."""
    return float(2 * outputs + 10 * np.sqrt(4 * outputs) + 25)


def _refine_with_noise(data: Data, fit: PoleFit, stated_weight: FloatArray | None) -> PoleFit:
    # The noise of each response is estimated from its residual: after the first pass well enough for weights.
    """Return the fit refined with the stated weights, or twice with those of its residual."""
    for tolerance in (FINE_TOLERANCE,) if stated_weight is not None else (ROUGH_TOLERANCE, FINE_TOLERANCE):
        weight = stated_weight if stated_weight is not None else _residual_weight(data, fit)
        fit = refine_poles(data, fit.poles * data.scale, fit.participation, weight=weight, tolerance=tolerance)
    return fit


def _residual_weight(data: Data, fit: PoleFit) -> FloatArray:
    """Return one over the standard deviation of the real and imaginary part of the residual of each response."""
    inputs, count = fit.participation.shape
    freedom = max(data.values.shape[0] - data.outside.shape[1] - 2 * count / inputs, 1.0)
    power = np.einsum("foi,foi->oi", data.values, data.values) / data.values.shape[0]
    variance = np.maximum(fit.squares / freedom, MIN_RELATIVE_NOISE**2 * scale_powers(power))
    is_live = power > MIN_RESPONSE_POWER * power.max()
    # The noise of what holds rounding alone is not known: that of the quietest other response stands for it.
    variance = np.where(is_live, variance, variance[is_live].min())
    return np.where(power > 0, 1 / np.sqrt(variance), UNMEASURED_WEIGHT / np.sqrt(power.max()))


def _stated_line_weight(frf: Frf) -> FloatArray | None:
    """Return one over the noise of each line over its mean, from the stated variance."""
    if frf.variance is None:
        return None
    mean = frf.variance.mean(axis=0)
    has_variance = mean > 0
    if not has_variance.any():
        return None
    relative = (frf.variance[:, has_variance] / mean[has_variance]).mean(axis=1)
    # A variance from a few hits is itself uncertain: weights of single lines would prefer those that look good by chance.
    kernel = np.ones(min(-(-VARIANCE_SMOOTHING_LINES // int(has_variance.sum())), relative.size))
    smoothed = np.convolve(relative, kernel, "same") / np.convolve(np.ones_like(relative), kernel, "same")
    return 1 / np.sqrt(np.maximum(smoothed, 1e-4))


def _stated_weight(frf: Frf, line_weight: FloatArray) -> FloatArray | None:
    """Return sqrt(2) over the stated standard deviation of each response; None where none is stated."""
    if frf.variance is None:
        return None
    level = (frf.variance * (line_weight**2)[:, None, None]).mean(axis=0) / 2
    power = scale_powers((np.abs(frf.values) ** 2).mean(axis=0))
    return 1 / np.sqrt(np.maximum(np.maximum(level, MIN_RELATIVE_NOISE**2 * power), np.finfo(float).tiny))


def _residual_line_weight(data: Data, fit: PoleFit) -> FloatArray | None:
    """Return the weight of every line where the noise of the residual clearly varies over the band, else None.

    The noise is the third difference of the residual over a sixteenth of the band: what the model misses is smooth and
    does not count as noise.
    """
    lines = data.p.size
    if lines < 8 * NOISE_WINDOW_COUNT:
        return None
    misfit = residual(data, fit)
    third_differences = np.abs(np.diff(misfit, n=3, axis=0)) ** 2
    power = third_differences.reshape(lines - 3, -1).mean(axis=1) / 20
    kernel = np.ones(lines // NOISE_WINDOW_COUNT)
    smoothed = np.convolve(power, kernel, "same") / np.convolve(np.ones_like(power), kernel, "same")
    # A third difference shortens the lines by three: its ends stand for those that have none.
    smoothed = np.concatenate([smoothed[:1], smoothed, smoothed[-1:], smoothed[-1:]])
    if smoothed.max() < MIN_NOISE_VARIATION * smoothed.min():
        return None
    relative = smoothed / np.median(smoothed)
    return 1 / np.sqrt(np.clip(relative, 1e-3, 1e3))


def residual(data: Data, fit: PoleFit) -> ComplexArray:
    """Return measured less synthesised responses over their noise, for MAX_SAMPLED_OUTPUTS outputs at most, (n_f, n_o, n_i)."""
    model = synthesise(data, fit)
    sampled = np.unique(np.linspace(0, fit.weight.shape[0] - 1, MAX_SAMPLED_OUTPUTS).astype(int))
    model_of_sample = ModalModel(model.terms, model.coefficients[:, sampled])
    return (data.frf.values[:, sampled] - model_of_sample.values()) * data.line_weight[:, None, None] * fit.weight[sampled]


def correlation_factor(misfit: ComplexArray) -> float:
    r"""Return :math:`1 + 2 \sum_l \rho_l` of residuals along the lines, as far as their correlation is significant.

    Noise of windowed data, and what the model cannot follow (a structure that is not quite linear), is shared by
    neighbouring lines: as many lines as share it count as one.
    """
    normalised = misfit.reshape(misfit.shape[0], -1)
    power = (np.abs(normalised) ** 2).sum(axis=0)
    # A response without noise of its own (planes that do not couple) shows the synthesis, which is smooth, and no residual.
    is_noisy = power > MIN_NOISY_POWER * power.max(initial=0.0)
    normalised = normalised[:, is_noisy] / np.sqrt(power[is_noisy])
    lines, responses = normalised.shape
    limit = 3 / np.sqrt(2 * max(lines * responses, 1))
    total = 1.0
    for lag in range(1, lines // 4):
        correlation = float((normalised[lag:] * normalised[:-lag].conj()).sum().real) / max(responses, 1)
        if correlation < limit:
            break
        total += 2 * correlation
    return total


def synthesise(data: Data, fit: PoleFit) -> ModalModel:
    """Return the model of a fit."""
    terms = (pole_terms(data.p, fit.poles) * data.factor[:, None, None]).reshape(data.p.size, -1)
    residue = fit.shape[:, None, :] * fit.participation
    parts = np.stack([residue.real, residue.imag], axis=-1).reshape(*residue.shape[:2], -1).transpose(2, 0, 1)
    outside_factors = data.outside.T @ data.values.reshape(data.values.shape[0], -1)
    outside_factors -= (data.outside.T @ real_rows(terms)) @ parts.reshape(parts.shape[0], -1)
    outside = data.outside[:data.p.size] + 1j * data.outside[data.p.size:]
    all_terms = np.concatenate([terms, outside], axis=1) / data.line_weight[:, None]
    return ModalModel(np.asarray(all_terms, complex), np.concatenate([parts, outside_factors.reshape(-1, *parts.shape[1:])]))


def _drop_weak_modes(data: Data, fit: PoleFit, stated_weight: FloatArray | None) -> PoleFit:
    """Return the fit without modes that the data give no evidence for, the weakest removed first."""
    limit = _evidence_limit(fit.weight.shape[0])
    while fit.poles.size > 1:
        evidence = np.where(_is_plausible(data, fit), fit.significance, 0.0)
        weakest = int(np.argmin(evidence))
        is_evident = evidence[weakest] > limit and np.isfinite(evidence[weakest])
        if is_evident and evidence[weakest] > WEAK_EVIDENCE_FACTOR * limit:
            break
        kept = np.arange(fit.poles.size) != weakest
        start = evaluate(data, fit.poles[kept], fit.participation[:, kept], weight=fit.weight)
        # Two poles on one mode need each other at their places: only a refit of one alone decides.
        reduced = start
        if is_evident:
            reduced = refine_poles(data, start.poles * data.scale, start.participation, weight=fit.weight,
                                 tolerance=FINE_TOLERANCE)
        if is_evident and 2 * (reduced.cost - fit.cost) > limit:
            break
        fit = _refine_with_noise(data, reduced, stated_weight)
    return fit


def to_modes(estimate: Estimate, with_covariance: bool = True) -> Modes:
    """Return the modes of a fit, lowest first, scaled by the driving points where there are any."""
    data, fit = estimate.data, estimate.fit
    rank = np.argsort(np.abs(fit.poles), kind="stable")
    poles = fit.poles[rank] * data.scale
    if (np.abs(poles) == 0).any():
        fail("poles", "a pole at zero", "must have a frequency")
    points = driving_points(data.frf.outputs, data.frf.inputs)
    scaled = [scale_shapes(fit.shape[:, r] * data.scale, fit.participation[:, r], points) for r in rank]
    is_scaled = all(part[2] for part in scaled)
    gain = np.array([np.abs(part[0]).max() / max(np.abs(fit.shape[:, r]).max(), np.finfo(float).tiny)
                     for part, r in zip(scaled, rank, strict=True)])
    outputs = fit.shape.shape[0]
    diagonal = np.diagonal(fit.shape_covariance, axis1=1, axis2=2).reshape(outputs, -1, 2).sum(axis=-1)[:, rank]
    lower, upper = _residual_terms(data, fit)
    widening_of_modes = np.ones(rank.size) if estimate.wider is None else estimate.wider
    return Modes(
        np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles), np.stack([part[0] for part in scaled], axis=1),
        data.frf.outputs, "modal A" if is_scaled else "unscaled",
        participation=np.stack([part[1] for part in scaled], axis=1), input_dofs=data.frf.inputs,
        lower_residual=lower, upper_residual=upper,
        covariance=(widening_of_modes[:, None, None] * covariance(data, fit))[rank] if with_covariance else None,
        shape_variance=widening_of_modes[rank] * diagonal * gain**2 if with_covariance else None, notes=data.frf.notes)


def covariance(data: Data, fit: PoleFit) -> FloatArray:
    """Return the covariance of (frequency in Hz, damping ratio) of every mode, shape (n_modes, 2, 2)."""
    variance = pole_covariance(fit)
    result = np.empty((fit.poles.size, 2, 2))
    for r, s in enumerate(fit.poles):
        size = abs(s)
        slope = np.array([[s.real / size * data.scale / (2 * np.pi), s.imag / size * data.scale / (2 * np.pi)],
                          [-s.imag**2 / size**3, s.real * s.imag / size**3]])
        result[r] = slope @ variance[r] @ slope.T
    return result


def _residual_terms(data: Data, fit: PoleFit) -> tuple[ComplexArray, ComplexArray]:
    """Return lower and upper residual (receptance, lower / s^2 + upper) nearest to all terms outside the band."""
    model = synthesise(data, fit)
    q = data.outside.shape[1]
    p = laplace(data.frf)
    two_terms = real_rows(np.stack([1 / p**2, np.ones_like(p)], axis=1) * (factor(data.frf) * data.line_weight)[:, None])
    size = np.linalg.norm(two_terms, axis=0)
    coefficients = np.linalg.lstsq(two_terms / size, data.outside, rcond=None)[0] / size[:, None]
    terms = np.tensordot(coefficients, model.coefficients[-q:], axes=(1, 0))
    return terms[0].astype(complex), terms[1].astype(complex)
