"""From starting poles to modes: noise levels, refinement, removal of modes without evidence, scaling, covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.modal_identification.basis import factor, laplace, pole_terms, real_rows
from toolpoint.modal_identification.fit.averaged_lines import average_lines
from toolpoint.modal_identification.fit.clusters import widening
from toolpoint.modal_identification.fit.completion import Candidate, search
from toolpoint.modal_identification.fit.dense_lines import DENSE
from toolpoint.modal_identification.fit.outside import economical, pole_covariance
from toolpoint.modal_identification.fit.refinement import Data, PoleFit, evaluate, refine_poles, solvable
from toolpoint.modal_identification.fit.twins import without_twins
from toolpoint.modal_identification.judgement.identification import ModalModel
from toolpoint.modal_identification.poles.stabilization import LARGEST_DAMPING
from toolpoint.modal_identification.scaling import scale_shapes
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

FLOOR = 1e-8
WINDOW_PARTS = 16
UNEVEN = 3.0
SAMPLED = 48
MOST_ADDED = 8
MOST_TRIED = 3  # candidates in a row that come to nothing
EXPLAINED = 3.0
STEADY = 100
ROUGH, TOLERANCE = 10.0, 1e-2
DOUBTFUL = 10.0


@dataclass(frozen=True, eq=False)
class Estimate:
    """A converged fit with its data.

    `excess` is the residual over the stated variance (1 where none is stated); `spread` says by how much neighbouring
    lines share their residual, which widens the covariance (1 for independent lines).
    """

    data: Data
    fit: PoleFit
    excess: float
    spread: float = 1.0
    wider: FloatArray | None = None


def starting_weight(frf: Frf) -> FloatArray:
    """Return one over the rms of each response; a response that is zero gets next to no weight."""
    rms = np.sqrt((np.abs(frf.values) ** 2).mean(axis=0))
    return np.where(rms > 1e-12 * rms.max(), 1 / np.where(rms > 0, rms, 1.0), 1e-6 / rms.max())


def estimate(frf: Frf, poles: ComplexArray, participation: ComplexArray, *, refine: bool = True, fixed: bool = False
             ) -> Estimate:
    """Return the fit from starting poles (rad/s, free of the window): refined, or with these poles as they are.

    fixed : refine exactly these poles; none is left out for lack of evidence, none added for what the residual shows.
    """
    dense = refine and not fixed and frf.frequency.size > DENSE
    if dense:  # which modes there are shows on fewer lines; their values come from all of them
        poles, participation = _searched_on_fewer(frf, poles, participation)
    data = Data.of(frf, _stated_lines(frf))
    stated = _stated(frf, data.line_weight)
    weight = starting_weight(frf) if stated is None else stated
    fit = evaluate(data, poles / data.scale, participation, weight=weight)
    if not refine:
        return Estimate(data, fit if fixed else _sifted(data, fit), 1.0)
    if fixed:
        fit = _refined_twice(data, fit, stated)
    else:
        fit = _polished(data, fit, stated) if dense else _searched(data, fit, stated)
    if frf.variance is None:
        lines = _noise_of_lines(data, fit)
        if lines is not None:
            data = Data.of(frf, lines)
            fit = _polished(data, fit, None) if dense or fixed else _pruned(data, _refined_twice(data, fit, None), None)
    seen = _noise(data, fit)
    final = seen if stated is None else np.minimum(stated, seen)
    excess = 1.0 if stated is None else float(np.median((stated / seen) ** 2))
    fit = evaluate(data, fit.poles, fit.participation, weight=final)
    spread = correlation_factor(residual(data, fit))
    data, fit, information = economical(data, fit, spread)
    # Noise that is smooth along the lines shows in both; whichever shows it more counts.
    wider = np.maximum(spread, widening(fit, frf.outputs))
    return Estimate(data, replace(fit, information=information), excess, spread, wider)


def _searched_on_fewer(frf: Frf, poles: ComplexArray, participation: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return poles (rad/s) and participation of the modes that lines averaged in blocks give evidence for."""
    fewer, counts = average_lines(frf, poles)
    stated_lines = _stated_lines(fewer)
    data = Data.of(fewer, np.sqrt(counts / counts.mean()) if stated_lines is None else stated_lines)
    stated = _stated(fewer, data.line_weight)
    weight = starting_weight(fewer) if stated is None else stated
    fit = _searched(data, evaluate(data, poles / data.scale, participation, weight=weight), stated)
    return fit.poles * data.scale, fit.participation


