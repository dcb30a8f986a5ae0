"""The command about NC programs: machining."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from toolpoint import io, pages, studies
from toolpoint._check import ToolpointError
from toolpoint.app.cut_options import CutValues
from toolpoint.app.declare import Argument, Help, Reading, command
from toolpoint.app.dynamics import Dynamics
from toolpoint.app.frame import Frame
from toolpoint.app.options import Folder, Naming
from toolpoint.app.values import AxisPositions, NewFile, SourceFile
from toolpoint.io.quantities.written import read_curve, read_numbered_file, read_numbered_length, read_stock
from toolpoint.project.limits.line_draws import read_tip_file, read_work_file

if TYPE_CHECKING:
    from toolpoint.machine import Machine
    from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
    from toolpoint.studies.machining.result import MachiningStudy
    from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
    from toolpoint.studies.machining.thin_walls.measured_work import MeasuredWork
    from toolpoint.studies.machining.tilted_stages import StagedStudy

StockText = Annotated[tuple[str, tuple[float, ...]], Reading(
    read_stock, "box=X1,Y1,Z1,X2,Y2,Z2 or cylinder=DIAMETER,BOTTOM,TOP[,X,Y] in mm, or an STL or STEP file")]
NumberedLength = Annotated[tuple[int, float], Reading(read_numbered_length, "NUMBER=MM, for example 3=45")]
NumberedTool = Annotated[tuple[int, Path], Reading(read_numbered_file, "NUMBER=FILE, for example 3=ball.yaml")]


@dataclass(frozen=True)
class ProgramDynamics:
    """Dynamics that a program meets: a machine, posed along it, or the measured tip of one pose."""

    machine: Annotated[SourceFile | None, Help("Machine file: it is posed along the program, and its cut is the tool.")] = None
    frf: Annotated[tuple[SourceFile, ...], Help("Measured tool-tip FRFs instead, the same all along the program.")] = ()
    frf_x: Annotated[SourceFile | None, Help("Measured FRF along x; with --frf-y.")] = None
    frf_y: Annotated[SourceFile | None, Help("Measured FRF along y.", needs="--frf-x")] = None
    modes: Annotated[SourceFile | None, Help("Modes of the tip instead (HDF5, universal).")] = None
    zero: Annotated[AxisPositions | None, Help("Axis positions of the machine at the program's zero.", metavar="X=0.1,Y=200mm",
                                               needs="--machine")] = None

    def read(self) -> Machine | ToolDynamics | None:
        """Read the machine or the tip; nothing where neither is given."""
        if self.machine is not None:
            if self.frf or self.frf_x or self.modes:
                raise ToolpointError("dynamics: a machine and a measured tip given; must be one of them")
            return io.read_machine_at(self.machine, self.zero)
        if not (self.frf or self.frf_x or self.modes):
            return None
        return Dynamics(Naming(), frf=self.frf, frf_x=self.frf_x, frf_y=self.frf_y, modes=self.modes).read()

    def machine_of(self, source: Machine | ToolDynamics | None) -> Machine | None:
        """Return the machine among what was read."""
        return None if self.machine is None else cast("Machine", source)


@dataclass(frozen=True)
class TipsOfTools:
    """Responses of tools that are not the tool of the machine or the tap."""

    tip: Annotated[tuple[NumberedTool, ...], Help("Response of the tip of a tool's number, measured or coupled (FRFs, modes); "
                                                  "several times.", metavar="NUMBER=FILE")] = ()
    shaft: Annotated[tuple[NumberedTool, ...], Help("Shaft file of a tool's number: it stands on the machine at every pose; "
                                                    "several times.", metavar="NUMBER=FILE", needs="--at")] = ()
    point: Annotated[str, Help("Point of the machine where these shafts begin.", name="--at", metavar="POINT",
                               needs="--machine")] = ""

    def read(self) -> studies.ToolTips:
        """Read the tips; raises ToolpointError as `studies.ToolTips` does."""
        shafts = {number: io.read_shaft(path) for number, path in self.shaft}
        struck = {number: read_tip_file(path) for number, path in self.tip}
        return studies.ToolTips(struck, shafts, self.point)


@dataclass(frozen=True)
class YieldingWork:
    """Work that gives way while its material goes: a clamped part by finite elements, or responses measured at stages."""

    work: Annotated[SourceFile | None, Help("Machine file of the clamped part in the program's coordinates, its one body by "
                                            "finite elements (elastic or solid): its response changes as material goes.",
                                            needs="--held")] = None
    held: Annotated[tuple[str, ...], Help("Interface of that body whose face is clamped; several times.", metavar="NAME",
                                          needs="--work")] = ()
    work_damping: Annotated[float, Help("Damping ratio of the clamped part; that of its material where left out.", minimum=0,
                                        maximum=0.5, needs="--work")] = 0.0
    stage_change: Annotated[float | None, Help("Change of a frequency at which the part is solved anew, %; 5 where left out.",
                                               scale=0.01, minimum=0.2, maximum=50, needs="--work")] = None
    work_response: Annotated[tuple[NumberedTool, ...], Help(
        "Response of the work, measured, from a line of the program on (FRFs, modes); several times.",
        metavar="LINE=FILE")] = ()

    def read(self) -> ClampedPart | MeasuredWork | None:
        """Read the work; nothing where it is rigid. Raises ToolpointError for both kinds at once."""
        if self.work_response and self.work is not None:
            raise ToolpointError("--work-response: given beside --work; must be one of them")
        if self.work_response:
            return studies.MeasuredWork({line: read_work_file(path) for line, path in self.work_response})
        if self.work is None:
            return None
        options = {} if self.stage_change is None else {"stage_change": self.stage_change}
        description = io.read_description(self.work)
        return studies.describe_part(description, self.held, damping_ratio=self.work_damping, **options)


@dataclass(frozen=True)
class ToolAbove:
    """Bodies above the edges, and limits of spindle and tool."""

    stick_out: Annotated[float, Help("From the tip to the holder, mm; bending is taken there.", scale=1e-3, minimum=0)] = 0.0
    stick_outs: Annotated[tuple[NumberedLength, ...], Help("Stick-out of a tool's number, in place of --stick-out; several "
                                                           "times.", name="--stick-out-of", metavar="NUMBER=MM")] = ()
    holder: Annotated[float, Help("Diameter of the holder, mm: it must not meet the work.", scale=1e-3, minimum=0)] = 0.0
    taper: Annotated[float, Help("Half angle of a tapered mill, degrees.", scale=0.017453292519943295, minimum=0)] = 0.0
    spindle_power: Annotated[float, Help("Power of the spindle, kW.", scale=1e3, above=0)] = float("inf")
    spindle_torque: Annotated[float, Help("Torque of the spindle, N m.", above=0)] = float("inf")
    spindle_curve: Annotated[tuple[tuple[float, float], ...], Reading(read_curve, "RPM:NM,..., for example 1500:60,12000:8"),
                             Help("Torque of the spindle over its speed.", metavar="RPM:NM,...")] = ()
    spindle_speed: Annotated[float, Help("Highest spindle speed, rev/min.", above=0)] = float("inf")
    rotary_speed: Annotated[float, Help("Highest speed of rotary axes, °/s: five-axis feeds keep it.", above=0,
                                        scale=0.017453292519943295)] = float("inf")
    rotary_acceleration: Annotated[float, Help("Highest acceleration of rotary axes, °/s².", above=0,
                                               scale=0.017453292519943295)] = float("inf")
    bending: Annotated[float, Help("Bending moment that the tool bears at the holder, N m.", above=0)] = float("inf")


@dataclass(frozen=True)
class MachineRecord:
    """Record of the machine beside the program."""

    record: Annotated[SourceFile | None, Help("Record of the spindle's power, torque or current while the program ran: a table "
                                              "with time, or a controller's trace.")] = None
    signal: Annotated[str, Help("Its signal, by name, where it holds several.", needs="--record")] = ""
    efficiency: Annotated[float, Help("Power at the tool over the recorded one, above the idle load.", needs="--record",
                                      above=0, maximum=1)] = 1.0

    def read(self) -> Any:
        """Read the record; nothing where none is given."""
        return None if self.record is None else io.read_servo_data(self.record)

    def compare(self, result: MachiningStudy, record: Any) -> MachiningStudy:
        """Return the result with the record beside it, as it is without one."""
        if record is None:
            return result
        signal = studies.spindle_signal(record, self.signal)
        return studies.compare_record(result, signal.time, signal.values, unit=signal.unit, name=signal.name,
                                      efficiency=self.efficiency)

    def compare_stages(self, result: StagedStudy, record: Any) -> StagedStudy:
        """Return the stages with the record beside them, as they are without one."""
        if record is None:
            return result
        signal = studies.spindle_signal(record, self.signal)
        return studies.compare_stages(result, signal.time, signal.values, unit=signal.unit, name=signal.name,
                                      efficiency=self.efficiency)


@command(steps=3, replace=True)
def machining(run: Frame, program: Annotated[SourceFile, Argument()], dynamics: ProgramDynamics, *,
              stock: Annotated[StockText, Help("Stock in the program's coordinates, mm.", metavar="box=...|cylinder=...|FILE")],
              tool: Annotated[tuple[NumberedTool, ...], Help(
                  "Tool of a number T: a file with a section 'cutting'; several times.", metavar="NUMBER=FILE")] = (),
              part: Annotated[SourceFile | None, Help("Part (STL in mm, or STEP) that must not be cut into.")] = None,
              speed: Annotated[float, Help("Spindle speed where the program holds no S, rev/min.", minimum=0)] = 0.0,
              first_feed: Annotated[float | None, Help("Feed of cuts before the program's first F.", metavar="MM/MIN", above=0,
                                                       scale=1 / 60e3)] = None,
              wear_only: Annotated[bool, Help("G41 and G42 (RL, RR) correct wear alone: the program holds the path of the "
                                              "tool's centre.", name="--wear-only")] = False,
              tip_programmed: Annotated[bool, Help("X, Y and Z are the tip's from the first line on, where A, B and C turn the "
                                                   "tool (kinematics of LinuxCNC that hold the tip).",
                                                   name="--tip-programmed")] = False,
              drives: Annotated[SourceFile | None, Help("Drive file: feeds are the planner's, and the servo follows under the "
                                                      "cutting forces.")] = None,
              spacing: Annotated[float, Help("Of the dexels, mm; a twentieth of the smallest radius where left out.",
                                             scale=1e-3, minimum=0)] = 0.0,
              with_advice: Annotated[bool, Help("Also a spindle speed for each tool, and feeds within the limits.",
                                                name="--advice")] = False,
              faster: Annotated[bool, Help("Advice looks for a faster speed where the programmed one holds, too; implies "
                                           "--advice.")] = False,
              lobes: Annotated[int, Help("Of how many engagements, those nearest to their limit, the page shows lobes.",
                                         minimum=0, maximum=200)] = 8,
              write: Annotated[NewFile | None, Help("Write the program with the advised S and F, old values in comments, here; "
                                                    "implies --advice.")] = None,
              folder: Folder = None, tips: TipsOfTools, work: YieldingWork, above: ToolAbove,
              recorded: MachineRecord, cut: CutValues) -> None:
    """Load, stability and contacts of every block of an NC program, on a machine or a measured tool tip.

    PROGRAM is G-code (ISO, Siemens) or Klartext of three axes, of tilted planes (G68.2, CYCLE800, PLANE SPATIAL), or of five
    axes with tool centre control (G43.4, G43.5, TRAORI, M128, TCPM). The tool and its coefficients are those of the machine
    file or the options below; the arcs of cut come from the stock.
    """
    source, record, tips_of_tools, yielding = dynamics.read(), recorded.read(), tips.read(), work.read()
    described = studies.cuts_of_options(dynamics.machine_of(source), cut)
    cuts = {number: io.read_tool(path) for number, path in tool}
    part_faces = None if part is None else io.read_surface(part)
    stock_faces = None if stock[1] else io.read_surface(Path(stock[0]))
    servo = None if drives is None else io.read_drives(drives)
    material = studies.stock_of(*stock, stock_faces)
    parsed = io.read_program(program, start=(0.0, 0.0, float(material.upper[2]) + 0.1), feed=first_feed,
                             cutter_radius=io.CutterRadii.of_cuts(described, cuts, wear_only=wear_only),
                             tip_programmed=tip_programmed)
    text = program.read_text(encoding="utf-8-sig", errors="replace")
    limits = studies.CuttingLimits(above.spindle_power, above.spindle_torque, above.bending, above.spindle_speed,
                                   above.spindle_curve)
    setup = studies.describe_machining(
        material, described, cuts=cuts, taper=above.taper, stick_out=above.stick_out,
        stick_outs=dict(above.stick_outs), holder_diameter=above.holder,
        zero=dynamics.zero or {}, speed=speed, spacing=spacing, limits=limits, part=part_faces,
        drives=servo, rotary_speed=above.rotary_speed, rotary_acceleration=above.rotary_acceleration,
        raises_speed=faster)
    # What is written are the advised words: without the advice there would be none.
    with_advice = with_advice or faster or write is not None
    if parsed.is_tilted:
        staged = studies.run_stages(parsed, setup, source, name=program.name, text=text, lobes=lobes, folder=folder,
                                    tips=tips_of_tools, work=yielding,
                                    with_advice=with_advice, progress=run.progress_of_parts())
        staged = recorded.compare_stages(staged, record)
        if write is not None:
            run.write("Program", write, lambda path: io.write_program(text, io.SpeedAndFeed(*staged.advised_words), path,
                                                                      original=program))
        run.present(pages.stages_page, staged, run.warnings, notes=[*staged.doubts, *staged.notes])
        return
    run_all = studies.run_five_axes if parsed.is_five_axis else studies.run_program
    result = run_all(parsed, setup, source, name=program.name, text=text, with_advice=with_advice, lobes=lobes,
                     folder=folder, tips=tips_of_tools, work=yielding, progress=run.progress_of_parts())
    result = recorded.compare(result, record)
    if result.advice is not None:
        run.write("Program", write, lambda path: io.write_program(text, io.SpeedAndFeed(*result.advised_words), path,
                                                                  original=program))
    run.present(pages.machining_page, result, run.warnings, notes=[*result.doubts, *result.notes])
