"""View of lobes: how deep at my speed, with its interval; tried cuts; the cut changed by sliders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.cutting.description import CuttingDescription, flat_values
from toolpoint.cutting.option_words import cut_words
from toolpoint.machine import Machine
from toolpoint.machine.description.project_plan import ASSUMED_COEFFICIENT_DEVIATION
from toolpoint.project import Project
from toolpoint.project.chain import TRIED_FILE
from toolpoint.project.changed_machine import change_machine
from toolpoint.project.limits.coupled_tool import stick_out_range
from toolpoint.project.limits.drawn_limits import CutQuestion, draw_limits, quantile_of
from toolpoint.project.limits.systems import DrawnSystems, MachineDraws, TipDraws, problem_of
from toolpoint.project.limits.tips import read_tip
from toolpoint.project.steps.plain_files import read_json
from toolpoint.studies.machines.tool_point import deep_chart
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.machine_look import apply_cut_values, limit_of, pack, resolve_speed
from toolpoint.workbench.views.stick_out import stick_out_slider, stick_out_words
from toolpoint.workbench.views.view import WorkbenchView, command_line, pose_words_of

# Values of a cut with a slider: key, factor of its ends over the value, unit shown, SI of that unit.
CUT_SLIDERS = (("tangential", 4.0, "MPa", 1e6), ("normal", 4.0, "MPa", 1e6), ("immersion", 0.0, "", 1.0),
               ("diameter", 2.0, "mm", 1e-3))
MIN_TEETH_END = 8  # where the slider of the teeth ends at least
BAND_SPEEDS = 15  # of the band over the range of a cut
MAX_INTERVAL_DRAWS = 200  # draws of an interval that the page waits for


def view_lobes(desk: Desk) -> WorkbenchView:
    """Return the view of a project's cuts: what is asked, tried, and known at the goals."""
    project = desk.project()
    outlooks = {entry.step.name: entry for entry in desk.outlook(project)}
    described = project.description
    goals, words, is_stale, inherited = {}, [], False, list[Doubt]()
    for name, goal in described.goals.items():
        entry = outlooks.get(f"limits/{name}")
        numbers = _kept_limit(desk, name)
        is_old = entry is None or not entry.is_of_today
        goals[name] = {"cut": goal.cut, "speed_rpm": goal.speed, "depth_m": goal.depth, "pose": dict(goal.pose),
                       "kept": numbers, "is_old": is_old}
        if numbers is not None and entry is not None and entry.record is not None:
            words.append(f"{name}: {entry.record.words}")
            is_stale = is_stale or is_old
            inherited += [doubt.doubt.within(doubt.step) for doubt in entry.record.doubts]
    has_tip = any("tip_x" in step.inputs for step in project.chain.steps)
    source = "the machine" if _machine_of(project) is not None else "the struck tip" if has_tip else "the coupled tool"
    answer = words[0] if words else f"Choose a speed: the limit of the cut at {source} follows, with its interval."
    doubts = [*([Doubt("the limits of the goals", "are of an earlier state", "run the project")] if is_stale else []),
              *inherited, *_deviation_doubts(project)]
    data = {"cuts": [_cut(name, cut.cut, project) for name, cut in described.cuts.items()], "goals": goals,
            "tried": _tried(project), "axes": _axes(project), "draws": described.draws, "source": source,
            "stick_out": stick_out_slider(project)}
    return WorkbenchView("lobes", ("Of an earlier state: " if is_stale else "") + answer, tuple(doubts),
                         (command_line("run", "."),), ("limits = project.Project.open('.').limits()",), data, is_stale)


def _kept_limit(desk: Desk, name: str) -> Any:
    try:
        return read_json(desk.folder / "results" / "limits" / name / "limits.json")
    except (OSError, ValueError):
        return None


def _deviation_doubts(project: Project) -> list[Doubt]:
    percent = f"{100 * ASSUMED_COEFFICIENT_DEVIATION:.0f} %"
    return [Doubt(f"coefficients of the cut {name}", f"no deviation is given: {percent} is assumed",
                  "write coefficient_deviation beside them") for name, cut in project.description.cuts.items()
            if cut.coefficient_deviation is None]


