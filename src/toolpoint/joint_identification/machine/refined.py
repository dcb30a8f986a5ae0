"""Joints refined by the fit of the whole machine: place, stiffness and damping with their uncertainty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.joints.estimate import JointEstimate, axis_of
from toolpoint.joint_identification.joints.kinds import idle_translations
from toolpoint.joint_identification.machine.joint_forms import JointForm
from toolpoint.joint_identification.machine.machine_fit import MachineFit
from toolpoint.joint_identification.machine.rigid_machine import MEASURED_RATIOS
from toolpoint.joint_identification.machine.whole_machine import WholeMachine

_MAX_STIFFNESS_DEVIATION = 0.2  # relative standard deviation: above, a stiffness is doubted
_MAX_FREQUENCY_ERROR = 0.02  # of a measured frequency, by the machine of a fit that explains the test
_MAX_BENDING_SHIFT = 0.01  # relative standard deviation of a stiffness by bending components: above, it is doubted
MAX_MASS_DEVIATIONS = 3.0  # stated ones, by which a fit may move a mass without a doubt
FIT_OF_MACHINE = "fit of the machine"  # what its doubts are about
MIN_EXPLAINED_MAC, MIN_EXPLAINED_FRACTION = 0.8, 0.5  # of a measured shape; of the measured modes that a machine must explain


def refine_joint(joint: JointEstimate, machine: WholeMachine) -> JointEstimate:
    """Return a joint with the numbers of the machine's fit in place of those of its motions alone."""
    i = machine.names.index(joint.child)
    form, part = machine.fit.model.forms[i], machine.fit.model.slices[i]
    covariance = machine.fit.covariance[part, part]
    place, stiff, _ = form.sizes
    result = replace(_refine_place(joint, form, covariance[:place, :place]), screws=form.start.basis)
    if form.lossy:
        result = replace(result, loss_factor=form.start.loss_factor,
                         loss_factor_deviation=float(np.sqrt(covariance[place + stiff, place + stiff])))
    elif machine.fit.model.law != MEASURED_RATIOS:
        result = replace(result, loss_factor=0.0)
    if form.viscous:
        result = replace(result, relaxation=form.start.relaxation, relaxation_deviation=float(np.sqrt(covariance[-1, -1])))
    shift = machine.moved.get(joint.child, 0.0)
    if shift > _MAX_BENDING_SHIFT:
        result = replace(result, doubts=(*result.doubts, Doubt(
            "stiffness", f"what components bend by may move it by {100 * shift:.2g} % (one standard deviation), which its "
            "interval covers", "describe them as elastic in the machine file", figure=shift)))
    return _refine_stiffness(result, form, covariance[place:place + stiff, place:place + stiff])


def question_fit(machine: WholeMachine, frequency: FloatArray) -> Doubt | None:
    """Return the doubt of all stiffnesses of a fit whose modes are not those measured; frequency : (n_modes,), Hz, measured."""
    measured = frequency[list(machine.modes)]
    error = np.abs(machine.fit.frequency / measured - 1)
    mode = int(error.argmax())
    if error[mode] < _MAX_FREQUENCY_ERROR:
        return None
    return Doubt("stiffness", f"the machine of the fit misses the measured mode at {measured[mode]:.4g} Hz by "
                 f"{100 * error[mode]:.2g} %: no stiffness is established, whatever its interval", "check masses, chain, "
                 "components, and whether one bends", figure=float(error[mode]))


def _refine_place(joint: JointEstimate, form: JointForm, covariance: FloatArray) -> JointEstimate:
    """Return the joint with the frame of the fit and its covariance."""
    if not form.ways:
        return joint
    axes = form.start.frame[:3, :3]
    frame_covariance = form.frame_motions @ covariance @ form.frame_motions.T
    axis = axis_of(axes, form.ways, joint.kind)
    cross = np.cross(axis, np.eye(3)).T
    axis_covariance = axes @ frame_covariance[3:, 3:] @ axes.T
    return replace(joint, position=form.start.frame[:3, 3], position_covariance=axes @ frame_covariance[:3, :3] @ axes.T,
                   frame=axes,
                   axis=axis, axis_covariance=cross @ axis_covariance @ cross.T, frame_covariance=frame_covariance,
                   undetermined=(axes @ idle_translations(form.ways, form.diagonal)).T)


