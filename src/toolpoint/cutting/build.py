r"""Parts of a cut from plain data, as machine files and the command line say it: tool, engagement, coefficients, variation."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from toolpoint._check import LEFT_OUT, ToolpointError, fail, one_of
from toolpoint.cutting.cut.coefficients import CuttingCoefficients
from toolpoint.cutting.cut.problem import SpeedVariation
from toolpoint.cutting.cut.tool import Engagement, Tool
from toolpoint.cutting.cut.total_energy import TotalEnergy, linearise_over
from toolpoint.cutting.description import COEFFICIENTS, CoefficientsDescription, CuttingDescription
from toolpoint.cutting.force.materials import Range, literature, materials

# Keys of a description and the fields of CuttingCoefficients.
_FIELD_OF_KEY = {"tangential": "kt", "normal": "kn", "axial": "ka",
                 "edge_tangential": "edge_t", "edge_normal": "edge_n", "edge_axial": "edge_a"}


def tool_of(cut: CuttingDescription) -> Tool:
    """Return the tool of a described cut."""
    tool = cut.tool
    if isinstance(tool.helix, tuple) and len(tool.helix) not in (1, tool.teeth):
        fail("Tool.helix", f"{len(tool.helix)} angles", f"must be one, or one for each of the {tool.teeth} teeth")
    if tool.pitch and len(tool.pitch) != tool.teeth:
        fail("Tool.pitch", f"{len(tool.pitch)} angles", f"must be one for each of the {tool.teeth} teeth")
    if tool.pitch and abs(sum(tool.pitch) - 2 * np.pi) > 1e-6:
        fail("Tool.pitch", f"angles that add up to {np.degrees(sum(tool.pitch)):.6g} degrees",
             "must add up to 360 degrees (2 pi rad)", remedy="the last closes the circle")
    return Tool(tool.diameter, tool.teeth, np.asarray(tool.helix, float), np.asarray(tool.pitch) if tool.pitch else LEFT_OUT,
                tool.runout, tool.runout_angle, tool.tilt, tool.corner_radius)


def engagement_of(cut: CuttingDescription) -> Engagement:
    """Return the arc of cut: entry and exit angles where given, else from direction and radial immersion."""
    arc = cut.engagement
    if arc.entry is not None or arc.exit is not None:
        if arc.entry is None or arc.exit is None:
            fail("exit" if arc.exit is None else "entry", "missing", "entry and exit belong together",
                 remedy="give both angles")
        if arc.immersion is not None:
            fail("immersion", f"{arc.immersion:g} beside entry and exit", "must be left out then",
                 remedy="the angles say the arc of cut already")
        return Engagement(arc.entry, arc.exit)
    kinds = {"up": Engagement.up, "down": Engagement.down, "centred": Engagement.centred}
    kind = one_of("direction", arc.direction, ("up", "down", "slot", "centred"))
    if kind == "slot":
        return Engagement.slot()
    if arc.immersion is None:
        fail("immersion", "missing", f"{kind}-milling needs the radial immersion a/D, above 0 to 1",
             remedy="or give entry and exit angles, or direction: slot")
    return kinds[kind](arc.immersion)


def coefficients_of(cut: CuttingDescription) -> CuttingCoefficients:
    """Return the coefficients: those of the material where one is named, replaced by the values given beside it.

    A material may have several sets in the literature; the first is taken, ``NAME:2`` takes the second. Kienzle's law is
    linearised at the mean chip thickness of the cut, a total-energy law over its arc, which both need its feed per tooth. The
    sources of Kienzle's constants give the tangential force only, so the normal coefficient must be given.
    """
    described = cut.coefficients
    if (law := total_energy_of(cut)) is not None:
        _refuse_second_law(described)
        mean_chip(cut, "the total-energy law")  # refuses a cut without feed
        return linearise_over(law, engagement_of(cut), cut.feed_per_tooth)[0]
    stated = {to: getattr(described, name) for name, to in _FIELD_OF_KEY.items() if getattr(described, name) is not None}
    if not described.material:
        for name in ("tangential", "normal"):
            if _FIELD_OF_KEY[name] not in stated:
                fail(name, "missing", "must be the coefficient in Pa (the command line: N/mm^2), unless a material is named",
                     remedy="materials: " + ", ".join(materials()))
        return CuttingCoefficients(**stated)
    material, number = find_material(described.material)
    count = len(material.sets) + len(material.kienzle)
    kt_min, kt_max = (f"{value / 1e6:g}" for value in material.kt)
    which = f"set {number} of {count}" + (f" (kt {kt_min} .. {kt_max} N/mm^2)" if count > 1 else "")
    if material.sets:
        base = material.sets[number - 1]
    else:
        if "kn" not in stated:
            fail("normal", "missing", f"the source for {material.material} gives the tangential force only",
                 remedy="give the normal coefficient too")
        base = material.kienzle[number - 1].linearised(mean_chip(cut, "Kienzle's law"))
        which += f", {base.source}"
    return replace(base, **stated, source=f"{material.material}, {which}, {material.source}" + (", changed" if stated else ""))


def find_material(name: str) -> tuple[Range, int]:
    """Return a material of the literature table and the number of its set, from ``al7075``, ``Al 7075:2`` and the like."""
    text, colon, digits = name.partition(":")
    letters = re.sub(r"[^a-z0-9]", "", text.lower())
    plain_names = {label: re.sub(r"[^a-z0-9]", "", label.lower()) for label in materials()}
    matches = [label for label, word in plain_names.items() if word == letters]
    matches = matches or [label for label, word in plain_names.items() if letters and letters in word]
    if len(matches) > 1:
        fail("material", repr(text), "fits several: " + ", ".join(matches), remedy="write the whole name")
    material = literature(matches[0] if matches else text)
    count = len(material.sets) + len(material.kienzle)
    number = int(digits) if digits.strip().isdigit() else (1 if not colon else 0)
    if not 1 <= number <= count:
        fail("material", repr(name), f"{material.material} has {count} set{'s' if count > 1 else ''}",
             remedy=f"write {material.material}:1" + (f" to {material.material}:{count}" if count > 1 else ""))
    return material, number


def total_energy_of(cut: CuttingDescription) -> TotalEnergy | None:
    """Return the total-energy law of a described cut, where it has one."""
    law = cut.coefficients.total_energy
    return None if law is None else TotalEnergy(law.energy, law.exponent, law.normal_ratio, law.axial_ratio)


def _refuse_second_law(described: CoefficientsDescription) -> None:
    for name in ("material", *COEFFICIENTS):
        if getattr(described, name):
            fail(name, "given beside total_energy", "must be left out: the law says all forces", remedy="keep one of the two")


def mean_chip(cut: CuttingDescription, user: str = "the force law") -> float:
    r"""Return the mean chip thickness over the arc of cut, m.

    :math:`f_z (\cos\phi_{st} - \cos\phi_{ex})/(\phi_{ex} - \phi_{st})`, the mean of :math:`f_z \sin\phi`.
    """
    if not cut.feed_per_tooth > 0:
        fail("feed_per_tooth", "missing", f"{user} is taken at the mean chip thickness and needs it",
             remedy="for example 0.1 mm (`feed`)")
    arc = engagement_of(cut)
    return float(cut.feed_per_tooth * (np.cos(arc.entry) - np.cos(arc.exit)) / arc.arc)


def variation_of(cut: CuttingDescription) -> SpeedVariation | None:
    """Return the spindle-speed variation of a described cut, where it has one."""
    variation = cut.variation
    return None if variation is None else SpeedVariation(variation.amplitude, variation.revolutions, variation.phase)


def words(cut: CuttingDescription) -> str:
    """Return tool, arc of cut and coefficients in one line."""
    tool, k = tool_of(cut), coefficients_of(cut)
    parts = [repr(tool)[5:-1]]
    if tool.corner_radius:
        parts.append("ball" if tool.corner_radius > 0.999 * tool.radius else f"corner radius {1e3 * tool.corner_radius:g} mm")
    parts += [_arc_words(cut), f"feed along {cut.feed}", f"K_t {k.kt / 1e6:g}, K_n {k.kn / 1e6:g}"
              + (f", K_a {k.ka / 1e6:g}" if k.ka else "") + " N/mm^2"]
    if k.edge.any():
        parts.append("edge " + "/".join(f"{v / 1e3:g}" for v in k.edge) + " N/mm")
    if cut.coefficients.material or cut.coefficients.total_energy:
        parts.append(k.source)
    if cut.damping.coefficient:
        parts.append(f"process damping {cut.damping.coefficient:g} N/m")
    if cut.variation is not None:
        parts.append(f"speed varied by {100 * cut.variation.amplitude:g} % over {cut.variation.revolutions} revolutions")
    if cut.feed_per_tooth:
        parts.append(f"{1e3 * cut.feed_per_tooth:g} mm a tooth")
    return ", ".join(parts)


def _arc_words(cut: CuttingDescription) -> str:
    described, arc = cut.engagement, engagement_of(cut)
    if described.entry is not None:
        return f"{np.degrees(arc.entry):.4g} .. {np.degrees(arc.exit):.4g} deg"
    return "slot" if described.direction == "slot" else f"{described.direction}-milling at a/D {described.immersion:g}"


def fault_of(cut: CuttingDescription) -> tuple[tuple[str, ...], str] | None:
    """Return the key and the message of the first fault that the parts of a described cut have together, or None."""
    makers: tuple[Callable[[CuttingDescription], object], ...] = (tool_of, engagement_of, coefficients_of, variation_of)
    for make in makers:
        try:
            make(cut)
        except ToolpointError as error:
            message = str(error).removeprefix(f"{error.argument}:")
            last = error.argument.rsplit(".", 1)[-1]
            key_of_field = {value: key for key, value in _FIELD_OF_KEY.items()}
            key = {"Engagement": "entry", **key_of_field}.get(last, last)
            return (("speed_variation", key) if make is variation_of else (key,)), message.strip()
    return None
