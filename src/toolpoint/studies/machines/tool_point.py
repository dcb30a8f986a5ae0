"""Tool-point dynamics: relative FRFs of tool against table at several poses, and the stability lobes that follow."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, increasing
from toolpoint._notebook import NotebookText
from toolpoint.cutting import MillingProblem, PanelArnoldi, StabilityChart, stability
from toolpoint.cutting.build import coefficients_of, engagement_of, tool_of, total_energy_of, variation_of
from toolpoint.cutting.cut.kept_modes import find_least_frequency
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.kinematics.chain import Pose, check_poses
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.machine.assembly.gyroscopics import fastest_spin, run_at_speed
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.description import ELASTIC_KINDS
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.pose_words import direction_words, pose_words
from toolpoint.substructuring.reach import DEFAULT_REACH_RATIO
from toolpoint.vibration import Dof, Frf, Modes, SecondOrderSystem, damping, eigen, frequency_response
from toolpoint.vibration.damped_modes import solve_as_damped
from toolpoint.vibration.frequency_response import condense_above
from toolpoint.vibration.gyroscopic import is_gyroscopic

MAX_DEPTH_DOUBLINGS, MAX_CHART_DEPTH = 4, 1.0  # of a chart without a limit; m
FIRST_LOSS_DEPTH_RATIO = 64  # depths of the softest mode up to which a first loss of stability is searched
FIRST_LOSS_TOLERANCE = 1e-3  # relative error requested of such a limit; the achieved one is stated
STUDY_LINES = np.array([0.0, 1.0])  # Hz; only the modes of such a study are used
FEED_ANGLE = {"x": 0.0, "y": np.pi / 2, "-x": np.pi, "-y": -np.pi / 2}


@dataclass(frozen=True, eq=False)
class ToolPoint(NotebookText):
    """Tool-point dynamics at several poses.

    poses : axis name to position, one mapping a pose; modes : Modes with one leading pose axis, seen at the tool point;
    frf : Frf (n_poses, n_f, 3, 3), receptance, m/N; point : the name of the point, ``tool-table`` when it is relative.
    axes : (n_poses, 3, 3), the tool's x, y and z at every pose as columns in the machine frame; modes and responses are seen
    along them. They are the machine's axes where the tool stands as z does, carried along by the smallest turn where it leans.
    """

    machine: Machine
    poses: tuple[Mapping[str, float], ...]
    point: str
    modes: Modes
    frf: Frf
    axes: FloatArray

    def leaning(self) -> list[str]:
        """Return a line on every pose at which the tool does not stand along the machine's z: where it points."""
        return [f"{pose_words(self.machine, pose)}: the tool's axis is {direction_words(turn[:, 2])}; x, y and z are the tool's"
                for pose, turn in zip(self.poses, self.axes, strict=True) if turn[2, 2] < 1 - 1e-12]

    def __repr__(self) -> str:
        return f"ToolPoint({self.machine.name!r}, {self.point}, {len(self.poses)} poses, {self.frf!r})"


def tool_point(
    machine: Machine, poses: Sequence[Mapping[str, float]] | None = None, frequency: FloatArray | None = None
) -> ToolPoint:
    """Return modes and FRFs of the tool against the table.

    Parameters
    ----------
    machine : Machine
        Its description names `tool`; the response is relative to `table` where that is named too.
    poses : sequence of mappings of axis name to m or rad, optional
        Those of the description, or the reference pose, where left out.
    frequency : (n_f,) floats, optional
        Hz; 800 lines over the lowest twelve modes where left out.

    Raises
    ------
    ToolpointError
        Where the machine names no tool point, or has no damping at all.
    """
    description = machine.description
    if description.tool is None:
        fail("tool", "none", "must name the point where the tool cuts", remedy="add 'tool: NAME' to the machine file")
    point = description.tool if description.table is None else f"{description.tool}-{description.table}"
    poses = tuple(check_poses(poses) if poses is not None else description.poses) or ({},)
    batch = batch_of(machine, poses)
    # Read as the cut reads them: the point named 7 of a measured machine is the number 7.
    labels = [Dof.parse(f"{point}:{way}") for way in ("+x", "+y", "+z")]
    system = assemble(machine, batch or None, labels, modal_damping=False)
    if not batch:
        system = _as_batch(system, len(poses))
    axes = tool_axes(machine, batch, len(poses))
    system = rotate_to_axes(system, axes)
    modes = _modes(system, description.damping_ratio)
    if not modes.damping_ratio.any():
        fail("machine", "no damping", "its FRF would be infinite at every resonance",
             remedy="give damping_ratio, or loss_factor or damping to joints")
    lines = _lines(modes) if frequency is None else increasing("frequency", np.asarray(frequency, float))
    # Modes with both kinds of damping are equivalent between resonances only: the response itself is solved for.
    mixed = modes.scaling == "modal A" and modes.damping == "structural"
    frf = frequency_response.direct(system, lines) if mixed else frequency_response.modal(modes, lines)
    return ToolPoint(machine, poses, point, modes, frf, axes)


