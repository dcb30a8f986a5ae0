"""The machine that explains all modes, from joints as their motions determine them: start, forms of the joints, choice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.joint_identification.joints.estimate import JointEstimate
from toolpoint.joint_identification.joints.joint_fit import DECISIVE_INFORMATION
from toolpoint.joint_identification.joints.kinds import inner_moves
from toolpoint.joint_identification.joints.stiffness import ComponentMass, first_stiffness
from toolpoint.joint_identification.machine.bending_share import BendingShare
from toolpoint.joint_identification.machine.joint_forms import JointForm, diagonal_form
from toolpoint.joint_identification.machine.law_choice import LawChoice, choose_law
from toolpoint.joint_identification.machine.machine_fit import MIN_NOISE_PVALUE, MachineFit, MachineNumbers, fit_machine
from toolpoint.joint_identification.machine.mode_pairs import match_modes, rival_pairs
from toolpoint.joint_identification.machine.rigid_machine import MEASURED_RATIOS, ElasticJoint, RigidMachine, tree_order
from toolpoint.joint_identification.modes.modal_data import ModalData, covariance_roots, pole_spread
from toolpoint.joint_identification.modes.mode_mixing import with_mixing
from toolpoint.joint_identification.motion.measured import Component
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion
from toolpoint.spatial import transform as tf
from toolpoint.vibration import Modes

_MIN_PARTNER_CORRELATION = 0.3  # MAC of a measured mode with its partner at the start
_LOOSE_POLE_DEVIATION = 3e-3  # relative, of poles in the first fit
_MAX_RESTARTS, _HOPELESS_CHI2_RATIO = 3, 30.0  # starts; misfit over its degrees of freedom from which they are tried


@dataclass(frozen=True, eq=False)
class WholeMachine:
    """The fit, the names of its components in the order of the tree, the measured modes (indices) that it explains, and the law
    of damping that they obey (None for real shapes, which tell none); `moved`: by what share bending components leave the
    stiffness of every joint open."""

    fit: MachineFit
    names: tuple[str, ...]
    modes: tuple[int, ...]
    lonely: tuple[int, ...]
    law: LawChoice | None = None
    moved: Mapping[str, float] = field(default_factory=dict)


def whole_machine(
    modes: Modes, parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], *, joints: Sequence[JointEstimate],
    relatives: Sequence[RelativeMotion], masses: Mapping[str, ComponentMass], scale: FloatArray | None = None,
    calibration: float | None = None, mixing: ComplexArray | None = None,
) -> WholeMachine:
    """Return the machine of joints whose kinds are known.

    Parameters
    ----------
    modes : Modes
        Of these motions, for their poles.
    parts, motions : of every component; complex shapes as columns of real parts followed by imaginary parts
    joints : as the motions tell them
    relatives : of the same joints, for their lengths
    masses : of every component
    scale : standard deviation (k,) of the logarithm of every mode's squared scale (`scale_deviations`), None without any
    calibration : standard deviation of the test's gain as a share of it, None where not told: then scales only check
    mixing : what errors of the poles add to the shapes of others (`shape_mixing`), None where nothing is known of it
    """
    order = tree_order([(joint.parent, joint.child) for joint in joints])
    names = tuple(child for _, child in order)
    by_child = {joint.child: joint for joint in joints}
    lengths = {joint.child: motion.size for joint, motion in zip(joints, relatives, strict=True)}
    model, full = _start(modes, order, [by_child[name] for name in names], motions, masses=masses, lengths=lengths)
    kept, lonely = _pair_with_machine(model, _modal_data(modes, parts, motions, names, range(modes.count)))
    if not kept:
        raise np.linalg.LinAlgError("no measured mode looks like any of the machine's")
    data = _modal_data(modes, parts, motions, names, kept)
    if mixing is not None:
        data = with_mixing(data, mixing[np.ix_(kept, kept)])
    if scale is not None:
        # With exact masses a scale has nothing to tell but that they are wrong: it must not bend the shapes.
        uncertain = any(mass.deviations[0] > 0 for mass in masses.values())
        data = replace(data, scale=scale[kept], calibration=calibration if uncertain else None)
    fit = _fit_in_stages(model, data)

    def richer(coupled: MachineFit) -> MachineFit:
        return _enrich(coupled, start=model, full=full, data=data)
    law = None
    if data.is_complex:
        fit, law = choose_law(fit, data, _typical_relaxation(data), richer=richer)
    else:
        fit = richer(fit)
    fit = _loosen_ratios(fit, data) if fit.model.law != MEASURED_RATIOS else fit
    if fit.mass_scale is not None:
        stated = max(mass.mass_deviation for mass in masses.values())
        fit = replace(fit, mass_scale=replace(fit.mass_scale, calibration=calibration, masses=stated))
    return WholeMachine(fit, names, tuple(kept), tuple(lonely), law)


def _start(modes: Modes, order: Sequence[tuple[str, str]], joints: Sequence[JointEstimate], motions: Mapping[str, RigidMotion],
           *, masses: Mapping[str, ComponentMass], lengths: Mapping[str, float]
           ) -> tuple[MachineNumbers, list[JointForm]]:
    """Return the numbers with every joint as diagonal as can be, and the forms of full matrices beside."""
    names = [child for _, child in order]
    parents = tuple(names.index(parent) if parent in names else -1 for parent, _ in order)
    k = modes.count
    frames = [tf.transform(joint.frame, joint.position) for joint in joints]
    local = [tf.adjoint(tf.inverse(frame)) @ joint.screws for frame, joint in zip(frames, joints, strict=True)]
    bare = RigidMachine(parents, tuple(ElasticJoint(frame, twists, np.eye(twists.shape[1])) for frame, twists in zip(
        frames, local, strict=True)), np.stack([masses[name].matrix for name in names]))
    stiffness = first_stiffness(
        modes.omega, bare.jacobians(), bare.masses, sizes=[twists.shape[1] for twists in local],
        twists=np.stack([motions[name].twist[:, :k].T for name in names]),
        covariance=np.stack([motions[name].covariance[:k] for name in names]))
    loss = float(np.clip(2 * np.median(modes.damping_ratio), 0.0, 0.5))
    forms, full = [], []
    for joint, frame, twists, matrix in zip(joints, frames, local, stiffness, strict=True):
        if joint.freedoms or not twists.shape[1]:
            form = diagonal_form(frame, joint.freedoms, matrix)
        else:
            form = JointForm(ElasticJoint(frame, twists, matrix), (), False, lengths[joint.child])
        forms.append(replace(form, start=replace(form.start, loss_factor=loss)))
        full.append(JointForm(ElasticJoint(frame, twists, matrix, loss), joint.freedoms, False, lengths[joint.child]))
    return MachineNumbers(parents, tuple(forms), tuple(masses[name] for name in names)), full


def _modal_data(modes: Modes, parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], names: Sequence[str],
                kept: Sequence[int]) -> ModalData:
    """Return the measured data of some modes."""
    count, indices = modes.count, list(kept)
    is_complex = motions[names[0]].twist.shape[1] > count
    columns = indices + [count + i for i in indices] if is_complex else indices
    twists = np.stack([motions[name].twist for name in names])
    shapes = twists[:, :, indices] + 1j * twists[:, :, [count + i for i in indices]] if is_complex else twists[:, :, indices]
    covariances = [motions[name].full_covariance[columns][:, :, columns] for name in names]
    covariance = None if modes.covariance is None else modes.covariance[indices]
    grams = np.stack([parts[name].rows.T @ parts[name].rows for name in names])
    frequency, ratio = modes.frequency[indices], modes.damping_ratio[indices]
    errors = np.stack([motions[name].gain_errors for name in names]).transpose(3, 0, 2, 1)
    gain_errors = errors[..., indices] + (1j * errors[..., [count + i for i in indices]] if is_complex else 0.0)
    return ModalData(shapes, covariance_roots(covariances, grams, shapes), grams, frequency, ratio,
                     pole_spread(frequency, ratio, covariance), gain_errors=gain_errors if gain_errors.size else None)


def _pair_with_machine(model: MachineNumbers, data: ModalData) -> tuple[list[int], list[int]]:
    """Return the measured modes that some mode of the machine looks like, one each, and those without such a partner."""
    machine = model.machine(np.zeros(len(model.deviations)))
    partner, correlation = match_modes(machine, data)
    with_partner = [r for r in range(len(partner)) if partner[r] >= 0
                    and correlation[r, partner[r]] >= _MIN_PARTNER_CORRELATION]
    return with_partner, [r for r in range(len(partner)) if r not in with_partner]


def _fit_in_stages(model: MachineNumbers, data: ModalData) -> MachineFit:
    """Return the fit with poles first believed within a part in some hundred, then as they are known."""
    loose = np.linalg.inv(np.diag([_LOOSE_POLE_DEVIATION, 10 * _LOOSE_POLE_DEVIATION]))
    # Far from the measured poles their errors are no small ones: mixing comes last.
    easy = replace(data, spread=np.broadcast_to(loose, data.spread.shape), mixing=None, mixing_deviation=None)
    first = fit_machine(model, easy, 15)
    if _is_far(first):
        # Two modes close together that look half like each other's partner, in the wrong order at the start.
        for pairs in rival_pairs(model.machine(np.zeros(len(model.deviations))), data, _MAX_RESTARTS):
            restarted = fit_machine(model, easy, 15, partner=pairs)
            first = restarted if restarted.chi2 < first.chi2 else first
    rng = np.random.default_rng(0)
    for _ in range(_MAX_RESTARTS):
        if not _is_far(first):
            break
        # Far from any noise: a frame may lie in another valley of what only the stiffness tells.
        restarted = fit_machine(replace(model, forms=tuple(_rotate_randomly(form, rng) for form in model.forms)), easy, 15)
        first = restarted if restarted.chi2 < first.chi2 else first
    return fit_machine(first.model, data, after=first)


def _is_far(fit: MachineFit) -> bool:
    """Whether noise cannot explain so large a misfit."""
    return fit.chi2 >= _HOPELESS_CHI2_RATIO * max(fit.freedom, 1)


def _rotate_randomly(form: JointForm, rng: np.random.Generator) -> JointForm:
    """Return a form with its frame rotated where only the stiffness orients it."""
    motions = inner_moves(form.ways) if form.ways and form.diagonal else np.zeros((6, 0))
    if not motions.shape[1]:
        return form
    frame = form.start.frame @ tf.exponential(motions @ rng.uniform(-0.8, 0.8, motions.shape[1]))
    return replace(form, start=replace(form.start, frame=frame))


def _enrich(fit: MachineFit, *, start: MachineNumbers, full: Sequence[JointForm], data: ModalData) -> MachineFit:
    """Return the fit with viscous damping or full stiffness matrices where the data ask for them beyond chance."""
    best = fit
    if best.freedom > 0 and best.chi2 > _HOPELESS_CHI2_RATIO * best.freedom:
        # Far from any noise: springs that no frame makes diagonal, from where the motions and forces put them.
        # All joints begin anew: the others were drawn to where they made up for the wrong ones.
        forms = tuple(b if _is_richer(a) else c for a, b, c in zip(best.model.forms, full, start.forms, strict=True))
        other = _fit_in_stages(replace(best.model, forms=forms), data)
        best = other if other.information < best.information - DECISIVE_INFORMATION else best
    if best.freedom > 0 and best.probability < MIN_NOISE_PVALUE:
        tried = [_add_viscous(best.model, _typical_relaxation(data))]
        tried += [_use_matrix(best.model, i) for i, form in enumerate(best.model.forms)
                  if _is_richer(form)]
        for change in tried:
            other = fit_machine(change, data, after=best)
            if other.information < best.information - DECISIVE_INFORMATION:
                best = other
    return best


def _loosen_ratios(fit: MachineFit, data: ModalData) -> MachineFit:
    """Return the fit with damping ratios believed only as far as damping in the joints can explain them."""
    if fit.damping_excess == 1.0:
        return fit
    refitted = fit_machine(fit.model, replace(data, spread=data.spread * np.array([1.0, 1 / np.sqrt(fit.damping_excess)])),
                        after=fit)
    return replace(refitted, damping_excess=fit.damping_excess)


def _is_richer(form: JointForm) -> bool:
    """Whether a full matrix has more numbers than the diagonal form."""
    return form.diagonal and len(form.ways) > 1 and replace(form, diagonal=False).count > form.count


def _typical_relaxation(data: ModalData) -> float:
    """Return a relaxation time (s) that damps the middle mode by 5 %."""
    return float(0.1 / (2 * np.pi * np.median(data.frequency)))


def _add_viscous(model: MachineNumbers, typical: float) -> MachineNumbers:
    """Return the numbers with viscous damping in every joint."""
    return replace(model, forms=tuple(replace(form, viscous=typical) for form in model.forms))


def _use_matrix(model: MachineNumbers, i: int) -> MachineNumbers:
    """Return the numbers with a full matrix in one joint."""
    forms = list(model.forms)
    forms[i] = replace(forms[i], diagonal=False)
    return replace(model, forms=tuple(forms))


def widen_softness(machine: WholeMachine, bending: BendingShare | None) -> WholeMachine:
    """Return the machine with the numbers of its joints known no better than bending components leave them.

    The stiffnesses of a joint may be off by the share of its deflection that is bending. Bending also lowers the frequencies,
    and the fit of the frequencies passes that on to every joint that takes part in the mode.
    """
    if bending is None:
        return machine
    fit = machine.fit
    covariance, slices = fit.covariance.copy(), fit.model.slices
    lowered = fit.pole_gain * (bending.lowered / 2)
    covariance += lowered @ lowered.T
    deviations = {}
    for i, (form, name) in enumerate(zip(fit.model.forms, machine.names, strict=True)):
        place, stiff, _ = form.sizes
        stiffness_numbers = np.arange(slices[i].start + place, slices[i].start + place + stiff)
        covariance[stiffness_numbers, stiffness_numbers] += bending.joints.get(name, 0.0) ** 2
        deviations[name] = float(np.sqrt((covariance[stiffness_numbers, stiffness_numbers]
                                          - fit.covariance[stiffness_numbers, stiffness_numbers]).max(initial=0.0)))
    return replace(machine, fit=replace(fit, covariance=covariance), moved=deviations)
