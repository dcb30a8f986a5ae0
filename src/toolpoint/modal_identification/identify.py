"""identify: one call from frequency responses to modes, for every method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, count, fail, one_of, positive
from toolpoint._threads import on_one_thread
from toolpoint.modal_identification.band import cut, noise_level
from toolpoint.modal_identification.fit import estimate as _estimate
from toolpoint.modal_identification.fit.refinement import Indistinguishable
from toolpoint.modal_identification.judgement.advice import is_smooth, remarks
from toolpoint.modal_identification.judgement.identification import Identification, mode_quality
from toolpoint.modal_identification.judgement.joined_setups import join_setups, question_sensor
from toolpoint.modal_identification.judgement.parting import parting_remarks
from toolpoint.modal_identification.judgement.repeated_modes import RepeatedModes, find_repeated_modes
from toolpoint.modal_identification.judgement.resonances import Resonance, resonances
from toolpoint.modal_identification.judgement.steadiness import (
    is_crowded,
    judge_steadiness,
    steadiness_remarks,
    widen,
)
from toolpoint.modal_identification.poles.choice import PoleChoice, poles_with, remaining_modes, stray_remarks
from toolpoint.modal_identification.poles.circle_fit import CircleFit, Quadrature
from toolpoint.modal_identification.poles.era import Realization
from toolpoint.modal_identification.poles.lsce import ComplexExponential
from toolpoint.modal_identification.poles.lscf import CommonDenominator
from toolpoint.modal_identification.poles.plscf import poles_of_orders
from toolpoint.modal_identification.poles.rational_fraction import RationalFraction
from toolpoint.modal_identification.poles.selection import select_poles
from toolpoint.modal_identification.poles.start import PoleMethod, Start
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes


@dataclass(frozen=True)
class PolyReference:
    """pLSCF of all orders, automatic selection across them, and (by default) refinement by variable projection.

    Parameters
    ----------
    order : int
        Highest order; lowered to a third of the number of lines where that is less.
    step : int
        Between the orders.
    share : float
        Share of the orders that must hold a mode.
    refine : bool
        False: pLSCF alone, poles as selected.
    """

    order: int = 60
    step: int = 2
    share: float = 0.35
    refine: bool = True

    @property
    def name(self) -> str:
        """Name in messages."""
        return "pLSCF and variable projection" if self.refine else "pLSCF"

    def start(self, frf: Frf) -> Start:
        """Return the poles selected across orders."""
        order = min(count("order", self.order, 2), frf.frequency.size // 3)
        diagram = poles_of_orders(frf, order, self.step, weight=_weight(frf))
        choice = select_poles(diagram, self.share)
        return Start(choice.poles, choice.participation, diagram, choice.support)


# Doublings of the order, the share of the residual that a doubling must leave at most, and the residual's power over the noise
# (third differences along the lines) from which resonances are looked for in it; fewer responses do not tell modes from misfit.
DEEPER, LESS, UNEXPLAINED, RESPONSES = 2, 0.3, 1.5, 12


def _weight(frf: Frf) -> FloatArray | None:
    if frf.variance is None:
        return None
    mean = frf.variance.mean(axis=0)
    return None if (mean <= 0).any() else 1 / np.sqrt(mean)


METHODS: dict[str, PoleMethod] = {
    "refined": PolyReference(), "plscf": PolyReference(refine=False), "lscf": CommonDenominator(),
    "lsce": ComplexExponential(), "era": Realization(), "global rfp": RationalFraction(),
    "circle fit": CircleFit(), "quadrature": Quadrature()}


@on_one_thread
def identify(frf: Frf, method: str | PoleMethod = "refined", band: tuple[float, float] | None = None, *,
             choice: PoleChoice | None = None, sensor_mass: float | None = None) -> Identification:
    """Return the modes within a band, found without user input, with confidence and fit quality.

    Parameters
    ----------
    frf : Frf
        One pose; receptance, mobility or accelerance; any number of outputs and references. Its `variance` weights the
        responses where given, otherwise the noise is estimated from the residual; its `decay` (exponential window) is
        taken out of the poles.
    method : str or Method
        ``refined`` (default: pLSCF, selection across orders, variable projection), or another of `METHODS`, or a method
        object with its own settings, e.g. ``PolyReference(order=80)``.
    band : (low, high) in Hz, optional
        The whole axis where left out. Leave a few half-power widths beyond the outer modes.
    choice : PoleChoice, optional
        Poles that a person adds, which are refined with all others, and modes that go, of those that are found without it; the
        others stay as they are. The result and its advice say so.
    sensor_mass : float, optional
        kg, of each sensor that was moved between set-ups. Modes that are seen once in every set-up are joined and that mass
        is taken out of them; without it they are named in the doubts and marked.

    Raises
    ------
    ToolpointError
        For responses without measurement, a band without lines or outside the data, no mode found, or modes that the lines
        cannot tell apart.
    """
    chosen = METHODS[one_of("method", method, METHODS)] if isinstance(method, str) else method
    inside, dead = _alive(cut(frf, band))
    if sensor_mass is not None:
        positive("sensor_mass", sensor_mass)
    try:
        return _identified_either_way(inside, chosen, dead, choice=choice, sensor_mass=sensor_mass)
    except np.linalg.LinAlgError as error:
        fail("frf", f"{inside.frequency.size} lines from {inside.frequency[0]:.4g} to {inside.frequency[-1]:.4g} Hz "
             f"({error})", "must determine the fit of the modes", remedy="widen the band, take finer lines, or check the "
             "responses for repeated or corrupt values")


def _identified_either_way(inside: Frf, chosen: PoleMethod, dead: list[str], *, choice: PoleChoice | None,
                           sensor_mass: float | None) -> Identification:
    if len(inside.inputs) > len(inside.outputs):
        # By reciprocity the side with fewer Dofs serves as references: fewer unknowns for the same poles. The sensors stayed
        # where they were and are in all responses alike.
        return _turned(_judged(_with_choice(_identified_deeper(_transposed(inside), chosen, dead), chosen, choice), chosen))
    return _judged(_with_choice(_identified_deeper(inside, chosen, dead), chosen, choice), chosen, sensor_mass)


def _with_choice(automatic: Identification, chosen: PoleMethod, choice: PoleChoice | None) -> Identification:
    """Return the identification of exactly the poles that a choice leaves of the automatic ones."""
    if choice is None or choice.is_empty:
        return automatic
    result = automatic
    if choice.add:
        poles, participation = poles_with(automatic.frf, automatic.modes, choice)
        fitted = _estimate.estimate(automatic.frf, poles, participation, refine=chosen.refine, fixed=True)
        result = _conclude(automatic.frf, fitted, chosen, (), Start(poles, participation, automatic.diagram))
    kept = remaining_modes(result.modes, automatic.modes, choice)
    if len(kept) < result.modes.count:
        result = _only(result, kept)
    return replace(result, choice=choice, advice=(choice.remark, *result.advice, *stray_remarks(result.modes, choice)))


def _only(result: Identification, kept: list[int]) -> Identification:
    """Return the identification with some of its modes, as they are; the synthesis is that of these."""
    modes, frf = result.modes.selected(kept), result.frf
    fitted = _estimate.estimate(frf, modes.poles, modes.participation_at(frf.inputs), refine=False, fixed=True)
    model, quality = _estimate.synthesise(fitted.data, fitted.fit), _quality(fitted)
    support, significance = (None if part is None else part[kept] for part in (result.support, result.significance))
    return replace(result, modes=modes, model=model, quality=quality, mode_quality=mode_quality(frf, model, modes),
                   support=support, significance=significance, resonances=resonances(frf, modes, result.smooth))


def _judged(result: Identification, chosen: PoleMethod, sensor_mass: float | None = None) -> Identification:
    """Return the identification with its intervals as wide as its modes move with the band, where its residual is not noise,
    and with the points, where modes crowd that one reference alone tells apart; modes that set-ups of sensors repeat are
    named, or joined."""
    repeated = find_repeated_modes(result.modes)
    if repeated is not None:
        if sensor_mass is not None:
            return _joined(result, repeated, sensor_mass)
        return replace(result, repeated=repeated, doubts=(repeated.doubt(result.modes), *result.doubts))
    if sensor_mass is not None:
        result = replace(result, doubts=(*result.doubts, *question_sensor(result.modes, sensor_mass)))
    crowded = is_crowded(result.modes) and len(result.frf.inputs) == 1
    if not (result.smooth or crowded) or result.modes.covariance is None:
        return result
    steadiness = judge_steadiness(result.frf, result.modes, lambda part: _identified(part, chosen, []).modes,
                                  bands=result.smooth, points=crowded)
    if steadiness is None:
        return result
    modes = widen(result.modes, steadiness)
    return replace(result, modes=modes, steadiness=steadiness,
                   advice=(*result.advice, *steadiness_remarks(modes, steadiness, result.modes)))


def _joined(result: Identification, repeated: RepeatedModes, mass: float) -> Identification:
    """Return the identification with every mode of several set-ups once, without the mass (kg) of its sensors."""
    joined = join_setups(result.modes, repeated, mass)
    names = ", ".join(str(k + 1) for k, member in enumerate(joined.members) if len(member) > 1)
    share = result.share
    groups = tuple(Resonance((k,), k, float(share[list(member)].max()), frequency=float(joined.modes.frequency[k]))
                   for k, member in enumerate(joined.members))
    first = [member[0] for member in joined.members]
    support, significance = (None if part is None else part[first] for part in (result.support, result.significance))
    note = f"modes {names} were seen once in every set-up of sensors ({result.modes.count} in all) and are joined"
    return replace(result, modes=joined.modes, support=support, significance=significance, resonances=groups,
                   mode_quality=np.array([result.mode_quality[list(member)].min() for member in joined.members]),
                   doubts=(*joined.doubts, *result.doubts), advice=(note, *joined.notes, *result.advice))


def _identified_deeper(inside: Frf, chosen: PoleMethod, dead: list[str]) -> Identification:
    """Return the identification; at twice the order where resonances are left in the residual and more order explains them.

    Few references carry many modes only at high orders: one reference of a machine of six bodies loses the lower half of its
    modes at order 60 and none at 120.
    """
    result = _identified(inside, chosen, dead)
    for _ in range(DEEPER):
        if not (isinstance(chosen, PolyReference) and chosen.refine and _leaves_resonances(result)):
            break
        chosen = replace(chosen, order=2 * chosen.order)
        try:
            deeper = _identified(inside, chosen, dead)
        except Indistinguishable:  # more modes than the lines tell apart: what was found stands
            break
        if deeper.modes.count <= result.modes.count or 1 - deeper.fit > LESS * (1 - result.fit):
            break
        note = (f"order {chosen.order // 2} left resonances in the residual; order {chosen.order} explains "
                f"{deeper.modes.count - result.modes.count} modes more")
        result = replace(deeper, advice=(*deeper.advice, note))
    return result


def _leaves_resonances(result: Identification) -> bool:
    """Return whether what the synthesis leaves is larger at the peaks of the responses than their noise along the lines."""
    values = result.frf.values.reshape(result.frf.frequency.size, -1)
    if values.shape[1] < RESPONSES:
        return False
    noise = noise_level(values.real) ** 2 + noise_level(values.imag) ** 2
    power = (np.abs(values) ** 2).mean(axis=0)
    left = (1 - result.quality.ravel()) * power
    return bool(np.median(left / np.maximum(noise, 1e-8 * power)) > UNEXPLAINED)


def _identified(inside: Frf, chosen: PoleMethod, dead: list[str]) -> Identification:
    start = chosen.start(inside)
    if start.poles.size == 0:
        fail("frf", f"no mode found within {inside.frequency[0]:g} .. {inside.frequency[-1]:g} Hz by {chosen.name}",
             "at least one resonance must stand out of the noise", remedy="widen the band, raise the order or average more")
    fitted = _estimate.estimate(inside, start.poles + inside.decay, start.participation, refine=chosen.refine)
    return _conclude(inside, fitted, chosen, dead, start)


def _conclude(inside: Frf, fitted: _estimate.Estimate, chosen: PoleMethod, first: Sequence[str], start: Start
              ) -> Identification:
    """Return the identification of a fit; `first` are the remarks that come before those of its judgement."""
    every = _estimate.to_modes(fitted, chosen.refine)
    modes, kept, unstable = _without_unstable(every, inside.decay)
    model = _estimate.synthesise(fitted.data, fitted.fit)
    quality = _quality(fitted)
    per_mode = mode_quality(inside, model, modes)
    rank = np.argsort(np.abs(fitted.fit.poles), kind="stable")[kept]
    smooth = is_smooth(fitted.spread, quality)
    groups = resonances(inside, modes, smooth)
    advice = (*first, *unstable, *start.notes, *parting_remarks(inside, model.values()),
              *remarks(inside, modes, quality, mode_quality=per_mode, excess=fitted.excess, spread=fitted.spread,
                       groups=groups))
    return Identification(modes, inside, model, quality, per_mode, chosen.name, start.diagram,
                          _support(start, fitted.fit.poles[rank] * fitted.data.scale),
                          fitted.fit.significance[rank] / (2 * len(inside.outputs)), advice, groups, smooth=smooth)


def _without_unstable(modes: Modes, decay: float) -> tuple[Modes, np.ndarray, list[str]]:
    """Return the modes with damping, their places, and a remark on those without: a passive structure has none.

    With a window's decay taken out all are kept: then it is the decay that is in question. So they are where all are such.
    """
    kept = np.flatnonzero(modes.damping_ratio > 0)
    if decay != 0 or kept.size in (0, modes.count):
        return modes, np.arange(modes.count), []
    gone = ", ".join(f"{modes.frequency[i]:.4g} Hz ({100 * modes.damping_ratio[i]:.2g} %)"
                     for i in np.setdiff1d(np.arange(modes.count), kept))
    return modes.selected(kept.tolist()), kept, [
        f"poles without positive damping stay in the synthesis but are no modes: {gone}; drift of integrated signals or noise "
        "makes them, mostly at the ends of the band: narrow it"]


def _transposed(frf: Frf) -> Frf:
    return replace(frf, values=np.swapaxes(frf.values, -1, -2), outputs=frf.inputs, inputs=frf.outputs,
                   coherence=_swapped(frf.coherence), variance=_swapped(frf.variance))


def _swapped(array: FloatArray | None) -> FloatArray | None:
    return None if array is None else np.swapaxes(array, -1, -2)


def _turned(identification: Identification) -> Identification:
    modes = identification.modes
    turned = replace(
        modes, shape=modes.participation_at(modes.input_dofs), dofs=modes.input_dofs,
        participation=modes.shape, input_dofs=modes.dofs,
        lower_residual=None if modes.lower_residual is None else modes.lower_residual.T,
        upper_residual=None if modes.upper_residual is None else modes.upper_residual.T, shape_variance=None)
    model = replace(identification.model, coefficients=np.swapaxes(identification.model.coefficients, -1, -2))
    return replace(identification, modes=turned, frf=_transposed(identification.frf), model=model,
                   quality=identification.quality.T)


def _alive(frf: Frf) -> tuple[Frf, list[str]]:
    power = (np.abs(frf.values) ** 2).sum(axis=0)
    rows, columns = power.any(axis=1), power.any(axis=0)
    names = [str(dof) for dof, alive in zip(frf.outputs, rows, strict=True) if not alive]
    names += [str(dof) for dof, alive in zip(frf.inputs, columns, strict=True) if not alive]
    if not names:
        return frf, []
    kept = frf.selected(np.flatnonzero(rows).tolist(), np.flatnonzero(columns).tolist())
    return kept, [f"dead channel{'s' * (len(names) > 1)} left out (all zero): {', '.join(names)}"]


def _quality(fitted: _estimate.Estimate) -> FloatArray:
    total = np.einsum("foi,foi->oi", fitted.data.values, fitted.data.values)
    # A response of rounding alone, beside others, is explained by nothing: its share stays finite.
    return 1 - fitted.fit.squares / np.maximum(total, max(1e-25 * float(total.max()), np.finfo(float).tiny))


def _support(start: Start, poles: ComplexArray) -> FloatArray | None:
    if start.support is None:
        return None
    nearest = np.argmin(np.abs(poles[:, None] - start.poles), axis=1)
    return start.support[nearest]
