"""ProgramPart: the keys of an NC program in a project file, with its spindle and its work; quantities that need a unit."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from toolpoint.io.quantities import units
from toolpoint.io.quantities.units import UnitError
from toolpoint.io.yaml.document import Document
from toolpoint.io.yaml.part import Part
from toolpoint.io.yaml.quantity_fields import AxisPosition, Scalar, fault


class StatedScalar(Scalar):
    """Quantity whose unit must be written: a goal of ``3`` may be meant in mm or in m."""

    def read(self, value: object) -> float:
        """Return a text with unit as its SI value; refuse a bare number."""
        text = str(value).strip().replace("rev/min", "rpm")
        try:
            float(text)
        except ValueError:
            return super().read(text)
        unit = {"m": "mm", "m/s": "mm/s"}.get(self.kind.unit, self.kind.unit)
        raise fault(UnitError(f"{text} has no unit; write it with one, for example '{text} {unit}'"))

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        limited = core_schema.float_schema(gt=self.gt, ge=self.ge, lt=self.lt, le=self.le)
        return core_schema.no_info_before_validator_function(self.read, limited)


PoseField = dict[str, Annotated[float, AxisPosition()]]
SpeedField = Annotated[float, StatedScalar(units.SPEED, gt=0)]
DepthField = Annotated[float, StatedScalar(units.LENGTH, gt=0, le=1)]


class SpindlePart(Part):
    """Limits of the spindle and of the tool at its holder."""

    power: Annotated[float, Scalar(units.POWER, gt=0)] = float("inf")
    torque: Annotated[float, Scalar(units.MOMENT, gt=0)] = float("inf")
    speed: Annotated[float, Scalar(units.SPEED, gt=0)] = float("inf")
    bending: Annotated[float, Scalar(units.MOMENT, gt=0)] = float("inf")
    curve: str = ""


class WorkPart(Part):
    """Work that gives way: a clamped part by finite elements, or responses from lines of the program on."""

    part: str | None = None
    held: tuple[str, ...] = ()
    damping_ratio: Annotated[float, Scalar(units.RATIO, ge=0, le=0.5)] = 0.0
    stage_change: Annotated[float, Scalar(units.RATIO, ge=0.002, le=0.5)] = 0.05
    responses: dict[int, str] = {}


class ProgramPart(Part):
    """An NC program: its file and stock, the tool, the place of its zero, what the spindle bears, a record of its run."""

    program: str
    stock: str
    cut: str = ""
    tools: dict[int, str] = {}
    tips: dict[int, str] = {}
    shafts: dict[int, str] = {}
    coefficient_deviation: Annotated[float, Scalar(units.RATIO, gt=0, lt=1)] | None = None
    zero: PoseField = {}
    speed: Annotated[float, StatedScalar(units.SPEED, ge=0)] = 0.0
    first_feed: Annotated[float, StatedScalar(units.FEED, gt=0)] | None = None
    stick_out: Annotated[float, StatedScalar(units.LENGTH, ge=0, le=1)] = 0.0
    stick_outs: dict[int, Annotated[float, StatedScalar(units.LENGTH, gt=0, le=1)]] = {}
    wear_only: bool = False
    holder: Annotated[float, StatedScalar(units.LENGTH, ge=0, le=1)] = 0.0
    spacing: Annotated[float, StatedScalar(units.LENGTH, ge=0, le=0.1)] = 0.0
    servo: bool = True
    part: str | None = None
    record: str | None = None
    signal: str = ""
    efficiency: Annotated[float, Scalar(units.RATIO, ge=0.1, le=1)] = 1.0
    spindle: SpindlePart = SpindlePart()
    rotary_speed: Annotated[float, StatedScalar(units.ANGULAR_SPEED, gt=0)] = float("inf")
    rotary_acceleration: Annotated[float, StatedScalar(units.ANGULAR_ACCELERATION, gt=0)] = float("inf")
    rotary_jerk: Annotated[float, StatedScalar(units.ANGULAR_JERK, gt=0)] = float("inf")
    work: WorkPart | None = None


def check_work(name: str, entry: Any, document: Document) -> None:
    """Add the fault of a work that is described in two ways or in none, or that nothing holds."""
    if not isinstance(entry, dict):
        return
    if bool(entry.get("part")) == bool(entry.get("responses")):
        document.fault(("programs", name, "work"), "must have part (a machine file with one body by finite elements) with "
                       "held, or responses (files by the line from which each holds)")
    elif entry.get("part") and not entry.get("held"):
        document.fault(("programs", name, "work"), "held: missing; name the interfaces of the part that are clamped")
