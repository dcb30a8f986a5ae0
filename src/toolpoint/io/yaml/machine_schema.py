"""The schema of machine files: every key, its unit and its limits; also the source of the JSON schema for editors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema, create_model, model_validator
from pydantic_core import PydanticCustomError

from toolpoint.bodies.inertia import inertia_fault
from toolpoint.cutting.description import DEFAULTS, PARAMETERS, VARIATION, Parameter
from toolpoint.io.quantities import units
from toolpoint.io.quantities.units import Kind, UnitError
from toolpoint.machine.description import InertiaDescription

VERSION = 1
EDGE = replace(units.STIFFNESS, name="edge coefficient", largest=1e7)
PROCESS_DAMPING = replace(units.STIFFNESS, name="process damping", largest=1e9)
_NUMBER_SCHEMA = {"anyOf": [{"type": "number"}, {"type": "string"}]}


def _fault(error: UnitError) -> PydanticCustomError:
    # The text goes in as a parameter: braces in a user's value must not be read as placeholders.
    return PydanticCustomError("quantity", "{message}", {"message": str(error)})


def quantity_type(kind: Kind, **limits: Any) -> Any:
    """Return the type of a field that holds a quantity of this kind, within the limits given (gt, ge, lt, le; SI)."""

    def read(value: object) -> float:
        try:
            return units.quantity(value, kind)
        except UnitError as error:
            raise _fault(error) from None

    described = {**_NUMBER_SCHEMA, "description": f"{kind.name}; a bare number is in {kind.unit}"}
    return Annotated[float, BeforeValidator(read), Field(**limits), WithJsonSchema(described)]


def _v(kind: Kind, length: int = 3) -> Any:
    def read(value: object) -> tuple[float, ...]:
        try:
            return units.quantities(value, kind, length)
        except UnitError as error:
            raise _fault(error) from None

    described = {"anyOf": [{"type": "array", "items": _NUMBER_SCHEMA, "minItems": length, "maxItems": length},
                           {"type": "string"}], "description": f"{length} of {kind.name}; bare numbers are in {kind.unit}"}
    return Annotated[tuple[float, ...], BeforeValidator(read), WithJsonSchema(described)]


def _several(kind: Kind, one: bool = False) -> Any:
    """Return the type of a field that holds any number of quantities; with `one` a single one stays a number."""
    def read(value: object) -> float | tuple[float, ...]:
        try:
            if one and not isinstance(value, (list, tuple)) and not (isinstance(value, str) and "," in value):
                return units.quantity(value, kind)
            length = len(value) if isinstance(value, (list, tuple)) else str(value).count(",") + 1
            return units.quantities(value, kind, length)
        except UnitError as error:
            raise _fault(error) from None

    single = [{"type": "number"}] if one else []
    described = {"anyOf": [{"type": "array", "items": _NUMBER_SCHEMA}, {"type": "string"}, *single],
                 "description": f"{kind.name}, one for each tooth" + (" or one for all" if one else "")
                 + f"; bare numbers are in {kind.unit}"}
    return Annotated[Any, BeforeValidator(read), WithJsonSchema(described)]


class Part(BaseModel):
    """A part of a file: unknown keys are faults, values cannot be changed."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class FrameModel(Part):
    at: _v(units.LENGTH) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    rotation: _v(units.ANGLE) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]


class ShapeModel(Part):
    kind: Literal["box", "cylinder", "sphere"]
    size: _v(units.LENGTH) | None = None  # type: ignore[valid-type]
    diameter: quantity_type(units.LENGTH, gt=0) | None = None  # type: ignore[valid-type]
    length: quantity_type(units.LENGTH, gt=0) | None = None  # type: ignore[valid-type]
    axis: Literal["x", "y", "z"] = "z"
    bore: quantity_type(units.LENGTH, ge=0) = 0.0  # type: ignore[valid-type]


class MeshModel(Part):
    file: str
    unit: quantity_type(units.LENGTH, gt=0) = 1.0  # type: ignore[valid-type]


class InertiaModel(Part):
    xx: quantity_type(units.AREA_MOMENT)  # type: ignore[valid-type]
    yy: quantity_type(units.AREA_MOMENT)  # type: ignore[valid-type]
    zz: quantity_type(units.AREA_MOMENT)  # type: ignore[valid-type]
    xy: quantity_type(units.AREA_MOMENT) = 0.0  # type: ignore[valid-type]
    xz: quantity_type(units.AREA_MOMENT) = 0.0  # type: ignore[valid-type]
    yz: quantity_type(units.AREA_MOMENT) = 0.0  # type: ignore[valid-type]

    @model_validator(mode="after")
    def possible(self) -> InertiaModel:
        """Refuse principal moments that no rigid body has."""
        tensor = InertiaDescription(**self.model_dump()).tensor
        if message := inertia_fault(tensor):
            raise _fault(UnitError(message))
        return self


