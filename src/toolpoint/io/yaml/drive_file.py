"""Drive files in YAML: mechanics, friction and control of the axes of a machine; read with all faults at once."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.document import Document, parsed, validated
from toolpoint.io.yaml.drive_schema import VERSION, DriveAxis, Drives

_LARGEST_DELAY, _FILTERS = 7, 4
_NEEDED = {
    "rigid": ("lead", "inertia"), "two-mass": ("lead", "inertia", "table_mass", "stiffness"),
    "rack": ("inertia", "table_mass", "pinion_radius", "stiffness"), "linear-motor": ("table_mass",),
    "screw": ("lead", "inertia", "table_mass", "screw_diameter", "screw_length", "nut_position", "coupling_stiffness",
              "bearing_stiffness", "nut_stiffness"),
    "ball-screw": ("lead", "inertia", "screw_inertia", "screw_mass", "coupling_stiffness", "bearing_stiffness",
                   "nut_stiffness")}
_LAW = {"stribeck": ("static", "stribeck_velocity"), "lugre": ("static", "stribeck_velocity", "bristle_stiffness"),
        "two-exponential": ("static", "stribeck_velocity", "coulomb_velocity"),
        "maxwell-slip": ("static", "stribeck_velocity", "element_stiffness", "element_share", "attraction")}
_FILTER = {"notch": ("frequency",), "low-pass": ("frequency",), "low-pass-1": ("time_constant",)}


def read(path: str | Path) -> Drives:
    """Return the drives of a YAML file, SI; raises FileFaults with every fault of the file."""
    document = parsed(Path(path))
    if document.data.get("toolpoint") != VERSION:
        document.fault(("toolpoint",), f"file version {document.data.get('toolpoint')!r}; this program reads version {VERSION}")
    found: Drives | None = validated(Drives, document.data, (), document)
    if found is not None:
        if not found.axes:
            document.fault(("axes",), "missing; a drive file needs at least one axis")
        if found.substeps < 1:
            document.fault(("substeps",), f"{found.substeps}; must be at least 1")
        for name, axis in found.axes.items():
            for key, message in _faults(axis):
                document.fault(("axes", name, *key), message)
        _common_samples(found, document)
    if document.faults or found is None:
        raise FileFaults(str(path), document.text, document.faults)
    return found


def _faults(axis: DriveAxis) -> Iterator[tuple[tuple[str | int, ...], str]]:
    m = axis.mechanics
    yield from _missing(("mechanics",), m, _NEEDED[m.kind], f"a {m.kind} axis")
    if m.kind == "ball-screw" and axis.ends is None:
        yield (), "'ends' is missing; a ball screw needs base, table, tool and the stiffness it replaces"
    if m.backlash is not None and m.preload is not None:
        yield ("mechanics", "preload"), "a nut has either backlash or a preload; leave one out"
    if (m.backlash is not None or m.preload is not None) and m.kind not in ("two-mass", "rack", "screw"):
        key = "backlash" if m.backlash is not None else "preload"
        yield ("mechanics", key), f"a {m.kind} axis has no contact; use two-mass, rack or screw"
    if m.kind == "rack" and m.preload is not None:
        yield ("mechanics", "preload"), "a rack takes backlash only"
    if m.nut_moves and m.kind != "screw":
        yield ("mechanics", "nut_moves"), f"a {m.kind} axis has no nut along a screw; use kind screw"
    if m.kind == "screw" and m.nut_position and m.screw_length and m.nut_position >= m.screw_length:
        yield ("mechanics", "nut_position"), f"{m.nut_position:g} m; must be below the screw's length {m.screw_length:g} m"
    if axis.guide_friction.law != "none" and m.kind in ("rigid", "ball-screw"):
        yield ("guide_friction",), f"a {m.kind} axis has no guide of its own; put the friction at the shaft"
    if axis.friction.law != "none" and m.kind in ("linear-motor", "rack"):
        yield ("friction",), f"a {m.kind} axis takes its friction at the guide: guide_friction, N and m/s"
    for name, law in (("friction", axis.friction), ("guide_friction", axis.guide_friction)):
        yield from _missing((name,), law, _LAW.get(law.law, ()), f"the law {law.law!r}")
        if law.static is not None and law.law != "two-exponential" and law.static < law.coulomb:
            yield (name, "static"), f"{law.static:g} is below the Coulomb level {law.coulomb:g}; exchange the two"
        if law.law == "maxwell-slip" and abs(sum(law.element_share) - 1) > 1e-6:
            yield (name, "element_share"), f"sum {sum(law.element_share):g}; the shares must sum to one"
        if len(law.element_share) != len(law.element_stiffness):
            yield (name, "element_share"), f"{len(law.element_share)} shares for {len(law.element_stiffness)} stiffnesses"
    yield from _control_faults(axis)


def _control_faults(axis: DriveAxis) -> Iterator[tuple[tuple[str | int, ...], str]]:
    for i, part in enumerate(axis.velocity.filters):
        yield from _missing(("velocity", "filters", i), part, _FILTER[part.kind], f"a {part.kind}")
        if part.frequency is not None and part.frequency * axis.velocity.sample_time >= 0.5:
            yield ("velocity", "filters", i, "frequency"), \
                f"{part.frequency:g} Hz; must be below half the sample rate, {0.5 / axis.velocity.sample_time:g} Hz"
    if len(axis.velocity.filters) > _FILTERS:
        yield ("velocity", "filters"), f"{len(axis.velocity.filters)} filters; must be at most {_FILTERS}"
    for loop in ("velocity", *(("current",) if axis.current else ())):
        delay = getattr(axis, loop).delay
        if not 0 <= delay <= _LARGEST_DELAY:
            yield (loop, "delay"), f"{delay} samples; must be 0 to {_LARGEST_DELAY}"
    if (axis.motor is None) != (axis.current is None):
        missing = "motor" if axis.motor is None else "current"
        yield (), f"{missing!r} is missing; motor and current loop are given together, or both left out"
    motors: list[tuple[tuple[str, ...], Any]] = [(("motor",), axis.motor)]
    motors += [(("current", "model"), axis.current.model)] if axis.current else []
    for key, motor in motors:
        if motor is not None and (motor.flux is None) == (motor.torque_constant is None):
            yield key, "give either flux or torque_constant"
    if axis.current is not None:
        c = axis.current
        if (c.bandwidth is None) == (c.gain is None and c.integral is None) or (c.bandwidth is None and c.gain is None):
            yield ("current",), "give either bandwidth, or gain and integral"
        if c.carrier < 1:
            yield ("current", "carrier"), f"{c.carrier}; must be at least 1"
    times = [("velocity", axis.velocity.sample_time), ("position", axis.position.sample_time)]
    times = [("current", axis.current.sample_time), *times] if axis.current else times
    for (inner, one), (outer, other) in pairwise(times):
        ratio = other / one
        if ratio < 0.999 or abs(ratio - round(ratio)) > 1e-6:
            yield (outer, "sample_time"), (f"{other:g} s; must be a whole multiple of the {inner} loop's {one:g} s, "
                                           f"for example {max(1, round(ratio)) * one:g} s")


def _missing(key: tuple[str | int, ...], part: Any, names: tuple[str, ...], whose: str
             ) -> Iterator[tuple[tuple[str | int, ...], str]]:
    for name in names:
        if getattr(part, name) in (None, ()):
            yield key, f"{name!r} is missing; {whose} needs it"


def _common_samples(drives: Drives, document: Document) -> None:
    """All axes share one clock: the sample times of each loop are those of the first axis."""
    first: DriveAxis | None = next(iter(drives.axes.values()), None)
    for name, axis in drives.axes.items():
        if first is None or (axis.current is None) != (first.current is None):
            document.fault(("axes", name), "must have a current loop, or none, as the first axis")
            continue
        for loop in ("position", "velocity", *(("current",) if axis.current else ())):
            own, other = getattr(axis, loop).sample_time, getattr(first, loop).sample_time
            if abs(own - other) > 1e-12:
                document.fault(("axes", name, loop, "sample_time"), f"{own:g} s; must be those of the first axis, {other:g} s")
