"""Joints from mode shapes: rigid motions, relative motions, joints, and the doubts about them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointWarning, fail, floats, nonnegative
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._threads import on_one_thread
from toolpoint.joint_identification.component_motions import (
    MotionMethod,
    add_coordinate_variance,
    align_phase,
    component_motions,
    real_variance,
)
from toolpoint.joint_identification.joints.chain import better_order, parents, relative_motion_of
from toolpoint.joint_identification.joints.estimate import JointEstimate, estimate_joint
from toolpoint.joint_identification.joints.joint_fit import (
    Criterion,
    JointFit,
    candidates,
    rival_of,
    settle_floor,
    stack_twists,
)
from toolpoint.joint_identification.joints.stiffness import ComponentMass
from toolpoint.joint_identification.machine.bending_share import bending_share
from toolpoint.joint_identification.machine.refined import FIT_OF_MACHINE, fit_doubts, question_fit, refine_joint
from toolpoint.joint_identification.machine.rigid_machine import COUPLED
from toolpoint.joint_identification.machine.rival_joints import fit_with_rivals, question_runaways
from toolpoint.joint_identification.machine.untested_directions import find_tested_directions, struck_wrenches
from toolpoint.joint_identification.machine.whole_machine import WholeMachine, whole_machine, widen_softness
from toolpoint.joint_identification.modes.modal_scale import scale_deviations
from toolpoint.joint_identification.modes.mode_mixing import mixing_in_phase
from toolpoint.joint_identification.motion.direction_gains import question_gains
from toolpoint.joint_identification.motion.measured import Component, Point, component
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion, SmallMotion
from toolpoint.joint_identification.motion.sensor_gains import SensorGains, fit_gains
from toolpoint.joint_identification.motion.strangers import strangers, sure_strangers
from toolpoint.joint_identification.motion.wrong_channels import question_channels
from toolpoint.joint_identification.motion.wrong_points import WrongPoints, find_wrong_points
from toolpoint.vibration import Modes
from toolpoint.vibration.correlation import mac

_REAL_SHAPES = "damping: a loss factor a joint is assumed; real shapes cannot tell what losses couple between modes"
# Fraction of a component's points that may be left out because they do not move with it, and the points that must remain.
_MAX_STRANGER_FRACTION, _MIN_COMPONENT_POINTS = 0.2, 6


@dataclass(frozen=True, eq=False)
class JointIdentification(NotebookText):
    """Joints of a chain, with the rigid motion of every component and every relative motion they come from.

    wrong_points : points that are not where they are stated, left out of the motions; tested_frequency : by child, Hz, below
    which no further freedom of its joint brings a mode.

    Examples
    --------
    Runs in ``examples/joint_between_two_plates.py``.
    """

    joints: tuple[JointEstimate, ...]
    motions: Mapping[str, RigidMotion]
    relatives: tuple[RelativeMotion, ...]
    doubts: tuple[Doubt, ...] = ()
    machine: WholeMachine | None = None
    gains: SensorGains | None = None
    wrong_points: WrongPoints | None = None
    tested_frequency: Mapping[str, float] = field(default_factory=dict)

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions of the stiffnesses and losses."""
        of_gains = () if self.gains is None else (self.gains.note,)
        if self.machine is None:
            return of_gains
        loss = max((abs(joint.loss_factor or 0.0) for joint in self.joints if joint.screws.shape[1]), default=0.0)
        scale, law = self.machine.fit.mass_scale, self.machine.law
        said = [*of_gains, *([] if scale is None or scale.doubt else [scale.note])]
        if self.tested_frequency:
            frequencies = ", ".join(f"{child} {hertz:.3g} Hz" for child, hertz in self.tested_frequency.items())
            said.append("joints count as rigid where they are not free; modes of further freedoms are excluded below "
                        f"{frequencies}")
        said.append(_REAL_SHAPES if law is None else law.note)
        if law is not None and law.law != COUPLED:
            return tuple(said)
        return (*said, f"joints dissipate by a loss factor; if they did so by viscous damping, stiffnesses would be up to "
                f"{50 * loss**2:.2g} % higher at the same natural frequencies, not in their intervals",)

    def joint(self, child: str) -> JointEstimate:
        """Return the joint that carries a component."""
        for joint in self.joints:
            if joint.child == child:
                return joint
        fail("child", repr(child), "must be one of " + ", ".join(joint.child for joint in self.joints))

    @property
    def certain(self) -> bool:
        """Whether there is no doubt about any joint."""
        return not self.doubts and all(joint.certain for joint in self.joints)

    @property
    def status(self) -> str:
        """Summary: established, or the doubtful joints and why."""
        if self.certain:
            return f"{len(self.joints)} joints established"
        weak = [joint.child for joint in self.joints if not joint.certain]
        return "doubtful" + (f" at {', '.join(weak)}" if weak else "") + "".join(f"; {text}" for text in self.doubts)

    def table(self) -> str:
        """Return the joints as text, doubts first, then a few lines each."""
        lines = []
        for joint in self.joints:
            lines.append(f"{joint.parent} - {joint.child}: {joint.kind}, free {joint.free_text or 'nothing'}")
            lines.append(f"    at {joint.position_text} mm")
            if joint.stiffness_text:
                lines.append(f"    stiffness {joint.stiffness_text}; loss factor {joint.damping_text}")
            lines += [f"    {line}" for line in mark_notes(joint.doubts)]
        notes = [f"note: {text}" for text in self.notes]
        return "\n".join([*mark_notes(self.doubts), *lines, *notes])

    def __repr__(self) -> str:
        kinds = ", ".join(f"{joint.child}: {joint.kind}" for joint in self.joints)
        return f"JointIdentification({kinds}; {self.status})"


