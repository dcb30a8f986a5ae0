"""Schemas of files from descriptions: a pydantic model of every frozen dataclass, its units read and its limits checked.

The fields, their order, defaults, units and limits stand in the description alone (`Quantity` in the annotations).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, create_model

from toolpoint._check import ToolpointError
from toolpoint._quantity import Quantity
from toolpoint.io.faults import FileFaults
from toolpoint.io.quantities import electrical, units
from toolpoint.io.quantities.electrical import electrical_type
from toolpoint.io.yaml.document import Key, parse, validate
from toolpoint.io.yaml.key_meanings import add_meanings
from toolpoint.io.yaml.part import Part
from toolpoint.io.yaml.quantity_fields import AxisPosition, quantity_type

Described = TypeVar("Described")

_KINDS = {kind.name: kind for kind in vars(units).values() if isinstance(kind, units.Kind)}
_ELECTRICAL = {value[0]: value for name, value in vars(electrical).items() if name.isupper() and isinstance(value, tuple)}
_DESCRIPTIONS: dict[type[BaseModel], type[Any]] = {}


def model_of(description: Any, *, version: bool = False) -> type[BaseModel]:
    """Return the model of a description class; `version` puts the file's version key `toolpoint` before its fields.

    The model is named as the class without the word Description.
    """
    return _model(description, version)


def read_described(path: Path, description: type[Described], version: int, *,
                   find_faults: Callable[[Described], Iterable[tuple[Key, str]]] = lambda described: (),
                   place_error: Callable[[ToolpointError], tuple[Key, str]] | None = None) -> Described:
    """Return what a YAML file describes, SI: the file is one description with its version.

    Raises FileFaults with every fault of the file: of its keys, of the description (at the place that `place_error` gives;
    at the argument's where left out), and those of the whole that `find_faults` names with their keys.
    """
    document = parse(path)
    document.check_version(version)
    model: BaseModel | None = validate(model_of(description, version=True), document.data, (), document=document)
    described = None
    try:
        described = None if model is None else describe(description, model)
    except ToolpointError as error:
        document.fault(*(place_error or _at_argument)(error))
    for key, text in () if described is None else find_faults(described):
        document.fault(key, text)
    if document.faults or described is None:
        raise FileFaults(str(path), document.text, document.faults)
    return described


def _at_argument(error: ToolpointError) -> tuple[Key, str]:
    return tuple(error.argument.split(".")), str(error).removeprefix(f"{error.argument}: ")


def file_schema(model: type[BaseModel], title: str) -> dict[str, Any]:
    """Return the JSON schema of the files of a model, under their title."""
    schema = model.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["title"] = title
    add_meanings(schema, model.__name__)
    return schema


@cache
def _model(description: Any, version: bool) -> type[BaseModel]:
    hints = get_type_hints(description, include_extras=True)
    entries: dict[str, Any] = {"toolpoint": (int, ...)} if version else {}
    for part in fields(description):
        entries[part.name] = (_file_type(hints[part.name]), _default(part))
    model: type[BaseModel] = create_model(description.__name__.removesuffix("Description"), __base__=Part, **entries)
    model.__doc__ = description.__doc__
    _DESCRIPTIONS[model] = description
    return model


def describe(description: type[Described], model: BaseModel) -> Described:
    """Return the description whose fields a validated model holds."""
    return description(**{name: _plain(getattr(model, name)) for name in type(model).model_fields if name != "toolpoint"})


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return describe(_DESCRIPTIONS[type(value)], value)
    if isinstance(value, tuple):
        return tuple(_plain(part) for part in value)
    return {key: _plain(part) for key, part in value.items()} if isinstance(value, dict) else value


def _default(part: Field[Any]) -> Any:
    if part.default_factory is not MISSING:
        return part.default_factory()
    if part.default is MISSING:
        return ... if part.default_factory is MISSING else part.default_factory()
    if is_dataclass(part.default):
        values = {part_field.name: getattr(part.default, part_field.name) for part_field in fields(part.default)}
        return model_of(type(part.default))(**values)
    return part.default


def _file_type(hint: Any) -> Any:
    """Return the type that a file's value is read as: quantities with their units, descriptions as their models."""
    if is_dataclass(hint):
        return model_of(hint)
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated and isinstance(parts[1], Quantity):
        return _quantity_type(parts[1])
    if origin is tuple:
        return GenericAlias(tuple, (_file_type(parts[0]), ...))
    if origin is Mapping:
        return GenericAlias(dict, (parts[0], _file_type(parts[1])))
    if type(None) in parts:
        return Union[tuple(_file_type(part) for part in parts)]  # noqa: UP007
    return hint


def _quantity_type(quantity: Quantity) -> Any:
    if quantity.name == "axis position":
        return Annotated[float, AxisPosition()]
    if quantity.name in _KINDS:
        return quantity_type(_KINDS[quantity.name], **quantity.limits)
    name, *symbols = _ELECTRICAL.get(quantity.name, (quantity.name, quantity.unit))
    return electrical_type(name, *symbols, **quantity.limits)
