"""Stability of the cut that is milled along a side: a run whose chips do not feed back cannot show chatter."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.panels.method import PanelArnoldi
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.accuracy.moving_structure import MovingStructure
from toolpoint.studies.accuracy.side_run import MillingSetup
from toolpoint.studies.machines.arm_reach import Pose
from toolpoint.studies.machines.tool_point import STUDY_LINES, pose_problem, tool_point


def judge_cut(machine: Machine, structure: MovingStructure, setup: MillingSetup, *, cut: CuttingDescription) -> tuple[str, ...]:
    """Return the doubt that a side's cut chatters, or the reason why it cannot be judged; nothing for a stable cut.

    The largest multiplier of the described cut in the side's feed direction at its first, middle and last pose; motors held.
    """
    if "cutting" not in setup.loads or not setup.with_force:
        return ()
    poses = [pose for pose in structure.reach.poses if pose is not None]
    chosen = sorted({0, len(poses) // 2, len(poses) - 1})
    try:
        sizes = [_multiplier(machine, poses[i], structure.axes[i][:, 0], setup=setup, cut=cut) for i in chosen]
    except ToolpointError as error:
        return (f"whether the cut chatters was not judged: {error}",)
    if max(sizes) < 1:
        return ()
    what = "its vibration grows, and how far hangs on the length of the run alone" if setup.regenerative else \
        "its vibration grows, and the errors here, of a chip that does not feed back, are not those of the milled part"
    where = f"{1e3 * setup.depth:g} mm at {setup.speed:g} rev/min"
    count = f"{sum(size >= 1 for size in sizes)} of {len(sizes)} poses along it"
    why = f"{structure.side.name}: the cut ({where}) chatters at {count} (multiplier {max(sizes):.3g}, stable below 1): {what}"
    return (Doubt("accuracy", why, "take a smaller depth, or a speed that lobes show to be stable", figure=max(sizes) - 1),)


def _multiplier(machine: Machine, pose: Pose, feed: FloatArray, *, setup: MillingSetup, cut: CuttingDescription) -> float:
    """Return the size of the largest multiplier at a pose, the feed along a direction in machine axes."""
    study = tool_point(machine, [pose], STUDY_LINES)
    along = study.axes[0].T @ feed
    problem = pose_problem(study, cut, 0).at_feed_angle(float(np.arctan2(along[1], along[0])))
    return float(np.abs(PanelArnoldi().multipliers(problem, setup.speed, setup.depth)[0]))