@on_one_thread
def identify_joints(
    modes: Modes, points: Mapping[Point, ArrayLike], components: Mapping[str, Sequence[Point]],
    *, chain: Sequence[str] | Mapping[str, str], method: MotionMethod | None = None, criterion: Criterion | None = None,
    masses: Mapping[str, ComponentMass] | None = None, coordinate_deviation: float = 0.0,
    calibration_deviation: float | None = None) -> JointIdentification:
    """Return the joints of a machine from its measured mode shapes, with nobody choosing.

    Every component's rigid motion is fitted in every mode, the motion relative to the component before it is formed, and
    the joint is the simplest kind that explains the relative motions of all modes within their noise (`joint_fit`).

    Parameters
    ----------
    modes : Modes
        Real or complex, of one pose; with `shape_variance` the points are weighted by it, without it the noise is taken
        from what the rigid motions leave.
    points : map from point to (3,) floats
        Positions in the machine frame, m.
    components : map from name to points
    chain : sequence of names, or map from child to parent
        From ``ground`` (or the first component) outwards.
    method : SmallMotion (default), FiniteRotation or ClosestPoint
    criterion : Criterion, optional
    masses : map from component to MassProperties, optional
        Of every component of the chain; then every freedom gets its stiffness.
    coordinate_deviation : float
        Standard deviation of each coordinate of the measured points, m: its effect is carried into all intervals.
    calibration_deviation : float, optional
        Standard deviation of the gain of each channel (the force, each direction of the sensor), as a share of it. With it the
        driving points tell the common factor of masses that are uncertain; without it they only check them (`modal_scale`), and
        1 % is taken for the directions (`sensor_gains`).

    Raises
    ------
    ToolpointError
        For components that cannot tell a rigid motion, a chain that is no tree, or a mode given twice.

    Warns
    -----
    ToolpointWarning
        Where a doubt is marked in the result.

    Examples
    --------
    Runs in ``examples/joint_between_two_plates.py``.
    """
    criterion, method = criterion or Criterion(), method or SmallMotion()
    tree = parents(chain, list(components))
    _check_overlap(components)
    deviation = float(nonnegative("coordinate_deviation", floats("coordinate_deviation", coordinate_deviation)))
    if calibration_deviation is not None:
        nonnegative("calibration_deviation", floats("calibration_deviation", calibration_deviation))
    aligned = align_phase(modes)
    real = replace(aligned, shape=aligned.shape.real, shape_variance=real_variance(aligned))
    # What is wrong is looked for in the shapes as they were measured, not where gains have made up for a part of it.
    measured = {name: component(name, real, points, labels=labels) for name, labels in components.items()}
    judged = {name: add_coordinate_variance(part, deviation) for name, part in measured.items()}
    wrong = find_wrong_points(judged)
    channel_doubts = [*wrong.doubts, *question_gains(wrong.parts), *question_channels(wrong.parts, real.dofs)]
    if wrong.places:  # their component's motion is that of the other points, and its interval theirs
        points, components = wrong.left_out_of(points, components)
        measured = {name: component(name, real, points, labels=labels) for name, labels in components.items()}
    gains = fit_gains(measured, deviation, calibration_deviation)
    motions_of = partial(_motions_with_gains, points=points, method=method, deviation=deviation, criterion=criterion)
    parts, motions, place_doubts = motions_of(real, gains, components=components)
    independent, general_doubts = _count_independent(modes, parts)
    sure = {name: tuple(point for point in points_of if point not in wrong.places)
            for name, points_of in sure_strangers(wrong.parts).items()}
    strangers_of = {name: tuple(dict.fromkeys((*strangers(part), *sure[name]))) for name, part in parts.items()}
    components = _drop_strangers(components, strangers_of, sure)
    flexible = _flaws(motions, strangers_of, components, count=modes.count, criterion=criterion)
    if any(len(part.points) > len(components[name]) for name, part in parts.items()):
        measured = {name: component(name, real, points, labels=labels) for name, labels in components.items()}
        gains = fit_gains(measured, deviation, calibration_deviation)
        parts, motions, place_doubts = motions_of(real, gains, components=components)
    tree, order_doubts = _best_tree(tree, parts, motions, criterion)
    relatives = tuple(relative_motion_of(parent, child, parts, motions=motions) for child, parent in tree.items())
    question = partial(_joint_doubts, independent=independent, flexible=flexible, frequency=modes.frequency,
                       criterion=criterion)
    joints, rivals = _choose_joints(relatives, criterion, question)
    doubts = [*channel_doubts, *([] if gains is None else gains.doubts), *order_doubts, *general_doubts]
    machine = None
    if masses is not None:
        _check_masses(parts, joints, masses)
        if np.iscomplexobj(aligned.shape):
            parts, motions, place_doubts = motions_of(aligned, gains, components=components)
        common = calibration_deviation if calibration_deviation is None or gains is None else gains.common_deviation
        fit = partial(whole_machine, aligned, parts, motions, relatives=relatives, masses=masses, scale=scale_deviations(modes),
                      calibration=common, mixing=mixing_in_phase(modes))
        try:
            fitted, joints = fit_with_rivals(lambda chosen: fit(joints=chosen), joints, rivals)
            machine = widen_softness(fitted, bending_share(parts, motions, relatives, frequency=modes.frequency,
                                                           kept=fitted.modes, criterion=criterion))
        except np.linalg.LinAlgError as error:
            doubts.append(Doubt(FIT_OF_MACHINE, f"it broke down ({error}): no stiffness", "check masses, chain and doubts, and "
                                "whether modes were counted twice"))
    result = JointIdentification(tuple(joints), motions, relatives, (*doubts, *place_doubts), machine, gains, wrong)
    return _refine_joints(result, modes, struck_wrenches(modes, points, wrong.restored_to(components)))