def _cut(name: str, cut: CuttingDescription, project: Project) -> dict[str, Any]:
    """Return a cut with its sliders: key, ends, value, unit."""
    values, sliders = flat_values(cut), []
    for key, reach, unit, scale in CUT_SLIDERS:
        value = values.get(key)
        if isinstance(value, (int, float)) and value > 0:
            ends = (0.02, 1.0) if reach == 0 else (value / reach, value * reach)
            sliders.append({"key": key, "value": value, "lower": ends[0], "upper": ends[1], "unit": unit, "scale": scale})
    if not cut.tool.pitch and not isinstance(cut.tool.helix, tuple):  # angles of each tooth are of their number
        sliders.append({"key": "teeth", "value": cut.tool.teeth, "lower": 1, "upper": max(2 * cut.tool.teeth, MIN_TEETH_END),
                        "unit": "", "scale": 1.0, "step": 1})
    goal = next((goal for goal in project.description.goals.values() if goal.cut == name), None)
    return {"name": name, "speeds": list(cut.speeds), "sliders": sliders,
            "speed_rpm": sum(cut.speeds) / 2 if goal is None else goal.speed, "depth_m": None if goal is None else goal.depth}


def _tried(project: Project) -> list[dict[str, Any]]:
    file = project.folder / TRIED_FILE
    if not file.is_file():
        return []
    return [{"speed_rpm": cut.speed, "depth_m": cut.depth, "stable": cut.stable, "frequency_hz": cut.frequency, "cut": cut.cut}
            for cut in io.read_tried(file)]


def _axes(project: Project) -> list[str]:
    machine = _machine_of(project)
    return [] if machine is None else list(machine.description.axes)


def _machine_of(project: Project) -> Machine | None:
    try:
        return Desk(project.folder).machine(project.machine_file).machine
    except ToolpointError:
        return None


def systems_of(desk: Desk, project: Project, values: Mapping[str, float], *, draws: int, stick_out: float | None = None
               ) -> DrawnSystems:
    """Return the draws that limits of a project rest on: of its machine with changed numbers, else of the struck tip.

    stick_out : m, of the coupled tool in place of these.
    """
    machine = _machine_of(project)
    if stick_out is not None:
        return project.coupled_tool(stick_out, draws=draws)
    if machine is not None:
        return MachineDraws(change_machine(machine, values), draws, project.description.seed)
    step = next((step for step in project.chain.steps if "tip_x" in step.inputs), None)
    inputs = {} if step is None else step.inputs
    places = {way: desk.folder / str(inputs[f"tip_{way}"]) for way in "xy" if f"tip_{way}" in inputs}
    if ("x" not in places or not places["x"].is_file()) and project.description.coupling is not None:
        return project.coupled_tool(stick_out_range(project.description.coupling, project.folder)[1], draws=draws)
    if "x" not in places or not places["x"].is_file():
        raise ToolpointError("limits: the project has neither a machine nor responses of a tip yet; run it")
    return TipDraws(read_tip(places["x"], places.get("y")), draws, project.description.seed)


def _asked(desk: Desk, request: MachineRequest) -> tuple[Project, CuttingDescription, float, str, DrawnSystems]:
    """Return project, cut, deviation of its coefficients, its name, and the systems of a request."""
    project = desk.project()
    cuts = project.description.cuts
    name = request.cut or next(iter(cuts), "")
    if name not in cuts:
        raise ToolpointError(f"cut {name!r}: must be one of {', '.join(cuts) or 'the cuts of project.yaml, which has none'}")
    cut = apply_cut_values(cuts[name].cut, request.cut_values)
    deviation = cuts[name].coefficient_deviation or ASSUMED_COEFFICIENT_DEVIATION
    draws = min(project.description.draws, MAX_INTERVAL_DRAWS)
    return project, cut, deviation, name, systems_of(desk, project, request.values, draws=draws,
                                                                  stick_out=request.stick_out)


def ask_cut(desk: Desk, request: MachineRequest) -> tuple[Project, CuttingDescription, DrawnSystems]:
    """Return the project, the cut with the numbers of the page, and the systems of a request."""
    project, cut, _, _, systems = _asked(desk, request)
    return project, cut, systems


def limit_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return the exact limit at the asked speed and the quick curve over the speeds."""
    project, cut, _, _, systems = _asked(desk, request)
    dynamics = systems.nominal(request.pose)
    data, doubts = limit_of(dynamics, cut, request)
    coupled_doubts = systems.doubts if request.stick_out is not None else ()
    return {"limit": data, "doubts": [str(doubt) for doubt in dict.fromkeys([*coupled_doubts, *doubts])],
            "calls": _calls(desk, project, request, cut), "commands": _commands(desk, project, request, cut)}


def curve_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return the exact limits over the speeds, for when the sliders rest."""
    _, cut, _, _, systems = _asked(desk, request)
    dynamics = systems.nominal(request.pose)
    speeds = np.linspace(*cut.speeds, min(request.count, 120))
    chart = deep_chart(problem_of(dynamics, cut), speeds, None, end=cut.depth_end[0])
    return {"speeds": pack(speeds), "limit": pack(chart.limit), "searched_m": chart.depth_max, "method": chart.method,
            "doubts": [str(doubt) for doubt in (*doubts_among(dynamics.notes), *chart.doubts)]}


