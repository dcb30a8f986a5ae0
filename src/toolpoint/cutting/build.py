r"""Parts of a cut from plain data, as machine files and the command line say it: tool, engagement, coefficients, variation."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, fail, one_of
from toolpoint.cutting.cut.coefficients import CuttingCoefficients
from toolpoint.cutting.cut.problem import SpeedVariation
from toolpoint.cutting.cut.tool import Engagement, Tool
from toolpoint.cutting.force.materials import Range, literature, materials

# `cut` below is the CuttingDescription of a machine file, or anything with its fields; that class stands a floor higher.
_GIVEN = {"tangential": "kt", "normal": "kn", "axial": "ka",
          "edge_tangential": "edge_t", "edge_normal": "edge_n", "edge_axial": "edge_a"}


def tool_of(cut: Any) -> Tool:
    """Return the tool of a described cut."""
    helix = np.asarray(cut.helix, float) if isinstance(cut.helix, tuple) else float(cut.helix)
    if isinstance(cut.helix, tuple) and len(cut.helix) not in (1, cut.teeth):
        fail("Tool.helix", f"{len(cut.helix)} angles", f"must be one, or one for each of the {cut.teeth} teeth")
    if cut.pitch and len(cut.pitch) != cut.teeth:
        fail("Tool.pitch", f"{len(cut.pitch)} angles", f"must be one for each of the {cut.teeth} teeth")
    if cut.pitch and abs(sum(cut.pitch) - 2 * np.pi) > 1e-6:
        fail("Tool.pitch", f"angles that add up to {np.degrees(sum(cut.pitch)):.6g} degrees",
             "must add up to 360 degrees (2 pi rad)", "the last closes the circle")
    return Tool(cut.diameter, cut.teeth, helix, np.asarray(cut.pitch) if cut.pitch else None, cut.runout, cut.runout_angle,
                cut.tilt, cut.corner_radius)


def engagement_of(cut: Any) -> Engagement:
    """Return the arc of cut: entry and exit angles where given, else from direction and radial immersion."""
    if cut.entry is not None or cut.exit is not None:
        if cut.entry is None or cut.exit is None:
            fail("exit" if cut.exit is None else "entry", "missing", "entry and exit belong together", "give both angles")
        if cut.immersion is not None:
            fail("immersion", f"{cut.immersion:g} beside entry and exit", "must be left out then",
                 "the angles say the arc of cut already")
        return Engagement(cut.entry, cut.exit)
    kind = one_of("direction", cut.direction, ("up", "down", "slot", "centred"))
    if kind == "slot":
        return Engagement.slot()
    if cut.immersion is None:
        fail("immersion", "missing", f"{kind}-milling needs the radial immersion a/D, above 0 to 1",
             "or give entry and exit angles, or direction: slot")
    made: Engagement = getattr(Engagement, kind)(cut.immersion)
    return made


def coefficients_of(cut: Any) -> CuttingCoefficients:
    """Return the coefficients: those of the material where one is named, replaced by the values given beside it.

    A material may have several sets in the literature; the first is taken, ``NAME:2`` takes the second. Kienzle's law is
    linearised at the mean chip thickness of the cut, which needs its feed per tooth; the sources of Kienzle's constants give
    the tangential force only, so the normal coefficient must be given.
    """
    given = {to: getattr(cut, name) for name, to in _GIVEN.items() if getattr(cut, name) is not None}
    if not cut.material:
        for name in ("tangential", "normal"):
            if _GIVEN[name] not in given:
                fail(name, "missing", "must be the coefficient in Pa (the command line: N/mm^2), unless a material is named",
                     "materials: " + ", ".join(materials()))
        return CuttingCoefficients(**given)
    found, number = named_material(cut.material)
    count = len(found.sets) + len(found.kienzle)
    low, high = (f"{value / 1e6:g}" for value in found.kt)
    which = f"set {number} of {count}" + (f" (kt {low} .. {high} N/mm^2)" if count > 1 else "")
    if found.sets:
        base = found.sets[number - 1]
    else:
        if "kn" not in given:
            fail("normal", "missing", f"the source for {found.material} gives the tangential force only",
                 "give the normal coefficient too")
        base = found.kienzle[number - 1].linearised(mean_chip(cut))
        which += f", {base.source}"
    return replace(base, **given, source=f"{found.material}, {which}, {found.source}" + (", changed" if given else ""))


def named_material(name: str) -> tuple[Range, int]:
    """Return a material of the literature table and the number of its set, from ``al7075``, ``Al 7075:2`` and the like."""
    text, colon, digits = name.partition(":")
    want = re.sub(r"[^a-z0-9]", "", text.lower())
    plain = {one: re.sub(r"[^a-z0-9]", "", one.lower()) for one in materials()}
    near = [one for one, word in plain.items() if word == want] or [one for one, word in plain.items() if want and want in word]
    if len(near) > 1:
        fail("material", repr(text), "fits several: " + ", ".join(near), "write the whole name")
    found = literature(near[0] if near else text)
    count = len(found.sets) + len(found.kienzle)
    number = int(digits) if digits.strip().isdigit() else (1 if not colon else 0)
    if not 1 <= number <= count:
        fail("material", repr(name), f"{found.material} has {count} set{'s' if count > 1 else ''}",
             f"write {found.material}:1" + (f" to {found.material}:{count}" if count > 1 else ""))
    return found, number


def mean_chip(cut: Any) -> float:
    r"""Return the mean chip thickness over the arc of cut, m.

    :math:`f_z (\cos\phi_{st} - \cos\phi_{ex})/(\phi_{ex} - \phi_{st})`, the mean of :math:`f_z \sin\phi`.
    """
    if not cut.feed_per_tooth > 0:
        fail("feed_per_tooth", "missing", "Kienzle's law is taken at the mean chip thickness and needs it",
             "for example 0.1 mm")
    arc = engagement_of(cut)
    return float(cut.feed_per_tooth * (np.cos(arc.entry) - np.cos(arc.exit)) / arc.arc)


def variation_of(cut: Any) -> SpeedVariation | None:
    """Return the spindle-speed variation of a described cut, where it has one."""
    one = cut.speed_variation
    return None if one is None else SpeedVariation(one.amplitude, one.revolutions, one.phase)


def words(cut: Any) -> str:
    """Return tool, arc of cut and coefficients in one line."""
    tool, k = tool_of(cut), coefficients_of(cut)
    arc = engagement_of(cut)
    kind = f"{np.degrees(arc.entry):.4g} .. {np.degrees(arc.exit):.4g} deg" if cut.entry is not None else \
        "slot" if cut.direction == "slot" else f"{cut.direction}-milling at a/D {cut.immersion:g}"
    parts = [repr(tool)[5:-1]]
    if tool.corner_radius:
        parts.append("ball" if tool.corner_radius > 0.999 * tool.radius else f"corner radius {1e3 * tool.corner_radius:g} mm")
    parts += [kind, f"feed along {cut.feed}", f"K_t {k.kt / 1e6:g}, K_n {k.kn / 1e6:g}"
              + (f", K_a {k.ka / 1e6:g}" if k.ka else "") + " N/mm^2"]
    if k.edge.any():
        parts.append("edge " + "/".join(f"{v / 1e3:g}" for v in k.edge) + " N/mm")
    if cut.material:
        parts.append(k.source)
    if cut.process_damping:
        parts.append(f"process damping {cut.process_damping:g} N/m")
    if cut.speed_variation is not None:
        one = cut.speed_variation
        parts.append(f"speed varied by {100 * one.amplitude:g} % over {one.revolutions} revolutions")
    if cut.feed_per_tooth:
        parts.append(f"{1e3 * cut.feed_per_tooth:g} mm a tooth")
    return ", ".join(parts)


def fault_of(cut: Any) -> tuple[tuple[str, ...], str] | None:
    """Return the key and the message of the first fault that the parts of a described cut have together, or None."""
    for make in (tool_of, engagement_of, coefficients_of, variation_of):
        try:
            make(cut)
        except ToolpointError as error:
            name, _, rest = str(error).partition(":")
            last = name.rsplit(".", 1)[-1]
            back = {value: key for key, value in _GIVEN.items()}
            key = {"Engagement": "entry", **back}.get(last, last)
            return (("speed_variation", key) if make is variation_of else (key,)), rest.strip()
    return None
