"""Content of a project file as plain frozen data: tests, machine, cuts, goals, changes; every part may be missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:  # as in the description of a machine
    from toolpoint.cutting.description import CuttingDescription

STRUCTURE, TIP_X, TIP_Y = "structure", "tip x", "tip y"
ASSUMED_COEFFICIENT_DEVIATION = 0.1  # relative standard deviation of cutting coefficients where none is given


@dataclass(frozen=True)
class ProjectTest:
    """Hammer test of a project: one of a test file, records, responses or modes; where and when it was made.

    test, records, responses, modes : files relative to the project; records and responses may be patterns (``tip_*.csv``).
    channels : as for `toolpoint frf --channel`; struck, pattern : where the names or the channels do not say it.
    of : ``structure`` (joints or an update come from it), ``tip x`` or ``tip y`` (limits come from it directly).
    date : ISO, empty where not known; pose : m or rad; sensor_mass : kg, of a sensor that was moved; band : Hz.
    """

    test: str | None = None
    records: tuple[str, ...] = ()
    responses: tuple[str, ...] = ()
    modes: str | None = None
    channels: tuple[str, ...] = ()
    struck: str | None = None
    pattern: str | None = None
    of: Literal["structure", "tip x", "tip y"] = "structure"
    date: str = ""
    pose: Mapping[str, float] = field(default_factory=dict)
    sensor_mass: float | None = None
    band: tuple[float, float] | None = None


@dataclass(frozen=True)
class ProjectCut:
    """Cut of a project: tool, engagement and material, and how well its coefficients are known (relative standard deviation;
    None where nothing is said)."""

    cut: CuttingDescription
    coefficient_deviation: float | None = None


@dataclass(frozen=True)
class ProjectGoal:
    """Goal of a project: a cut at a speed (rev/min) and depth (m) at a pose; stick_out : m, of the project's coupled tool, None
    for the tool of the machine or the tap."""

    speed: float
    depth: float
    cut: str = ""
    pose: Mapping[str, float] = field(default_factory=dict)
    stick_out: float | None = None


@dataclass(frozen=True)
class ProjectChange:
    """Change that may be made: all springs of a joint, by a share of them; and its cost."""

    joint: str
    stiffness: float
    cost: float = 1.0


@dataclass(frozen=True)
class ContourGoal:
    """Circle that the servo must follow: radius (m), feed (m/s), largest radial deviation (m), its two axes, and the pose of
    the machine (m or rad)."""

    radius: float
    feed: float
    deviation: float
    axes: tuple[str, str] = ("X", "Y")
    pose: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SpindleLimits:
    """Limits of a spindle and its tool: power (W), torque (N m), speed (rev/min), bending moment at the holder (N m);
    infinite where not given. curve : pairs of rev/min and torque (N m), in rising speed."""

    power: float = float("inf")
    torque: float = float("inf")
    speed: float = float("inf")
    bending: float = float("inf")
    curve: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class ProgramWork:
    """Work of a program that gives way: a machine file whose one body by finite elements is clamped at its interfaces `held`,
    in the program's coordinates; or responses measured from a line of the program on.

    damping_ratio : of the clamped part, 0 for that of its material; stage_change : of a frequency, at which it is solved anew.
    """

    part: str | None = None
    held: tuple[str, ...] = ()
    damping_ratio: float = 0.0
    stage_change: float = 0.05
    responses: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ProjectProgram:
    """NC program of a project, over its stock, on the machine of the project.

    program : file; stock : ``box=X1,Y1,Z1,X2,Y2,Z2`` or ``cylinder=DIAMETER,BOTTOM,TOP[,X,Y]`` in mm, as for
    `toolpoint machining`, or an STL file; cut : name of the project's cut whose tool and material it is, empty for the cut of
    the machine file; tools : files of further tools by number; coefficient_deviation : of these, relative; tips : files of
    their own responses, shafts : their shaft files, which stand on the machine where the coupled tool begins, by number.
    zero : axis positions at the program's zero, m or rad; speed : rev/min, where the program holds no S; first_feed : m/s,
    before its first F; stick_out, holder : m, 0 where not known; stick_outs : of tools by number, m; wear_only : whether radius
    compensation corrects wear alone, as the program holds the path of the tool's centre; spacing : of the dexels, m, 0 for that
    of the smallest tool. servo : whether the project's servo follows the program; part : STL file that must not be cut into.
    work : None where it is rigid; rotary_speed, rotary_acceleration : limits of the rotary axes of five-axis programs, rad/s
    and rad/s^2. record : of the spindle's power, torque or current; signal : its name there; efficiency : power at the tool
    over that of the record.
    """

    program: str
    stock: str
    cut: str = ""
    tools: Mapping[int, str] = field(default_factory=dict)
    tips: Mapping[int, str] = field(default_factory=dict)
    shafts: Mapping[int, str] = field(default_factory=dict)
    coefficient_deviation: float | None = None
    zero: Mapping[str, float] = field(default_factory=dict)
    speed: float = 0.0
    first_feed: float | None = None
    stick_out: float = 0.0
    stick_outs: Mapping[int, float] = field(default_factory=dict)
    holder: float = 0.0
    wear_only: bool = False
    spacing: float = 0.0
    servo: bool = True
    part: str | None = None
    record: str | None = None
    signal: str = ""
    efficiency: float = 1.0
    spindle: SpindleLimits = SpindleLimits()
    rotary_speed: float = float("inf")
    rotary_acceleration: float = float("inf")
    work: ProgramWork | None = None


@dataclass(frozen=True)
class CoupledTool:
    """Tool of a project by its shaft file, coupled to the spindle: then its stick-out can be changed.

    tool : shaft file, from the spindle to the tip; segment : whose length is the stick-out, the first where empty.
    gauge, responses : shaft file of the gauge that was struck in the spindle, and its responses; noise : their standard
    deviation, a share, where the files state none. point : of the machine, where the tool begins, in place of a gauge.
    """

    tool: str
    segment: str = ""
    gauge: str | None = None
    responses: tuple[str, ...] = ()
    noise: float | None = None
    point: str | None = None


@dataclass(frozen=True)
class ProjectDescription:
    """Content of a project file; paths are relative to the project, poses in m and rad.

    workspace : poses that limits are wanted at besides those of the goals; draws, seed : of the limits.
    """

    name: str
    tests: Mapping[str, ProjectTest] = field(default_factory=dict)
    machine: str | None = None
    components: str | None = None
    geometry: str | None = None
    servo: str | None = None
    cuts: Mapping[str, ProjectCut] = field(default_factory=dict)
    goals: Mapping[str, ProjectGoal] = field(default_factory=dict)
    contours: Mapping[str, ContourGoal] = field(default_factory=dict)
    changes: Mapping[str, ProjectChange] = field(default_factory=dict)
    workspace: tuple[Mapping[str, float], ...] = ()
    draws: int = 60
    seed: int = 1
    programs: Mapping[str, ProjectProgram] = field(default_factory=dict)
    coupling: CoupledTool | None = None


@dataclass(frozen=True)
class TriedCut:
    """Cut that was tried: speed (rev/min), depth (m), whether it was stable, its chatter frequency (Hz) where it was heard.

    >>> TriedCut(8000.0, 3e-3, stable=False, frequency=612.0).pose  # at the reference pose
    {}
    """

    speed: float
    depth: float
    stable: bool
    frequency: float | None = None
    cut: str = ""
    pose: Mapping[str, float] = field(default_factory=dict)
