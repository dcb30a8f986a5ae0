"""Commands about cuts: lobes, turn, mill, map-chatter, speeds, calibrate."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.cut_options import coefficient_options, in_si, numbers, tool_options
from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, NEW_FILE, OUTPUT, PATH, REPLACE
from toolpoint.app.source import Source, dynamics_options
from toolpoint.app.speeds import speeds_of

HIGHEST_LOBE = 10


def _percentages(ctx: click.Context, parameter: click.Parameter, value: str | None) -> dict[str, Any]:
    names = ("frequency", "damping", "stiffness", "coefficients")
    parts = (value or "").split(",")
    try:
        if value and len(parts) != len(names):
            raise ValueError
        shares = {name: float(part) / 100 for name, part in zip(names, parts, strict=False) if part.strip() not in ("", "-")}
        if min(shares.values(), default=0.0) < 0:
            raise ValueError
        return shares
    except ValueError:
        raise click.BadParameter(f"{value!r}: write four numbers in percent, none below zero, for example 1,10,5,10; "
                                 "- keeps one") from None


def _tried(ctx: click.Context, parameter: click.Parameter, value: tuple[str, ...]) -> tuple[tuple[float, float, bool], ...]:
    cuts = []
    for text in value:
        try:
            speed, depth, outcome = text.split(":")
            cuts.append((float(speed), 1e-3 * float(depth), {"stable": True, "chatter": False}[outcome]))
        except (ValueError, KeyError):
            raise click.BadParameter(f"{text!r}: write SPEED:DEPTH:OUTCOME, rev/min, mm and stable or chatter, for example "
                                     "12000:1.5:chatter") from None
    return tuple(cuts)


def _materials(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value:
        from toolpoint.app import console
        from toolpoint.studies.cuts.forces.material_table import materials_table

        console.text(materials_table())
        ctx.exit()


@click.command()
@dynamics_options
@tool_options
@coefficient_options
@click.option("--speeds", callback=speeds_of, metavar="3000:20000:200", help="Spindle speeds, rev/min.")
@click.option("--method", default="auto", show_default=True, help="auto (chosen to suit the cut), floquet, panel, hill, "
              "zero-order, multi-frequency, semi-discretization or collocation.")
@click.option("--materials", is_flag=True, is_eager=True, expose_value=False, callback=_materials,
              help="List the literature table of cutting coefficients and end.")
@click.option("--simulate", is_flag=True, help="Also simulate cuts on a grid; a click on one shows its vibration.")
@click.option("--probability", "samples", type=click.IntRange(2), metavar="SAMPLES",
              help="Also P(stable) from that many charts with uncertain parameters.")
@click.option("--uncertainty", callback=_percentages, metavar="F,Z,K,C", help="Standard deviations of frequencies, damping "
              "ratios, stiffnesses and cutting coefficients, percent; - for measured, or 1, 10, 5, 10.")
@click.option("--tried", multiple=True, callback=_tried, metavar="SPEED:DEPTH:OUTCOME",
              help="A cut already made: rev/min, mm, stable or chatter; sharpens P(stable).")
@OUTPUT
@JSON
def lobes(source: Source, speeds: Any, method: str, simulate: bool, samples: int | None, uncertainty: dict[str, Any],
          tried: tuple[tuple[float, float, bool], ...], output: Path, as_json: bool, **cut: Any) -> None:
    """Stability lobes of a milling cut, from a machine file, from measured FRFs, or from saved modes."""
    from toolpoint.app.dynamics import read_dynamics

    if (tried or uncertainty) and samples is None:
        raise click.UsageError("--tried and --uncertainty need --probability SAMPLES, for example --probability 200")
    with frame(output, as_json) as run, run.progress_of_parts() as progress:
        dynamics = read_dynamics(source)

        from toolpoint.cutting.stability import method_named
        from toolpoint.studies.cuts.lobes_study import chart_lobes
        from toolpoint.studies.cuts.uncertain_cut import Uncertainty

        known = replace(Uncertainty(samples or 0, cuts=tried), **uncertainty)
        chosen = method_named(method, "--method")
        result = chart_lobes(dynamics, in_si(cut), method=chosen, speeds=speeds, simulate_cuts=simulate,
                             uncertainty=known, progress=progress).noted(run.warnings)

        from toolpoint.pages.cuts.lobes import lobes_page

        run.save(lobes_page(result, run.warnings))
    run.show(result, result.chart.notes)


def _direction(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, float, float] | None:
    """Return the vector of x, -z, 30deg (from x towards y), or 1,0,0.5."""
    if value is None:
        return None
    text = value.strip()
    name = text.lstrip("+-")
    if name in ("x", "y", "z"):
        sign = -1.0 if text.startswith("-") else 1.0
        return (sign * (name == "x"), sign * (name == "y"), sign * (name == "z"))
    try:
        if "," in text:
            x, y, z = (float(part) for part in text.split(","))
            return x, y, z
        angle = math.radians(float(text.removesuffix("deg")))
        return math.cos(angle), math.sin(angle), 0.0
    except ValueError:
        raise click.BadParameter(f"{value!r}: write x, y, z, an angle from x towards y like 30deg, or a vector like 1,0,0.5"
                                 ) from None


@click.command()
@dynamics_options
@click.option("--kf", type=float, required=True, help="Cutting coefficient along the thickness of the chip, N/mm^2.")
@click.option("--direction", callback=_direction, metavar="x|y|z|30deg|1,0,0.5",
              help="Direction in which the chip is thick, from the work into the tool: an axis, an angle from x towards y, or "
                   "a vector; x where left out.")
@click.option("--kt", type=float, help="Coefficient along the cutting speed, N/mm^2; it matters where the structure bends from "
                                       "one direction into the other.")
@click.option("--cutting-direction", callback=_direction, metavar="x|y|z|...",
              help="Way of the work past the edge, for --kt; y where left out.")
@click.option("--speeds", callback=speeds_of, metavar="300:6000:400", help="Spindle speeds, rev/min.")
@click.option("--process-damping", type=float, default=0.0, help="Process damping, N/m; with --diameter or --cutting-speed.")
@click.option("--diameter", type=float, help="Diameter of the work, mm: the cutting speed grows with the spindle speed.")
@click.option("--cutting-speed", type=float, help="Cutting speed held at every spindle speed, m/min.")
@OUTPUT
@JSON
def turn(source: Source, kf: float, direction: Any, kt: float | None, cutting_direction: Any, speeds: Any,
         process_damping: float, diameter: float | None, cutting_speed: float | None, output: Path, as_json: bool) -> None:
    """Stability lobes of a turning cut: stable widths over spindle speed, and the width that is stable at every speed."""
    from toolpoint.app.dynamics import read_dynamics

    if diameter is not None and cutting_speed is not None:
        raise click.UsageError("--diameter and --cutting-speed: must be one of them; the first lets the cutting speed grow "
                               "with the spindle speed, the second holds it")
    if not kf > 0:
        raise click.UsageError(f"--kf {kf:g}: must be above zero, N/mm^2")
    with frame(output, as_json) as run:
        dynamics = read_dynamics(source)

        from toolpoint.studies.cuts.turning_study import TurningCut, chart_turning

        cut = TurningCut(1e6 * kf, 1e6 * (kt or 0.0), direction, cutting_direction, process_damping,
                         cutting_speed and cutting_speed / 60, diameter and 1e-3 * diameter)
        result = chart_turning(dynamics, cut, speeds).noted(run.warnings)

        from toolpoint.pages.cuts.turning import turning_page

        run.save(turning_page(result))
    run.show(result, result.chart.notes)


@click.command()
@click.option("--chatter", type=float, required=True, help="Chatter frequency, Hz, from a microphone or a spectrum.")
@click.option("--teeth", type=int, required=True, help="Number of teeth.")
@click.option("--highest", type=float, required=True, help="Highest spindle speed, rev/min.")
@click.option("--lowest", type=float, default=0.0, help="Lowest spindle speed, rev/min.")
@JSON
def speeds(chatter: float, teeth: int, highest: float, lowest: float, as_json: bool) -> None:
    """Spindle speeds to try against chatter of a known frequency, with nothing else known."""
    from toolpoint.app import console
    from toolpoint.cutting.advice.best_speed import from_chatter_frequency
    from toolpoint.studies.text_table import text_table

    if not 0 <= lowest < highest:
        raise click.UsageError(f"--lowest {lowest:g} and --highest {highest:g}: must be 0 <= lowest < highest")
    advice = from_chatter_frequency(chatter, teeth, highest, speed_min=lowest)
    if as_json:
        click.echo(json.dumps([{"speed_rpm": cut.speed, "reason": cut.reason} for cut in advice]))
        return
    console.text(text_table(f"Speeds to try against chatter at {chatter:g} Hz", ["rev/min", "why"],
                            [[f"{cut.speed:.0f}", cut.reason] for cut in advice]))
    first = round(60 * chatter / (teeth * advice[0].speed))
    if first > HIGHEST_LOBE:
        console.text(f"note: the fastest of them is lobe {first}; beyond lobe {HIGHEST_LOBE} or so the stable pockets are too "
                     "narrow to be of use: a higher --highest, fewer teeth, or unequal pitch help more")


@click.command()
@dynamics_options
@tool_options
@coefficient_options
@click.option("--speed", type=float, required=True, help="Spindle speed, rev/min.")
@click.option("--depth", type=float, required=True, help="Axial depth of cut, mm.")
@click.option("--revolutions", type=click.IntRange(1), help="As many as the start-up needs to die out where left out.")
@OUTPUT
@JSON
def mill(source: Source, speed: float, depth: float, revolutions: int | None, output: Path, as_json: bool,
         **cut: Any) -> None:
    """Simulate a milling cut in time: forces, vibration, spectra, whether it chatters."""
    from toolpoint.app.dynamics import read_dynamics

    values = in_si(cut)
    with frame(output, as_json, steps=2) as run:
        dynamics = read_dynamics(source)

        from toolpoint.studies.cuts.simulated_cut import check_cut, simulate_cut

        check_cut(values, speed, 1e-3 * depth)
        result = simulate_cut(dynamics, values, speed=speed, depth=1e-3 * depth, revolutions=revolutions,
                              step=run.step)
        run.step("page")

        from toolpoint.pages.cuts.simulated_cut import simulation_page

        run.save(simulation_page(result, run.warnings))
    run.show(result, [*result.notes, *run.warnings])


def _angles(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
    """Return angles in rad of the text 0,45,90 or FIRST:LAST:NUMBER, degrees."""
    if value is None:
        return None
    import numpy as np

    text = value.replace("deg", "")
    try:
        if ":" in text:
            first, last, number = text.split(":")
            if int(number) < 1:
                raise ValueError
            return np.radians(np.linspace(float(first), float(last), int(number)))
        return np.radians([float(part) for part in text.split(",")])
    except ValueError:
        raise click.BadParameter(f"{value!r}: write angles in degrees, 0,45,90 or FIRST:LAST:NUMBER, for example 0:135:4"
                                 ) from None


@click.command("map-chatter")
@click.argument("machine", type=FILE)
@click.option("--axis", "axes", multiple=True, required=True, metavar="X=-300mm:300mm:5",
              help="Axis with first position, last position and number of positions (m or rad without a unit); several times.")
@click.option("--feed-directions", callback=_angles, metavar="0,45,90|0:135:4",
              help="Angles of the feed from x towards y, degrees; that of the cut where left out.")
@tool_options
@coefficient_options
@click.option("--speeds", callback=speeds_of, metavar="3000:20000:60", help="Spindle speeds, rev/min; 60 of the cut's where "
                                                                            "left out.")
@click.option("--method", default="auto", show_default=True, help="As of lobes; zero-order is quicker by far, and rougher.")
@click.option("--workers", type=click.IntRange(0), default=0, show_default=True,
              help="Worker processes (extra 'cluster'); 0 is this process.")
@click.option("--folder", type=PATH, help="Keep finished poses here and resume from them.")
@OUTPUT
@JSON
def map_chatter(machine: Path, axes: tuple[str, ...], feed_directions: Any, speeds: Any, method: str, workers: int,
                folder: Path | None, output: Path, as_json: bool, **cut: Any) -> None:
    """Chatter limits over a grid of axis positions and feed directions: where in the workspace a cut may be how deep.

    The cut is that of the machine file, with the options given here in its place. With --folder an interrupted map goes on
    where it stopped.
    """
    from toolpoint.app.poses import grid
    from toolpoint.io.yaml import machine_file

    built = machine_file.read(machine)
    positions = grid(built, axes, "--axis")

    from toolpoint.cutting.build import words
    from toolpoint.cutting.stability import method_named
    from toolpoint.pages.cuts.chatter_map import chatter_map_page
    from toolpoint.studies.cuts.chatter_map import chatter_map
    from toolpoint.studies.cuts.described_cut import cut_on
    from toolpoint.studies.execute import Dask, Serial
    from toolpoint.studies.machines.tool_point import FEED_ANGLE

    chosen = method_named(method, "--method")
    used, notes = cut_on(built, in_si(cut))
    words(used)  # faults of the cut are told before any work
    angles = (FEED_ANGLE[used.feed],) if feed_directions is None else feed_directions
    with frame(output, as_json) as run, run.progress("poses", folder) as progress:
        result = chatter_map(built, positions, used, speeds=speeds, feed_angles=angles, method=chosen,
                             engine=Dask(workers) if workers else Serial(), folder=folder, progress=progress)
    notes += [*result.notes, *run.warnings]
    run.save(chatter_map_page(result, built, notes))
    run.show(result, notes)


@click.command()
@click.argument("forces", nargs=-1, required=True, type=FILE)
@tool_options
@click.option("--speed", type=float, required=True, help="Spindle speed, rev/min, constant.")
@click.option("--depth", type=float, required=True, help="Axial depth of cut, mm.")
@click.option("--feed", callback=numbers, metavar="MM[,MM...]",
              help="Feed per tooth of each file, mm; left out where the files have a column 'feed'.")
@click.option("--force-on", type=click.Choice(["tool", "work"]), default="tool", show_default=True,
              help="Whether the forces act on the tool or (the opposite, a table dynamometer) on the work.")
@click.option("--angle", type=float, help="Angle of tooth 0 at the first sample, degrees clockwise from y, the same in all "
              "files (a trigger); found for each record where left out.")
@click.option("--no-runout", is_flag=True, help="Do not fit run-out.")
@click.option("--yaml", "yaml_file", type=NEW_FILE, help="Write the 'cutting' section for a machine file.")
@REPLACE
@OUTPUT
@JSON
def calibrate(forces: tuple[Path, ...], speed: float, depth: float, feed: tuple[float, ...] | None, force_on: str,
              angle: float | None, no_runout: bool, yaml_file: Path | None, output: Path, as_json: bool, **tool: Any) -> None:
    """Cutting coefficients and run-out from measured forces, with 95 % intervals.

    FORCES are time histories, columns time, Fx, Fy and Fz (N): text, MATLAB, universal files or a saved Record; x is the
    feed, y normal to it (clockwise from y to x), z along the spindle, away from the work. One file for each feed per tooth.
    """
    from toolpoint.io.measured import record_files
    if yaml_file is not None and not yaml_file.parent.is_dir():
        raise ToolpointError(f"--yaml {yaml_file}: the folder {yaml_file.parent} does not exist; create it first")
    with frame(output, as_json, steps=3) as run:
        run.step("forces")
        records = [(str(path), record_files.read(path)) for path in forces]

        from toolpoint.pages.cuts.calibration import calibration_page
        from toolpoint.studies.cuts.forces.calibration import CuttingTest, calibrate, check_test

        test = CuttingTest(in_si(tool), speed, 1e-3 * depth, None if feed is None else tuple(1e-3 * f for f in feed),
                           force_on, angle, not no_runout)
        check_test(test)
        run.step("fit")
        result = calibrate(records, test)
        run.step("page")
        run.save(calibration_page(result, run.warnings))
    if yaml_file is not None:
        from toolpoint.io.yaml import machine_file

        machine_file.write_cutting(result.description, yaml_file)
    run.warnings += result.doubts
    run.show(result, written={"Section 'cutting'": yaml_file})
