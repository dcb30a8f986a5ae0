"""The part of a file that describes a cut: its keys and types from what the description states, and the cut that it gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, Field, create_model

from toolpoint.cutting.description import (
    DEFAULTS,
    PARAMETERS,
    TOTAL_ENERGY,
    VARIATION,
    CutParameter,
    CuttingDescription,
)
from toolpoint.io.quantities import units
from toolpoint.io.yaml.document import Document
from toolpoint.io.yaml.part import Part
from toolpoint.io.yaml.quantity_fields import Several, Vector, quantity_type

EDGE = replace(units.STIFFNESS, name="edge coefficient", largest=1e7)
PROCESS_DAMPING = replace(units.STIFFNESS, name="process damping", largest=1e9)
_KINDS = {"length": units.LENGTH, "angle": units.ANGLE, "ratio": units.RATIO, "pressure": units.PRESSURE,
          "speed": units.SPEED, "edge coefficient": EDGE, "process damping": PROCESS_DAMPING}
_NOTES = {"material": "name in the table of literature coefficients"}


def _type_of(key: str, parameter: CutParameter) -> Any:
    """Return the type of a key of the cut from what its description states."""
    if parameter.kind == "variation":
        return SpeedVariationModel
    if parameter.kind == "total energy":
        return TotalEnergyModel
    if parameter.kind == "count":
        return Annotated[int, Field(strict=True, ge=parameter.limits["ge"], le=parameter.limits["le"])]
    if parameter.kind == "choice":
        return Literal[parameter.choices]
    if parameter.kind == "text":
        return Annotated[str, Field(description=_NOTES.get(key))]
    kind = _KINDS[parameter.kind]
    if isinstance(parameter.several, str):
        return Annotated[Any, Several(kind, parameter.several == "one or each")]
    if parameter.several == 1:
        return quantity_type(kind, **parameter.limits)
    return Annotated[tuple[float, ...], Vector(kind, parameter.several)]


def _model(name: str, parameters: Mapping[str, CutParameter], defaults: Mapping[str, Any]) -> type[BaseModel]:
    """Return the schema of a part of the cut; a default of None makes a key that may be left out."""
    keys: dict[str, Any] = {}
    for key, parameter in parameters.items():
        kind, default = _type_of(key, parameter), defaults.get(key, ...)
        keys[key] = (kind | None if default is None else kind, default)
    return create_model(name, __base__=Part, **keys)


TotalEnergyModel = _model("TotalEnergyModel", TOTAL_ENERGY, {"exponent": 0.0, "normal_ratio": 0.3, "axial_ratio": 0.0})
SpeedVariationModel = _model("SpeedVariationModel", VARIATION, {"revolutions": 4, "phase": 0.0})
if TYPE_CHECKING:  # to the type checker a part like any other
    CuttingModel = Part
else:
    CuttingModel = _model("CuttingModel", PARAMETERS, DEFAULTS)


def cutting_of(part: BaseModel, document: Document) -> CuttingDescription:
    """Return the described cut, its faults in the document."""
    from toolpoint.cutting.build import fault_of  # loaded where a file describes a cut

    cut = CuttingDescription.of(**part.model_dump())
    if (fault := fault_of(cut)) is not None:
        document.fault(("cutting", *fault[0]), fault[1])
    return cut