def _refine_stiffness(joint: JointEstimate, form: JointForm, covariance: FloatArray) -> JointEstimate:
    """Return the joint with the stiffness of the fit and its standard deviation."""
    doubts = list(joint.doubts)
    if form.diagonal:
        values = np.diag(form.start.stiffness).copy()
        deviation = values * np.sqrt(np.diag(covariance))
        doubts += [Doubt(f"stiffness {name}", f"known within {200 * share:.0f} % only", figure=share) for name, share in zip(
            form.ways, deviation / np.maximum(values, 1e-300), strict=True) if not share < _MAX_STIFFNESS_DEVIATION]
        return replace(joint, stiffness=values, stiffness_deviation=deviation, doubts=tuple(doubts))
    lower = np.linalg.cholesky(form.start.stiffness)
    f = len(lower)
    slopes = np.zeros((f, f, len(covariance)))
    for n, (a, b) in enumerate(zip(*np.triu_indices(f), strict=True)):
        change = np.zeros((f, f))
        change[a, b] = change[b, a] = 1.0
        slopes[:, :, n] = lower @ change @ lower.T
    variance = np.einsum("abn,nm,abm->ab", slopes, covariance, slopes)
    size = np.sqrt(np.diag(form.start.stiffness))
    largest_variance = np.linalg.eigvalsh(covariance)[-1] if len(covariance) else 0.0
    if np.sqrt(largest_variance) > _MAX_STIFFNESS_DEVIATION:
        doubts.append(Doubt("stiffness matrix", f"some of it is known within {200 * np.sqrt(largest_variance):.0f} % only",
                            figure=float(np.sqrt(largest_variance))))
    single = np.diag(form.start.stiffness).copy() if f == 1 else None
    return replace(joint, stiffness=single, stiffness_deviation=None if single is None else np.sqrt(variance[:, 0]),
                   stiffness_matrix=(form.start.stiffness + form.start.stiffness.T) / 2, doubts=tuple(doubts),
                   stiffness_matrix_deviation=np.sqrt(variance)) if size.size else joint


def question_masses(machine: WholeMachine) -> list[Doubt]:
    """Return the doubts about stated masses that the fit moves by more than their stated deviations allow."""
    model, doubts = machine.fit.model, list[Doubt]()
    for name, mass, part in zip(machine.names, model.masses, model.slices[len(model.forms):], strict=True):
        if not mass.mass_deviation > 0:
            continue
        change = float(machine.fit.x[part][0])  # the logarithm of the mass is the first number of a component
        count = abs(change) / mass.mass_deviation
        if count > MAX_MASS_DEVIATIONS:
            doubts.append(Doubt(f"mass of {name}", f"the test moves it by {100 * np.expm1(change):+.2g} %, {count:.2g} of "
                                f"the standard deviations of {100 * mass.mass_deviation:.2g} % that were stated", "weigh or "
                                "compute it again, or state how well it is known", figure=count))
    return doubts


def fit_doubts(fit: MachineFit, machine: WholeMachine, frequency: FloatArray) -> list[Doubt]:
    """Return the doubts about the machine as a whole."""
    result = list[Doubt]()
    if machine.lonely:
        frequencies = ", ".join(f"{frequency[i]:.4g}" for i in machine.lonely)
        result.append(Doubt(f"measured modes at {frequencies} Hz", "look like none of the machine's: they are left out",
                            "check them, the components and the chain"))
    # What noise takes from a MAC is no sign of another shape.
    likeness = fit.mac + fit.mac_noise
    n_measured, n_explained = likeness.size + len(machine.lonely), int((likeness >= MIN_EXPLAINED_MAC).sum())
    if n_explained < MIN_EXPLAINED_FRACTION * n_measured:
        result.append(Doubt("the machine", f"it explains {n_explained} of {n_measured} measured modes: it is not the machine "
                            "that was struck", "mend what the other doubts name, then measure or describe it again", grave=True,
                            figure=1 - n_explained / n_measured))
    if fit.widened > 2.0:
        result.append(Doubt(FIT_OF_MACHINE, f"it leaves {fit.widened:.3g} times the noise unexplained (probability "
                            f"{fit.probability:.1g}): all intervals are widened by it", "check masses, positions of points, "
                            "and whether components bend", figure=fit.widened))
    if fit.damping_excess > 10.0:
        result.append(Doubt("damping", f"that of the joints explains the modal damping {np.sqrt(fit.damping_excess):.2g} times "
                            "worse than its noise: other parts dissipate too; the intervals of the damping are widened by it",
                            figure=float(np.sqrt(fit.damping_excess))))
    result += question_masses(machine)
    if fit.mass_scale is not None and fit.mass_scale.doubt:
        result.append(fit.mass_scale.doubt)
    dissimilar = list(np.flatnonzero(likeness < 0.95))
    if dissimilar:
        where = ", ".join(f"{fit.frequency[i]:.4g} Hz (MAC {fit.mac[i]:.2f})" for i in dissimilar)
        result.append(Doubt("shapes of the machine", f"those at {where} differ from the measured ones",
                            figure=1 - float(fit.mac[dissimilar].min())))
    if not fit.converged:
        result.append(Doubt(FIT_OF_MACHINE, "it did not settle: its numbers are those of the last step",
                            "give more modes or check the chain"))
    return result
