"""CuttingDescription: a cut as plain frozen data, each number with its unit, limits and option of the commands.

The metadata of a field is the only place where a parameter is stated: the keys of machine files with their limits, the
options of the commands with their units, and the flat form of a description are all made from it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from math import isfinite
from operator import ge, gt, le, lt
from typing import Any

from toolpoint._check import fail, suggestion

WORDS = {"gt": ("above", gt), "ge": ("at least", ge), "lt": ("below", lt), "le": ("at most", le)}
LIMITS = tuple(WORDS)
MAX_SPINDLE_SPEED = 1e6  # rev/min: no spindle turns faster
MAX_CUT_DEPTH = 1.0  # m: no edge is longer
CHIPS = ("path", "constant")  # the feed over speed and teeth at every place, or feed_per_tooth all along
DEFAULT_EDGE_LENGTH_RATIO = 2.0  # of the diameter: length of the edges where it is not given
SI_VALUE = {"": 1.0, "mm": 1e-3, "um": 1e-6, "um/mm": 1e-3, "degrees": math.pi / 180, "N/mm^2": 1e6, "N/mm": 1e3, "N/m": 1.0}


@dataclass(frozen=True)
class CutParameter:
    """Metadata of a number or word of a description.

    kind : the quantity (length, angle, pressure, ratio, speed, edge coefficient, process damping), or count, choice, text.
    meaning, unit, remark : of the option; together they are its help.
    option : name of the option, where the commands have one.
    limits : of the SI value, such as {"gt": 0.0, "le": 1.0}.
    several : how many numbers: 1, 2, ``each`` (one for each tooth) or ``one or each``.
    """

    kind: str
    meaning: str = ""
    unit: str = ""
    remark: str = ""
    option: str = ""
    metavar: str | None = None
    limits: Mapping[str, float] = field(default_factory=dict)
    several: int | str = 1
    choices: tuple[str, ...] = ()
    key: str = ""

    @property
    def help(self) -> str:
        """Help text of the option."""
        return self.meaning + (f", {self.unit}" if self.unit else "") + self.remark + "."

    def in_si(self, value: Any) -> Any:
        """Return the SI value of what the option gives: a number, or a tuple of them."""
        if self.kind in ("count", "choice", "text"):
            return value
        if isinstance(value, tuple):
            numbers = tuple(SI_VALUE[self.unit] * v for v in value)
            return numbers[0] if self.several == "one or each" and len(numbers) == 1 else numbers
        return SI_VALUE[self.unit] * value

    def check(self, name: str, value: Any) -> None:
        """Refuse an SI value (number or tuple of them) outside the limits, in the unit of the option, under this name."""
        scale = SI_VALUE.get(self.unit, 1.0)
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float | int) and not (isfinite(number) and self._allows(number)):
                fail(name, f"{number / scale:g} {self.unit}".strip(), self._range(scale), remedy=self.meaning)

    def _allows(self, number: float) -> bool:
        return all(WORDS[kind][1](number, limit) for kind, limit in self.limits.items())

    def _range(self, scale: float) -> str:
        limits = [f"{WORDS[kind][0]} {limit / scale:g} {self.unit}".strip() for kind, limit in self.limits.items()]
        return "must be " + (" and ".join(limits) or "finite")


def _states(kind: str, meaning: str = "", unit: str = "", remark: str = "", **extras: Any) -> dict[str, CutParameter]:
    """Return the metadata of a field; limits are given by their short names (gt, ge, lt, le)."""
    limits: dict[str, float] = {name: extras.pop(name) for name in LIMITS if name in extras}
    return {"parameter": CutParameter(kind, meaning, unit, remark, limits=limits, **extras)}


@dataclass(frozen=True)
class ToolDescription:
    """An end mill: diameter, corner radius and run-out in m, angles in rad; `pitch` is equal where empty."""

    diameter: float = field(metadata=_states("length", "Tool diameter", "mm", option="diameter", gt=0))
    teeth: int = field(metadata=_states("count", "Number of teeth", option="teeth", ge=1, le=1000))
    helix: float | tuple[float, ...] = field(default=0.0, metadata=_states(
        "angle", "Helix angle", "degrees", ": one, or one a tooth", option="helix", metavar="DEG[,DEG...]",
        several="one or each"))
    pitch: tuple[float, ...] = field(default=(), metadata=_states(
        "angle", "Angles from each tooth to the next", "degrees", ", sum 360; equal where left out", option="pitch",
        metavar="80,100,80,100", several="each"))
    corner_radius: float = field(default=0.0, metadata=_states(
        "length", "Corner radius", "mm", "; half the diameter is a ball end mill", option="corner-radius", ge=0))
    runout: float = field(default=0.0, metadata=_states(
        "length", "Radial run-out (offset of the cutter's axis)", "um", option="runout", ge=0, le=1e-3))
    runout_angle: float = field(default=0.0, metadata=_states(
        "angle", "Direction of the run-out from tooth 0", "degrees", option="runout-angle"))
    tilt: float = field(default=0.0, metadata=_states(
        "angle", "Run-out added per height", "um/mm", option="tilt", ge=-0.1, le=0.1))
    flute_length: float = field(default=0.0, metadata=_states(
        "length", "Length of the cutting edges along the axis", "mm", "; charts end there, at twice the diameter where left "
        "out", option="flute-length", ge=0))


@dataclass(frozen=True)
class EngagementDescription:
    """The arc of cut: `direction` with the radial `immersion` a/D, or `entry` and `exit` angles, rad."""

    immersion: float | None = field(default=None, metadata=_states(
        "ratio", "Radial immersion a/D, 0 to 1", option="immersion", gt=0, le=1))
    direction: str = field(default="down", metadata=_states(
        "choice", "How the arc of cut lies", option="direction", choices=("up", "down", "slot", "centred")))
    entry: float | None = field(default=None, metadata=_states(
        "angle", "Entry angle", "degrees", " clockwise from y (feed along x); with --exit", option="entry", ge=0))
    exit: float | None = field(default=None, metadata=_states(
        "angle", "Exit angle", "degrees", "; instead of --immersion and --direction", option="exit", gt=0))


@dataclass(frozen=True)
class CoefficientsDescription:
    """Cutting coefficients, Pa, and edge coefficients, N/m; those of a `material` of the literature where not given."""

    tangential: float | None = field(default=None, metadata=_states(
        "pressure", "Tangential coefficient", "N/mm^2", option="kt", gt=0))
    normal: float | None = field(default=None, metadata=_states(
        "pressure", "Normal (radial) coefficient", "N/mm^2", option="kn", ge=0))
    axial: float | None = field(default=None, metadata=_states(
        "pressure", "Axial coefficient", "N/mm^2", "; the response along z then counts where known", option="ka", ge=0))
    edge_tangential: float | None = field(default=None, metadata=_states(
        "edge coefficient", "Tangential edge coefficient", "N/mm", option="kte", ge=0))
    edge_normal: float | None = field(default=None, metadata=_states(
        "edge coefficient", "Normal (radial) edge coefficient", "N/mm", option="kne", ge=0))
    edge_axial: float | None = field(default=None, metadata=_states(
        "edge coefficient", "Axial edge coefficient", "N/mm", option="kae", ge=0))
    material: str = field(default="", metadata=_states(
        "text", "Coefficients from the literature instead, for example al7075 or 'Al 7075:2' for the second set; 'toolpoint "
        "lobes --materials' lists them", option="material"))
    total_energy: TotalEnergyDescription | None = field(default=None, metadata=_states(
        "total energy", "Total-energy law in place of coefficients: energy per volume at a chip of 1 mm, N/mm^2, its exponent, "
        "normal and axial force over the tangential one", option="total-energy", metavar="1200,0.2,0.3[,0.1]"))


@dataclass(frozen=True)
class TotalEnergyDescription:
    """Total-energy law: `energy` per volume at a chip of 1 mm (Pa), its `exponent`, ratios of normal and axial force."""

    energy: float = field(metadata=_states("pressure", unit="N/mm^2", gt=0))
    exponent: float = field(default=0.0, metadata=_states("ratio", ge=0, lt=1))
    normal_ratio: float = field(default=0.3, metadata=_states("ratio", ge=0, le=10))
    axial_ratio: float = field(default=0.0, metadata=_states("ratio", ge=0, le=10))


@dataclass(frozen=True)
class ProcessDampingDescription:
    """Process damping: `coefficient` C in N/m, and the share of friction in its force."""

    coefficient: float = field(default=0.0, metadata=_states(
        "process damping", "Process damping coefficient C", "N/m", option="process-damping", ge=0, key="process_damping"))
    friction: float = field(default=0.3, metadata=_states(
        "ratio", "Friction share of the process damping", option="damping-friction", ge=0, key="damping_friction"))


@dataclass(frozen=True)
class SpeedVariationDescription:
    """Spindle-speed variation: `amplitude` as a share of the mean speed, period in `revolutions`, `phase` in rad."""

    amplitude: float = field(metadata=_states("ratio", gt=0, lt=0.9))
    revolutions: int = field(default=4, metadata=_states("count", ge=1, le=1000))
    phase: float = field(default=0.0, metadata=_states("angle", unit="degrees"))


@dataclass(frozen=True)
class CuttingDescription:
    """A cut: tool, arc, coefficients, damping and speed variation; SI units.

    `feed` is the machine axis that the feed goes along, `feed_per_tooth` in m, `speeds` the range of charts in rev/min. `chip`
    says which chip is cut along a path: as the path's feed gives it, or `feed_per_tooth` all along.
    """

    tool: ToolDescription
    engagement: EngagementDescription = EngagementDescription()
    coefficients: CoefficientsDescription = CoefficientsDescription()
    damping: ProcessDampingDescription = ProcessDampingDescription()
    variation: SpeedVariationDescription | None = field(default=None, metadata=_states(
        "variation", "Spindle speed varied by this share of the mean over so many revolutions; phase in degrees",
        option="speed-variation", metavar="0.1,4[,PHASE]", key="speed_variation"))
    feed_per_tooth: float = field(default=0.0, metadata=_states(
        "length", "Feed per tooth", "mm", option="feed", ge=0, le=0.01))
    chip: str = field(default="path", metadata=_states("choice", choices=CHIPS))
    feed: str = field(default="x", metadata=_states("choice", choices=("x", "y", "-x", "-y")))
    speeds: tuple[float, float] = field(default=(1000.0, 12000.0), metadata=_states("speed", several=2))
    source: str = field(default="", metadata=_states("text"))
    deepest: float = field(default=0.0, metadata=_states(
        "length", "Deepest cut of a chart", "mm", "; the length of the edges where left out", option="deepest", ge=0,
        le=MAX_CUT_DEPTH))

    @property
    def depth_end(self) -> tuple[float, str]:
        """The depth (m) at which charts end, and why there, in words."""
        if self.deepest:
            return self.deepest, "the deepest cut that was asked for"
        if self.tool.flute_length:
            return self.tool.flute_length, "the length of the edges"
        return DEFAULT_EDGE_LENGTH_RATIO * self.tool.diameter, (
            f"{DEFAULT_EDGE_LENGTH_RATIO:g} diameters of the tool, as no length of its edges is "
                                                                "given (`flute_length`)")

    @classmethod
    def of(cls, **values: Any) -> CuttingDescription:
        """Return the description with these values under their flat keys, as machine files write them: ``of(diameter=0.016,
        teeth=4, immersion=0.4, tangential=8e8, normal=3e8)``; `diameter` and `teeth` must be there."""
        for key in ("diameter", "teeth"):
            if key not in values:
                fail(f"CuttingDescription.{key}", "missing", "must be given")
        tool = ToolDescription(values["diameter"], values["teeth"])
        return cls(tool).replaced(**values)

    def flat(self) -> dict[str, Any]:
        """Return all values under their flat keys."""
        return {key: _value(self, place) for key, place in PLACES.items()}

    def replaced(self, **values: Any) -> CuttingDescription:
        """Return the description with values replaced by their flat keys, and nothing else."""
        changes: dict[str, dict[str, Any]] = {}
        for key, value in values.items():
            if key not in PLACES:
                fail("CuttingDescription", repr(key), f"is not a key of a cut, which are {', '.join(PLACES)}",
                     remedy=_suggest_key(key))
            if isinstance(value, str) and PARAMETERS[key].kind not in ("choice", "text"):
                fail(f"CuttingDescription.{key}", repr(value), "must be a number in SI units, without a unit behind it",
                     remedy="0.012 for 12 mm, 8e8 for 800 N/mm^2")
            *group, name = PLACES[key]
            if isinstance(value, Mapping):
                value = _NESTED_KINDS[key](**value)
            changes.setdefault(group[0] if group else "", {})[name] = value
        own_values = changes.pop("", {})
        return replace(self, **own_values, **{group: replace(getattr(self, group), **new) for group, new in changes.items()})

    def with_values(self, values: Mapping[str, Any]) -> CuttingDescription:
        """Return the description with these values; what they stand instead of (the other arc, coefficients) is dropped."""
        dropped: dict[str, Any] = {}
        if "entry" in values or "exit" in values:
            dropped |= {"immersion": None}
        elif "immersion" in values or "direction" in values:
            dropped |= {"entry": None, "exit": None}
        if "material" in values or "total_energy" in values:
            dropped |= dict.fromkeys(COEFFICIENTS, None)
            dropped |= {"material": ""} if "total_energy" in values else {"total_energy": None}
        elif any(values.get(name) is not None for name in COEFFICIENTS):
            dropped |= {"total_energy": None}
        return self.replaced(**{**dropped, **values})


def _entries(kind: type[Any], group: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Field[Any], CutParameter]]:
    """Yield path, field and CutParameter of every value of a description."""
    for f in fields(kind):
        if "parameter" in f.metadata:
            yield (*group, f.name), f, f.metadata["parameter"]
        else:
            yield from _entries(_GROUPS[f.name], (f.name,))


def _suggest_key(word: str) -> str:
    """Return which key is meant by the name of an option (``kt``), or else by a word near to it."""
    by_option = {parameter.option: key for key, parameter in PARAMETERS.items() if parameter.option}
    key = by_option.get(word.lower().replace("_", "-"))
    return suggestion(word, PLACES) if key is None else f"did you mean {key!r}?"


def _value(cut: CuttingDescription, place: tuple[str, ...]) -> Any:
    value: Any = cut
    for name in place:
        value = getattr(value, name)
    return value


_NESTED_KINDS: Mapping[str, type[Any]] = {"speed_variation": SpeedVariationDescription,
                                          "total_energy": TotalEnergyDescription}
_GROUPS: dict[str, type[Any]] = {"tool": ToolDescription, "engagement": EngagementDescription,
                                 "coefficients": CoefficientsDescription, "damping": ProcessDampingDescription}
# By flat key, in the order in which options are listed.
PLACES: Mapping[str, tuple[str, ...]] = {p.key or path[-1]: path for path, _, p in _entries(CuttingDescription)}
PARAMETERS: Mapping[str, CutParameter] = {p.key or path[-1]: p for path, _, p in _entries(CuttingDescription)}
DEFAULTS: Mapping[str, Any] = {p.key or path[-1]: f.default for path, f, p in _entries(CuttingDescription)
                               if f.default is not MISSING}
VARIATION: Mapping[str, CutParameter] = {f.name: f.metadata["parameter"] for f in fields(SpeedVariationDescription)}
TOTAL_ENERGY: Mapping[str, CutParameter] = {f.name: f.metadata["parameter"] for f in fields(TotalEnergyDescription)}
COEFFICIENTS = tuple(f.name for f in fields(CoefficientsDescription) if f.name not in ("material", "total_energy"))


def flat_values(cut: CuttingDescription) -> dict[str, Any]:
    """Return the values that are not the default ones, under their flat keys, nested data as mappings: a machine file's."""
    values = {key: value for key, value in cut.flat().items() if key not in DEFAULTS or value != DEFAULTS[key]}
    return {key: {f.name: getattr(value, f.name) for f in fields(value) if getattr(value, f.name) != f.default}
            if is_dataclass(value) else value for key, value in values.items()}


def check_values(values: Mapping[str, Any], name: Mapping[str, str] | None = None) -> None:
    """Refuse values of a cut (flat keys, SI) outside the limits of their keys, before anything is read or computed.

    `name` tells under which name a key was given, such as an option of a command; the key itself where it is missing.
    """
    for key, value in values.items():
        PARAMETERS[key].check((name or {}).get(key, f"`{key}`"), value)


def check_cut(values: Mapping[str, Any], speed: float, depth: float) -> None:
    """Refuse a speed (rev/min), a depth (m) or a feed that no simulated cut has."""
    if not 0 < speed <= MAX_SPINDLE_SPEED:
        fail("`speed`", f"{speed:g} rev/min", f"must be above zero and at most {MAX_SPINDLE_SPEED:g} rev/min")
    if not 0 < depth <= MAX_CUT_DEPTH:
        fail("`depth`", f"{1e3 * depth:g} mm", f"must be above zero and at most {1e3 * MAX_CUT_DEPTH:g} mm")
    if values.get("feed_per_tooth") is not None and not values["feed_per_tooth"] > 0:
        fail("`feed`", f"{1e3 * values['feed_per_tooth']:g} mm", "must be above zero", remedy="without feed there is no cut")