def _modes(system: SecondOrderSystem, ratio: float | None) -> Modes:
    """Return modes with the described damping: one ratio for all, or that of joints and bodies, coupled between modes."""
    if ratio is None:
        return solve_as_damped(system)
    if is_gyroscopic(system):
        return eigen.solve_damped(damping.modal(system, ratio))
    return eigen.solve_undamped(system).with_damping(ratio)


def speed_dynamics(machine: Machine, pose: Mapping[str, float] | None = None) -> Callable[[float], Modes] | None:
    """Return the modes at the tool point as a function of the spindle speed (rev/min); None where nothing spins.

    The fastest body of the machine turns with the spindle, the others in proportion; the last 256 speeds are kept.
    """
    if not fastest_spin(machine.description):
        return None
    poses = [dict(pose or {})]

    @lru_cache(maxsize=256)
    def modes_at(speed: float) -> Modes:
        spinning = tool_point(run_at_speed(machine, speed * np.pi / 30), poses, np.array([0.0, 1.0]))
        return condense_unreliable(machine, spinning.modes.at_pose(0))

    return modes_at


def batch_of(machine: Machine, poses: Sequence[Mapping[str, float]]) -> dict[str, FloatArray]:
    """Return a sequence of poses as one batch: every axis that a pose names, at rest where another does not."""
    reference = {axis.name: axis.reference_position for axis in machine.chain.axes}
    names = dict.fromkeys(name for pose in poses for name in pose)
    return {name: np.array([float(pose.get(name, reference.get(name, 0.0))) for pose in poses]) for name in names}


def tool_axes(machine: Machine, pose: Pose | None = None, count: int = 1, *, point: str | None = None) -> FloatArray:
    """Return the tool's x, y and z at a batch of poses as columns in the machine frame, shape (n_poses, 3, 3).

    point : on the body that carries the tool, the tool point itself where left out.
    """
    description = machine.description
    name = point or description.tool
    if name is None:
        fail("tool", "none", "must name the point where the tool cuts", remedy="add 'tool: NAME' to the machine file")
    link = machine.link(description.points[name].body)
    direction = np.array(description.tool_axis)
    if link >= 0:
        direction = machine.chain.displacements(pose or {})[:, link, :3, :3] @ direction
    return np.broadcast_to(smallest_turn(direction), (count, 3, 3))


def rotate_to_axes(system: SecondOrderSystem, axes: FloatArray) -> SecondOrderSystem:
    """Return a batch of systems with their outputs and inputs x, y, z along other axes (n_poses, 3, 3)."""
    if np.array_equal(axes, np.broadcast_to(np.eye(3), axes.shape)):
        return system
    return replace(system, output_map=np.swapaxes(axes, -1, -2) @ system.output_map, input_map=system.input_map @ axes)


def method_for(modes: Modes, method: StabilityMethod | None) -> StabilityMethod | None:
    """Return the method of a chart, by the damping of the modes where none is given.

    Where modes are overdamped it is `PanelArnoldi` for the first loss of stability alone: such machines (robots) have dozens of
    modes, and most speeds of their charts lie far above the lowest.
    """
    return PanelArnoldi(first_only=True, tolerance=FIRST_LOSS_TOLERANCE) if method is None and is_overdamped(modes) else method


