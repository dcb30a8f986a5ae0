"""Steps of answers: weights of the draws by tried cuts, limits of goals, ranked changes, the next test and the next cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint import io, studies
from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.machine.description.project_plan import ASSUMED_COEFFICIENT_DEVIATION, CoupledTool
from toolpoint.project.engine.step import StepOutcome
from toolpoint.project.limits.better_speed import CERTAIN_LEVEL, find_better_speed
from toolpoint.project.limits.changes import lead_of, rank_joints
from toolpoint.project.limits.coupled_tool import couple_at
from toolpoint.project.limits.drawn_limits import CutQuestion, DrawnLimits, draw_limits, quantile_of
from toolpoint.project.limits.next_cut import choose_cut
from toolpoint.project.limits.systems import DrawnSystems, MachineDraws, TipDraws, cut_of
from toolpoint.project.limits.tips import read_tip
from toolpoint.project.limits.tried_cuts import weigh_draws
from toolpoint.project.steps.plain_files import read_json, write_json

MAX_NEXT_POINTS = 12  # measured points among the candidates of the next test


def weigh_tried(folder: Path, tried: Path, *, cuts: Mapping[str, Any], has_poses: bool, draws: int, seed: int,
                machine: Path | None = None, tip_x: Path | None = None, tip_y: Path | None = None) -> StepOutcome:
    """Write the weights of the draws after the tried cuts (weights.json); has_poses : whether goals are asked at poses."""
    systems = _systems(machine, tip_x, tip_y, draws=draws, seed=seed)
    questions = {name: _question(name, entry, 1.0, {}) for name, entry in cuts.items()}
    cuts_made = io.read_tried(tried)
    result = weigh_draws(systems, cuts_made, questions)
    write_json(folder / "weights.json", {
        "weights": result.weights, "effective_draws": result.effective,
        "cuts": [{"speed_rpm": cut.speed, "depth_m": cut.depth, "pose": dict(cut.pose), "cut": cut.cut, "stable": cut.stable,
                  "frequency_hz": cut.frequency,
                  "share_of_draws": share} for cut, share in zip(cuts_made, result.likelihoods, strict=True)]})
    words = f"{len(cuts_made)} tried cut{'s' * (len(cuts_made) != 1)}; the draws count as {result.effective:.0f} of {draws}"
    placeless = [cut for cut in cuts_made if not cut.pose] if has_poses and machine is not None else []
    doubts = [Doubt("tried cuts", f"{len(placeless)} of {len(cuts_made)} without a pose, taken at the reference pose of the "
                    "machine", "write the pose beside them in tried.yaml")] if placeless else []
    return StepOutcome(words, (*result.doubts, *doubts))


def limit_goal(folder: Path, *, name: str, cut: Mapping[str, Any], cut_name: str, goal: Mapping[str, Any],
               struck_pose: Mapping[str, float], draws: int, seed: int, machine: Path | None = None,
               tip_x: Path | None = None, tip_y: Path | None = None, weights: Path | None = None,
               verdict: Path | None = None, checked: Path | None = None, coupling: Mapping[str, Any] | None = None,
               tool: Path | None = None, gauge: Path | None = None, gauge_responses: Sequence[Path] = ()) -> StepOutcome:
    """Write the limit of a goal's cut at its speed and pose with its interval, and P(stable) (limits.json).

    verdict, checked : what the limit rests on besides: the verdict on the tap, the look at the machine; struck_pose : at which
    the tip was struck; coupling, tool, gauge, gauge_responses : of a goal of the coupled tool.
    """
    if coupling is None:
        systems: DrawnSystems = _systems(machine, tip_x, tip_y, draws=draws, seed=seed)
    else:
        plan = CoupledTool(**{**coupling, "tool": str(tool), "gauge": None if gauge is None else str(gauge),
                              "responses": tuple(map(str, gauge_responses))})
        systems = couple_at(plan, folder, goal["stick_out"], machine=None if machine is None else io.read_machine(machine),
                            draws=draws, seed=seed)
    question = _question(cut_name, cut, goal["speed"], goal["pose"], goal["depth"])
    limits, weighed = draw_limits(systems, question), _weights(weights, draws)
    data = {"goal": name, **_numbers(limits, weighed)}
    data["next_cut"] = choose_cut(limits, weighed, _tried_cuts(weights, cut_name, goal["pose"])).to_dict()
    certain_depth = max(quantile_of(limits.draws[:, 0], weighed, CERTAIN_LEVEL) - float(limits.error[0]), 0.0)
    better_speed = find_better_speed(systems, question, weighed, certain_depth=min(certain_depth, limits.depth_max))
    data["better_speed"] = None if better_speed is None else better_speed.to_dict()
    write_json(folder / "limits.json", data)
    doubts = [*systems.doubts, *_coefficient_doubts(cut_name, cut), *_notes_of(systems, goal), *doubts_among(limits.notes)]
    doubts += question_draws(limits)
    if tip_x is not None and goal["pose"] and dict(goal["pose"]) != dict(struck_pose):
        doubts.append(Doubt("pose of the goal", "the tip was struck at another pose; its response is taken for this one too",
                            "strike it at the pose of the goal, or add a test of the structure (components, geometry)"))
    return StepOutcome(_limit_words(data), tuple(doubts))


def _systems(machine: Path | None, tip_x: Path | None, tip_y: Path | None, *, draws: int, seed: int) -> DrawnSystems:
    """Return the draws of the tip where it was struck, otherwise those of the machine."""
    if tip_x is not None:
        return TipDraws(read_tip(tip_x, tip_y), draws, seed)
    assert machine is not None
    return MachineDraws(io.read_machine(machine), draws, seed)


def _question(name: str, cut: Mapping[str, Any], speed: float, pose: Mapping[str, float], depth: float | None = None
              ) -> CutQuestion:
    deviation = cut["deviation"] or ASSUMED_COEFFICIENT_DEVIATION
    return CutQuestion(name, cut_of(cut["values"]), deviation, (speed,), pose, depth)


def _coefficient_doubts(name: str, cut: Mapping[str, Any]) -> tuple[Doubt, ...]:
    """Return the doubt of coefficients whose deviation is assumed."""
    if cut["deviation"]:
        return ()
    return (Doubt(f"coefficients of the cut {name}", f"no deviation is given: {100 * ASSUMED_COEFFICIENT_DEVIATION:.0f} % is "
                  "assumed", "calibrate them (toolpoint calibrate), and write coefficient_deviation beside them"),)


def _notes_of(systems: DrawnSystems, goal: Mapping[str, Any]) -> tuple[Doubt, ...]:
    return tuple(doubts_among(systems.nominal(goal["pose"]).notes))


def question_draws(limits: DrawnLimits) -> list[Doubt]:
    """Return the grave doubt that the limit of the likeliest system lies outside the interval of its draws.

    A covariance that a large misfit has widened reaches systems that are none: their limits say nothing of this one.
    """
    lower, upper = limits.interval(np.full(len(limits.draws), 1 / len(limits.draws)))[:, 0]
    limit = float(limits.limit[0])
    if not np.isfinite(limit) or lower <= limit <= upper:
        return []
    return [Doubt("interval of the limit", f"the likeliest system has {1e3 * limit:.3g} mm, outside the {1e3 * lower:.3g} .. "
                  f"{1e3 * upper:.3g} mm of its draws: its numbers are known too badly for an interval",
                  "mend the doubts on the fit first, or measure again", grave=True)]


def _weights(path: Path | None, draws: int) -> FloatArray:
    return np.full(draws, 1 / draws) if path is None else np.asarray(read_json(path)["weights"], float)


def _tried_cuts(path: Path | None, name: str, pose: Mapping[str, float]) -> list[tuple[float, float]]:
    """Return speed (rev/min) and depth (m) of the tried cuts that a goal's cut at its pose is, as the weights hold them.

    A cut without a pose was made at that of the machine file, as a goal without one asks about.
    """
    if path is None:
        return []
    return [(cut["speed_rpm"], cut["depth_m"]) for cut in read_json(path)["cuts"]
            if cut["cut"] in ("", name) and cut["pose"] == dict(pose)]


def _numbers(limits: DrawnLimits, weights: FloatArray) -> dict[str, Any]:
    """Return the numbers of one speed as plain data, SI."""
    lower, upper = limits.interval(weights)[:, 0]
    question, limit = limits.question, float(limits.limit[0])
    if np.ptp(weights) > 0:  # the likeliest system was that before the tried cuts (equal weights can have a tiny deviation)
        limit = quantile_of(limits.draws[:, 0], weights, 0.5)
    return {"cut": question.name, "speed_rpm": question.speeds[0], "depth_m": question.depth, "pose": dict(question.pose),
            "limit_m": limit, "interval_m": [float(lower), float(upper)],
            "stable_probability": float(limits.chance(weights)[0]), "chatter_frequency_hz": float(limits.frequency[0]),
            "shares": limits.shares, "draws": int(weights.size), "effective_draws": 1 / float((weights**2).sum()),
            "error_m": float(limits.error[0]), "notes": [note for note in limits.notes if not isinstance(note, Doubt)],
            "depth_max_m": limits.depth_max}


def _limit_words(data: Mapping[str, Any]) -> str:
    lower, upper = data["interval_m"]
    above = f"above {1e3 * data['depth_max_m']:.3g} mm"
    ends = above if not np.isfinite(lower) else f"{1e3 * lower:.3g} .. " + (
        f"{1e3 * upper:.3g} mm" if np.isfinite(upper) else f"more than {1e3 * data['depth_max_m']:.3g} mm")
    limit = f"{1e3 * data['limit_m']:.3g} mm" if np.isfinite(data["limit_m"]) else f"above {1e3 * data['depth_max_m']:.3g} mm"
    return (f"{1e3 * data['depth_m']:.3g} mm at {data['speed_rpm']:.5g} rev/min is stable with a probability of "
            f"{100 * data['stable_probability']:.0f} %; the limit there is {limit}, 95 % interval {ends}"
            + "".join(f"; {note}" for note in data["notes"]))


def rank_changes(folder: Path, machine: Path, checked: Path, *, cuts: Mapping[str, Any], goals: Mapping[str, Any],
                 changes: Mapping[str, Any], draws: int, seed: int) -> StepOutcome:
    """Write what each change would do to the limits of the goals, best first (changes.json).

    checked : the look at the machine, whose doubts are those of the advice.
    """
    systems = MachineDraws(io.read_machine(machine), draws, seed)
    questions = {name: _question(goal["cut"], cuts[goal["cut"]], goal["speed"], goal["pose"], goal["depth"])
                 for name, goal in goals.items()}
    ranked = rank_joints(systems, questions, changes)
    listed = [change.to_dict() for change in ranked]
    write_json(folder / "changes.json", {"changes": listed})
    return StepOutcome(lead_of(listed))


def choose_test(folder: Path, machine: Path, checked: Path, *, pose: Mapping[str, float],
                poses: Sequence[Mapping[str, float]]) -> StepOutcome:
    """Write which measurement would narrow the tool's compliance at a pose most (next.json); checked as in `rank_changes`."""
    built = io.read_machine(machine)
    names = [name for name in built.description.points if name not in (built.description.tool, built.description.table)]
    step = max(len(names) // MAX_NEXT_POINTS, 1)
    result = studies.rank_tests(built, pose, poses, points=names[::step][:MAX_NEXT_POINTS])
    write_json(folder / "next.json", result.to_dict())
    words = (f"{result.names[0]}: the interval of the {result.answer} would be ± {100 * result.after[0]:.2g} % after it, today "
             f"± {100 * result.today:.2g} %, after a random one of these ± {100 * result.random:.2g} %")
    return StepOutcome(words)


def question_of(name: str, cut: Mapping[str, Any], speeds: Sequence[float], *, pose: Mapping[str, float]) -> CutQuestion:
    """Return the question of a cut of a project at several speeds (rev/min)."""
    return replace(_question(name, cut, speeds[0], pose), speeds=tuple(speeds))
