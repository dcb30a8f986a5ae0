"""Commands about cuts: lobes, turn, mill, map-chatter, speeds, calibrate."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from toolpoint import cutting, io, pages, studies
from toolpoint.app.cut_options import CutValues, ToolValues
from toolpoint.app.declare import Help, Printed, Reading, command
from toolpoint.app.dynamics import Dynamics
from toolpoint.app.frame import Frame
from toolpoint.app.options import Axes, Depth, Files, Folder, MachineFile, Speed, Speeds, Workers
from toolpoint.app.values import Angles, Direction, NewFile, Numbers, SpindleSpeeds
from toolpoint.cutting.description import check_cut

SPREADS = ("frequency", "damping", "stiffness", "coefficients")


def _spreads(text: str) -> dict[str, Any]:
    shares = {name: float(part) / 100 for name, part in zip(SPREADS, text.split(","), strict=True)
              if part.strip() not in ("", "-")}
    if min(shares.values(), default=0.0) < 0:
        raise ValueError
    return shares


def _tried(text: str) -> tuple[float, float, bool]:
    speed, depth, outcome = text.split(":")
    return float(speed), 1e-3 * float(depth), {"stable": True, "chatter": False}[outcome]


Spreads = Annotated[dict[str, Any], Reading(_spreads, "four numbers in percent, none below zero, for example 1,10,5,10; - "
                                                      "keeps one")]
TriedCut = Annotated[tuple[float, float, bool], Reading(_tried, "SPEED:DEPTH:OUTCOME, rev/min, mm and stable or chatter, for "
                                                             "example 12000:1.5:chatter")]
Method = Annotated[str, Help("auto (chosen to suit the cut), floquet, panel, hill, zero-order, multi-frequency, "
                             "semi-discretization or collocation.")]


@command(printed=Printed("--materials", "List the literature table of cutting coefficients and end.",
                         lambda: studies.materials_table()))
def lobes(run: Frame, source: Dynamics, cut: CutValues, *, speeds: Speeds = None, method: Method = "auto",
          simulate: Annotated[bool, Help("Also simulate cuts on a grid; a click on one shows its vibration.")] = False,
          samples: Annotated[int | None, Help("Also P(stable) from that many charts with uncertain parameters.",
                                              name="--probability", metavar="SAMPLES", least=2)] = None,
          uncertainty: Annotated[Spreads | None, Help(
              "Standard deviations of frequencies, damping ratios, stiffnesses and cutting coefficients, percent; - for "
              "measured, or 1, 10, 5, 10.", metavar="F,Z,K,C", needs="--probability, for example --probability 200")] = None,
          tried: Annotated[tuple[TriedCut, ...], Help("A cut already made: rev/min, mm, stable or chatter; sharpens P(stable).",
                                                      metavar="SPEED:DEPTH:OUTCOME",
                                                      needs="--probability, for example --probability 200")] = ()) -> None:
    """Stability lobes of a milling cut, from a machine file, from measured FRFs, or from saved modes."""
    progress, dynamics = run.progress_of_parts(), source.read()
    known = studies.Uncertainty(samples or 0, cuts=tried, **(uncertainty or {}))
    result = studies.chart_lobes(dynamics, cut, method=cutting.stability.method_named(method, "`method`"), speeds=speeds,
                                 simulate_cuts=simulate, uncertainty=known, progress=progress).noted(run.warnings)
    run.save(pages.lobes_page, result, run.warnings)
    run.show(result, result.chart.notes)


@command()
def turn(run: Frame, source: Dynamics, *,
         kf: Annotated[float, Help("Cutting coefficient along the thickness of the chip, N/mm^2.", above=0)],
         direction: Annotated[Direction | None, Help("Direction in which the chip is thick, from the work into the tool: an "
                                                     "axis, an angle from x towards y, or a vector; x where left out.",
                                                     metavar="x|y|z|30deg|1,0,0.5")] = None,
         kt: Annotated[float, Help("Coefficient along the cutting speed, N/mm^2; it matters where the structure bends from one "
                                   "direction into the other.")] = 0.0,
         cutting_direction: Annotated[Direction | None, Help("Way of the work past the edge, for --kt; y where left out.",
                                                             metavar="x|y|z|...")] = None,
         speeds: Annotated[SpindleSpeeds | None, Help("Spindle speeds, rev/min.", metavar="300:6000:400")] = None,
         process_damping: Annotated[float, Help("Process damping, N/m; with --diameter or --cutting-speed.")] = 0.0,
         diameter: Annotated[float | None, Help("Diameter of the work, mm: the cutting speed grows with the spindle "
                                                "speed.")] = None,
         cutting_speed: Annotated[float | None, Help("Cutting speed held at every spindle speed, m/min.",
                                                     excludes="--diameter, with which it grows with the "
                                                     "spindle speed")] = None) -> None:
    """Stability lobes of a turning cut: stable widths over spindle speed, and the width that is stable at every speed."""
    dynamics = source.read()
    cut = studies.TurningCut(1e6 * kf, 1e6 * kt, direction, cutting_direction, process_damping,
                             cutting_speed and cutting_speed / 60, diameter and 1e-3 * diameter)
    result = studies.chart_turning(dynamics, cut, speeds).noted(run.warnings)
    run.save(pages.turning_page, result)
    run.show(result, result.chart.notes)


@command(page=False)
def speeds(run: Frame, *, chatter: Annotated[float, Help("Chatter frequency, Hz, from a microphone or a spectrum.")],
           teeth: Annotated[int, Help("Number of teeth.")], highest: Annotated[float, Help("Highest spindle speed, rev/min.")],
           lowest: Annotated[float, Help("Lowest spindle speed, rev/min.")] = 0.0) -> None:
    """Spindle speeds to try against chatter of a known frequency, with nothing else known."""
    result = studies.propose_speeds(chatter, teeth, highest=highest, lowest=lowest)
    run.show(result, result.notes)


@command(steps=2)
def mill(run: Frame, source: Dynamics, cut: CutValues, *, speed: Speed, depth: Depth, revolutions: Annotated[int | None, Help(
        "As many as the start-up needs to die out where left out.", least=1)] = None) -> None:
    """Simulate a milling cut in time: forces, vibration, spectra, whether it chatters."""
    check_cut(cut, speed, 1e-3 * depth)
    dynamics = source.read()
    result = studies.simulate_cut(dynamics, cut, speed=speed, depth=1e-3 * depth, revolutions=revolutions, step=run.step)
    run.step("page")
    run.save(pages.simulation_page, result, run.warnings)
    run.show(result, [*result.notes, *run.warnings])


@command()
def map_chatter(run: Frame, machine: MachineFile, axes: Axes, *, feed_directions: Annotated[Angles | None, Help(
        "Angles of the feed from x towards y, degrees; that of the cut where left out.", metavar="0,45,90|0:135:4")] = None,
                cut: CutValues, speeds: Annotated[SpindleSpeeds | None, Help(
                    "Spindle speeds, rev/min; 60 of the cut's where left out.", metavar="3000:20000:60")] = None,
                method: Method = "auto", workers: Workers = 0, folder: Folder = None) -> None:
    """Chatter limits over a grid of axis positions and feed directions: where in the workspace a cut may be how deep.

    The cut is that of the machine file, with the options given here in its place. The method zero-order is quicker by far, and
    rougher. With --folder an interrupted map goes on where it stopped.
    """
    built = io.read_machine_at(machine)
    positions = io.lay_grid(built, axes)
    described, notes = studies.cut_on(built, cut)
    result = studies.map_chatter(built, positions, described, speeds=speeds, feed_angles=feed_directions,
                                 method=cutting.stability.method_named(method, "`method`"), folder=folder,
                                 engine=studies.choose_engine(workers), progress=run.progress("poses", folder))
    notes += [*result.notes, *run.warnings]
    run.save(pages.chatter_map_page, result, built, notes)
    run.show(result, notes)


@command(steps=3, replace=True)
def calibrate(run: Frame, forces: Files, tool: ToolValues, *,
              speed: Annotated[float, Help("Spindle speed, rev/min, constant.")], depth: Depth,
              feed: Annotated[Numbers | None, Help("Feed per tooth of each file, mm; left out where the files have a column "
                                                   "'feed'.", metavar="MM[,MM...]")] = None,
              force_on: Annotated[Literal["tool", "work"], Help("Whether the forces act on the tool or (the opposite, a table "
                                                                "dynamometer) on the work.")] = "tool",
              angle: Annotated[float | None, Help("Angle of tooth 0 at the first sample, degrees clockwise from y, the same in "
                                                  "all files (a trigger); found for each record where left out.")] = None,
              no_runout: Annotated[bool, Help("Do not fit run-out.")] = False,
              section: Annotated[NewFile | None, Help("Write the 'cutting' section for a machine file.",
                                                      name="--yaml")] = None) -> None:
    """Cutting coefficients and run-out from measured forces, with 95 % intervals.

    FORCES are time histories, columns time, Fx, Fy and Fz (N): text, MATLAB, universal files or a saved Record; x is the
    feed, y normal to it (clockwise from y to x), z along the spindle, away from the work. One file for each feed per tooth.
    """
    run.step("forces")
    records = [(str(path), io.read_record(path)) for path in forces]
    run.step("fit")
    result = studies.calibrate(records, studies.CuttingTest(
        tool, speed, 1e-3 * depth, None if feed is None else tuple(1e-3 * f for f in feed), force_on, angle, not no_runout))
    run.step("page")
    run.save(pages.calibration_page, result, run.warnings)
    if section is not None:
        io.write_cutting(result.description, section)
    run.warnings += result.doubts
    run.show(result, written={"Section 'cutting'": section})
