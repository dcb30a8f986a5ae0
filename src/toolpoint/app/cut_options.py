"""Options that say what is cut, with which tool and which coefficients; the units of the command line turned into SI."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import click


def numbers(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, ...] | None:
    """Return the numbers of the text 80,100,80,100."""
    if value is None:
        return None
    try:
        return tuple(float(part) for part in value.split(","))
    except ValueError:
        raise click.BadParameter(f"{value!r}: write numbers with a decimal point, separated by commas, for example "
                                 "80,100,80,100") from None


def _variation(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, int, float] | None:
    if value is None:
        return None
    parts = value.split(",")
    try:
        if not 1 <= len(parts) <= 3:
            raise ValueError
        phase = math.radians(float(parts[2])) if len(parts) > 2 else 0.0
        return float(parts[0]), int(parts[1]) if len(parts) > 1 else 4, phase
    except ValueError:
        raise click.BadParameter(f"{value!r}: write SHARE,REVOLUTIONS or SHARE,REVOLUTIONS,PHASE (degrees), for example 0.1,4"
                                 ) from None


def tool_options(command: Any) -> Any:
    """Add the options of the tool and the arc of cut."""
    return _added(command, (
        click.option("--diameter", type=float, help="Tool diameter, mm."),
        click.option("--teeth", type=int, help="Number of teeth."),
        click.option("--helix", callback=numbers, metavar="DEG[,DEG...]", help="Helix angle, degrees: one, or one a tooth."),
        click.option("--pitch", callback=numbers, metavar="80,100,80,100",
                     help="Angles from each tooth to the next, degrees, sum 360; equal where left out."),
        click.option("--corner-radius", type=float, help="Corner radius, mm; half the diameter is a ball end mill."),
        click.option("--runout", type=float, help="Radial run-out (offset of the cutter's axis), um."),
        click.option("--runout-angle", type=float, help="Direction of the run-out from tooth 0, degrees."),
        click.option("--tilt", type=float, help="Run-out added per height, um/mm."),
        click.option("--immersion", type=float, help="Radial immersion a/D, 0 to 1."),
        click.option("--direction", type=click.Choice(["up", "down", "slot", "centred"]), help="How the arc of cut lies."),
        click.option("--entry", type=float, help="Entry angle, degrees clockwise from y (feed along x); with --exit."),
        click.option("--exit", "exit_", type=float, help="Exit angle, degrees; instead of --immersion and --direction.")))


def coefficient_options(command: Any) -> Any:
    """Add the options of the cutting coefficients and what else acts on the edge."""
    return _added(command, (
        click.option("--kt", type=float, help="Tangential coefficient, N/mm^2."),
        click.option("--kn", type=float, help="Normal (radial) coefficient, N/mm^2."),
        click.option("--ka", type=float, help="Axial coefficient, N/mm^2; the response along z then counts where known."),
        click.option("--kte", type=float, help="Tangential edge coefficient, N/mm."),
        click.option("--kne", type=float, help="Normal (radial) edge coefficient, N/mm."),
        click.option("--kae", type=float, help="Axial edge coefficient, N/mm."),
        click.option("--material", help="Coefficients from the literature instead, for example al7075 or 'Al 7075:2' for the "
                     "second set; 'toolpoint lobes --materials' lists them."),
        click.option("--process-damping", type=float, help="Process damping coefficient C, N/m."),
        click.option("--damping-friction", type=float, help="Friction share of the process damping."),
        click.option("--speed-variation", callback=_variation, metavar="0.1,4[,PHASE]",
                     help="Spindle speed varied by this share of the mean over so many revolutions; phase in degrees."),
        click.option("--feed", type=float, help="Feed per tooth, mm.")))


def _added(command: Any, options: Sequence[Any]) -> Any:
    for option in reversed(options):
        command = option(command)
    return command


_SCALE = {"diameter": 1e-3, "corner_radius": 1e-3, "runout": 1e-6, "runout_angle": math.pi / 180, "tilt": 1e-3,
          "entry": math.pi / 180, "exit": math.pi / 180, "tangential": 1e6, "normal": 1e6, "axial": 1e6, "feed_per_tooth": 1e-3,
          "edge_tangential": 1e3, "edge_normal": 1e3, "edge_axial": 1e3}
_NAMES = {"exit_": "exit", "kt": "tangential", "kn": "normal", "ka": "axial", "kte": "edge_tangential", "kne": "edge_normal",
          "kae": "edge_axial", "feed": "feed_per_tooth"}
HIGHEST = 3e10  # Pa
COEFFICIENTS = ("tangential", "normal", "axial", "edge_tangential", "edge_normal", "edge_axial")


def in_si(given: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a CuttingDescription from the options that were given, in SI."""
    from toolpoint.machine.description import SpeedVariationDescription

    found: dict[str, Any] = {}
    for option, value in given.items():
        if value is None:
            continue
        name = _NAMES.get(option, option)
        if name in ("helix", "pitch"):
            angles = tuple(math.radians(v) for v in value)
            found[name] = angles[0] if name == "helix" and len(angles) == 1 else angles
        elif name == "speed_variation":
            found[name] = SpeedVariationDescription(*value)
        else:
            found[name] = _SCALE[name] * value if name in _SCALE else value
    return found


def doubts(cut: Any) -> list[str]:
    """Return remarks on values of a CuttingDescription that hint at another unit; the options' units are named."""
    lines = []
    if not 2e-4 <= cut.diameter <= 0.5:
        lines.append(f"diameter {1e3 * cut.diameter:g} mm: doubtful; --diameter is in mm")
    if cut.feed_per_tooth > 0.2 * cut.diameter:
        lines.append(f"feed {1e3 * cut.feed_per_tooth:g} mm a tooth on a tool of {1e3 * cut.diameter:g} mm: doubtful; --feed "
                     "is in mm per tooth")
    for option, value in (("kt", cut.tangential), ("kn", cut.normal), ("ka", cut.axial)):
        if value is not None and value > HIGHEST:
            lines.append(f"{option} {value / 1e6:g} N/mm^2: above that of any work material; --{option} is in N/mm^2 (1 N/mm^2 "
                         "is 1e6 Pa)")
    return lines


def changed(base: Any, given: Mapping[str, Any]) -> Any:
    """Return a CuttingDescription with given fields; what they stand instead of (arc, coefficients) is dropped."""
    from dataclasses import replace

    dropped: dict[str, Any] = {}
    if "entry" in given or "exit" in given:
        dropped |= {"immersion": None}
    elif "immersion" in given or "direction" in given:
        dropped |= {"entry": None, "exit": None}
    if "material" in given:
        dropped |= dict.fromkeys(COEFFICIENTS, None)
    return replace(base, **{**dropped, **given})
