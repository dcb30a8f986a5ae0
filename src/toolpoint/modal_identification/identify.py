"""identify: one call from frequency responses to modes, for every method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, count, fail, one_of, positive
from toolpoint._threads import on_one_thread
from toolpoint.modal_identification.band import cut, noise_level
from toolpoint.modal_identification.basis import scale_powers
from toolpoint.modal_identification.fit import estimate as _estimate
from toolpoint.modal_identification.fit.refinement import Indistinguishable
from toolpoint.modal_identification.judgement.advice import is_smooth, remarks
from toolpoint.modal_identification.judgement.identification import Identification, mode_quality
from toolpoint.modal_identification.judgement.joined_setups import join_setups, question_sensor
from toolpoint.modal_identification.judgement.moved_sensor import (
    free_of_moved_sensor,
    is_moved_alone,
    is_split,
    largest_shift,
    merge_split_modes,
    question_moved_sensor,
    steady_modes,
)
from toolpoint.modal_identification.judgement.parting import parting_remarks
from toolpoint.modal_identification.judgement.repeated_modes import RepeatedModes, find_repeated_modes
from toolpoint.modal_identification.judgement.resonances import Resonance, resonances
from toolpoint.modal_identification.judgement.steadiness import (
    inflate_covariance,
    is_crowded,
    judge_steadiness,
    steadiness_remarks,
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
        diagram = poles_of_orders(frf, order, self.step, weight=_stated_weight(frf))
        choice = select_poles(diagram, self.share)
        return Start(choice.poles, choice.participation, diagram, choice.support)


# From order 60 to 240, where lines of a usual band (a third of their number is the largest order) end as well.
MAX_ORDER_DOUBLINGS, MAX_MOVED_SENSOR_ROUNDS = 2, 4
MAX_REMAINING_FRACTION = 0.3  # of the residual, after a doubling of the order that is kept
MIN_RESIDUAL_RATIO = 1.5  # power of the residual over the noise (third differences of lines) with resonances in it
MIN_JUDGED_RESPONSES = 12  # fewer do not distinguish modes from misfit


def _stated_weight(frf: Frf) -> FloatArray | None:
    """Return one over the stated standard deviation of each response, None where there is none."""
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
        kg, of each sensor that was moved between set-ups. Of one sensor it is taken out of the responses, point by point;
        where several were moved at once, modes that are seen once in every set-up are joined and it is taken out of them.
        Without it a mass that the frequencies show is named in the doubts.

    Raises
    ------
    ToolpointError
        For responses without measurement, a band without lines or outside the data, no mode found, or modes that the lines
        cannot tell apart.

    >>> from toolpoint.vibration import frequency_response
    >>> modes = Modes([60.0, 100.0], [0.01, 0.02], [[0.1, 0.05]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(30.0, 150.0, 0.25), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> result = identify(frf)
    >>> result.modes.frequency.round(3).tolist(), result.modes.damping_ratio.round(5).tolist()
    ([60.0, 100.0], [0.01, 0.02])
    """
    pole_method = METHODS[one_of("method", method, METHODS)] if isinstance(method, str) else method
    inside, dead_notes = _select_live_channels(cut(frf, band))
    if sensor_mass is not None:
        positive("sensor_mass", sensor_mass)
    try:
        return _identify_by_fewer_references(inside, pole_method, dead_notes, choice=choice, sensor_mass=sensor_mass)
    except np.linalg.LinAlgError as error:
        fail("frf", f"{inside.frequency.size} lines from {inside.frequency[0]:.4g} to {inside.frequency[-1]:.4g} Hz "
             f"({error})", "must determine the fit of the modes", remedy="widen the band, take finer lines, or check the "
             "responses for repeated or corrupt values")


def _identify_by_fewer_references(inside: Frf, pole_method: PoleMethod, dead_notes: list[str], *, choice: PoleChoice | None,
                           sensor_mass: float | None) -> Identification:
    """Return the identification; by reciprocity the side with fewer Dofs serves as references."""
    if len(inside.inputs) > len(inside.outputs):
        # By reciprocity the side with fewer Dofs serves as references: fewer unknowns for the same poles. The sensors stayed
        # where they were and are in all responses alike.
        return _transpose_result(_judge(_apply_choice(_identify_with_order(_transpose_frf(inside), pole_method, dead_notes),
                                                      pole_method, choice), pole_method))
    automatic, open_mass = _identify_with_order(inside, pole_method, dead_notes), sensor_mass
    if sensor_mass is not None and (freed := _without_moved_sensor(automatic, pole_method, sensor_mass)) is not None:
        automatic, open_mass = freed, None
    judged = _judge(_apply_choice(automatic, pole_method, choice), pole_method, open_mass)
    if judged.repeated is not None or judged.modes.count < automatic.modes.count:  # several sensors at once: named or joined
        return judged
    doubts = question_moved_sensor(judged.frf, judged.modes, sensor_mass, is_taken_out=open_mass is None)
    return replace(judged, doubts=(*doubts, *judged.doubts))


