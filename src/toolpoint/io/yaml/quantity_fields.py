"""Fields of files that hold quantities: numbers with units, read to SI, within limits; used as ``Annotated[float, ...]``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from toolpoint.io.quantities import units
from toolpoint.io.quantities.units import Kind, UnitError

MAX_BARE_PERCENT = 100.0  # largest bare number of a ratio that may be meant in percent
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
            self._question_percent(value)
            return units.quantity(value, self.kind)
        except UnitError as error:
            raise fault(error) from None

    def _question_percent(self, value: object) -> None:
        """Refuse a bare number above the limit of a ratio as the percentage that it may be: damping_ratio: 3."""
        limit = self.lt if self.lt is not None else self.le
        bare = value.strip() if isinstance(value, str) else value
        if self.kind is not units.RATIO or limit is None or isinstance(bare, bool) or not isinstance(bare, str | float | int):
            return
        try:
            number = float(bare)
        except ValueError:
            return
        if 1 <= number <= MAX_BARE_PERCENT and (number > limit or (number == limit and self.lt is not None)):
            raise UnitError(f"{number:g} is a ratio; must be {'below' if self.lt is not None else 'at most'} {limit:g} "
                            f"({number:g} %?)")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        limited = core_schema.float_schema(gt=self.gt, ge=self.ge, lt=self.lt, le=self.le)
        return core_schema.no_info_before_validator_function(self.read, limited)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        limits = {"above": self.gt, "at least": self.ge, "below": self.lt, "at most": self.le}
        bounds = [f"{word} {value:g}" for word, value in limits.items() if value is not None]
        return {**NUMBER, "description": "; ".join([self.kind.name, f"a bare number is in {self.kind.unit}", *bounds])}


@dataclass(frozen=True)
class AxisPosition:
    """A position of an axis, m or rad, as a number or with its unit: ``200 mm``, ``30 deg``."""

    def read(self, value: object) -> object:
        """Return a text with unit as its SI value; what is no text stays."""
        try:
            return units.length_or_angle(value)[0] if isinstance(value, str) else value
        except UnitError as error:
            raise fault(error) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, core_schema.float_schema())

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {**NUMBER, "description": "position of an axis; a bare number is in m or rad"}


@dataclass(frozen=True)
class Gravity:
    """Gravity: three accelerations in the machine frame, or one, its size, which acts against the machine's `up`."""

    def read(self, value: object) -> tuple[float, ...]:
        """Return the SI vector, or the size alone."""
        try:
            if not isinstance(value, (list, tuple)) and not (isinstance(value, str) and len(units.split_list(value)) > 1):
                size = units.quantity(value, units.ACCELERATION)
                if size < 0:
                    raise UnitError(f"{value!r}: one number is its size downwards; must not be negative; write three numbers "
                                    "for another direction")
                return (size,)
            return units.quantities(value, units.ACCELERATION, 3)
        except UnitError as error:
            raise fault(error) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        array = {"type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3}
        return {"anyOf": [array, {"type": "string"}, {"type": "number"}],
                "description": "3 of acceleration, or one downwards, against up; bare numbers are in m/s^2"}


@dataclass(frozen=True)
class Vector:
    """Several quantities of a kind: a list, or a text with commas."""

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
            if self.or_one and not isinstance(value, (list, tuple)) and not (
                    isinstance(value, str) and len(units.split_list(value)) > 1):
                return units.quantity(value, self.kind)
            length = len(value) if isinstance(value, (list, tuple)) else len(units.split_list(str(value)))
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
