"""Component files in YAML: which measured points belong to which component, the chain, and the masses where known."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.document import Document, parse, validate
from toolpoint.io.yaml.machine_file import body_of
from toolpoint.io.yaml.machine_schema import BodyModel, Part
from toolpoint.machine.components import Components
from toolpoint.machine.description import GROUND, BodyDescription

VERSION = 1
_RANGE = re.compile(r"(\d+)\s*-\s*(\d+)")


class ComponentPart(Part):
    """Points of a component (numbers, names, or ranges such as ``"12-40"``), and its mass properties where known."""

    points: tuple[int | str, ...]
    body: BodyModel | None = None


class ComponentFile(Part):
    """The keys of a component file."""

    toolpoint: int
    name: str
    chain: tuple[str, ...]
    components: dict[str, ComponentPart]

    def points(self) -> dict[str, list[int | str]]:
        """Return the points of every component, ranges written out."""
        return {name: [point for entry in part.points for point in _written_out(entry)]
                for name, part in self.components.items()}


def _written_out(entry: int | str) -> list[int | str]:
    match = _RANGE.fullmatch(entry.strip()) if isinstance(entry, str) else None
    return [entry] if match is None else list(range(int(match[1]), int(match[2]) + 1))


@door("component file")
def read(path: str | Path) -> Components:
    """Return the components of a file; raises FileFaults with every fault."""
    document = parse(Path(path))
    if document.data.get("toolpoint") != VERSION:
        document.fault(("toolpoint",), f"file version {document.data.get('toolpoint')!r}; this program reads version {VERSION}")
    part: ComponentFile | None = validate(ComponentFile, document.data, (), document=document)
    bodies = {} if part is None else _checked(part, document)
    if document.faults or part is None:
        raise FileFaults(str(path), document.text, document.faults)
    return Components(part.name, part.chain, part.points(), bodies)


def _checked(part: ComponentFile, document: Document) -> dict[str, BodyDescription]:
    links = list(part.chain)
    for i, name in enumerate(links):
        if name != GROUND and name not in part.components:
            document.fault(("chain", i), f"there is no component {name!r}; known: {', '.join(part.components)}")
    for name in part.components:
        if name not in links:
            document.fault(("components", name), "is not in the chain; name it there, after the component that carries it")
    owner: dict[Any, str] = {}
    for name, points in part.points().items():
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