def _without_moved_sensor(result: Identification, pole_method: PoleMethod, mass: float) -> Identification | None:
    """Return the identification of the responses without the mass (kg) of one sensor that was moved from point to point.

    None where no driving point gives the modes a scale, where the points show that sensors did not move one by one, and where
    the set-ups are those of several sensors at once: without the mass they show more modes, or repeat them still.
    """
    if not is_moved_alone(result.frf, result.modes, mass):
        return None
    is_repeated, freed = find_repeated_modes(result.modes) is not None, result
    for _ in range(MAX_MOVED_SENSOR_ROUNDS):
        merged, count_before = merge_split_modes(freed.modes), freed.modes.count
        freed = _without_faint_modes(_identify_with_order(free_of_moved_sensor(result.frf, merged, mass), pole_method, []),
                                     pole_method)
        if freed.modes.scaling != "modal A":
            return None
        if freed.modes.count == count_before == merged.count:
            break
    if freed.modes.count > result.modes.count - is_repeated or find_repeated_modes(freed.modes) is not None:
        return None
    note = (f"the mass of {1e3 * mass:.3g} g of the sensor is taken out of the responses, point by point: it had lowered "
            f"frequencies by up to {100 * largest_shift(freed.modes, mass):.2g} %")
    return replace(freed, advice=(note, *freed.advice))


def _without_faint_modes(result: Identification, pole_method: PoleMethod) -> Identification:
    """Return the identification without modes that are a rest of the sensor's mass, which is never taken out to the last bit.

    They are faint and of no shape; the poles that stay are refined anew, as a false one takes its share of its neighbour.
    """
    kept = steady_modes(result.modes)
    if len(kept) == result.modes.count:
        return result
    modes, frf = result.modes.selected(kept), result.frf
    participation = modes.participation_at(frf.inputs)
    fitted = _estimate.estimate(frf, modes.poles, participation, refine=pole_method.refine, fixed=True)
    return _conclude(frf, fitted, pole_method, (), Start(modes.poles, participation, result.diagram))


def _apply_choice(automatic: Identification, pole_method: PoleMethod, choice: PoleChoice | None) -> Identification:
    """Return the identification of exactly the poles that a choice leaves of the automatic ones."""
    if choice is None or choice.is_empty:
        return automatic
    result = automatic
    if choice.add:
        poles, participation = poles_with(automatic.frf, automatic.modes, choice)
        estimate = _estimate.estimate(automatic.frf, poles, participation, refine=pole_method.refine, fixed=True)
        result = _conclude(automatic.frf, estimate, pole_method, (), Start(poles, participation, automatic.diagram))
    mode_numbers = remaining_modes(result.modes, automatic.modes, choice)
    if len(mode_numbers) < result.modes.count:
        result = _select_modes(result, mode_numbers)
    return replace(result, choice=choice, advice=(choice.remark, *result.advice, *stray_remarks(result.modes, choice)))


def _select_modes(result: Identification, mode_numbers: list[int]) -> Identification:
    """Return the identification with some of its modes, as they are; the synthesis is that of these."""
    modes, frf = result.modes.selected(mode_numbers), result.frf
    fitted = _estimate.estimate(frf, modes.poles, modes.participation_at(frf.inputs), refine=False, fixed=True)
    model, quality = _estimate.synthesise(fitted.data, fitted.fit), _explained_fractions(fitted)
    support, significance = (None if values is None else values[mode_numbers]
                             for values in (result.support, result.significance))
    return replace(result, modes=modes, model=model, quality=quality, mode_quality=mode_quality(frf, model, modes),
                   support=support, significance=significance, resonances=resonances(frf, modes, result.smooth))


