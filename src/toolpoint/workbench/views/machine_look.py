"""Look at a machine in one state of the page: modes, responses of the tool, the limit of a cut; fast enough for a slider."""

from __future__ import annotations

import base64
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.cutting import MillingProblem, StabilityChart, ZeroOrder, stability
from toolpoint.cutting.description import CuttingDescription, flat_values
from toolpoint.machine import Machine
from toolpoint.machine.description import ELASTIC_KINDS, FrameDescription, PointDescription
from toolpoint.plot.shape_view.animated_shapes import AnimatedShapes
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.plot.shape_view.scene import Scene
from toolpoint.project.changed_machine import change_machine
from toolpoint.project.limits.systems import problem_of
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machines.tool_point import deep_chart, depth_limit, tool_point
from toolpoint.vibration import Modes, frequency_response
from toolpoint.workbench.state.machine_request import MAX_LOOKED_MODES, MachineRequest

JOINT_MARK = "joint "  # before a joint's name: a mark of the scene where its springs are
MARK_NODES = 8  # corners of the box that marks a point
JOINT_MARK_SCALE = 2.6  # size of the mark of a joint over that of a point
LOOKED_LINES = 400  # frequency lines of the drawn responses
MAX_LOOKED_SPEEDS = 400  # of a chart that is drawn while a slider moves


@dataclass(frozen=True, eq=False)
class MachineState:
    """A machine with the numbers of the page, and the cut that is asked about."""

    machine: Machine
    pose: Mapping[str, float]
    cut: CuttingDescription | None

    @property
    def has_tool(self) -> bool:
        """Whether the file names the point where the tool cuts."""
        return self.machine.description.tool is not None


def state_of(machine: Machine, request: MachineRequest, cut: CuttingDescription | None) -> MachineState:
    """Return the machine and cut as the page has changed them; raises ToolpointError for what cannot be."""
    cut = None if cut is None else apply_cut_values(cut, request.cut_values)
    for axis in request.pose:
        if axis not in machine.description.axes:
            raise ToolpointError(f"axis {axis}: not of this machine; its axes: {', '.join(machine.description.axes) or 'none'}")
    return MachineState(change_machine(machine, request.values), dict(request.pose), cut)


def apply_cut_values(cut: CuttingDescription, values: Mapping[str, float]) -> CuttingDescription:
    """Return a cut with numbers changed by their flat keys, SI; ``depth`` is that of a question and no number of a cut."""
    changes = {key: value for key, value in values.items() if key != "depth"}
    if "teeth" in changes:  # JSON knows no whole numbers
        if not changes["teeth"].is_integer():
            fail("teeth", f"{changes['teeth']:g}", "must be a whole number")
        changes = {**changes, "teeth": int(changes["teeth"])}
    return CuttingDescription.of(**{**flat_values(cut), **changes}) if changes else cut


def look(state: MachineState, request: MachineRequest, lines: FloatArray) -> dict[str, Any]:
    """Return modes, the drawn shape, responses and the limit at the asked speed as plain data.

    lines : (n,) Hz of the responses. Arrays of numbers are packed as base64 of 32-bit floats.
    """
    start = time.perf_counter()
    scene, shapes = drawn_shapes(state.machine, state.pose)
    mode = min(request.mode, shapes.count - 1)
    data: dict[str, Any] = {"frequency_hz": shapes.frequency, "damping_ratio": shapes.damping_ratio,
                            "nodes": pack(scene.nodes), "shape": pack(np.real(shapes.displacement[mode])), "mode": mode}
    doubts: list[Doubt] = []
    if state.has_tool:
        dynamics = machine_dynamics(state.machine, state.pose)
        data["response"] = response_of(state, lines, dynamics)
        if state.cut is not None:
            data["limit"], doubts = limit_of(dynamics, state.cut, request)
    hand_doubts = [doubt for doubt in state.machine.description.doubts if "changed by hand" in doubt.why]
    data["doubts"] = [str(doubt) for doubt in dict.fromkeys([*hand_doubts, *doubts])]
    data["seconds"] = time.perf_counter() - start
    return data


def drawn_shapes(machine: Machine, pose: Mapping[str, float]) -> tuple[Scene, AnimatedShapes]:
    """Return scene and lowest modes of a machine whose marks are tool, table and joints: measured points would hide it."""
    description = machine.description
    points = {name: point for name, point in description.points.items() if name in (description.tool, description.table)}
    points |= {JOINT_MARK + name: PointDescription(description.joints[name].child, description.joints[name].frame.at)
               for name in _marked_joints(machine)}
    drawn = replace(machine, description=replace(description, points=points))
    scene, shapes = machine_shapes(drawn, pose, min(MAX_LOOKED_MODES, machine.size))
    nodes = np.array(scene.nodes)
    for first in joint_marks(machine, scene).values():
        corners = nodes[first:first + MARK_NODES]
        nodes[first:first + MARK_NODES] = corners.mean(axis=0) + JOINT_MARK_SCALE * (corners - corners.mean(axis=0))
    return replace(scene, nodes=nodes), shapes


