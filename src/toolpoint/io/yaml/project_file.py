"""Project files in YAML: tests, machine, cuts, goals, changes; and the file of cuts that were tried. All faults at once."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from toolpoint._check import ToolpointError, suggestion
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.quantities import units
from toolpoint.io.quantities.written import read_curve, read_stock
from toolpoint.io.yaml.cutting_schema import CuttingModel, cutting_of
from toolpoint.io.yaml.description_schema import file_schema
from toolpoint.io.yaml.document import FILE_VERSION, Document, Key, parse, validate
from toolpoint.io.yaml.part import Part
from toolpoint.io.yaml.program_part import DepthField, PoseField, ProgramPart, SpeedField, StatedScalar, check_work
from toolpoint.io.yaml.quantity_fields import Scalar, Vector
from toolpoint.machine.description.project_plan import (
    ContourGoal,
    CoupledTool,
    ProgramWork,
    ProjectChange,
    ProjectCut,
    ProjectDescription,
    ProjectGoal,
    ProjectProgram,
    ProjectTest,
    SpindleLimits,
    TriedCut,
)

CUT_SECTIONS = ("goals", "programs")  # keys whose parts name a cut
SOURCE_KEYS = ("test", "records", "responses", "modes")


class TestPart(Part):
    """A test: one source of data, where, when, of what."""

    test: str | None = None
    records: tuple[str, ...] = ()
    responses: tuple[str, ...] = ()
    modes: str | None = None
    channels: tuple[str, ...] = ()
    struck: str | None = None
    pattern: str | None = None
    of: Literal["structure", "tip x", "tip y"] = "structure"
    date: str = ""
    pose: PoseField = {}
    sensor_mass: Annotated[float, Scalar(units.MASS, gt=0)] | None = None
    band: Annotated[tuple[float, float], Vector(units.FREQUENCY, 2)] | None = None


class GoalPart(Part):
    """A goal: a cut at a speed and depth at a pose, both with their units."""

    speed: SpeedField
    depth: DepthField
    cut: str = ""
    pose: PoseField = {}
    stick_out: Annotated[float, StatedScalar(units.LENGTH, gt=0, le=1)] | None = None


class ContourPart(Part):
    """A circle for the servo, with the largest radial deviation."""

    radius: Annotated[float, StatedScalar(units.LENGTH, gt=0)]
    feed: Annotated[float, StatedScalar(units.FEED, gt=0)]
    deviation: Annotated[float, StatedScalar(units.LENGTH, gt=0)]
    axes: tuple[str, str] = ("X", "Y")
    pose: PoseField = {}


class ChangePart(Part):
    """A change: all springs of a joint by a share, and its cost."""

    joint: str
    stiffness: Annotated[float, Scalar(units.RATIO, gt=-1)]
    cost: Annotated[float, Field(ge=0)] = 1.0


class CouplingPart(Part):
    """A tool by its shaft file, coupled to a spindle that a gauge or the machine gives."""

    tool: str
    segment: str = ""
    gauge: str | None = None
    responses: tuple[str, ...] = ()
    noise: Annotated[float, Scalar(units.RATIO, gt=0, lt=1)] | None = None
    point: str | None = None


class ProjectFile(Part):
    """The keys of a project file; cuts are read by the model of cuts, their coefficient_deviation beside it."""

    toolpoint: int
    name: str
    tests: dict[str, TestPart] = {}
    machine: str | None = None
    components: str | None = None
    geometry: str | None = None
    servo: str | None = None
    cuts: dict[str, dict[str, Any]] = {}
    goals: dict[str, GoalPart] = {}
    contours: dict[str, ContourPart] = {}
    changes: dict[str, ChangePart] = {}
    workspace: tuple[PoseField, ...] = ()
    draws: Annotated[int, Field(ge=20, le=10_000)] = 60
    seed: Annotated[int, Field(ge=0)] = 1
    programs: dict[str, ProgramPart] = {}
    coupling: CouplingPart | None = None


class DeviationPart(Part):
    """Relative standard deviation of the coefficients of a cut."""

    coefficient_deviation: Annotated[float, Scalar(units.RATIO, gt=0, lt=1)] | None = None


class TriedPart(Part):
    """A cut that was tried."""

    speed: SpeedField
    depth: DepthField
    outcome: Literal["stable", "chatter"]
    frequency: Annotated[float, Scalar(units.FREQUENCY, gt=0)] | None = None
    cut: str = ""
    pose: PoseField = {}


class TriedFile(Part):
    """The keys of a file of tried cuts."""

    toolpoint: int
    tried: tuple[TriedPart, ...] = ()


@door("project file")
def read(path: str | Path) -> ProjectDescription:
    """Return the project of a YAML file, SI; raises FileFaults with every fault of the file.

    >>> import tempfile
    >>> from toolpoint.project import write_folder
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     read(write_folder(Path(folder, "mill"))).name
    'mill'
    """
    document = parse(Path(path))
    document.check_version(FILE_VERSION)
    # A section whose entries are all comments is none.
    document.data = {key: entry for key, entry in document.data.items() if entry is not None}
    part: ProjectFile | None = validate(ProjectFile, document.data, (), document=document)
    project = _project(part, document)
    if document.faults or project is None:
        raise FileFaults(str(path), document.text, document.faults)
    return project


def find_parts_without_cut(path: Path) -> list[str]:
    r"""Return the goals and programs of a project file, as ``SECTION.NAME``, that name no cut.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "project.yaml")
    ...     _ = file.write_text("toolpoint: 1\ngoals:\n  rough: {speed: 8000 rpm, depth: 3 mm}\n")
    ...     find_parts_without_cut(file)
    ['goals.rough']
    """
    data = parse(path).data
    return [f"{section}.{name}" for section in CUT_SECTIONS for name, entry in (data.get(section) or {}).items()
            if isinstance(entry, dict) and not entry.get("cut")]


@door("file of tried cuts")
def read_tried(path: str | Path) -> tuple[TriedCut, ...]:
    r"""Return the cuts of a YAML file that were tried, SI; raises FileFaults with every fault of the file.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "tried.yaml")
    ...     cut = "{speed: 8000 rpm, depth: 3 mm, outcome: chatter, frequency: 612 Hz}"
    ...     _ = file.write_text(f"toolpoint: 1\ntried: [{cut}]\n")
    ...     read_tried(file)[0].frequency
    612.0
    """
    document = parse(Path(path))
    document.check_version(FILE_VERSION)
    part: TriedFile | None = validate(TriedFile, document.data, (), document=document)
    if document.faults or part is None:
        raise FileFaults(str(path), document.text, document.faults)
    return tuple(TriedCut(cut.speed, cut.depth, cut.outcome == "stable", cut.frequency, cut.cut, cut.pose)
                 for cut in part.tried)


def line_of_tried(cut: TriedCut) -> str:
    """Return a tried cut as a line of its file.

    >>> from toolpoint.project import TriedCut
    >>> line_of_tried(TriedCut(8000.0, 3e-3, stable=True)).strip()
    '- {speed: 8000.0 rpm, depth: 3 mm, outcome: stable}'
    """
    parts = [f"speed: {cut.speed!r} rpm", f"depth: {cut.depth * 1e3:.12g} mm",
             f"outcome: {'stable' if cut.stable else 'chatter'}"]
    parts += [] if cut.frequency is None else [f"frequency: {cut.frequency!r} Hz"]
    parts += [f'cut: "{cut.cut}"'] if cut.cut else []
    parts += ["pose: {" + ", ".join(f"{name}: {value!r}" for name, value in cut.pose.items()) + "}"] if cut.pose else []
    return "  - {" + ", ".join(parts) + "}\n"


def _project(part: ProjectFile | None, document: Document) -> ProjectDescription | None:
    """Return the project, None with faults: those of cuts, tests and goals are looked for whatever else is wrong."""
    entries = {key: _mappings(document.data.get(key)) for key in ("cuts", "tests", "goals", "programs")}
    cuts = {name: cut for name, entry in entries["cuts"].items() if (cut := _cut(name, entry, document)) is not None}
    _check_tests(entries["tests"], document)
    for name, goal in entries["goals"].items():
        _check_cut_name(("goals", name, "cut"), str(goal.get("cut", "")), entries["cuts"], document)
        if goal.get("stick_out") is not None and not document.data.get("coupling"):
            document.fault(("goals", name, "stick_out"), "needs the section coupling: a shaft file of the tool, its spindle")
    for name, program in entries["programs"].items():
        _check_program(name, program, entries["cuts"], document)
    _check_coupling(document.data.get("coupling"), document)
    if document.faults or part is None:
        return None
    tests = {name: ProjectTest(**test.model_dump()) for name, test in part.tests.items()}
    goals = {name: ProjectGoal(goal.speed, goal.depth, goal.cut or next(iter(cuts)), goal.pose, goal.stick_out)
             for name, goal in part.goals.items()}
    return ProjectDescription(
        part.name, tests, part.machine, part.components, part.geometry, part.servo, cuts, goals,
        {name: ContourGoal(**goal.model_dump()) for name, goal in part.contours.items()},
        {name: ProjectChange(**change.model_dump()) for name, change in part.changes.items()}, part.workspace, part.draws,
        part.seed, {name: _program(program, cuts) for name, program in part.programs.items()},
        None if part.coupling is None else CoupledTool(**part.coupling.model_dump()))


def _program(part: ProgramPart, cuts: Mapping[str, ProjectCut]) -> ProjectProgram:
    """Return a program of the file; its cut is the only one of the project where none is named."""
    values = {**part.model_dump(exclude={"spindle", "work"}), "cut": part.cut or next(iter(cuts), "")}
    curve = read_curve(part.spindle.curve) if part.spindle.curve else ()
    values["work"] = None if part.work is None else ProgramWork(**part.work.model_dump())
    return ProjectProgram(**values, spindle=SpindleLimits(**{**part.spindle.model_dump(), "curve": curve}))


def _check_coupling(entry: Any, document: Document) -> None:
    """Add the fault of a coupled tool whose spindle nothing gives, or two things."""
    if not isinstance(entry, dict):
        return
    has_gauge, has_point = bool(entry.get("gauge") and entry.get("responses")), bool(entry.get("point"))
    if has_gauge == has_point:
        document.fault(("coupling",), "must have gauge and responses (a gauge that was struck in the spindle), or point (of "
                       "the machine, where the tool begins)")


def _check_program(name: str, entry: Mapping[str, Any], cuts: Mapping[str, Any], document: Document) -> None:
    """Add the faults of a program: a cut that is not described, a stock that cannot be read."""
    if cuts or entry.get("cut"):  # without any the tool is that of the machine file
        _check_cut_name(("programs", name, "cut"), str(entry.get("cut", "")), cuts, document)
    coupling = document.data.get("coupling")
    if entry.get("shafts") and not (isinstance(coupling, dict) and coupling.get("point")):
        document.fault(("programs", name, "shafts"), "need the section coupling with a point of the machine, where they begin; "
                       "on a struck gauge, couple them by toolpoint rcsa and name the responses under tips")
    check_work(name, entry.get("work"), document)
    stock, curve = str(entry.get("stock", "")), str((entry.get("spindle") or {}).get("curve", ""))
    try:
        read_curve(curve or "1:1")
    except (ToolpointError, ValueError):
        document.fault(("programs", name, "spindle", "curve"), f"{curve!r}; must be RPM:NM,..., for example 1500:60,12000:8")
    try:
        kind, lengths = read_stock(stock)
        counts = {"box": (6,), "cylinder": (3, 5)}.get(kind, (0,))
        if len(lengths) not in counts:
            raise ToolpointError(f"{stock!r}: {len(lengths)} lengths")
    except (ToolpointError, ValueError) as error:
        document.fault(("programs", name, "stock"), f"{error}; must be box=X1,Y1,Z1,X2,Y2,Z2 or "
                                                    "cylinder=DIAMETER,BOTTOM,TOP[,X,Y] in mm, or an STL file")


def _mappings(section: Any) -> dict[str, dict[str, Any]]:
    """Return the entries of a section that hold keys; the schema names the others."""
    return {name: entry for name, entry in section.items() if isinstance(entry, dict)} if isinstance(section, dict) else {}


def _cut(name: str, entry: Mapping[str, Any], document: Document) -> ProjectCut | None:
    """Return a cut of the file, its faults in the document."""
    deviation: Any = validate(DeviationPart, {key: value for key, value in entry.items() if key == "coefficient_deviation"},
                              ("cuts", name), document=document)
    values = {key: value for key, value in entry.items() if key != "coefficient_deviation"}
    part: Any = validate(CuttingModel, values, ("cuts", name), document=document)
    if part is None or deviation is None:
        return None
    earlier = list(document.faults)
    document.faults.clear()
    cut = cutting_of(part, document)
    # The reader of cuts names its faults as those of a machine file's section.
    placed = [(tuple(entry.path.split(".")[1:]), entry.message) for entry in document.faults]
    document.faults[:] = earlier
    for key, message in placed:
        document.fault(("cuts", name, *key), message)
    return None if placed else ProjectCut(cut, deviation.coefficient_deviation)


def _check_tests(tests: Mapping[str, Mapping[str, Any]], document: Document) -> None:
    """Add the faults of tests: no source of data or several, dates that are none or out of order."""
    last = ("", datetime.date.min)
    for name, test in tests.items():
        sources = [key for key in SOURCE_KEYS if test.get(key)]
        if len(sources) != 1:
            document.fault(("tests", name), f"{' and '.join(sources) or 'no data'}; must have one of {', '.join(SOURCE_KEYS)}")
        if not test.get("date"):
            continue
        try:
            date = datetime.date.fromisoformat(str(test["date"]))
        except ValueError:
            document.fault(("tests", name, "date"), f"{test['date']!r} is no date; write it as 2026-11-26")
            continue
        if date < last[1]:
            document.fault(("tests", name, "date"), f"{date} lies before that of the test above it ({last[0]}, {last[1]}); "
                           "put the tests in the order of their dates, or mend the date")
        last = (name, date)


def _check_cut_name(key: Key, name: str, cuts: Mapping[str, Any], document: Document) -> None:
    """Add a fault for a goal whose cut is not described, or of several not said."""
    if not name and len(cuts) != 1:
        document.fault(key, f"{len(cuts)} cuts are described; must say which, by its name under 'cuts'")
    elif name and name not in cuts:
        document.fault(key, f"there is no cut {name!r}; {suggestion(name, cuts) or 'known: ' + (', '.join(cuts) or 'none')}")


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of project files, for editors that check YAML while it is typed."""
    return file_schema(ProjectFile, "toolpoint project file")