def _judge(result: Identification, pole_method: PoleMethod, sensor_mass: float | None = None) -> Identification:
    """Return the identification with widened intervals, and with modes that set-ups of sensors repeat named or joined.

    Where the residual is not noise, intervals are as wide as the modes move with the band; where modes crowd that one reference
    alone distinguishes, as they move with the points.
    """
    repeated = find_repeated_modes(result.modes)
    if repeated is not None:
        if sensor_mass is not None:
            return _join_repeated(result, repeated, sensor_mass)
        return replace(result, repeated=repeated, doubts=(repeated.doubt(result.modes), *result.doubts))
    if sensor_mass is not None and not is_split(result.modes):
        result = replace(result, doubts=(*result.doubts, *question_sensor(result.modes, sensor_mass)))
    has_crowds = is_crowded(result.modes) and len(result.frf.inputs) == 1
    if not (result.smooth or has_crowds) or result.modes.covariance is None:
        return result
    steadiness = judge_steadiness(result.frf, result.modes, lambda responses: _identify_once(responses, pole_method, []).modes,
                                  bands=result.smooth, points=has_crowds)
    if steadiness is None:
        return result
    modes = inflate_covariance(result.modes, steadiness)
    return replace(result, modes=modes, steadiness=steadiness,
                   advice=(*result.advice, *steadiness_remarks(modes, steadiness, result.modes)))


def _join_repeated(result: Identification, repeated: RepeatedModes, mass: float) -> Identification:
    """Return the identification with every mode of several set-ups once, without the mass (kg) of its sensors."""
    joined = join_setups(result.modes, repeated, mass)
    names = ", ".join(str(k + 1) for k, member in enumerate(joined.members) if len(member) > 1)
    share = result.share
    groups = tuple(Resonance((k,), k, float(share[list(member)].max()), frequency=float(joined.modes.frequency[k]))
                   for k, member in enumerate(joined.members))
    first_members = [member[0] for member in joined.members]
    support, significance = (None if part is None else part[first_members] for part in (result.support, result.significance))
    note = f"modes {names} were seen once in every set-up of sensors ({result.modes.count} in all) and are joined"
    return replace(result, modes=joined.modes, support=support, significance=significance, resonances=groups,
                   mode_quality=np.array([result.mode_quality[list(member)].min() for member in joined.members]),
                   doubts=(*joined.doubts, *result.doubts), advice=(note, *joined.notes, *result.advice))


def _identify_with_order(inside: Frf, pole_method: PoleMethod, dead_notes: list[str]) -> Identification:
    """Return the identification; at twice the order where resonances are left in the residual and more order explains them.

    Few references carry many modes only at high orders: one reference of a machine of six bodies loses the lower half of its
    modes at order 60 and none at 120.
    """
    result = _identify_once(inside, pole_method, dead_notes)
    for _ in range(MAX_ORDER_DOUBLINGS):
        if not (isinstance(pole_method, PolyReference) and pole_method.refine and _leaves_resonances(result)):
            break
        pole_method = replace(pole_method, order=2 * pole_method.order)
        try:
            higher_order = _identify_once(inside, pole_method, dead_notes)
        except Indistinguishable:  # more modes than the lines tell apart: what was found stands
            break
        if higher_order.modes.count <= result.modes.count or 1 - higher_order.fit > MAX_REMAINING_FRACTION * (1 - result.fit):
            break
        note = (f"order {pole_method.order // 2} left resonances in the residual; order {pole_method.order} explains "
                f"{higher_order.modes.count - result.modes.count} modes more")
        result = replace(higher_order, advice=(*higher_order.advice, note))
    return result


def _leaves_resonances(result: Identification) -> bool:
    """Whether the residual is larger at the peaks of the responses than the noise along the lines."""
    values = result.frf.values.reshape(result.frf.frequency.size, -1)
    if values.shape[1] < MIN_JUDGED_RESPONSES:
        return False
    noise = noise_level(values.real) ** 2 + noise_level(values.imag) ** 2
    power = (np.abs(values) ** 2).mean(axis=0)
    residual_power = (1 - result.quality.ravel()) * power
    return bool(np.median(residual_power / np.maximum(noise, 1e-8 * power)) > MIN_RESIDUAL_RATIO)


def _identify_once(inside: Frf, pole_method: PoleMethod, dead_notes: list[str]) -> Identification:
    """Return the identification by one method, without judgement of its modes."""
    start = pole_method.start(inside)
    if start.poles.size == 0:
        fail("frf", f"no mode found within {inside.frequency[0]:g} .. {inside.frequency[-1]:g} Hz by {pole_method.name}",
             "at least one resonance must stand out of the noise", remedy="widen the band, raise the order or average more")
    fitted = _estimate.estimate(inside, start.poles + inside.decay, start.participation, refine=pole_method.refine)
    return _conclude(inside, fitted, pole_method, dead_notes, start)