def is_overdamped(modes: Modes) -> bool:
    """Whether some modes are real poles."""
    return modes.scaling == "modal A" and bool((modes.damping_ratio >= 1).any())


def _as_batch(system: SecondOrderSystem, count: int) -> SecondOrderSystem:
    def repeat(a: FloatArray | None) -> Any:
        return None if a is None else np.repeat(a[None], count, axis=0)
    return SecondOrderSystem(
        repeat(system.mass), repeat(system.stiffness), repeat(system.damping), repeat(system.structural_damping),
        repeat(system.output_map), repeat(system.input_map), system.outputs, system.inputs, system.coordinates, system.notes)


def _lines(modes: Modes) -> FloatArray:
    moving = np.where(modes.frequency > 1e-6, modes.frequency, np.nan)
    frequency_min, frequency_max = float(np.nanmin(moving)), float(np.nanmax(moving[..., :12]))
    return np.linspace(0.2 * frequency_min, 1.3 * frequency_max, 800)


def milling_problem(cut: CuttingDescription, dynamics: Modes | Frf, x: str | None = None, *, y: str | None = None
                    ) -> MillingProblem:
    """Return the milling problem of a described cut on these dynamics; x, y label the machine axes of the cutting plane.

    Where the cut has an axial force or a rounded edge and the dynamics know the direction z of the same point, the response
    is taken in space.
    """
    tool, material = tool_of(cut), coefficients_of(cut)
    spatial = (material.ka > 0 or tool.corner_radius > 0) and y != "same"
    return MillingProblem(
        tool, engagement_of(cut), material, dynamics, x, y, feed_angle=FEED_ANGLE[cut.feed],
        feed_per_tooth=cut.feed_per_tooth, process_damping=cut.damping.coefficient, damping_friction=cut.damping.friction,
        speed_variation=variation_of(cut), z=_axial_label(dynamics, x) if spatial else None, law=total_energy_of(cut))


def _axial_label(dynamics: Modes | Frf, x: str | None) -> str | None:
    """Return the label of the direction z of the point that is cut at, where the dynamics have it."""
    point_dofs = dynamics.dofs if isinstance(dynamics, Modes) else [dof for dof in dynamics.outputs if dof in dynamics.inputs]
    along = [dof for dof in point_dofs if dof.direction[1:] == "x" and dof.vector is None] if x is None else [Dof.parse(x)]
    normal = [dof for dof in point_dofs if dof.direction[1:] == "z" and dof.vector is None
              and dof.point in {d.point for d in along}]
    return str(normal[0]) if len(normal) == 1 else None


def lobes(
    study: ToolPoint, cut: CuttingDescription | None = None, speeds: FloatArray | None = None,
    *, method: StabilityMethod | None = None,
) -> tuple[StabilityChart, ...]:
    """Return a stability chart for every pose of a study.

    Parameters
    ----------
    study : ToolPoint
    cut : CuttingDescription, optional
        The machine's own where left out.
    speeds : (n,) floats, optional
        rev/min; 200 over the cut's range where left out.
    method : stability method, optional
        The exact engine where left out; `ZeroOrder` is quicker over many poses and says its usual error in the notes.
    """
    cut = cut or study.machine.description.cutting
    if cut is None:
        fail("cut", "none", "must be given, here or as 'cutting' in the machine file")
    n = np.linspace(*cut.speeds, 200) if speeds is None else speeds
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:  # the compiled kernels release the interpreter
        return tuple(pool.map(lambda problem: deep_chart(problem, n, method_for(study.modes, method),
                                                             end=cut.depth_end[0]),
                              _problems(study, cut)))


def lowest_limits(study: ToolPoint, charts: Sequence[StabilityChart], cut: CuttingDescription | None = None, *,
                  method: StabilityMethod | None = None) -> tuple[stability.LowestLimit, ...]:
    """Return the lowest limit between the charted speeds for every pose; arguments are those of `lobes`, and its charts."""
    described = cut or study.machine.description.cutting
    if described is None:
        fail("cut", "none", "must be given, here or as 'cutting' in the machine file")
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        return tuple(pool.map(lambda problem, chart: stability.lowest_limit(problem, chart, method_for(study.modes, method)),
                              _problems(study, described), charts))


