"""Doubts about a described cut: coefficients, tool and speeds of other units, and numbers that contradict each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.machines.check.ranges import question_range

# Usual ranges, each with its unit: a number beyond is doubted, never refused.
COEFFICIENT_RANGES = {"tangential": (5e7, 1e10, "Pa"), "normal": (5e6, 1e10, "Pa"), "axial": (5e6, 1e10, "Pa")}
# Published coefficients of metals lie inside with a margin of some times: beyond, the unit is wrong.
EDGE_COEFFICIENT_RANGE = (50.0, 3e5, "N/m")
NORMAL_TO_TANGENTIAL_RANGE = (0.03, 2.0)  # normal over tangential coefficient
DIAMETER_RANGE = (2e-4, 0.6, "m")
MAX_FEED_RATIO, MIN_FEED_RATIO = 0.15, 2e-4  # feed per tooth over the diameter; of tools above 1 mm
FLUTE_LENGTH_RATIO_RANGE = (0.2, 20.0)  # length of the edges over the diameter
HELIX_ANGLE_RANGE = (2.0, 65.0)  # degrees, of a tool that has one
CUTTING_SPEED_RANGE = (0.02, 150.0)  # m/s at the highest spindle speed: from tough alloys to light metal
SPINDLE_SPEED_RANGE = (20.0, 2e5)  # rev/min, of the highest speed


def question_cut(cut: CuttingDescription) -> tuple[Doubt, ...]:
    """Return doubts about numbers of a cut that are possible but probably in another unit."""
    return (*_question_coefficients(cut), *_question_tool(cut), *_question_speeds(cut))


def _question_coefficients(cut: CuttingDescription) -> Iterator[Doubt]:
    """Yield doubts about cutting and edge coefficients beyond their ranges, and about normal over tangential."""
    k = cut.coefficients
    said = list[Doubt]()
    for key, bounds in COEFFICIENT_RANGES.items():
        said += question_range(f"cutting.{key}", getattr(k, key), bounds, words="(1 N/mm^2 is 1e6 Pa)")
    yield from said
    # A coefficient of a wrong unit makes the ratio wrong too: it is doubted once.
    if (not said and k.tangential and k.normal and not NORMAL_TO_TANGENTIAL_RANGE[0] <= k.normal / k.tangential <=
        NORMAL_TO_TANGENTIAL_RANGE[1]):
        ratio = k.normal / k.tangential
        key = "normal" if ratio < 1 else "tangential"
        yield Doubt(f"cutting.{key}", f"normal {k.normal:.4g} Pa is {ratio:.3g} times tangential {k.tangential:.4g} Pa, "
                    f"{NORMAL_TO_TANGENTIAL_RANGE[0]:g} to {NORMAL_TO_TANGENTIAL_RANGE[1]:g} is usual",
                    "check the unit of both; are they exchanged?",
                    figure=ratio)
    for key in ("edge_tangential", "edge_normal", "edge_axial"):
        yield from question_range(f"cutting.{key}", getattr(k, key), EDGE_COEFFICIENT_RANGE, words="(1 N/mm is 1e3 N/m)")


def _question_tool(cut: CuttingDescription) -> Iterator[Doubt]:
    """Yield doubts about diameter, helix, feed, edge length and runout; the diameter alone where that is doubted."""
    tool = cut.tool
    odd = list(question_range("cutting.diameter", tool.diameter, DIAMETER_RANGE))
    yield from odd
    if odd:
        return
    helices = np.degrees(np.abs(np.atleast_1d(tool.helix)))
    if helices.max() > 0 and not HELIX_ANGLE_RANGE[0] <= helices.max() <= HELIX_ANGLE_RANGE[1]:
        yield Doubt("cutting.helix",
                    f"{helices.max():.4g} degrees, {HELIX_ANGLE_RANGE[0]:g} to {HELIX_ANGLE_RANGE[1]:g} is usual",
                    "write its unit: 30 deg", figure=float(helices.max()))
    share = cut.feed_per_tooth / tool.diameter
    if share and (share > MAX_FEED_RATIO or (share < MIN_FEED_RATIO and tool.diameter > 1e-3)):
        yield Doubt("cutting.feed_per_tooth", f"{1e3 * cut.feed_per_tooth:.4g} mm on a tool of {1e3 * tool.diameter:.4g} mm",
                    "check its unit", figure=share)
    if (tool.flute_length and not FLUTE_LENGTH_RATIO_RANGE[0] <= tool.flute_length / tool.diameter <=
        FLUTE_LENGTH_RATIO_RANGE[1]):
        yield Doubt("cutting.flute_length", f"{1e3 * tool.flute_length:.4g} mm on a tool of {1e3 * tool.diameter:.4g} mm",
                    "check its unit", figure=tool.flute_length / tool.diameter)
    # No tool is run with more than 2 % of its diameter, or 0.1 mm of a small one: the unit has slipped.
    if tool.runout > max(0.02 * tool.diameter, 1e-4):
        yield Doubt("cutting.runout", f"{1e6 * tool.runout:.4g} um on a tool of {1e3 * tool.diameter:.4g} mm", "check its unit",
                    figure=tool.runout / tool.diameter)


def _question_speeds(cut: CuttingDescription) -> Iterator[Doubt]:
    """Yield a doubt about the highest spindle speed, or about the cutting speed that it gives a usual diameter."""
    highest = max(cut.speeds)
    fastest = np.pi * cut.tool.diameter * highest / 60
    if not SPINDLE_SPEED_RANGE[0] <= highest <= SPINDLE_SPEED_RANGE[1]:
        yield Doubt("cutting.speeds",
                    f"up to {highest:.4g} rev/min, {SPINDLE_SPEED_RANGE[0]:g} to {SPINDLE_SPEED_RANGE[1]:g} is usual",
                    "check its unit (rpm)", figure=highest)
    elif (DIAMETER_RANGE[0] <= cut.tool.diameter <= DIAMETER_RANGE[1]
          and not CUTTING_SPEED_RANGE[0] <= fastest <= CUTTING_SPEED_RANGE[1]):
        yield Doubt("cutting.speeds", f"up to {highest:.4g} rev/min with {1e3 * cut.tool.diameter:.4g} mm is "
                    f"{60 * fastest:.4g} m/min of cutting speed", "check the units of speeds and diameter",
                    figure=float(fastest))
