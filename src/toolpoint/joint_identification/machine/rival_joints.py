"""Joints that the motions alone leave open, chosen by the fit of the whole machine; and joints that no fit determines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.linalg import eigh

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.joints.estimate import JointEstimate
from toolpoint.joint_identification.machine.whole_machine import WholeMachine
from toolpoint.joint_identification.motion.measured import about
from toolpoint.joint_identification.motion.relative_motion import RelativeMotion

MAX_GOOD_MISFIT = 2.0  # misfit of a fit over its noise, up to which no other joint is tried
MAX_PLACE_DISTANCE = 5.0  # lengths of the components between a joint's place and them, above which nobody built it there
MAX_STIFFNESS_RATIO = 1e3  # of a joint's stiffness over that of the stiffest other joint


def fit_with_rivals(fit: Callable[[Sequence[JointEstimate]], WholeMachine], joints: Sequence[JointEstimate],
                    rivals: Mapping[str, JointEstimate]) -> tuple[WholeMachine, list[JointEstimate]]:
    """Return the machine, and its joints, that explains the most modes with the best information criterion.

    Rivals (by child) are tried where the machine of the likeliest joints leaves more than noise: all at once, then one by one.
    """
    machine, error = None, None
    chosen = list(joints)
    tried = [chosen]
    if rivals:
        tried.append([rivals.get(joint.child, joint) for joint in joints])
    if len(rivals) > 1:
        tried += [[rivals[child] if joint.child == child else joint for joint in joints] for child in rivals]
    for candidate in tried:
        try:
            other = fit(candidate)
        except np.linalg.LinAlgError as problem:
            error = error or problem
            continue
        if machine is None or _rank(other) < _rank(machine):
            machine, chosen = other, candidate
        if _is_good(machine):
            break
    if machine is None:
        raise error or np.linalg.LinAlgError("no joint could be fitted")
    return machine, chosen


def _is_good(machine: WholeMachine) -> bool:
    """Whether a machine explains all modes within about their noise."""
    return machine.fit.converged and machine.fit.widened <= MAX_GOOD_MISFIT and not machine.lonely


def _rank(machine: WholeMachine) -> tuple[int, float]:
    """Return the order of machines: the number of modes without a partner, then the information criterion."""
    return len(machine.lonely), machine.fit.information


def question_runaways(joints: Sequence[JointEstimate], relatives: Sequence[RelativeMotion]) -> list[tuple[Doubt, ...]]:
    """Return for every joint the grave doubts about a place or a stiffness that no test determines."""
    stiffness = [_largest_stiffness(joint, motion) for joint, motion in zip(joints, relatives, strict=True)]
    result = []
    for k, (joint, motion) in enumerate(zip(joints, relatives, strict=True)):
        offset = joint.position - motion.centre
        if len(joint.undetermined):
            offset = offset - np.linalg.pinv(joint.undetermined) @ (joint.undetermined @ offset)
        distance = float(np.linalg.norm(offset))
        others = max((value for i, value in enumerate(stiffness) if i != k), default=0.0)
        doubts = []
        if distance > MAX_PLACE_DISTANCE * motion.size:
            doubts.append(Doubt("place", f"it lies {distance:.3g} m from the components it joins, which are "
                                f"{2 * motion.size:.2g} m large: the motions do not determine it",
                                "check the components, their points and the chain", figure=distance / motion.size, grave=True))
        if 0 < MAX_STIFFNESS_RATIO * others < stiffness[k]:
            ratio = stiffness[k] / others
            doubts.append(Doubt("stiffness", f"it is {ratio:.2g} times that of the stiffest other joint: the test does not "
                                "determine it", "describe the two components as one, or excite the joint more", figure=ratio,
                                grave=True))
        result.append(tuple(doubts))
    return result


def _largest_stiffness(joint: JointEstimate, motion: RelativeMotion) -> float:
    """Return the largest stiffness of a joint for a motion of unit size at its components, N/m; zero where none is known."""
    matrix: FloatArray | None = joint.stiffness_matrix if joint.stiffness is None else np.diag(joint.stiffness)
    if matrix is None or not joint.screws.shape[1]:
        return 0.0
    local = np.linalg.solve(about(motion.centre, motion.size), joint.screws)
    return float(eigh(matrix, local.T @ local, eigvals_only=True)[-1])
