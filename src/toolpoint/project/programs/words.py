"""Answer to a program of a project in one sentence, and its numbers as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.project.programs.drawn_places import DrawnPlaces
from toolpoint.project.programs.run_files import ProgramRun
from toolpoint.studies.machining.advice import ToolAdvice
from toolpoint.studies.machining.errors.block_errors import ERROR_HEADER
from toolpoint.studies.machining.result import HEADER, MachiningStudy

KEPT_ROWS = 40  # worst blocks and largest errors in the results of a project


def program_numbers(run: ProgramRun, places: DrawnPlaces | None, after: DrawnPlaces | None, *, weights: FloatArray
                    ) -> dict[str, Any]:
    """Return the numbers of a program as plain data, SI; after : the places at the advised speeds, None without any."""
    stages = run.stages
    grave = [str(doubt) for stage in stages for doubt in stage.doubts if doubt.grave]
    cutting = sum(int((stage.blocks.verdict > 0).sum()) for stage in stages)
    return {"cutting_blocks": cutting, "chatter_blocks": sum(stage.chatter_blocks.size for stage in stages),
            "unknown_blocks": sum(int((stage.blocks.verdict == 3).sum()) for stage in stages),
            "time_s": sum(float(stage.laid.time.sum()) for stage in stages), "grave": grave,
            "largest_force_n": max(float(stage.blocks.loads["lateral"].max(initial=0.0)) for stage in stages),
            "stable_probability": None if places is None else places.chance(weights), "draws": int(weights.size),
            "places": [] if places is None else _places(places, weights),
            "advice": [_tool(tool, number if len(stages) > 1 else 0) for number, stage in enumerate(stages, 1)
                       if stage.advice is not None for tool in stage.advice.tools],
            "stable_probability_advised": None if after is None else after.chance(weights),
            "time_advised_s": None if after is None else sum(s.advice.time_after for s in stages if s.advice is not None),
            "record": next((stage.record.answer for stage in stages if stage.record is not None), None),
            "header": list(HEADER), "worst_blocks": [row for stage in stages for row in stage.worst_rows(KEPT_ROWS)],
            "error_header": list(ERROR_HEADER), "errors": [row for stage in stages for row in stage.error_rows(KEPT_ROWS)],
            "notes": [note for stage in stages for note in stage.notes]}


def _tool(tool: ToolAdvice, stage: int) -> dict[str, Any]:
    """Return the advice for a tool as plain data; stage : from 1, 0 of a program of one stage."""
    return {**tool.to_dict(), "stage": stage, "words": f"Stage {stage}: {tool.words}" if stage else tool.words}


def _places(places: DrawnPlaces, weights: FloatArray) -> list[dict[str, Any]]:
    chances = places.chances(weights)
    rows = []
    for k in range(places.line.size):
        lower, upper = places.interval(weights, k)
        rows.append({"line": int(places.line[k]), "tool": int(places.tool[k]), "speed_rpm": float(places.speed[k]),
                     "depth_m": float(places.depth[k]), "limit_m": float(places.limit[k]), "interval_m": [lower, upper],
                     "chatter_frequency_hz": float(places.frequency[k]), "stable_probability": float(chances[k])})
    return rows


def program_words(data: Mapping[str, Any]) -> str:
    """Return the answer to a program in one sentence; infinite numbers of the data are None or infinite."""
    begin = f"do not run it as it is ({data['grave'][0]}); " if data["grave"] else ""
    if data["stable_probability"] is None:
        return begin + (f"{data['cutting_blocks']} cutting blocks of unknown stability, largest force "
                        f"{data['largest_force_n']:.0f} N")
    chatters = [place for place in data["places"] if place["stable_probability"] < 0.5]
    place = chatters[0] if chatters else data["places"][0]
    chance = f"every block is stable with a probability of {100 * data['stable_probability']:.0f} %"
    unknown = f"; {data['unknown_blocks']} blocks could not be judged" if data["unknown_blocks"] else ""
    if not chatters:
        return f"{begin}{chance}; the nearest to its limit is line {place['line']}, {_depths(place)}{_advised(data)}{unknown}"
    frequency = place["chatter_frequency_hz"]
    tone = "" if frequency is None or not np.isfinite(frequency) else f" ({frequency:.0f} Hz)"
    return (f"{begin}line {place['line']} chatters at {place['speed_rpm']:.0f} rev/min{tone}, {_depths(place)}"
            f"{_advised(data)}; as it is, {chance}{unknown}")


def _depths(place: Mapping[str, Any]) -> str:
    lower, upper = (None if end is None or not np.isfinite(end) else 1e3 * end for end in place["interval_m"])
    searched = 4e3 * place["depth_m"]
    ends = f"above {searched:.3g}" if lower is None else f"{lower:.3g} .. " + (
        f"more than {searched:.3g}" if upper is None else f"{upper:.3g}")
    limit = place["limit_m"]
    limit_text = f"{1e3 * limit:.3g} mm" if limit is not None and np.isfinite(limit) else f"above {searched:.3g} mm"
    return f"{1e3 * place['depth_m']:.3g} mm deep where the limit is {limit_text}, 95 % interval {ends} mm"


def _advised(data: Mapping[str, Any]) -> str:
    """Return what speed keeps every block stable, nothing where none is needed, why where there is none."""
    changed = [tool for tool in data["advice"] if tool["advised_rpm"] != tool["programmed_rpm"]]
    if not changed:
        return "; no speed from 0.4 to 1.3 times it is better" if data["chatter_blocks"] and data["advice"] else ""
    speeds = ", ".join(f"S {tool['advised_rpm']:.0f}" + (f" for T{tool['tool']}" if tool["tool"] else "")
                       + (f" in stage {tool['stage']}" if tool["stage"] else "") for tool in changed)
    chance = data["stable_probability_advised"]
    sure = "" if chance is None else f" with a probability of {100 * chance:.0f} %"
    if any(tool["chatter_blocks_after"] for tool in changed):
        return f"; {speeds} is better, and does not keep every block stable"
    return f"; {speeds} keeps every block stable{sure}"


def speed_factors(study: MachiningStudy) -> dict[int, float]:
    """Return the advised over the programmed speed of the tools whose speed the advice changes."""
    tools = () if study.advice is None else study.advice.tools
    return {tool.tool: tool.speed / tool.programmed for tool in tools if tool.speed != tool.programmed}