def _choose_joints(relatives: Sequence[RelativeMotion], criterion: Criterion,
                   question: Callable[[RelativeMotion, list[JointFit]], tuple[Doubt, ...]]
                   ) -> tuple[list[JointEstimate], dict[str, JointEstimate]]:
    """Return the joints as their motions determine them, and by child those that the fit of the machine may prefer."""
    joints, rivals = list[JointEstimate](), dict[str, JointEstimate]()
    for motion in relatives:
        stack = stack_twists(motion, criterion)
        choices = candidates(stack, criterion)
        rival = rival_of(stack, choices, criterion)
        choices[0] = settle_floor(motion, criterion, choices[0])
        joints.append(estimate_joint(motion, choices, question(motion, choices)))
        if rival is not None:
            fits = [settle_floor(motion, criterion, rival)]
            rivals[motion.child] = estimate_joint(motion, fits, question(motion, fits))
    return joints, rivals


def _motions_with_gains(modes: Modes, gains: SensorGains | None, *, points: Mapping[Point, ArrayLike],
                        components: Mapping[str, Sequence[Point]], method: MotionMethod, deviation: float,
                        criterion: Criterion) -> tuple[dict[str, Component], dict[str, RigidMotion], list[Doubt]]:
    """Return components, motions and doubts of the coordinates, from shapes divided by the gains of the sensor's directions."""
    corrected = modes if gains is None else gains.corrected(modes)
    return component_motions(corrected, points, components, method=method, deviation=deviation, criterion=criterion,
                             gains=gains)