def interval_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return the 95 % interval of the limit at the asked speed, and the chance that the asked depth is stable."""
    project, cut, deviation, name, systems = _asked(desk, request)
    speed = resolve_speed(cut, request)
    depth = request.cut_values.get("depth")
    limits = draw_limits(systems, CutQuestion(name, cut, deviation, (speed,), dict(request.pose), depth))
    weights, is_weighed = _weights(desk, project, systems.count, request)
    lower, upper = limits.interval(weights)[:, 0]
    chance = None if depth is None else float(limits.chance(weights)[0])
    doubts = [*systems.doubts, *doubts_among(limits.notes), *_uncounted_cuts(desk, is_weighed)]
    # As in the answer of a goal: the likeliest system was that before the tried cuts.
    limit = quantile_of(limits.draws[:, 0], weights, 0.5) if is_weighed else limits.limit[0]
    return {"speed_rpm": speed, "limit_m": limit, "lower_m": lower, "upper_m": upper, "searched_m": limits.depth_max,
            "depth_m": depth, "stable_probability": chance, "shares": limits.shares, "draws": systems.count,
            "is_weighed": is_weighed, "doubts": list(map(str, doubts))}


def band_deed(desk: Desk, request: MachineRequest) -> dict[str, Any]:
    """Return the 95 % intervals of the limit at speeds over the range of the cut; many times slower than one."""
    project, cut, deviation, name, systems = _asked(desk, request)
    speeds = tuple(np.linspace(*cut.speeds, BAND_SPEEDS).tolist())
    limits = draw_limits(systems, CutQuestion(name, cut, deviation, speeds, dict(request.pose)))
    weights, is_weighed = _weights(desk, project, systems.count, request)
    lower, upper = limits.interval(weights)
    return {"speeds": pack(speeds), "lower": pack(lower), "upper": pack(upper), "draws": systems.count,
            "is_weighed": is_weighed, "doubts": [str(doubt) for doubt in (*systems.doubts, *doubts_among(limits.notes),
                                                                          *_uncounted_cuts(desk, is_weighed))]}


def _uncounted_cuts(desk: Desk, is_weighed: bool) -> tuple[Doubt, ...]:
    """Return the doubt of an interval beside cuts that were tried and are not in it; none where they are, or there are none."""
    if is_weighed or not (desk.folder / TRIED_FILE).is_file():
        return ()
    return (Doubt("the interval", "does not count the cuts that were tried: they weigh the saved machine of the last run alone",
                  "run the project; take changed numbers back"),)


def _weights(desk: Desk, project: Project, count: int, request: MachineRequest) -> tuple[Any, bool]:
    """Return the weights of the draws by the tried cuts, where they are of today and of the machine as it is saved."""
    kind = "machine" if _machine_of(project) is not None else "tip"
    entry = next((entry for entry in desk.outlook(project) if entry.step.name == f"tried/{kind}"), None)
    if entry is not None and entry.is_of_today and not request.values and request.stick_out is None:
        weights = np.asarray(read_json(desk.folder / entry.step.output_paths[0])["weights"], float)
        if weights.size == count:
            return weights, True
    return np.full(count, 1 / count), False


def _calls(desk: Desk, project: Project, request: MachineRequest, cut: CuttingDescription) -> list[str]:
    """Return the Python calls that give the same."""
    values = {key: value for key, value in flat_values(cut).items() if value is not None and value != ""}
    if request.stick_out is not None:
        return [f"limits = project.Project.open('.').limits(cut={request.cut!r}, speeds=[{resolve_speed(cut, request):.6g}], "
                f"stick_out={request.stick_out:.6g})", "print(limits.limit, limits.draws)"]
    if _machine_of(project) is None:
        return ["limits = project.Project.open('.').run()"]
    file = project.machine_file.relative_to(desk.folder).as_posix()
    return [f"dynamics = studies.machine_dynamics(io.read_machine({file!r}), {dict(request.pose)!r})",
            f"print(studies.chart_lobes(dynamics, {values!r}).table())"]


def _commands(desk: Desk, project: Project, request: MachineRequest, cut: CuttingDescription) -> list[str]:
    """Return the command that charts the same cut on the machine, the run of the project where there is none."""
    if request.stick_out is not None:
        return [command_line(*stick_out_words(desk, project, request.stick_out), "--lobes", *cut_words(cut))]
    if _machine_of(project) is None:
        return [command_line("run", ".")]
    file = project.machine_file.relative_to(desk.folder).as_posix()
    pose = ["--pose", pose_words_of(request.pose)] if request.pose else []
    return [command_line("lobes", file, *pose, *cut_words(cut))]