def _searched(data: Data, fit: PoleFit, stated: FloatArray | None) -> PoleFit:
    """Return the refined fit without modes that lack evidence, with those that the residual shows."""
    return _completed(data, _pruned(data, _refined_twice(data, fit, stated), stated), stated)


def _polished(data: Data, fit: PoleFit, stated: FloatArray | None) -> PoleFit:
    """Return the fit refined from poles that are nearly right already."""
    weight = stated if stated is not None else _noise(data, fit)
    return refine_poles(data, fit.poles * data.scale, fit.participation, weight=weight, tolerance=TOLERANCE)


def _sifted(data: Data, fit: PoleFit) -> PoleFit:
    """Return the fit with its poles as they are, less twins of one mode and modes without evidence."""
    fit = evaluate(data, *without_twins(fit), weight=fit.weight)
    fit = evaluate(data, fit.poles, fit.participation, weight=_noise(data, fit))
    keep = _plausible(data, fit) & (fit.significance > _evidence_limit(fit.weight.shape[0]))
    return evaluate(data, fit.poles[keep], fit.participation[:, keep], weight=fit.weight) if keep.any() else fit


def _completed(data: Data, fit: PoleFit, stated: FloatArray | None) -> PoleFit:
    """Return the fit with modes that the orders missed but the residual shows, one after the other."""
    tried: list[complex] = []
    for _ in range(MOST_ADDED):
        before = search(data, fit, residual(data, fit), tried=tried)
        if before is None:
            break
        trial = _with_candidate(data, fit, before, stated)
        if trial is not None:
            fit, tried = trial, []
        elif len(tried) == MOST_TRIED:
            break
        else:  # noise that is larger elsewhere in the band may stand before what is there
            tried.append(before.pole)
    return fit


def _with_candidate(data: Data, fit: PoleFit, candidate: Candidate, stated: FloatArray | None) -> PoleFit | None:
    """Return the fit with one more mode, None where there is no evidence for it, or it explains nothing."""
    poles = np.append(fit.poles, candidate.pole)
    wider = solvable(data, poles, np.column_stack([fit.participation, candidate.participation]), weight=fit.weight)
    if wider is None:
        return None
    trial = _refined_twice(data, wider, stated)
    after = search(data, trial, residual(data, trial), at=candidate.pole)
    explained = after is None or after.gain < max(EXPLAINED, 0.05 * candidate.gain)
    evident = trial.significance.min() > _evidence_limit(fit.weight.shape[0])
    return trial if _plausible(data, trial)[-1] and explained and evident else None


def _plausible(data: Data, fit: PoleFit) -> np.ndarray:
    """Return for every mode whether it lies within the band and is not damped beyond what a structure is."""
    size = np.abs(fit.poles) * data.scale
    slack = 0.01 * size
    inside = (size >= data.frf.omega[0] - slack) & (size <= data.frf.omega[-1] + slack)
    return inside & (np.abs(fit.poles.real) < 1.5 * LARGEST_DAMPING * np.abs(fit.poles))


def _evidence_limit(outputs: int) -> float:
    return float(2 * outputs + 10 * np.sqrt(4 * outputs) + 25)


def _refined_twice(data: Data, fit: PoleFit, stated: FloatArray | None) -> PoleFit:
    # The noise of each response is read off its residual: after the first pass it is known well enough for weights.
    for tolerance in (TOLERANCE,) if stated is not None else (ROUGH, TOLERANCE):
        weight = stated if stated is not None else _noise(data, fit)
        fit = refine_poles(data, fit.poles * data.scale, fit.participation, weight=weight, tolerance=tolerance)
    return fit


