"""Commands about cuts: lobes, turn, mill, map-chatter, speeds, calibrate; and rcsa, for tools that are joined on paper."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from toolpoint import cutting, io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint.app.cut_options import CutValues, ToolValues
from toolpoint.app.declare import Argument, Help, Printed, Reading, command
from toolpoint.app.dynamics import Dynamics, read_responses
from toolpoint.app.frame import Frame
from toolpoint.app.options import Axes, Depth, Files, Folder, MachineFile, Pose, Quantity, Speed, Speeds, Workers
from toolpoint.app.values import Angles, Direction, LengthRange, Lines, NewFile, Numbers, SourceFile, SpindleSpeeds
from toolpoint.cutting.description import PARAMETERS, check_cut
from toolpoint.io.quantities.written import read_shares, read_tried_cut
from toolpoint.project.limits.line_draws import read_work_file

if TYPE_CHECKING:
    from toolpoint.substructuring import PlaneReceptance, SpindleReceptance

# Usual speeds of milling spindles: the tool alone, without a machine file, says nothing of its range.
DEFAULT_CHART_SPEEDS = np.linspace(3000, 20000, 60)  # rev/min
# Shares in percent, as a person types them; `Uncertainty` takes fractions.
Spreads = Annotated[dict[str, Any], Reading(
    lambda text: read_shares(text, ("frequency", "damping", "stiffness", "coefficients")),
    "four numbers in percent, none below zero, for example 1,10,5,10; - keeps one")]
TriedCut = Annotated[tuple[float, float, bool | Path], Reading(
    read_tried_cut, "SPEED:DEPTH:OUTCOME, rev/min, mm and stable, chatter or a recording, for example 12000:1.5:chatter or "
                    "12000:1.5:cut.wav")]
Method = Annotated[str, Help("auto (chosen to suit the cut), floquet, panel, hill, zero-order, multi-frequency, "
                             "semi-discretization or collocation.")]


@command(printed=Printed("--materials", "List the literature table of cutting coefficients and end.",
                         lambda: studies.materials_table()))
def lobes(run: Frame, source: Dynamics, cut: CutValues, *, speeds: Speeds = None, method: Method = "auto",
          simulate: Annotated[bool, Help("Also simulate cuts on a grid; a click on one shows its vibration.")] = False,
          samples: Annotated[int | None, Help("Also P(stable) from that many charts with uncertain parameters.",
                                              name="--probability", metavar="SAMPLES", minimum=2)] = None,
          uncertainty: Annotated[Spreads | None, Help(
              "Standard deviations of frequencies, damping ratios, stiffnesses and cutting coefficients, percent; - for "
              "measured, or 1, 10, 5, 10.", metavar="F,Z,K,C", needs="--probability, for example --probability 200")] = None,
          tried: Annotated[tuple[TriedCut, ...], Help("A cut already made: rev/min, mm, and stable, chatter, or a recording "
                                                      "that is listened to (with --teeth); sharpens P(stable).",
                                                      metavar="SPEED:DEPTH:OUTCOME",
                                                      needs="--probability, for example --probability 200")] = (),
          fields: Annotated[bool, Help("Other immersions and numbers of teeth for the fields of the page, also where many "
                                       "modes make them take long.")] = False) -> None:
    """Stability lobes of a milling cut, from a machine file, from measured FRFs, or from saved modes."""
    progress, dynamics = run.progress_of_parts(), source.read()
    # Recordings are judged before the chart is computed: one that cannot be read must not cost the minutes of it.
    recordings = [(speed, depth, io.read_listened(outcome)) for speed, depth, outcome in tried if isinstance(outcome, Path)]
    decided = [(speed, depth, outcome) for speed, depth, outcome in tried if isinstance(outcome, bool)]
    judged, notes = studies.hear_tried(recordings, cut.get("teeth")) if recordings else ([], [])
    parameters = studies.Uncertainty(samples or 0, cuts=(*decided, *judged), **(uncertainty or {}))
    result = studies.chart_lobes(dynamics, cut, method=cutting.stability.method_named(method, "`method`"), speeds=speeds,
                                 simulate_cuts=simulate, uncertainty=parameters, progress=progress,
                                 other_cuts=True if fields else None if run.output else False)
    result = result.noted([*notes, *run.warnings])
    run.present(pages.lobes_page, result, run.warnings, notes=result.chart.notes, has_answer=False)


@command()
def turn(run: Frame, source: Dynamics, *,
         kf: Annotated[float | None, Help("Cutting coefficient along the thickness of the chip, N/mm^2; or --material.",
                                          above=0, scale=1e6)] = None,
         material: Annotated[str | None, Help("Coefficients of the literature table (K_n as K_f, and K_t); --kf and --kt take "
                                              "their place.", metavar="NAME[:SET]")] = None,
         direction: Annotated[Direction | None, Help("Direction in which the chip is thick, from the work into the tool: an "
                                                     "axis, an angle from x towards y, or a vector; x where left out.",
                                                     metavar="x|y|z|30deg|1,0,0.5")] = None,
         kt: Annotated[float | None, Help("Coefficient along the cutting speed, N/mm^2; it matters where the structure bends "
                                          "from one direction into the other.", scale=1e6)] = None,
         cutting_direction: Annotated[Direction | None, Help("Way of the work past the edge, for --kt; y where left out.",
                                                             metavar="x|y|z|...")] = None,
         speeds: Annotated[SpindleSpeeds | None, Help("Spindle speeds, rev/min.", metavar="300:6000:400")] = None,
         process_damping: Annotated[float, Help("Process damping, N/m; with --diameter or --cutting-speed.")] = 0.0,
         diameter: Annotated[float | None, Help("Diameter of the work, mm: the cutting speed grows with the spindle "
                                                "speed.", scale=1e-3)] = None,
         cutting_speed: Annotated[float | None, Help(
             "Cutting speed held at every spindle speed, m/min.", scale=1 / 60,
             excludes="--diameter, with which it grows with the spindle speed")] = None) -> None:
    """Stability lobes of a turning cut: stable widths over spindle speed, and the width that is stable at every speed."""
    cut = studies.describe_turning(kf, kt, material=material, normal=direction, velocity=cutting_direction,
                                   process_damping=process_damping, cutting_speed=cutting_speed, diameter=diameter)
    dynamics = source.read()
    result = studies.chart_turning(dynamics, cut, speeds).noted(run.warnings)
    run.present(pages.turning_page, result, notes=result.chart.notes, has_answer=False)


@command(page=False)
def speeds(run: Frame, *, chatter: Annotated[float, Help("Chatter frequency, Hz, from a microphone or a spectrum.")],
           teeth: Annotated[int, Help("Number of teeth.")], highest: Annotated[float, Help("Highest spindle speed, rev/min.")],
           lowest: Annotated[float, Help("Lowest spindle speed, rev/min.")] = 0.0) -> None:
    """Spindle speeds to try against chatter of a known frequency, with nothing else known."""
    result = studies.propose_speeds(chatter, teeth, highest=highest, lowest=lowest)
    run.show(result, result.notes)


@command(steps=3)
def mill(run: Frame, source: Dynamics, cut: CutValues, *, speed: Speed, depth: Depth, revolutions: Annotated[int | None, Help(
        "As many as the start-up needs to die out where left out.", minimum=1)] = None) -> None:
    """Simulate a milling cut in time: forces, vibration, spectra, whether it chatters."""
    # Before any file is read: a cut beyond the tool's edge needs no dynamics to be refused.
    check_cut(cut, speed, depth)
    dynamics = source.read()
    result = studies.simulate_cut(dynamics, cut, speed=speed, depth=depth, revolutions=revolutions, step=run.step)
    run.present(pages.simulation_page, result, run.warnings, notes=[*result.notes, *run.warnings])


@command()
def map_chatter(run: Frame, machine: MachineFile, axes: Axes, *, feed_directions: Annotated[Angles | None, Help(
        "Angles of the feed from x towards y, degrees; that of the cut where left out.", metavar="0,45,90|0:135:4")] = None,
                cut: CutValues, speeds: Annotated[SpindleSpeeds | None, Help(
                    "Spindle speeds, rev/min; 60 over the range of the cut where left out.", metavar="3000:20000:60")] = None,
                work: Annotated[SourceFile | None, Help("Work that gives way too, along the tool's x and y: its modes (HDF5, "
                                                        "universal), or a machine file whose tool is the place cut.")] = None,
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
                                 work=None if work is None else read_work_file(work),
                                 engine=studies.choose_engine(workers), progress=run.progress("poses", folder))
    notes += [*result.notes, *run.warnings]
    run.present(pages.chatter_map_page, result, built, notes, notes=notes)


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
              law: Annotated[Literal["linear-edge", "total-energy"], Help(
                  "Force law of the section that is written: coefficients of chip and edge, or energy per volume that falls "
                  "with the chip, and two force ratios.")] = "linear-edge",
              section: Annotated[NewFile | None, Help("Write the 'cutting' section for a machine file.",
                                                      name="--yaml")] = None) -> None:
    """Cutting coefficients and run-out from measured forces, with 95 % intervals.

    FORCES are time histories, columns time, Fx, Fy and Fz (N): text, MATLAB, universal files or a saved Record; x is the
    feed, y normal to it (clockwise from y to x), z along the spindle, away from the work. One file for each feed per tooth.
    """
    records = [(str(path), io.read_record(path)) for path in forces]
    run.step("fit")
    result = studies.calibrate(records, studies.CuttingTest(
        tool, speed, depth, None if feed is None else tuple(1e-3 * f for f in feed), force_on, angle, not no_runout, law))
    run.write("Section 'cutting'", section, io.write_cutting, result.description)
    run.warnings += result.doubts
    run.present(pages.calibration_page, result, run.warnings)


@dataclass(frozen=True)
class Spindle:
    """Source of the spindle: a gauge that was struck in it, responses with rotations, or a machine file."""

    frf: Annotated[tuple[SourceFile, ...], Help("Measured responses: of a gauge's stations (with --gauge), or of the spindle "
                                                "with its rotations (with --at).")] = ()
    gauge: Annotated[SourceFile | None, Help("Shaft file of the gauge that was in the spindle, with its stations.")] = None
    machine: Annotated[SourceFile | None, Help("Machine file: the spindle is computed, at the point --at.")] = None
    point: Annotated[str | None, Help("Point where the tool begins.", name="--at", metavar="POINT")] = None
    pose: Pose = None
    lines: Annotated[Lines | None, Help("Lines (Hz) of a computed spindle; 20:6000:5981 where left out.",
                                        metavar="LOW:HIGH:NUMBER")] = None
    noise: Annotated[float | None, Help("Standard deviation of measured responses, percent of each, where the files state "
                                        "none.", metavar="PERCENT", scale=1e-2)] = None
    calibration: Annotated[float, Help("Standard deviation of the gain of hammer and sensor together, percent, alike for "
                                       "all responses of a gauge.", metavar="PERCENT", minimum=0, scale=1e-2)] = 1.0

    def __post_init__(self) -> None:
        """Refuse a spindle from no source, and one from several."""
        if bool(self.frf) == (self.machine is not None):
            raise ToolpointError("spindle: neither or both of --frf and --machine given; give --frf FILES --gauge GAUGE.yaml, "
                                 "--frf FILES --at POINT, or --machine FILE --at POINT")
        if (self.gauge is None) == (self.point is None):
            raise ToolpointError("--gauge, --at: one of them must be there: a gauge whose stations were struck, or the point "
                                 "where rotations are known")
        if self.machine is not None and self.point is None:
            raise ToolpointError("--at: missing; a computed spindle needs the point where the tool begins")

    def read(self, quantity: str | None, draws: int, generator: np.random.Generator
             ) -> list[PlaneReceptance] | SpindleReceptance:
        """Return the spindle's receptances, the likeliest and the draws."""
        if self.machine is not None and self.point is not None:
            built = io.read_machine_at(self.machine, self.pose)
            return studies.bases_of_machine(built, self.point, self.lines, pose=self.pose)
        measured = read_responses(self.frf, quantity)
        if self.gauge is None:
            assert self.point is not None
            return studies.bases_of_responses(measured, self.point, draws=draws, generator=generator)
        gauge = io.read_shaft(self.gauge)
        return studies.bases_from_gauge(measured, gauge, draws=draws, generator=generator, noise=self.noise,
                                        calibration=self.calibration)


