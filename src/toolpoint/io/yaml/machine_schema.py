"""The schema of machine files: every key, its unit and its limits; also the source of the JSON schema for editors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from toolpoint._doubt import Doubt
from toolpoint.bodies.inertia import inertia_fault
from toolpoint.io.quantities import units
from toolpoint.io.quantities.units import UnitError
from toolpoint.io.yaml.cutting_schema import CuttingModel
from toolpoint.io.yaml.description_schema import file_schema, model_of
from toolpoint.io.yaml.part import Part
from toolpoint.io.yaml.quantity_fields import Gravity, Scalar, Vector, fault
from toolpoint.joints.law import LawDescription
from toolpoint.machine.description import InertiaDescription
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.description.elastic import ElasticDescription, SolidDescription
from toolpoint.machine.description.matrices import MatricesDescription

if TYPE_CHECKING:
    StatedDoubt = Doubt
else:  # in a file a sentence
    StatedDoubt = Annotated[str, AfterValidator(Doubt.parsed)]


class FrameModel(Part):
    at: Annotated[tuple[float, float, float], Vector(units.LENGTH)] = (0.0, 0.0, 0.0)
    rotation: Annotated[tuple[float, float, float], Vector(units.ANGLE)] = (0.0, 0.0, 0.0)


class ShapeModel(Part):
    kind: Literal["box", "cylinder", "sphere"]
    size: Annotated[tuple[float, float, float], Vector(units.LENGTH)] | None = None
    diameter: Annotated[float, Scalar(units.LENGTH, gt=0)] | None = None
    length: Annotated[float, Scalar(units.LENGTH, gt=0)] | None = None
    axis: Literal["x", "y", "z"] = "z"
    bore: Annotated[float, Scalar(units.LENGTH, ge=0)] = 0.0


class MeshModel(Part):
    file: str
    unit: Annotated[float, Scalar(units.LENGTH, gt=0)] = 1.0


class InertiaModel(Part):
    xx: Annotated[float, Scalar(units.AREA_MOMENT)]
    yy: Annotated[float, Scalar(units.AREA_MOMENT)]
    zz: Annotated[float, Scalar(units.AREA_MOMENT)]
    xy: Annotated[float, Scalar(units.AREA_MOMENT)] = 0.0
    xz: Annotated[float, Scalar(units.AREA_MOMENT)] = 0.0
    yz: Annotated[float, Scalar(units.AREA_MOMENT)] = 0.0

    @model_validator(mode="after")
    def possible(self) -> InertiaModel:
        """Refuse principal moments that no rigid body has."""
        tensor = InertiaDescription(**self.model_dump()).tensor
        if message := inertia_fault(tensor):
            raise fault(UnitError(message))
        return self


class SpinModel(Part):
    speed: Annotated[float, Scalar(units.SPEED)]
    axis: Any = "z"


class BodyModel(Part):
    mass: Annotated[float, Scalar(units.MASS, gt=0)] | None = None
    centre: Annotated[tuple[float, float, float], Vector(units.LENGTH)] = (0.0, 0.0, 0.0)
    inertia: InertiaModel | None = None
    density: Annotated[float, Scalar(units.DENSITY, gt=0)] | None = None
    shape: ShapeModel | None = None
    mesh: MeshModel | None = None
    frame: FrameModel = FrameModel()
    draw: ShapeModel | None = None
    draw_at: Annotated[tuple[float, float, float], Vector(units.LENGTH)] | None = None
    source: str = ""
    spin: SpinModel | None = None
    elastic: model_of(ElasticDescription) | None = None  # type: ignore[valid-type]
    beam: model_of(BeamDescription) | None = None  # type: ignore[valid-type]
    matrices: model_of(MatricesDescription) | None = None  # type: ignore[valid-type]
    solid: model_of(SolidDescription) | None = None  # type: ignore[valid-type]


class StiffnessModel(Part):
    x: Annotated[float, Scalar(units.STIFFNESS, gt=0)] | None = None
    y: Annotated[float, Scalar(units.STIFFNESS, gt=0)] | None = None
    z: Annotated[float, Scalar(units.STIFFNESS, gt=0)] | None = None
    rx: Annotated[float, Scalar(units.TURNING_STIFFNESS, gt=0)] | None = None
    ry: Annotated[float, Scalar(units.TURNING_STIFFNESS, gt=0)] | None = None
    rz: Annotated[float, Scalar(units.TURNING_STIFFNESS, gt=0)] | None = None


class DampingModel(Part):
    x: Annotated[float, Scalar(units.DAMPING, ge=0)] | None = None
    y: Annotated[float, Scalar(units.DAMPING, ge=0)] | None = None
    z: Annotated[float, Scalar(units.DAMPING, ge=0)] | None = None
    rx: Annotated[float, Scalar(units.TURNING_DAMPING, ge=0)] | None = None
    ry: Annotated[float, Scalar(units.TURNING_DAMPING, ge=0)] | None = None
    rz: Annotated[float, Scalar(units.TURNING_DAMPING, ge=0)] | None = None


class LossFactorModel(Part):
    x: Annotated[float, Scalar(units.RATIO, ge=0)] | None = None
    y: Annotated[float, Scalar(units.RATIO, ge=0)] | None = None
    z: Annotated[float, Scalar(units.RATIO, ge=0)] | None = None
    rx: Annotated[float, Scalar(units.RATIO, ge=0)] | None = None
    ry: Annotated[float, Scalar(units.RATIO, ge=0)] | None = None
    rz: Annotated[float, Scalar(units.RATIO, ge=0)] | None = None


Direction = Literal["x", "y", "z", "rx", "ry", "rz"]
AxisDirection = Literal["x", "y", "z", "rx", "ry", "rz", "-x", "-y", "-z", "-rx", "-ry", "-rz"]


class JointModel(Part):
    parent: str
    child: str
    at: Annotated[tuple[float, float, float], Vector(units.LENGTH)] | None = None
    rotation: Annotated[tuple[float, float, float], Vector(units.ANGLE)] = (0.0, 0.0, 0.0)
    stiffness: StiffnessModel = StiffnessModel()
    damping: DampingModel = DampingModel()
    loss_factor: LossFactorModel | Annotated[float, Scalar(units.RATIO, ge=0)] = 0.0
    free: tuple[Direction, ...] = ()
    stiffness_matrix: tuple[tuple[float, ...], ...] | None = None
    damping_matrix: tuple[tuple[float, ...], ...] | None = None
    elastic_at: Literal["child", "parent"] = "child"
    closes_loop: bool = False
    parent_interface: str | None = None
    child_interface: str | None = None
    source: str = ""
    passive: tuple[Direction, ...] = ()
    limits: dict[Direction, tuple[Any, Any] | str] = {}
    largest_tilt: Annotated[float, Scalar(units.ANGLE, gt=0)] | None = None
    screws: Annotated[tuple[tuple[float, ...], ...], Field(
        description="free twists (v, w) in the joint's frame, SI, in place of directions; stiffness_matrix is over them")] = ()
    law: model_of(LawDescription) | None = None  # type: ignore[valid-type]


class DriveModel(Part):
    joint: str
    direction: AxisDirection
    factor: float = 1.0


class AxisModel(Part):
    joint: str = ""
    direction: AxisDirection | None = None
    drives: tuple[DriveModel, ...] = ()
    limits: tuple[Any, Any] | str | None = None
    at_reference: Any = 0.0


class ArmRowModel(Part):
    body: str
    axis: str
    theta: Any = 0.0
    d: Any = 0.0
    a: Any = 0.0
    alpha: Any = 0.0
    slides: bool = False
    coupled: dict[str, float] = {}
    limits: tuple[Any, Any] | str | None = None
    joint: str = ""
    stiffness: StiffnessModel = StiffnessModel()
    damping: DampingModel = DampingModel()
    loss_factor: LossFactorModel | Annotated[float, Scalar(units.RATIO, ge=0)] = 0.0
    source: str = ""


class ArmModel(Part):
    convention: Literal["standard", "modified"] = "standard"
    base: str = "ground"
    frame: FrameModel = FrameModel()
    rows: tuple[ArmRowModel, ...]


Coordinate = Literal["x", "y", "z", "tilt", "azimuth", "torsion"]


class CoordinateModel(Part):
    coordinate: Coordinate | None = None
    limits: tuple[Any, Any] | str | None = None


class TaskModel(Part):
    point: str
    axes: tuple[str, ...]
    coordinates: dict[str, CoordinateModel | None]


class PointModel(Part):
    body: str
    at: Annotated[tuple[float, float, float], Vector(units.LENGTH)] = (0.0, 0.0, 0.0)
    interface: str | None = None


class LoadModel(Part):
    point: str
    force: Annotated[tuple[float, float, float], Vector(units.FORCE)] = (0.0, 0.0, 0.0)
    moment: Annotated[tuple[float, float, float], Vector(units.MOMENT)] = (0.0, 0.0, 0.0)


class ReferenceModel(Part):
    name: str
    frequencies: tuple[Annotated[float, Scalar(units.FREQUENCY, gt=0)], ...]
    damping_ratio: tuple[Annotated[float, Scalar(units.RATIO, ge=0)], ...] = ()
    source: str = ""


class IdentifiedModel(Part):
    parameters: Annotated[tuple[str, ...], Field(description="paths of numbers in this file, as joints.guide.stiffness.x")]
    covariance: Annotated[tuple[tuple[float, ...], ...], Field(description="rows of the lower triangle, SI")]
    source: str = ""


class MachineModel(Part):
    toolpoint: int
    name: str
    bodies: dict[str, BodyModel]
    joints: dict[str, JointModel]
    axes: dict[str, AxisModel] = {}
    points: dict[str, PointModel] = {}
    gravity: Annotated[tuple[float, ...], Gravity()] | None = None
    loads: tuple[LoadModel, ...] = ()
    tool: str | None = None
    table: str | None = None
    damping_ratio: Annotated[float, Scalar(units.RATIO, ge=0, lt=1)] | None = None
    reduction_error: Annotated[float, Scalar(units.RATIO, ge=0, le=0.05)] | None = None
    cutting: CuttingModel | None = None
    reference: tuple[ReferenceModel, ...] = ()
    poses: tuple[dict[str, Any], ...] = ()
    description: str = ""
    source: str = ""
    assumptions: tuple[str, ...] = ()
    tool_axis: Any = "z"
    up: Any = "z"
    arm: ArmModel | None = None
    task: TaskModel | None = None
    assembly_modes: dict[str, dict[str, Any]] = {}
    assembly_mode: str = ""
    identified: IdentifiedModel | None = None
    doubts: tuple[StatedDoubt, ...] = ()
    modal_damping: Literal["energy"] | tuple[Annotated[float, Scalar(units.RATIO, ge=0, lt=1)], ...] = ()

    @model_validator(mode="after")
    def _one_damping(self) -> MachineModel:
        """Refuse two ratios for one mode."""
        if self.damping_ratio is not None and self.modal_damping:
            raise fault(UnitError("damping_ratio: one for all modes, beside modal_damping; leave one of them out"))
        return self


# Models of the parts of a machine file by their section.
SECTION_MODELS: dict[str, type[Part]] = {"bodies": BodyModel, "joints": JointModel, "axes": AxisModel, "points": PointModel}


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of machine files, for editors that check YAML while it is typed."""
    return file_schema(MachineModel, "toolpoint machine file")