def _conclude(inside: Frf, fitted: _estimate.Estimate, pole_method: PoleMethod, first_remarks: Sequence[str], start: Start
              ) -> Identification:
    """Return the identification of a fit; `first_remarks` are the remarks that come before those of its judgement."""
    all_modes = _estimate.to_modes(fitted, pole_method.refine)
    modes, kept, unstable = _drop_unstable(all_modes, inside.decay)
    model = _estimate.synthesise(fitted.data, fitted.fit)
    quality = _explained_fractions(fitted)
    per_mode = mode_quality(inside, model, modes)
    rank = np.argsort(np.abs(fitted.fit.poles), kind="stable")[kept]
    is_residual_smooth = is_smooth(fitted.spread, quality)
    groups = resonances(inside, modes, is_residual_smooth)
    advice = (*first_remarks, *unstable, *start.notes, *parting_remarks(inside, model.values()),
              *remarks(inside, modes, quality, mode_quality=per_mode, excess=fitted.excess, spread=fitted.spread,
                       groups=groups))
    return Identification(modes, inside, model, quality, per_mode, pole_method.name, start.diagram,
                          _support_of_modes(start, fitted.fit.poles[rank] * fitted.data.scale),
                          fitted.fit.significance[rank] / (2 * len(inside.outputs)), advice, groups, smooth=is_residual_smooth)


def _drop_unstable(modes: Modes, decay: float) -> tuple[Modes, np.ndarray, list[str]]:
    """Return the modes with damping, their places, and a remark on those without: a passive structure has none.

    With a window's decay taken out all are kept: then it is the decay that is in question. So they are where all are such.
    """
    kept = np.flatnonzero(modes.damping_ratio > 0)
    if decay != 0 or kept.size in (0, modes.count):
        return modes, np.arange(modes.count), []
    dropped = ", ".join(f"{modes.frequency[i]:.4g} Hz ({100 * modes.damping_ratio[i]:.2g} %)"
                     for i in np.setdiff1d(np.arange(modes.count), kept))
    return modes.selected(kept.tolist()), kept, [
        f"poles without positive damping stay in the synthesis but are no modes: {dropped}; drift of integrated signals or "
        "noise makes them, mostly at the ends of the band: narrow it"]


def _transpose_frf(frf: Frf) -> Frf:
    """Return the responses with outputs and inputs exchanged."""
    return replace(frf, values=np.swapaxes(frf.values, -1, -2), outputs=frf.inputs, inputs=frf.outputs,
                   coherence=_swap_axes(frf.coherence), variance=_swap_axes(frf.variance), draws=None)


def _swap_axes(array: FloatArray | None) -> FloatArray | None:
    return None if array is None else np.swapaxes(array, -1, -2)


def _transpose_result(identification: Identification) -> Identification:
    """Return the identification of transposed responses for the responses as they were measured."""
    modes = identification.modes
    transposed = replace(
        modes, shape=modes.participation_at(modes.input_dofs), dofs=modes.input_dofs,
        participation=modes.shape, input_dofs=modes.dofs,
        lower_residual=None if modes.lower_residual is None else modes.lower_residual.T,
        upper_residual=None if modes.upper_residual is None else modes.upper_residual.T, shape_variance=None)
    model = replace(identification.model, coefficients=np.swapaxes(identification.model.coefficients, -1, -2))
    return replace(identification, modes=transposed, frf=_transpose_frf(identification.frf), model=model,
                   quality=identification.quality.T)


def _select_live_channels(frf: Frf) -> tuple[Frf, list[str]]:
    """Return the responses without dead channels, and a note on those."""
    power = (np.abs(frf.values) ** 2).sum(axis=0)
    rows, columns = power.any(axis=1), power.any(axis=0)
    names = [str(dof) for dof, is_alive in zip(frf.outputs, rows, strict=True) if not is_alive]
    names += [str(dof) for dof, is_alive in zip(frf.inputs, columns, strict=True) if not is_alive]
    if not names:
        return frf, []
    live = frf.selected(np.flatnonzero(rows).tolist(), np.flatnonzero(columns).tolist())
    return live, [f"dead channel{'s' * (len(names) > 1)} left out (all zero): {', '.join(names)}"]


def _explained_fractions(fitted: _estimate.Estimate) -> FloatArray:
    """Return the fraction of each response's energy that the synthesis explains."""
    total = np.einsum("foi,foi->oi", fitted.data.values, fitted.data.values)
    return 1 - fitted.fit.squares / scale_powers(total)


def _support_of_modes(start: Start, poles: ComplexArray) -> FloatArray | None:
    """Return the support of the starting pole nearest to each mode."""
    if start.support is None:
        return None
    start_pole = np.argmin(np.abs(poles[:, None] - start.poles), axis=1)
    return start.support[start_pole]