@command(replace=True)
def rcsa(run: Frame, tool: Annotated[SourceFile, Argument()], spindle: Spindle, *,
         stick_out: Annotated[LengthRange | None, Help("Also at other lengths of a segment: first, last, number.",
                                                       metavar="SEGMENT=30mm:80mm:6")] = None,
         lobes: Annotated[bool, Help("Also stability lobes; the cut is given by the options below.")] = False,
         speeds: Speeds = None, draws: Annotated[int, Help("Equally likely spindles and tools.", minimum=20)] = 200,
         seed: Annotated[int, Help("Of the random draws.")] = 1, quantity: Quantity = None, cut: CutValues,
         save: Annotated[NewFile | None, Help("Save the tool-point responses here: universal (.uff) or HDF5 (.h5) "
                                              "file.")] = None) -> None:
    """Receptance coupling: the tool-point response of a tool that was never measured, with its 95 % interval.

    TOOL is a shaft file: segments from the spindle to the tip. The spindle comes from a gauge that was struck in it, from
    responses with rotations, or from a machine file.
    """
    # A cut without --lobes would be read and thrown away in silence.
    if cut and not lobes:
        raise ToolpointError(f"--{PARAMETERS[next(iter(cut))].option} is of a cut: add --lobes")
    shaft, generator = io.read_shaft(tool), np.random.default_rng(seed)
    bases = spindle.read(quantity, draws, generator)
    result = studies.study_tool(bases, shaft, cut=cut if lobes else None,
                                stick_out=None if stick_out is None else (stick_out.name, stick_out.positions),
                                speeds=DEFAULT_CHART_SPEEDS if speeds is None else speeds, generator=generator,
                                progress=run.progress_of_parts())
    run.write("Responses", save, io.write_frf, result.frf)
    run.present(pages.tool_coupling_page, result, run.warnings, notes=result.notes)
