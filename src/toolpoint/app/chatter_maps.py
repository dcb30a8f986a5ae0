"""Maps of chatter limits over the workspace from the command line, and their page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.app import console
from toolpoint.app.poses import grid
from toolpoint.cutting.build import words
from toolpoint.cutting.stability import method_named
from toolpoint.io.yaml import machine_file
from toolpoint.machine import Machine
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.lobes import StabilityCurve, stability_chart
from toolpoint.plot.figures.pose_map import frequency_curves, frequency_map
from toolpoint.studies.chatter_limits import HEADER, ChatterMap, angle_words, depth_words, pose_words
from toolpoint.studies.chatter_map import chatter_map
from toolpoint.studies.example_cut import example_cut
from toolpoint.studies.execute import Dask, Serial
from toolpoint.studies.tool_point import FEED_ANGLE

QUANTITY = "Stable depth, mm"


@dataclass(frozen=True)
class Study:
    """What is mapped: axes as texts ``X=-0.3:0.3:5``, feed angles (rad; None: the cut's own), speeds (rev/min), how."""

    axes: Sequence[str]
    feed_angles: FloatArray | None = None
    speeds: FloatArray | None = None
    method: str = "auto"
    workers: int = 0
    folder: Path | None = None


def chatter(machine: Path, study: Study, cut: Mapping[str, Any], output: str | Path = "toolpoint-report",
            quiet: bool = False) -> ChatterMap:
    """Map the stable depth of a cut over a grid of poses, print the worst places, and write the page."""
    method = method_named(study.method, "--method")
    built = machine_file.read(machine)
    positions = grid(built, study.axes, "--axis")
    given = {name: value for name, value in cut.items() if value is not None}
    described = built.description.cutting
    base, notes = example_cut(given) if described is None else (described, [])
    used = base.with_values(given)
    words(used)  # faults of the cut are told before any work
    angles = np.array([FEED_ANGLE[used.feed]]) if study.feed_angles is None else study.feed_angles
    with console.collected_warnings() as warnings, \
            console.counted("poses", quiet or not console.interactive()) as progress:
        found = chatter_map(built, positions, used, speeds=study.speeds, feed_angles=angles, method=method,
                            engine=Dask(study.workers) if study.workers else Serial(), folder=study.folder, progress=progress)
    notes += [*found.notes, *warnings]
    path = page(found, built, notes).save(output)
    if not quiet:
        console.table(f"Depth that is stable at every charted speed, {repr(found)[11:-1]}", list(HEADER), found.rows())
        for text in found.failed():
            console.ERR.print("warning: " + text, markup=False, style="yellow")
        console.OUT.print("Worst: " + str(found.worst()), markup=False)
        for text in dict.fromkeys(notes):
            console.OUT.print("note: " + text, markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return found


def page(found: ChatterMap, machine: Machine, notes: Sequence[str] = ()) -> Report:
    """Return the page of a map: least stable depth over the workspace, by feed direction, and what is stable everywhere."""
    units = {axis.name: "rad" if axis.is_rotary else "m" for axis in machine.chain.axes}
    described = words(found.cut).replace(f", feed along {found.cut.feed}", "")  # the feed turns here
    report = Report(f"Chatter limits over the workspace: {machine.description.name}", f"{described}.",
                    subtitle=repr(found)[11:-1])
    report = report.with_section(
        "Stable depth", *_map_parts(found, units),
        Table(list(HEADER), found.rows(), "Depth that is stable at every charted speed; the worst pose of each feed direction"))
    report = report.with_section("Over the speed", *_speed_parts(found))
    failed = found.failed()
    if failed:
        report = report.with_section("Failed poses", Notes(failed, "warning"))
    lines = list(dict.fromkeys(notes))
    return report.with_section("Remarks", Notes(lines, "assumed")) if lines else report


def _map_parts(found: ChatterMap, units: Mapping[str, str]) -> list[Chart | str]:
    """Return the map of the least depth over the first two axes that have several positions; the worst of further ones."""
    lowest = np.minimum(found.lowest, found.depth_max[..., None])
    several = [k for k, at in enumerate(found.axes.values()) if at.size > 1]
    names = list(found.axes)
    rest = tuple(k for k in range(len(names)) if k not in several[:2])
    values = 1e3 * lowest.min(axis=rest) if rest else 1e3 * lowest
    if not several:
        return ["One pose: " + pose_words(found.pose((0,) * len(names))) + "."]
    told = [f"feed at {angle_words(angle)}" for angle in found.feed_angles]
    if len(told) > 1:
        values = np.concatenate([values.min(axis=-1, keepdims=True), values], axis=-1)
        told = ["worst direction", *told]
    remark = _remark(found, [names[k] for k in several[2:]])
    parts: list[Chart | str] = [f"Depth that is stable at every charted speed. {remark}".strip()]
    at = [(names[k], found.axes[names[k]], units[names[k]]) for k in several[:2]]
    if len(at) == 1:
        made = frequency_curves(at[0][1], values, axis=at[0][0], unit=at[0][2], names=told, quantity=QUANTITY)
    else:
        unit = at[0][2] if at[0][2] == at[1][2] else "m or rad"
        made = frequency_map(at[0][1], at[1][1], values, axes=(at[0][0], at[1][0]), unit=unit, names=told, quantity=QUANTITY)
    return [*parts, Chart(made, name="map")]


def _remark(found: ChatterMap, further: Sequence[str]) -> str:
    lines = [f"Of {', '.join(further)} the worst position counts."] if further else []
    if np.isinf(found.limit.min(axis=-1)).any():
        lines.append("Where no limit was found, the largest depth looked at is drawn.")
    return " ".join(lines)


def _speed_parts(found: ChatterMap) -> list[Chart | str]:
    worst = found.worst()
    index = tuple(int(np.argmin(np.abs(found.axes[name] - value))) for name, value in worst.pose.items())
    way = int(np.argmin(np.abs(found.feed_angles - worst.feed_angle)))
    curves = [StabilityCurve(found.speeds, found.everywhere, "stable at every pose and in every feed direction"),
              StabilityCurve(found.speeds, found.limit[(*index, way)],
                             f"worst: {pose_words(worst.pose)}, feed at {angle_words(worst.feed_angle)}")]
    least = found.lowest.reshape(-1)
    if np.isfinite(least).any():
        *best, turn = (int(k) for k in np.unravel_index(int(np.nanargmax(least)), found.lowest.shape))
        if (*best, turn) != (*index, way):
            label = f"best: {pose_words(found.pose(best))}, feed at {angle_words(found.feed_angles[turn])}"
            curves.append(StabilityCurve(found.speeds, found.limit[(*best, turn)], label))
    top = None if np.isfinite(found.limit).any() else float(np.nanmax(found.depth_max))
    at = int(np.argmax(np.minimum(found.everywhere, np.nanmin(found.depth_max))))
    deepest = depth_words(float(found.everywhere[at]), float(np.nanmin(found.depth_max)))
    return [f"Worst: {worst}. Deepest cut that is stable everywhere: {deepest} mm at {found.speeds[at]:.0f} rev/min "
            "(nothing in hand).", Chart(stability_chart(curves, max_depth=top), name="speeds")]
