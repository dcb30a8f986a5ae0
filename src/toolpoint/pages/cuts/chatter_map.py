"""The page of a chatter map: least stable depth over the workspace, by feed direction, and what is stable everywhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._rounding import limit_text, number_text, text_below
from toolpoint.cutting.build import words
from toolpoint.cutting.description import ProcessDampingDescription
from toolpoint.machine import Machine
from toolpoint.pages.cuts.cut_words import inside
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, InverseField, Lookup, Notes, Report, Table, TableFields
from toolpoint.plot.figures.cuts.lobes import StabilityCurve, stability_chart
from toolpoint.plot.figures.machines.pose_map import frequency_curves, frequency_map
from toolpoint.studies.cuts.chatter_limits import HEADER, ChatterMap, angle_words, depth_words, pose_words
from toolpoint.studies.machines.pose_grid import Grid

QUANTITY = "Stable depth, mm"


def chatter_map_page(result: ChatterMap, machine: Machine, notes: Sequence[str] = ()) -> Report:
    """Return the page of a map: least stable depth over the workspace, by feed direction, and what is stable everywhere.

    Examples
    --------
    Runs in ``examples/map_chatter_limits.py``.
    """
    described = words(result.cut).replace(f", feed along {result.cut.feed}", "")  # the feed turns here
    report = Report(f"Chatter limits over the workspace: {machine.description.name}", _answer(result), subtitle=described)
    report = report.with_section(
        "Stable depth", *_map_parts(result),
        Table(list(HEADER), result.rows(), "Depth that is stable at every charted speed; the worst pose of each feed "
              "direction"))
    report = report.with_section("Over the speed", *_lookup(result), *_speed_parts(result))
    report = report.with_doubts(*result.doubts)
    failed = result.failed()
    if failed:
        report = report.with_section("Failed poses", Notes(failed, "warning")).with_doubts(
            f"{len(failed)} poses could not be computed; what is said of all poses is said of the others")
    return with_remarks(report, [*notes, f"Computed: {inside(result)}; between these poses nothing is known."])


def _answer(result: ChatterMap) -> str:
    """Return the worst and what is stable everywhere in a sentence."""
    worst_limit = result.worst()
    best_speed = int(np.argmax(np.minimum(result.everywhere, np.nanmin(result.depth_max))))
    deepest = float(result.everywhere[best_speed])
    speed_text = f"mm at {result.speeds[best_speed]:.0f} rev/min"
    best = (f"{text_below(1e3 * deepest)} {speed_text}" if np.isfinite(deepest) else
            f"no limit to {number_text(1e3 * float(np.nanmin(result.depth_max)), digits=3)} {speed_text}")
    if not np.isfinite(worst_limit.depth):
        return "No limit was found at any pose."
    depth = limit_text(1e3 * worst_limit.depth, 1e3 * worst_limit.error)
    return (f"{depth} mm is stable at every pose, feed direction and charted speed; worst is "
            f"{pose_words(worst_limit.pose, result.angles)}, feed at {angle_words(worst_limit.feed_angle)}, "
            f"{worst_limit.speed:.0f} rev/min, where chatter begins at {worst_limit.frequency:.0f} Hz. The speed that is best "
            f"everywhere allows {best}.")


def _lookup(result: ChatterMap) -> list[Lookup]:
    """Return the field of the speed, with K_t where the limit goes with its inverse; other cuts are refused by name."""
    limit, upper = result.everywhere, float(np.nanmin(result.depth_max))
    if not np.isfinite(limit).any():
        return []
    answers = [f"{speed:.0f} rev/min: " + (f"stable up to {text_below(1e3 * depth)} mm" if np.isfinite(depth) else
               f"no limit found up to {number_text(1e3 * upper, digits=3)} mm") + " at every pose and feed direction."
               for speed, depth in zip(result.speeds, limit, strict=True)]
    start = float(result.speeds[int(np.argmax(np.minimum(limit, upper)))])
    tool, engagement = result.cut.tool, result.cut.engagement
    other = None if engagement.immersion is None else TableFields(
        ("immersion", "teeth"), (engagement.immersion, tool.teeth), (engagement.immersion,), (tool.teeth,),
        result.speeds.tolist(), limit[None, None], [[upper]], 1e3, "mm", "",
        "A map is of one cut: for it run map-chatter with --immersion {0} --teeth {1}.")
    return [Lookup("How deep at my speed, at every pose", "rev/min", result.speeds.tolist(), limit.tolist(), answers, start,
                   "depth", _coefficient_field(result, upper), other)]


def _coefficient_field(result: ChatterMap, upper: float) -> InverseField | None:
    """Return the field of K_t, None where the limit is not proportional to its inverse, or K_t is not stated."""
    tool, k = result.cut.tool, result.cut.coefficients
    is_straight = not np.any(tool.helix) and tool.corner_radius == 0 and result.cut.damping == ProcessDampingDescription()
    if not is_straight or not k.tangential or k.total_energy is not None:
        return None
    return InverseField("K_t", "N/mm²", k.tangential / 1e6, 1e3, "mm", upper, "Exact for straight edges without process "
                        "damping: the limit goes with 1/Kt, and the ratios of the coefficients stay.")


def _map_parts(result: ChatterMap) -> list[Chart | str]:
    """Return the map of the least depth over the first two axes that have several positions; the worst of further ones."""
    lowest = np.minimum(result.lowest, result.depth_max[..., None])
    several = [k for k, positions in enumerate(result.axes.values()) if positions.size > 1]
    names = list(result.axes)
    minimised_axes = tuple(k for k in range(len(names)) if k not in several[:2])
    values = 1e3 * lowest.min(axis=minimised_axes) if minimised_axes else 1e3 * lowest
    if not several:
        return ["One pose: " + pose_words(result.pose((0,) * len(names)), result.angles) + "."]
    names_of_ways = [f"feed at {angle_words(angle)}" for angle in result.feed_angles]
    if len(names_of_ways) > 1:
        values = np.concatenate([values.min(axis=-1, keepdims=True), values], axis=-1)
        names_of_ways = ["worst direction", *names_of_ways]
    remark = _remark(result, [names[k] for k in several[2:]])
    parts: list[Chart | str] = [f"Depth that is stable at every charted speed. {remark}".strip()]
    grid = Grid(result.axes, result.angles)
    map_axes = [(names[k], grid.shown(names[k]), grid.unit(names[k])) for k in several[:2]]
    if len(map_axes) == 1:
        chart = frequency_curves(map_axes[0][1], values, axis=map_axes[0][0], unit=map_axes[0][2], names=names_of_ways,
                                 quantity=QUANTITY)
    else:
        chart = frequency_map(map_axes[0][1], map_axes[1][1], values, axes=(map_axes[0][0], map_axes[1][0]),
                              units=(map_axes[0][2], map_axes[1][2]),
                              names=names_of_ways, quantity=QUANTITY)
    return [*parts, Chart(chart, name="map")]


def _remark(result: ChatterMap, further: Sequence[str]) -> str:
    """Return how the map treats further axes and poses without a limit."""
    lines = [f"Of {', '.join(further)} the worst position counts."] if further else []
    if np.isinf(result.limit.min(axis=-1)).any():
        lines.append("Where no limit was found, the largest depth looked at is drawn.")
    return " ".join(lines)


def _speed_parts(result: ChatterMap) -> list[Chart | str]:
    """Return the limits over speed: least over all poses, at the worst pose, and at the best."""
    worst_limit = result.worst()
    index = tuple(int(np.argmin(np.abs(result.axes[name] - value))) for name, value in worst_limit.pose.items())
    worst_way = int(np.argmin(np.abs(result.feed_angles - worst_limit.feed_angle)))
    curves = [StabilityCurve(result.speeds, result.everywhere, "stable everywhere"),
              StabilityCurve(result.speeds, result.limit[(*index, worst_way)],
                             f"worst: {pose_words(worst_limit.pose, result.angles)}, feed at "
                             f"{angle_words(worst_limit.feed_angle)}")]
    lowest_limits = result.lowest.reshape(-1)
    if np.isfinite(lowest_limits).any():
        *best_pose, best_way = (int(k) for k in np.unravel_index(int(np.nanargmax(lowest_limits)), result.lowest.shape))
        if (*best_pose, best_way) != (*index, worst_way):
            label = (f"best: {pose_words(result.pose(best_pose), result.angles)}, feed at "
                     f"{angle_words(result.feed_angles[best_way])}")
            curves.append(StabilityCurve(result.speeds, result.limit[(*best_pose, best_way)], label))
    depth_top = None if np.isfinite(result.limit).any() else float(np.nanmax(result.depth_max))
    best_speed = int(np.argmax(np.minimum(result.everywhere, np.nanmin(result.depth_max))))
    deepest = depth_words(float(result.everywhere[best_speed]), float(np.nanmin(result.depth_max)))
    return [f"Worst: {worst_limit}. Deepest cut that is stable everywhere: {deepest} mm at {result.speeds[best_speed]:.0f} "
            "rev/min (nothing in hand).", Chart(stability_chart(curves, max_depth=depth_top), name="speeds")]