class BodyModel(Part):
    mass: quantity_type(units.MASS, gt=0) | None = None  # type: ignore[valid-type]
    centre: _v(units.LENGTH) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    inertia: InertiaModel | None = None
    density: quantity_type(units.DENSITY, gt=0) | None = None  # type: ignore[valid-type]
    shape: ShapeModel | None = None
    mesh: MeshModel | None = None
    frame: FrameModel = FrameModel()
    draw: ShapeModel | None = None
    draw_at: _v(units.LENGTH) | None = None  # type: ignore[valid-type]
    source: str = ""


class StiffnessModel(Part):
    x: quantity_type(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    y: quantity_type(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    z: quantity_type(units.STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    rx: quantity_type(units.TURNING_STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    ry: quantity_type(units.TURNING_STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]
    rz: quantity_type(units.TURNING_STIFFNESS, gt=0) | None = None  # type: ignore[valid-type]


class DampingModel(Part):
    x: quantity_type(units.DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    y: quantity_type(units.DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    z: quantity_type(units.DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    rx: quantity_type(units.TURNING_DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    ry: quantity_type(units.TURNING_DAMPING, ge=0) | None = None  # type: ignore[valid-type]
    rz: quantity_type(units.TURNING_DAMPING, ge=0) | None = None  # type: ignore[valid-type]


class LossFactorModel(Part):
    x: quantity_type(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    y: quantity_type(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    z: quantity_type(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    rx: quantity_type(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    ry: quantity_type(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]
    rz: quantity_type(units.RATIO, ge=0) | None = None  # type: ignore[valid-type]


Direction = Literal["x", "y", "z", "rx", "ry", "rz"]
AxisDirection = Literal["x", "y", "z", "rx", "ry", "rz", "-x", "-y", "-z", "-rx", "-ry", "-rz"]


class JointModel(Part):
    parent: str
    child: str
    at: _v(units.LENGTH) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    rotation: _v(units.ANGLE) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    stiffness: StiffnessModel = StiffnessModel()
    damping: DampingModel = DampingModel()
    loss_factor: LossFactorModel | quantity_type(units.RATIO, ge=0) = 0.0  # type: ignore[valid-type]
    free: tuple[Direction, ...] = ()
    stiffness_matrix: tuple[tuple[float, ...], ...] | None = None
    damping_matrix: tuple[tuple[float, ...], ...] | None = None
    elastic_at: Literal["child", "parent"] = "child"
    closes_loop: bool = False
    parent_interface: str | None = None
    child_interface: str | None = None
    source: str = ""


class AxisModel(Part):
    joint: str
    direction: AxisDirection
    limits: tuple[Any, Any] | str | None = None


class PointModel(Part):
    body: str
    at: _v(units.LENGTH) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    interface: str | None = None


class LoadModel(Part):
    point: str
    force: _v(units.FORCE) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]
    moment: _v(units.MOMENT) = (0.0, 0.0, 0.0)  # type: ignore[valid-type]


_KINDS = {"length": units.LENGTH, "angle": units.ANGLE, "ratio": units.RATIO, "pressure": units.PRESSURE,
          "speed": units.SPEED, "edge coefficient": EDGE, "process damping": PROCESS_DAMPING}
_NOTES = {"material": "name in the table of literature coefficients"}


def _type_of(key: str, parameter: Parameter) -> Any:
    """Return the type of a key of the cut from what its description states."""
    if parameter.kind == "variation":
        return SpeedVariationModel
    if parameter.kind == "count":
        return Annotated[int, Field(strict=True, ge=parameter.limits["ge"], le=parameter.limits["le"])]
    if parameter.kind == "choice":
        return Literal[parameter.choices]
    if parameter.kind == "text":
        return Annotated[str, Field(description=_NOTES.get(key))]
    kind = _KINDS[parameter.kind]
    if isinstance(parameter.several, str):
        return _several(kind, one=parameter.several == "one or each")
    return quantity_type(kind, **parameter.limits) if parameter.several == 1 else _v(kind, parameter.several)


def _model(name: str, parameters: Mapping[str, Parameter], defaults: Mapping[str, Any]) -> type[BaseModel]:
    """Return the schema of a part of the cut; a default of None makes a key that may be left out."""
    keys: dict[str, Any] = {}
    for key, parameter in parameters.items():
        kind, default = _type_of(key, parameter), defaults.get(key, ...)
        keys[key] = (kind | None if default is None else kind, default)
    return create_model(name, __base__=Part, **keys)


SpeedVariationModel = _model("SpeedVariationModel", VARIATION, {"revolutions": 4, "phase": 0.0})
CuttingModel = _model("CuttingModel", PARAMETERS, DEFAULTS)


class ReferenceModel(Part):
    name: str
    frequencies: tuple[quantity_type(units.FREQUENCY, gt=0), ...]  # type: ignore[valid-type]
    damping_ratio: tuple[quantity_type(units.RATIO, ge=0), ...] = ()  # type: ignore[valid-type]
    source: str = ""


class MachineModel(Part):
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
    damping_ratio: quantity_type(units.RATIO, ge=0, lt=1) | None = None  # type: ignore[valid-type]
    cutting: CuttingModel | None = None  # type: ignore[valid-type]
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