def _refine_joints(result: JointIdentification, modes: Modes, forces: Mapping[str, FloatArray]) -> JointIdentification:
    """Return the result with joints refined by the whole machine and the doubts of that fit; it warns where any is left."""
    machine = result.machine
    if machine is not None:
        fit_doubt = [doubt for doubt in (question_fit(machine, modes.frequency),) if doubt is not None]
        refined = [refine_joint(joint, machine) for joint in result.joints]
        directions = [find_tested_directions(joint, machine, result.motions, relative=motion, omega=modes.omega, forces=forces)
                      for joint, motion in zip(refined, result.relatives, strict=True)]
        untested = [() if tested is None else tested.doubts for tested in directions]
        runaways = question_runaways(refined, result.relatives)
        result = replace(result, joints=tuple(replace(joint, doubts=(*fit_doubt, *runaway, *doubts, *joint.doubts))
                                              for joint, doubts, runaway in zip(refined, untested, runaways, strict=True)),
                         doubts=(*result.doubts, *fit_doubts(machine.fit, machine, modes.frequency)),
                         tested_frequency={tested.joint.child: tested.frequency for tested in directions if tested is not None})
    if not result.certain:
        warnings.warn(result.status, ToolpointWarning, stacklevel=3)
    return result


def _check_masses(parts: Mapping[str, Component], joints: Sequence[JointEstimate], masses: Mapping[str, ComponentMass]) -> None:
    """Refuse masses that are not given for every component, and a chain without ground."""
    without_mass = [name for name in parts if name not in masses]
    if without_mass:
        fail("masses", f"none for {without_mass}", "must be given for every component")
    if all(joint.parent != "ground" for joint in joints):
        fail("chain", "without ground", "must start at ground for a stiffness", remedy="start the chain with 'ground'")


def _check_overlap(components: Mapping[str, Sequence[Point]]) -> None:
    """Refuse a point in two components."""
    owner: dict[Point, str] = {}
    for name, labels in components.items():
        for point in labels:
            if owner.setdefault(point, name) != name:
                fail(f"components[{name!r}]", f"point {point!r} is also in {owner[point]!r}", "must be in one component only")


def _count_independent(modes: Modes, parts: Mapping[str, Component]) -> tuple[int, list[Doubt]]:
    """Return the number of modes that are not repeats of others, and the doubts; refuse a mode that is there twice."""
    rows = np.concatenate([part.values for part in parts.values()])
    shape = rows[:, :modes.count]
    if (np.abs(shape).max(axis=0) == 0).any():
        fail("modes", f"mode {int(np.argmin(np.abs(shape).max(axis=0))) + 1} is zero at all points", "must move somewhere")
    correlation, doubts, repeated = mac(shape, shape), list[Doubt](), set()
    for i in range(modes.count):
        for j in range(i):
            if correlation[i, j] < 0.99:
                continue
            is_near = abs(modes.frequency[i] - modes.frequency[j]) <= 0.005 * max(modes.frequency[i], modes.frequency[j])
            both = f"modes {j + 1} and {i + 1} ({modes.frequency[j]:.4g} and {modes.frequency[i]:.4g} Hz)"
            words = f"have the same shape (MAC {correlation[i, j]:.4f})"
            if is_near or correlation[i, j] > 1 - 1e-9:
                fail("modes", f"{both} {words}", "every mode must be given once", remedy="leave one out with modes.selected")
            repeated.add(i)
            doubts.append(Doubt(both, f"{words}: they tell one motion only", figure=float(correlation[i, j])))
    if modes.count - len(repeated) < 2:
        doubts.append(Doubt("one mode only", "the axes are those of this mode, not yet joints", "give more modes"))
    return modes.count - len(repeated), doubts


def _drop_strangers(components: Mapping[str, Sequence[Point]], strange: Mapping[str, Sequence[Point]],
                    sure: Mapping[str, Sequence[Point]]) -> dict[str, Sequence[Point]]:
    """Return the components without points that move otherwise, where these are few and enough others stay, or are sure."""
    result: dict[str, Sequence[Point]] = {}
    for name, labels in components.items():
        kept = [point for point in labels if point not in strange[name]]
        can_drop = len(labels) - len(kept) <= _MAX_STRANGER_FRACTION * len(labels) and len(kept) >= _MIN_COMPONENT_POINTS
        result[name] = kept if can_drop else [point for point in labels if point not in sure[name]]
    return result


