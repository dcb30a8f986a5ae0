"""Fields of files that hold quantities: numbers with units, read to SI, within limits; used as ``Annotated[float, ...]``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from toolpoint.io.quantities import units
from toolpoint.io.quantities.units import Kind, UnitError

NUMBER = {"anyOf": [{"type": "number"}, {"type": "string"}]}


def fault(error: UnitError) -> PydanticCustomError:
    """Return an error of a unit as the schema's validation reports it."""
    # The text goes in as a parameter: braces in a user's value must not be read as placeholders.
    return PydanticCustomError("quantity", "{message}", {"message": str(error)})


@dataclass(frozen=True)
class Scalar:
    """One quantity of a kind, within limits (SI): above, at least, below, at most."""

    kind: Kind
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None

    def read(self, value: object) -> float:
        """Return a number or a text with unit as its SI value."""
        try:
            return units.quantity(value, self.kind)
        except UnitError as error:
            raise fault(error) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        limited = core_schema.float_schema(gt=self.gt, ge=self.ge, lt=self.lt, le=self.le)
        return core_schema.no_info_before_validator_function(self.read, limited)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        limits = {"above": self.gt, "at least": self.ge, "below": self.lt, "at most": self.le}
        bounds = [f"{word} {value:g}" for word, value in limits.items() if value is not None]
        return {**NUMBER, "description": "; ".join([self.kind.name, f"a bare number is in {self.kind.unit}", *bounds])}


@dataclass(frozen=True)
class Vector:
    """So many quantities of a kind: a list, or a text with commas."""

    kind: Kind
    length: int = 3

    def read(self, value: object) -> tuple[float, ...]:
        """Return the SI values."""
        try:
            return units.quantities(value, self.kind, self.length)
        except UnitError as error:
            raise fault(error) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        array = {"type": "array", "items": NUMBER, "minItems": self.length, "maxItems": self.length}
        return {"anyOf": [array, {"type": "string"}],
                "description": f"{self.length} of {self.kind.name}; bare numbers are in {self.kind.unit}"}


@dataclass(frozen=True)
class Several:
    """Any number of quantities of a kind, one for each tooth; with `or_one` a single one stays a number."""

    kind: Kind
    or_one: bool = False

    def read(self, value: object) -> float | tuple[float, ...]:
        """Return the SI values."""
        try:
            if self.or_one and not isinstance(value, (list, tuple)) and not (isinstance(value, str) and "," in value):
                return units.quantity(value, self.kind)
            length = len(value) if isinstance(value, (list, tuple)) else str(value).count(",") + 1
            return units.quantities(value, self.kind, length)
        except UnitError as error:
            raise fault(error) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, core_schema.any_schema())

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        single = [{"type": "number"}] if self.or_one else []
        return {"anyOf": [{"type": "array", "items": NUMBER}, {"type": "string"}, *single],
                "description": f"{self.kind.name}, one for each tooth" + (" or one for all" if self.or_one else "")
                + f"; bare numbers are in {self.kind.unit}"}


def quantity_type(kind: Kind, **limits: float) -> Any:
    """Return the type of a field that holds a quantity of this kind, for models that are made from descriptions."""
    return Annotated[float, Scalar(kind, **limits)]
