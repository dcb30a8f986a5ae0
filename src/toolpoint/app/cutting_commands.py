"""Commands about cuts: lobes, mill, speeds, calibrate."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from toolpoint.app.cut_options import coefficient_options, dynamics_options, in_si, numbers, tool_options
from toolpoint.app.options import JSON, OUTPUT


def _speeds(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Any:
    if not value:
        return None
    import numpy as np

    try:
        first, last, number = value.split(":")
        return np.linspace(float(first), float(last), int(number))
    except ValueError:
        raise click.BadParameter(f"{value!r}: write FIRST:LAST:NUMBER in rev/min, for example 3000:20000:200") from None


def _percentages(ctx: click.Context, parameter: click.Parameter, value: str | None) -> dict[str, Any]:
    names = ("frequency", "damping", "stiffness", "coefficients")
    parts = (value or "").split(",")
    try:
        if value and len(parts) != len(names):
            raise ValueError
        found = {name: float(part) / 100 for name, part in zip(names, parts, strict=False) if part.strip() not in ("", "-")}
        if min(found.values(), default=0.0) < 0:
            raise ValueError
        return found
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
        from toolpoint.app.cutting import print_materials

        print_materials()
        ctx.exit()


@click.command()
@dynamics_options
@tool_options
@coefficient_options
@click.option("--speeds", callback=_speeds, metavar="3000:20000:200", help="Spindle speeds, rev/min.")
@click.option("--method", default="auto", show_default=True, help="auto (chosen to suit the cut), floquet, panel, zero-order, "
              "multi-frequency, semi-discretization or collocation.")
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
def lobes(machine: Path | None, pose: dict[str, float] | None, frf: tuple[Path, ...], modes_file: Path | None,
          band: tuple[float, float] | None, speeds: Any, method: str, simulate: bool, samples: int | None,
          uncertainty: dict[str, Any], tried: tuple[tuple[float, float, bool], ...], output: Path, as_json: bool,
          **cut: Any) -> None:
    """Stability lobes of a milling cut, from a machine file, from measured FRFs, or from saved modes."""
    from toolpoint.app import cutting
    from toolpoint.app.uncertain_cut import Uncertainty

    if (tried or uncertainty) and samples is None:
        raise click.UsageError("--tried and --uncertainty need --probability SAMPLES, for example --probability 200")
    known = replace(Uncertainty(samples or 0, cuts=tried), **uncertainty)
    source = cutting.Source(machine, pose, frf, modes_file, band)
    chart, advice = cutting.lobes(source, in_si(cut), method, speeds, output, as_json, simulate, known)
    if as_json:
        intervals = [chart.intervals(i).tolist() for i in range(chart.speeds.size)]
        click.echo(json.dumps({"speed_rpm": chart.speeds.tolist(), "stable_intervals_m": intervals, "method": chart.method,
                               "advice": advice, "notes": list(chart.notes)}))


@click.command()
@click.option("--chatter", type=float, required=True, help="Chatter frequency, Hz, from a microphone or a spectrum.")
@click.option("--teeth", type=int, required=True)
@click.option("--highest", type=float, required=True, help="Highest spindle speed, rev/min.")
@click.option("--lowest", type=float, default=0.0, help="Lowest spindle speed, rev/min.")
@JSON
def speeds(chatter: float, teeth: int, highest: float, lowest: float, as_json: bool) -> None:
    """Spindle speeds to try against chatter of a known frequency, with nothing else known."""
    from toolpoint.app import console
    from toolpoint.cutting.best_speed import from_chatter_frequency

    advice = from_chatter_frequency(chatter, teeth, highest, lowest)
    if as_json:
        click.echo(json.dumps([{"speed_rpm": one.speed, "reason": one.reason} for one in advice]))
        return
    console.table(f"Speeds to try against chatter at {chatter:g} Hz", ["rev/min", "why"],
                  [[f"{one.speed:.0f}", one.reason] for one in advice])


@click.command()
@dynamics_options
@tool_options
@coefficient_options
@click.option("--speed", type=float, required=True, help="Spindle speed, rev/min.")
@click.option("--depth", type=float, required=True, help="Axial depth of cut, mm.")
@click.option("--revolutions", default=60, show_default=True)
@OUTPUT
@JSON
def mill(machine: Path | None, pose: dict[str, float] | None, frf: tuple[Path, ...], modes_file: Path | None,
         band: tuple[float, float] | None, speed: float, depth: float, revolutions: int, output: Path, as_json: bool,
         **cut: Any) -> None:
    """Simulate a milling cut in time: forces, vibration, spectra, whether it chatters."""
    from toolpoint.app import cutting

    run = cutting.mill(cutting.Source(machine, pose, frf, modes_file, band), in_si(cut), speed, 1e-3 * depth, None,
                       revolutions, output, as_json)
    if as_json:
        click.echo(json.dumps({"chatter": run.is_chattering(), "peak_to_peak_m": run.peak_to_peak().tolist(),
                               "power_w": float(run.power.mean()), "status": run.status}))



@click.command()
@click.argument("forces", nargs=-1, required=True, type=click.Path(path_type=Path))
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
@click.option("--yaml", "yaml_file", type=click.Path(path_type=Path), help="Write the 'cutting' section for a machine file.")
@OUTPUT
@JSON
def calibrate(forces: tuple[Path, ...], speed: float, depth: float, feed: tuple[float, ...] | None, force_on: str,
              angle: float | None, no_runout: bool, yaml_file: Path | None, output: Path, as_json: bool, **tool: Any) -> None:
    """Cutting coefficients and run-out from measured forces, with 95 % intervals.

    FORCES are time histories, columns time, Fx, Fy and Fz (N): text, MATLAB, universal files or a saved Record; x is the
    feed, y normal to it (clockwise from y to x), z along the spindle, away from the work. One file for each feed per tooth.
    """
    from toolpoint.app import calibrate as work

    test = work.CuttingTest(in_si(tool), speed, 1e-3 * depth, None if feed is None else tuple(1e-3 * f for f in feed),
                            force_on, angle, not no_runout)
    found = work.calibrate(forces, test, output, yaml_file, as_json)
    if as_json:
        click.echo(json.dumps(found.as_dict()))