def _flaws(motions: Mapping[str, RigidMotion], strange: Mapping[str, Sequence[Point]], kept: Mapping[str, Sequence[Point]], *,
           count: int, criterion: Criterion) -> dict[str, Doubt]:
    """Return a doubt on every component that bends, has points that move otherwise, or too few to tell."""
    tests = sum(motion.twist.shape[1] for motion in motions.values())
    result = dict[str, Doubt]()
    for name, motion in motions.items():
        bends = motion.bends(criterion.significance / tests, max(criterion.floor, 1e-3))
        # Points of another component look like bending; a name is the better hint.
        if strange[name]:
            remark = "" if set(strange[name]) & set(kept[name]) else " (left out of the fit)"
            bending = ", or whether it bends" if bends.any() else ""
            result[name] = Doubt(f"points {list(strange[name])[:8]}", f"do not move with {name}{remark}", "check their "
                                 f"component, position, directions and channels{bending}")
        elif bends.any():
            which = sorted({int(i) % count + 1 for i in np.flatnonzero(bends)})
            peak = float(motion.bending[bends].max())
            result[name] = Doubt(name, f"bends in mode {', '.join(map(str, which))} (up to {100 * peak:.2g} % of its motion)",
                                 "divide it, leave these modes out, or describe it as elastic in the machine file", figure=peak)
        elif np.isnan(motion.bending_p).any():
            result[name] = Doubt(name, "has too few points to tell whether it bends", "add points, or give the shapes' "
                                 "variance")
    return result


def _joint_doubts(motion: RelativeMotion, fits: list[JointFit], *, independent: int, flexible: Mapping[str, Doubt],
                  frequency: FloatArray, criterion: Criterion) -> tuple[Doubt, ...]:
    """Return the doubts about one joint: its components, the number of modes, and other kinds."""
    fit = fits[0]
    doubts = [flexible[name] for name in (motion.parent, motion.child) if name in flexible]
    if 0 < fit.chart.freedoms < 6 and fit.chart.freedoms >= independent:
        doubts.append(Doubt(f"{fit.chart.freedoms} freedoms from {independent} mode(s)", "more freedoms cannot be excluded",
                            "give more modes"))
    if fit.kind == "general":
        doubts.append(Doubt("kind", f"no simple kind explains the motion ({fit.chart.freedoms} freedoms)", "check the points "
                            f"of {motion.child} and {motion.parent} and the order of the chain"))
    if fit.freedom > 0 and fit.probability < criterion.significance:
        one_mode = fit.passes(criterion.significance)
        if one_mode:
            ratio = float(np.sqrt(fit.mode_misfit))
            why, remedy = (f"one mode alone, at {frequency[fit.misfit_mode]:.4g} Hz, leaves {ratio:.2g} times the noise",
                           "look at that mode, and strike where it moves")
        else:
            ratio = float(np.sqrt(fit.chi2 / fit.freedom))
            why, remedy = (f"no simple kind explains the motion, and this one leaves {ratio:.2g} times the noise",
                           f"check the points of {motion.child} and {motion.parent}")
        doubts.append(Doubt("kind", f"{why}: {fit.kind} is kept, and the intervals hold what it leaves", remedy, figure=ratio))
    if len(fits) > 1:
        doubts.append(Doubt("kind", f"the data do not refuse {', '.join(other.kind for other in fits[1:])} either",
                            "give more modes"))
    return tuple(doubts)


def _best_tree(tree: Mapping[str, str], parts: Mapping[str, Component], motions: Mapping[str, RigidMotion],
               criterion: Criterion) -> tuple[dict[str, str], list[Doubt]]:
    """Return the given tree, or another that needs fewer freedoms, with the words for it."""
    if len(tree) < 2:
        return dict(tree), []
    stated, lower, links = better_order(tree, parts, motions, criterion=criterion)
    if stated <= lower:
        return dict(tree), []
    order = ", ".join(f"{parent} - {child}" for child, parent in links)
    return dict(links), [Doubt("chain", f"as told it needs {stated} freedoms, {order} only {lower}: the joints are those of "
                               "the latter", "check the order of the chain")]
