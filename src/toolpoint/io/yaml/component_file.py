"""Component files in YAML: which measured points belong to which component, what carries what, and what else is known."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from toolpoint._check import ToolpointError, suggestion
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.quantities import units
from toolpoint.io.yaml.cutting_schema import CuttingModel, cutting_of
from toolpoint.io.yaml.description_schema import file_schema
from toolpoint.io.yaml.document import FILE_VERSION, Document, Key, parse, validate
from toolpoint.io.yaml.machine_parts import body_of
from toolpoint.io.yaml.machine_schema import BodyModel, FrameModel, PointModel
from toolpoint.io.yaml.part import Part
from toolpoint.io.yaml.quantity_fields import Scalar, Vector
from toolpoint.machine.components import Components, DrivenAxis, MassDeviation
from toolpoint.machine.description import GROUND, BodyDescription, FrameDescription, PointDescription

_RANGE = re.compile(r"(\d+)\s*-\s*(\d+)")
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_Letter = Literal["x", "y", "z", "-x", "-y", "-z"]
_Way = _Letter | tuple[float, float, float] | None


class UncertaintyPart(Part):
    """Standard deviations of a body's data: mass and inertia as shares, the centre as a length."""

    mass: Annotated[float, Scalar(units.RATIO, ge=0, lt=1)] = 0.0
    inertia: Annotated[float, Scalar(units.RATIO, ge=0, lt=1)] = 0.0
    centre: Annotated[float, Scalar(units.LENGTH, ge=0)] = 0.0


class ComponentPart(Part):
    """Points of a component (numbers, names, or ranges such as ``"12-40"``), and its mass properties where known."""

    points: tuple[int | str, ...]
    body: BodyModel | None = None
    uncertainty: UncertaintyPart = UncertaintyPart()


class DrivenAxisPart(Part):
    """An axis: the component that it moves, `along` or `about` a direction of the machine frame."""

    moves: str
    along: _Way = None
    about: _Way = None
    at: Annotated[tuple[float, float, float], Vector(units.LENGTH)] | None = None
    limits: tuple[Any, Any] | str | None = None
    elastic_at: Literal["child", "parent"] = "child"
    at_test: Any = 0.0


class ComponentFile(Part):
    """The keys of a component file."""

    toolpoint: int
    name: str
    chain: tuple[str, ...] | None = None
    parents: Annotated[dict[str, str] | None, Field(description="child: parent, for a tree")] = None
    components: dict[str, ComponentPart]
    axes: dict[str, DrivenAxisPart] = {}
    points: dict[str, PointModel] = {}
    tool: str | None = None
    table: str | None = None
    cutting: CuttingModel | None = None
    tool_axis: _Letter | tuple[float, float, float] = "z"
    coordinate_deviation: Annotated[float, Scalar(units.LENGTH, ge=0)] = 0.0
    calibration_deviation: Annotated[float, Scalar(units.RATIO, ge=0, lt=1)] | None = None
    frame: FrameModel | None = None

    def measured_points(self) -> dict[str, list[int | str]]:
        """Return the points of every component, ranges written out."""
        return {name: [point for entry in part.points for point in _written_out(entry)]
                for name, part in self.components.items()}


def _written_out(entry: int | str) -> list[int | str]:
    match = _RANGE.fullmatch(entry.strip()) if isinstance(entry, str) else None
    return [entry] if match is None else list(range(int(match[1]), int(match[2]) + 1))


@door("component file")
def read(path: str | Path) -> Components:
    """Return the components of a file; raises FileFaults with every fault.

    >>> import tempfile
    >>> from toolpoint.io import write_template
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     components = read(write_template(Path(folder, "parts.yaml"), "components"))
    >>> list(components.points)
    ['bed', 'column', 'table']
    """
    document = parse(Path(path))
    document.check_version(FILE_VERSION)
    part: ComponentFile | None = validate(ComponentFile, document.data, (), document=document)
    result = None if part is None else _components(part, document)
    if document.faults or result is None:
        raise FileFaults(str(path), document.text, document.faults)
    return result