def _problems(study: ToolPoint, cut: CuttingDescription) -> list[MillingProblem]:
    """Return the milling problem of every pose."""
    return [pose_problem(study, cut, i) for i in range(len(study.poses))]


def pose_problem(study: ToolPoint, cut: CuttingDescription, index: int) -> MillingProblem:
    """Return the milling problem at a pose of a study; with spinning bodies every spindle speed has modes of its own."""
    x, y = f"{study.point}:+x", f"{study.point}:+y"
    modes = condense_unreliable(study.machine, study.modes.at_pose(index))
    problem = milling_problem(cut, modes, x, y=y)
    at_speeds = speed_dynamics(study.machine, study.poses[index])
    if at_speeds is not None:
        return problem.changed(dynamics=at_speeds)
    return _without_idle_modes(problem, modes) if is_overdamped(modes) else problem


def _without_idle_modes(problem: MillingProblem, modes: Modes) -> MillingProblem:
    """Return a problem whose modes are replaced by their static part where no charted depth makes them chatter alone."""
    depth = first_loss_depth(problem)
    frequency, gain = find_least_frequency(problem, depth)
    reason = f"in cuts to {1e3 * depth:.3g} mm deep they cannot chatter by themselves (gain {gain:.2g}, 1 could)"
    return problem.changed(dynamics=condense_above(modes, frequency, reason))


def first_loss_depth(problem: MillingProblem) -> float:
    """Return the largest depth (m) of a chart that searches for the first loss of stability alone.

    It is so deep that stiffer modes limit the speeds whose teeth pass too fast for the softest.
    """
    return min(FIRST_LOSS_DEPTH_RATIO * depth_limit(problem), MAX_CHART_DEPTH)


def condense_unreliable(machine: Machine, modes: Modes) -> Modes:
    """Return the modes that the elastic bodies of a machine are reduced for, those above as their static part."""
    bands = [getattr(body, kind).band for body in machine.description.bodies.values() for kind in ELASTIC_KINDS
             if getattr(body, kind) is not None]
    return condense_above(modes, DEFAULT_REACH_RATIO * min(bands)) if bands else modes


def deep_chart(problem: MillingProblem, speeds: FloatArray, method: StabilityMethod | None, *, share: float = 0.0,
               end: float = MAX_CHART_DEPTH) -> StabilityChart:
    """Return a chart that is deep enough to show a limit at more than a share of the speeds, where there is one.

    The first depth is that of the softest mode; where the teeth pass too fast for it, stiffer modes limit, and deeper. No chart
    goes deeper than `end` (m).
    """
    if isinstance(method, PanelArnoldi) and method.first_only:
        return stability.chart(problem, speeds, method, depth_max=min(first_loss_depth(problem), end))
    depth = min(depth_limit(problem), end)
    chart = stability.chart(problem, speeds, method, depth_max=depth)
    for _ in range(MAX_DEPTH_DOUBLINGS):
        limited_fraction = float(np.isfinite(chart.limit).mean())
        if (limited_fraction >= share and limited_fraction > 0) or depth >= end:
            break
        depth = min(2 * depth, MAX_CHART_DEPTH, end)
        chart = stability.chart(problem, speeds, method, depth_max=depth)
    return chart


def depth_limit(problem: MillingProblem) -> float:
    """Return a depth (m) well above the lowest limit of a cut, for the range of a chart: 12/(K_t max |Re G|), <= 0.5 m."""
    frequency_min, frequency_max = problem.plane.span
    lines = problem.plane.frequency
    f = np.linspace(0.5 * frequency_min, 2 * frequency_max, 4000) if lines is None else lines
    compliance = float(np.abs(np.real(problem.plane.response(f))).max())
    if not np.isfinite(compliance) or compliance <= 0:
        raise ToolpointError("dynamics: no compliance in the cutting plane; the cut is stable at any depth")
    return float(min(0.5, 12 / (problem.coefficients.kt * compliance)))