def _marked_joints(machine: Machine) -> list[str]:
    """Return the joints with springs whose place in their child is known: rigid bodies in the machine's frame."""
    description = machine.description
    return [name for name, joint in description.joints.items() if joint.stiffness and joint.child in description.bodies
            and description.bodies[joint.child].frame == FrameDescription()
            and not any(getattr(description.bodies[joint.child], kind) is not None for kind in ELASTIC_KINDS)]


def joint_marks(machine: Machine, scene: Scene) -> dict[str, int]:
    """Return the first node of the mark of every joint with springs; marks stand last in the scene, in the order of points."""
    description = machine.description
    kept = [name for name in description.points if name in (description.tool, description.table)]
    names = _marked_joints(machine)
    first = len(scene.nodes) - MARK_NODES * (len(kept) + len(names))
    return {name: first + MARK_NODES * (len(kept) + number) for number, name in enumerate(names)}


def response_of(state: MachineState, lines: FloatArray, dynamics: ToolDynamics | None = None) -> dict[str, Any]:
    """Return the magnitude of the tool's receptance along x, y and z, m/N, packed.

    dynamics : of this state, whose modes then serve; where dampers and losses meet the response itself is solved for.
    """
    modes = None if dynamics is None or not isinstance(dynamics.response, Modes) else dynamics.response
    if modes is None or (modes.scaling == "modal A" and modes.damping == "structural"):
        values = tool_point(state.machine, [dict(state.pose)], lines).frf.values[0]
    else:
        values = frequency_response.modal(modes, lines).values
    return {way: pack(np.abs(values[:, place, place])) for place, way in enumerate("xyz")}


def limit_of(dynamics: ToolDynamics, cut: CuttingDescription, request: MachineRequest) -> tuple[dict[str, Any], list[Doubt]]:
    """Return the limit at the asked speed and the quick curve over all speeds, with the doubts about them.

    The limit is exact, but that of the quick method where the request is one of a slider on its way.
    """
    problem = problem_of(dynamics, cut)
    speed = resolve_speed(cut, request)
    chart = _quick_chart(cut, problem, dynamics, request, speed)
    quick = None if chart is None else {"speeds": pack(chart.speeds), "limit": pack(chart.limit)}
    if request.is_moving and chart is not None:
        place = int(np.searchsorted(chart.speeds, speed))
        return {"speed_rpm": speed, "limit_m": chart.limit[place], "searched_m": chart.depth_max, "chatter_hz": None,
                "method": chart.method, "is_exact": False, "quick": quick}, list(doubts_among(dynamics.notes))
    exact = deep_chart(problem, np.array([speed]), None, end=cut.depth_end[0])
    place = int(exact.limit_points()[0])
    data = {"speed_rpm": speed, "limit_m": exact.limit[0], "error_m": exact.limit_error[0], "searched_m": exact.depth_max,
            "chatter_hz": None if place < 0 else float(exact.frequency[place]), "method": exact.method,
            "is_exact": True, "quick": quick}
    return data, [*doubts_among(dynamics.notes), *exact.doubts]


def resolve_speed(cut: CuttingDescription, request: MachineRequest) -> float:
    """Return the asked speed, rev/min: the middle of the cut's range where none is, and never beyond it."""
    lower, upper = cut.speeds
    return float(np.clip((lower + upper) / 2 if request.speed is None else request.speed, lower, upper))


def _quick_chart(cut: CuttingDescription, problem: MillingProblem, dynamics: ToolDynamics, request: MachineRequest,
                 speed: float) -> StabilityChart | None:
    """Return the single-frequency limits over the speeds with the asked one, None where that method cannot take the cut."""
    if dynamics.at_speed is not None:
        return None
    speeds = np.union1d(np.linspace(*cut.speeds, min(request.count, MAX_LOOKED_SPEEDS)), [speed])
    try:
        return stability.chart(problem, speeds, ZeroOrder(), depth_max=depth_limit(problem))
    except ToolpointError:
        return None


def pack(values: Any) -> str:
    """Return numbers as base64 of little-endian 32-bit floats, row by row: what is not finite stays so."""
    return base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode("ascii")


@lru_cache(maxsize=8)
def response_lines(machine: Machine) -> FloatArray:
    """Return the lines (LOOKED_LINES,) Hz of the drawn responses: over the modes that the page lists."""
    frequency = machine_shapes_frequency(machine)
    return np.geomspace(0.4 * frequency[0], 1.4 * frequency[-1], LOOKED_LINES)


def machine_shapes_frequency(machine: Machine) -> FloatArray:
    """Return the natural frequencies above zero of the lowest modes, Hz."""
    frequency = drawn_shapes(machine, {})[1].frequency
    moving = frequency[frequency > 1e-6 * frequency.max()]
    return np.asarray(moving if moving.size else np.array([1.0, 100.0]))