def _noise(data: Data, fit: PoleFit) -> FloatArray:
    """Return one over the standard deviation of the real and imaginary part of the residual of each response."""
    inputs, count = fit.participation.shape
    freedom = max(data.values.shape[0] - data.outside.shape[1] - 2 * count / inputs, 1.0)
    rms2 = np.einsum("foi,foi->oi", data.values, data.values) / data.values.shape[0]
    variance = np.maximum(fit.squares / freedom, FLOOR**2 * rms2)
    alive = rms2 > 1e-24 * rms2.max()
    return np.where(alive, 1 / np.sqrt(np.where(alive, variance, 1.0)), 1e-6 / np.sqrt(rms2.max()))


def _stated_lines(frf: Frf) -> FloatArray | None:
    """Return one over the noise of each line over its mean, from the stated variance."""
    if frf.variance is None:
        return None
    mean = frf.variance.mean(axis=0)
    known = mean > 0
    if not known.any():
        return None
    relative = (frf.variance[:, known] / mean[known]).mean(axis=1)
    # A variance from a few hits is itself uncertain: weights of single lines would prefer those that look good by chance.
    kernel = np.ones(min(-(-STEADY // int(known.sum())), relative.size))
    smooth = np.convolve(relative, kernel, "same") / np.convolve(np.ones_like(relative), kernel, "same")
    return 1 / np.sqrt(np.maximum(smooth, 1e-4))


def _stated(frf: Frf, line_weight: FloatArray) -> FloatArray | None:
    if frf.variance is None:
        return None
    level = (frf.variance * (line_weight**2)[:, None, None]).mean(axis=0) / 2
    rms2 = (np.abs(frf.values) ** 2).mean(axis=0)
    return 1 / np.sqrt(np.maximum(np.maximum(level, FLOOR**2 * rms2), np.finfo(float).tiny))


def _noise_of_lines(data: Data, fit: PoleFit) -> FloatArray | None:
    """Return the weight of every line where the noise of the residual clearly varies over the band, else None.

    The noise is the third difference of the residual over a sixteenth of the band: what the model misses is smooth and
    does not count as noise.
    """
    lines = data.p.size
    if lines < 8 * WINDOW_PARTS:
        return None
    left = residual(data, fit)
    third = np.abs(np.diff(left, n=3, axis=0)) ** 2
    power = third.reshape(lines - 3, -1).mean(axis=1) / 20
    kernel = np.ones(lines // WINDOW_PARTS)
    smooth = np.convolve(power, kernel, "same") / np.convolve(np.ones_like(power), kernel, "same")
    smooth = np.concatenate([smooth[:1], smooth, smooth[-1:], smooth[-1:]])
    if smooth.max() < UNEVEN * smooth.min():
        return None
    relative = smooth / np.median(smooth)
    return 1 / np.sqrt(np.clip(relative, 1e-3, 1e3))


def residual(data: Data, fit: PoleFit) -> ComplexArray:
    """Return measured less synthesised responses over their noise, for SAMPLED outputs at most, (n_f, n_o, n_i)."""
    model = synthesise(data, fit)
    some = np.unique(np.linspace(0, fit.weight.shape[0] - 1, SAMPLED).astype(int))
    part = ModalModel(model.terms, model.coefficients[:, some])
    return (data.frf.values[:, some] - part.values()) * data.line_weight[:, None, None] * fit.weight[some]


def correlation_factor(left: ComplexArray) -> float:
    r"""Return :math:`1 + 2 \sum_l \rho_l` of residuals along the lines, as far as their correlation is significant.

    Noise of windowed data, and what the model cannot follow (a structure that is not quite linear), is shared by
    neighbouring lines: as many lines as share it count as one.
    """
    flat = left.reshape(left.shape[0], -1)
    power = (np.abs(flat) ** 2).sum(axis=0)
    flat = flat[:, power > 0] / np.sqrt(power[power > 0])
    lines, responses = flat.shape
    limit = 3 / np.sqrt(2 * max(lines * responses, 1))
    total = 1.0
    for lag in range(1, lines // 4):
        part = float((flat[lag:] * flat[:-lag].conj()).sum().real) / max(responses, 1)
        if part < limit:
            break
        total += 2 * part
    return total


def synthesise(data: Data, fit: PoleFit) -> ModalModel:
    """Return the model of a fit."""
    terms = (pole_terms(data.p, fit.poles) * data.factor[:, None, None]).reshape(data.p.size, -1)
    residue = fit.shape[:, None, :] * fit.participation
    parts = np.stack([residue.real, residue.imag], axis=-1).reshape(*residue.shape[:2], -1).transpose(2, 0, 1)
    inner = data.outside.T @ data.values.reshape(data.values.shape[0], -1)
    inner -= (data.outside.T @ real_rows(terms)) @ parts.reshape(parts.shape[0], -1)
    outside = data.outside[:data.p.size] + 1j * data.outside[data.p.size:]
    every = np.concatenate([terms, outside], axis=1) / data.line_weight[:, None]
    return ModalModel(np.asarray(every, complex), np.concatenate([parts, inner.reshape(-1, *parts.shape[1:])]))


def _pruned(data: Data, fit: PoleFit, stated: FloatArray | None) -> PoleFit:
    """Return the fit without modes that the data give no evidence for, the weakest taken out first."""
    limit = _evidence_limit(fit.weight.shape[0])
    while fit.poles.size > 1:
        evidence = np.where(_plausible(data, fit), fit.significance, 0.0)
        weakest = int(np.argmin(evidence))
        evident = evidence[weakest] > limit and np.isfinite(evidence[weakest])
        if evident and evidence[weakest] > DOUBTFUL * limit:
            break
        keep = np.arange(fit.poles.size) != weakest
        without = evaluate(data, fit.poles[keep], fit.participation[:, keep], weight=fit.weight)
        # Two poles on one mode need each other where they stand: only the fit of the one alone tells.
        alone = without
        if evident:
            alone = refine_poles(data, without.poles * data.scale, without.participation, weight=fit.weight,
                                 tolerance=TOLERANCE)
        if evident and 2 * (alone.cost - fit.cost) > limit:
            break
        fit = _refined_twice(data, alone, stated)
    return fit


def to_modes(estimate: Estimate, with_covariance: bool = True) -> Modes:
    """Return the modes of a fit, lowest first, scaled by the driving points where there are any."""
    data, fit = estimate.data, estimate.fit
    rank = np.argsort(np.abs(fit.poles), kind="stable")
    poles = fit.poles[rank] * data.scale
    if (np.abs(poles) == 0).any():
        fail("poles", "a pole at zero", "must have a frequency")
    points = driving_points(data.frf.outputs, data.frf.inputs)
    parts = [scale_shapes(fit.shape[:, r] * data.scale, fit.participation[:, r], points) for r in rank]
    is_scaled = all(part[2] for part in parts)
    gain = np.array([np.abs(part[0]).max() / max(np.abs(fit.shape[:, r]).max(), np.finfo(float).tiny)
                     for part, r in zip(parts, rank, strict=True)])
    outputs = fit.shape.shape[0]
    diagonal = np.diagonal(fit.shape_covariance, axis1=1, axis2=2).reshape(outputs, -1, 2).sum(axis=-1)[:, rank]
    lower, upper = _residual_terms(data, fit)
    wider = np.ones(rank.size) if estimate.wider is None else estimate.wider
    return Modes(
        np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles), np.stack([part[0] for part in parts], axis=1),
        data.frf.outputs, "modal A" if is_scaled else "unscaled",
        participation=np.stack([part[1] for part in parts], axis=1), input_dofs=data.frf.inputs,
        lower_residual=lower, upper_residual=upper,
        covariance=(wider[:, None, None] * covariance(data, fit))[rank] if with_covariance else None,
        shape_variance=wider[rank] * diagonal * gain**2 if with_covariance else None, notes=data.frf.notes)


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
    two = real_rows(np.stack([1 / p**2, np.ones_like(p)], axis=1) * (factor(data.frf) * data.line_weight)[:, None])
    size = np.linalg.norm(two, axis=0)
    fitted = np.linalg.lstsq(two / size, data.outside, rcond=None)[0] / size[:, None]
    terms = np.tensordot(fitted, model.coefficients[-q:], axes=(1, 0))
    return terms[0].astype(complex), terms[1].astype(complex)
