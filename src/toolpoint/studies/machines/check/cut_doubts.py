"""Doubts about a described cut: coefficients, tool and speeds of other units, and numbers that contradict each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.machines.check.ranges import question_range

COEFFICIENTS = {"tangential": (5e7, 1e10, "Pa"), "normal": (5e6, 1e10, "Pa"), "axial": (5e6, 1e10, "Pa")}
EDGES = (50.0, 3e5, "N/m")
NORMAL_SHARE = (0.03, 2.0)  # normal over tangential coefficient
DIAMETER = (2e-4, 0.6, "m")
MOST_FEED, LEAST_FEED = 0.15, 2e-4  # feed per tooth over the diameter; of tools above 1 mm
FLUTES = (0.2, 20.0)  # length of the edges over the diameter
HELIX = (2.0, 65.0)  # degrees, of a tool that has one
CUTTING_SPEED = (0.02, 150.0)  # m/s at the highest speed: tough alloys with large tools, light metal with small ones
SPINDLE_SPEED = (20.0, 2e5)  # rev/min, of the highest speed


def question_cut(cut: CuttingDescription) -> tuple[Doubt, ...]:
    """Return doubts about the numbers of a cut that are possible and hardly meant."""
    return (*_coefficients(cut), *_tool(cut), *_speeds(cut))


def _coefficients(cut: CuttingDescription) -> Iterator[Doubt]:
    k = cut.coefficients
    said = list[Doubt]()
    for key, bounds in COEFFICIENTS.items():
        said += question_range(f"cutting.{key}", getattr(k, key), bounds, words="(1 N/mm^2 is 1e6 Pa)")
    yield from said
    if not said and k.tangential and k.normal and not NORMAL_SHARE[0] <= k.normal / k.tangential <= NORMAL_SHARE[1]:
        ratio = k.normal / k.tangential
        key = "normal" if ratio < 1 else "tangential"
        yield Doubt(f"cutting.{key}", f"normal {k.normal:.4g} Pa is {ratio:.3g} times tangential {k.tangential:.4g} Pa, "
                    f"{NORMAL_SHARE[0]:g} to {NORMAL_SHARE[1]:g} is usual", "check the unit of both; are they exchanged?",
                    figure=ratio)
    for key in ("edge_tangential", "edge_normal", "edge_axial"):
        yield from question_range(f"cutting.{key}", getattr(k, key), EDGES, words="(1 N/mm is 1e3 N/m)")


def _tool(cut: CuttingDescription) -> Iterator[Doubt]:
    tool = cut.tool
    odd = list(question_range("cutting.diameter", tool.diameter, DIAMETER))
    yield from odd
    if odd:
        return
    helices = np.degrees(np.abs(np.atleast_1d(tool.helix)))
    if helices.max() > 0 and not HELIX[0] <= helices.max() <= HELIX[1]:
        yield Doubt("cutting.helix", f"{helices.max():.4g} degrees, {HELIX[0]:g} to {HELIX[1]:g} is usual",
                    "write its unit: 30 deg", figure=float(helices.max()))
    share = cut.feed_per_tooth / tool.diameter
    if share and (share > MOST_FEED or (share < LEAST_FEED and tool.diameter > 1e-3)):
        yield Doubt("cutting.feed_per_tooth", f"{1e3 * cut.feed_per_tooth:.4g} mm on a tool of {1e3 * tool.diameter:.4g} mm",
                    "check its unit", figure=share)
    if tool.flute_length and not FLUTES[0] <= tool.flute_length / tool.diameter <= FLUTES[1]:
        yield Doubt("cutting.flute_length", f"{1e3 * tool.flute_length:.4g} mm on a tool of {1e3 * tool.diameter:.4g} mm",
                    "check its unit", figure=tool.flute_length / tool.diameter)
    if tool.runout > max(0.02 * tool.diameter, 1e-4):
        yield Doubt("cutting.runout", f"{1e6 * tool.runout:.4g} um on a tool of {1e3 * tool.diameter:.4g} mm", "check its unit",
                    figure=tool.runout / tool.diameter)


def _speeds(cut: CuttingDescription) -> Iterator[Doubt]:
    highest = max(cut.speeds)
    fastest = np.pi * cut.tool.diameter * highest / 60
    if not SPINDLE_SPEED[0] <= highest <= SPINDLE_SPEED[1]:
        yield Doubt("cutting.speeds", f"up to {highest:.4g} rev/min, {SPINDLE_SPEED[0]:g} to {SPINDLE_SPEED[1]:g} is usual",
                    "check its unit (rpm)", figure=highest)
    elif DIAMETER[0] <= cut.tool.diameter <= DIAMETER[1] and not CUTTING_SPEED[0] <= fastest <= CUTTING_SPEED[1]:
        yield Doubt("cutting.speeds", f"up to {highest:.4g} rev/min with {1e3 * cut.tool.diameter:.4g} mm is "
                    f"{60 * fastest:.4g} m/min of cutting speed", "check the units of speeds and diameter",
                    figure=float(fastest))