def _components(part: ComponentFile, document: Document) -> Components | None:
    _check_order(part, document)
    bodies = _checked(part, document)
    axes = {name: axis for name, described in part.axes.items() if (axis := _axis(name, described, part, document)) is not None}
    for name, point in part.points.items():
        _check_known(("points", name, "body"), point.body, [*part.components, GROUND], document)
    measured = [str(point) for points in part.measured_points().values() for point in points]
    for key, point_name in (("tool", part.tool), ("table", part.table)):
        if point_name is not None:
            _check_known((key,), point_name, [*part.points, *measured], document)
    tool_axis = _unit(part.tool_axis)
    if tool_axis is None:
        document.fault(("tool_axis",), f"{part.tool_axis!r}: must be a letter or a vector that is not zero")
        return None
    cutting = None if part.cutting is None else cutting_of(part.cutting, document)
    if document.faults:
        return None
    return Components(
        part.name, dict(part.parents) if part.parents is not None else part.chain or (), part.measured_points(), bodies,
        {name: MassDeviation(**c.uncertainty.model_dump()) for name, c in part.components.items()}, axes,
        {name: PointDescription(p.body, p.at) for name, p in part.points.items()}, part.tool, part.table, cutting,
        tool_axis, part.coordinate_deviation, part.calibration_deviation,
        None if part.frame is None else FrameDescription(part.frame.at, part.frame.rotation))


def _check_known(key: Key, name: str, listed: list[str], document: Document) -> None:
    if name not in listed:
        document.fault(key, f"there is no {name!r}; " + (suggestion(name, listed) or f"known: {', '.join(listed[:20])}"))


def _check_order(part: ComponentFile, document: Document) -> None:
    if (part.chain is None) == (part.parents is None):
        document.fault(("chain",),
                       "chain and parents: one of them must be there; chain: [ground, bed, column] where each carries "
                       "the next, parents: {bed: ground, column: bed, table: bed} for a tree")
        return
    if part.chain is not None:
        named: list[tuple[Key, str]] = [(("chain", i), name) for i, name in enumerate(part.chain)]
    else:
        assert part.parents is not None
        named = [(("parents", child), name) for child, parent in part.parents.items() for name in (child, parent)]
    for key, name in named:
        if name != GROUND and name not in part.components:
            document.fault(key, f"there is no component {name!r}; known: {', '.join(part.components)}")
    for name in part.components:
        if name not in [listed for _, listed in named]:
            document.fault(("components", name), "is not in the chain; name it there, after the component that carries it")


def _checked(part: ComponentFile, document: Document) -> dict[str, BodyDescription]:
    owner: dict[Any, str] = {}
    for name, points in part.measured_points().items():
        for point in points:
            if owner.setdefault(point, name) != name:
                document.fault(("components", name, "points"), f"point {point} already belongs to {owner[point]}")
    bodies = {}
    for name, component in part.components.items():
        if component.body is not None:
            try:
                bodies[name] = body_of(component.body, document)
            except ToolpointError as error:
                document.fault(("components", name, "body"), str(error))
    return bodies


def _axis(name: str, described: DrivenAxisPart, part: ComponentFile, document: Document) -> DrivenAxis | None:
    key = ("axes", name)
    _check_known((*key, "moves"), described.moves, list(part.components), document)
    if (described.along is None) == (described.about is None):
        document.fault(key, "must have one of along (a slide) and about (a turn), a letter or a vector in the machine frame")
        return None
    turns = described.about is not None
    if turns and described.at is None:
        document.fault(key, "at: missing; an axis that turns needs a point of it")
        return None
    way = described.about if turns else described.along
    direction = _unit(way)
    if direction is None:
        document.fault(key, f"{way!r}: must be a letter or a vector that is not zero")
        return None
    limits, kind = (float("-inf"), float("inf")), units.ANGLE if turns else units.LENGTH
    try:
        at_test = units.quantity(described.at_test, kind)
        if described.limits is not None:
            lower, upper = units.quantities(described.limits, kind, 2)
            limits = (lower, upper)
    except units.UnitError as error:
        document.fault(key, str(error))
        return None
    if not limits[0] < limits[1] or not limits[0] <= at_test <= limits[1]:
        document.fault(key,
                       f"limits {limits[0]:g} .. {limits[1]:g}, at_test {at_test:g}; the lower limit must be below the upper, "
                       "and the axis between them in the test")
        return None
    return DrivenAxis(described.moves, direction, turns, described.at, limits, described.elastic_at, at_test)


def _unit(way: Any) -> tuple[float, float, float] | None:
    if isinstance(way, str):
        sign = -1.0 if way[0] == "-" else 1.0
        x, y, z = (sign * v for v in _AXES[way[-1]])
        return x, y, z
    vector = np.asarray(way, float)
    size = float(np.linalg.norm(vector))
    if not np.isfinite(size) or size == 0:
        return None
    x, y, z = (vector / size).tolist()
    return x, y, z


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of component files, for editors that check YAML while it is typed."""
    return file_schema(ComponentFile, "toolpoint component file")
