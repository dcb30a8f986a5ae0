"""The schema of machine files: every key, its unit and its limits; also the source of the JSON schema for editors."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from toolpoint.bodies.inertia import inertia_fault
from toolpoint.io import units
from toolpoint.io.units import Kind, UnitError
from toolpoint.machine.description import InertiaDescription

VERSION = 1
_NUMBER_SCHEMA = {"anyOf": [{"type": "number"}, {"type": "string"}]}


def _fault(error: UnitError) -> PydanticCustomError:
    # The text goes in as a parameter: braces in a user's value must not be read as placeholders.
    return PydanticCustomError("quantity", "{message}", {"message": str(error)})


def _q(kind: Kind, **limits: Any) -> Any:
    def read(value: object) -> float:
        try:
            return units.quantity(value, kind)
        except UnitError as error:
            raise _fault(error) from None

    described = {**_NUMBER_SCHEMA, "description": f"{kind.name}; a bare number is in {kind.unit}"}
    return Annotated[float, BeforeValidator(read), Field(**limits), WithJsonSchema(described)]  # type: ignore[arg-type]


def _v(kind: Kind, length: int = 3) -> Any:
    def read(value: object) -> tuple[float, ...]:
        try:
            return units.quantities(value, kind, length)
        except UnitError as error:
            raise _fault(error) from None

    described = {"anyOf": [{"type": "array", "items": _NUMBER_SCHEMA, "minItems": length, "maxItems": length},
                           {"type": "string"}], "description": f"{length} of {kind.name}; bare numbers are in {kind.unit}"}
    return Annotated[tuple[float, ...], BeforeValidator(read), WithJsonSchema(described)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class FrameModel(_Part):
    at: _v(units.LENGTH) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    rotation: _v(units.ANGLE) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]


class ShapeModel(_Part):
    kind: Literal["box", "cylinder", "sphere"]
    size: _v(units.LENGTH) | None = None  # type: ignore[valid-type]
    diameter: _q(units.LENGTH, gt=0) | None = None  # type: ignore[valid-type]
    length: _q(units.LENGTH, gt=0) | None = None  # type: ignore[valid-type]
    axis: Literal["x", "y", "z"] = "z"
    bore: _q(units.LENGTH, ge=0) = 0.0  # type: ignore[valid-type]


class MeshModel(_Part):
    file: str
    unit: _q(units.LENGTH, gt=0) = 1.0  # type: ignore[valid-type]


class InertiaModel(_Part):
    xx: _q(units.AREA_MOMENT)  # type: ignore[valid-type]
    yy: _q(units.AREA_MOMENT)  # type: ignore[valid-type]
    zz: _q(units.AREA_MOMENT)  # type: ignore[valid-type]
    xy: _q(units.AREA_MOMENT) = 0.0  # type: ignore[valid-type]
    xz: _q(units.AREA_MOMENT) = 0.0  # type: ignore[valid-type]
    yz: _q(units.AREA_MOMENT) = 0.0  # type: ignore[valid-type]

    @model_validator(mode="after")
    def possible(self) -> InertiaModel:
        """Refuse principal moments that no rigid body has."""
        tensor = InertiaDescription(**self.model_dump()).tensor
        if message := inertia_fault(tensor):
            raise _fault(UnitError(message))
        return self


class BodyModel(_Part):
    mass: _q(units.MASS, gt=0) | None = None  # type: ignore[valid-type]
    centre: _v(units.LENGTH) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    inertia: InertiaModel | None = None
    density: _q(units.DENSITY, gt=0) | None = None  # type: ignore[valid-type]
    shape: ShapeModel | None = None
    mesh: MeshModel | None = None
    frame: FrameModel = FrameModel()
    draw: ShapeModel | None = None
    draw_at: _v(units.LENGTH) | None = None  # type: ignore[valid-type]
    source: str = ""


class StiffnessModel(_Part):
    x: _q(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    y: _q(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    z: _q(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    rx: _q(units.TURNING_STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    ry: _q(units.TURNING_STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    rz: _q(units.TURNING_STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]


class DampingModel(_Part):
    x: _q(units.DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    y: _q(units.DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    z: _q(units.DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    rx: _q(units.TURNING_DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    ry: _q(units.TURNING_DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    rz: _q(units.TURNING_DAMPING, ge=0) | None = None  # type: ignore[valid-type]


class LossFactorModel(_Part):
    x: _q(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    y: _q(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    z: _q(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    rx: _q(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    ry: _q(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    rz: _q(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]


Direction = Literal["x", "y", "z", "rx", "ry", "rz"]
AxisDirection = Literal["x", "y", "z", "rx", "ry", "rz", "-x", "-y", "-z", "-rx", "-ry", "-rz"]


class JointModel(_Part):
    parent: str
    child: str
    at: _v(units.LENGTH) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    rotation: _v(units.ANGLE) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    stiffness: StiffnessModel = StiffnessModel()
    damping: DampingModel = DampingModel()
    loss_factor: LossFactorModel | _q(units.RATIO, ge=0) = 0.0  # type: ignore[valid-type]
    free: tuple[Direction, ...] = ()
    stiffness_matrix: tuple[tuple[float, ...], ...] | None = None
    damping_matrix: tuple[tuple[float, ...], ...] | None = None
    elastic_at: Literal["child", "parent"] = "child"
    closes_loop: bool = False
    parent_interface: str | None = None
    child_interface: str | None = None
    source: str = ""


class AxisModel(_Part):
    joint: str
    direction: AxisDirection
    limits: tuple[Any, Any] | str | None = None


class PointModel(_Part):
    body: str
    at: _v(units.LENGTH) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    interface: str | None = None


class LoadModel(_Part):
    point: str
    force: _v(units.FORCE) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    moment: _v(units.MOMENT) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]


class CuttingModel(_Part):
    diameter: _q(units.LENGTH, gt=0)  # type: ignore[valid-type]
    teeth: Annotated[int, Field(ge=1, le=1000, strict=True)]
    immersion: _q(units.RATIO, gt=0, le=1)  # type: ignore[valid-type]
    tangential: _q(units.PRESSURE, gt=0)  # type: ignore[valid-type]
    normal: _q(units.PRESSURE, ge=0)  # type: ignore[valid-type]
    direction: Literal["up", "down", "slot"] = "down"
    feed: Literal["x", "y", "-x", "-y"] = "x"
    speeds: _v(units.SPEED, 2) = (1000.0, 12000.0)  # type: ignore[valid-type]
    source: str = ""


class ReferenceModel(_Part):
    name: str
    frequencies: tuple[_q(units.FREQUENCY, gt=0), ...]  # type: ignore[valid-type]
    damping_ratio: tuple[_q(units.RATIO, ge=0), ...] = ()  # type: ignore[valid-type]
    source: str = ""


class MachineModel(_Part):
    toolpoint: Annotated[int, Field(description=f"version of the file format: {VERSION}")]
    name: str
    bodies: dict[str, BodyModel]
    joints: dict[str, JointModel]
    axes: dict[str, AxisModel] = {}
    points: dict[str, PointModel] = {}
    gravity: _v(units.ACCELERATION) | None = None  # type: ignore[valid-type]
    loads: tuple[LoadModel, ...] = ()
    tool: str | None = None
    table: str | None = None
    damping_ratio: _q(units.RATIO, ge=0, lt=1) | None = None  # type: ignore[valid-type]
    cutting: CuttingModel | None = None
    reference: tuple[ReferenceModel, ...] = ()
    poses: tuple[dict[str, Any], ...] = ()
    description: str = ""
    source: str = ""
    assumptions: tuple[str, ...] = ()


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of machine files, for editors that check YAML while it is typed."""
    schema = MachineModel.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = "toolpoint machine file"
    return schema
