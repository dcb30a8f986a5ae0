r"""Names of files that say what was measured where: patterns such as ``Point_{output}_*`` or ``P{input}_hit*``.

``{output}`` and ``{input}`` stand for a point, or a point with its direction (``5``, ``5=+z``, ``5+z``, ``5z``);
``{output_direction}`` and ``{input_direction}`` (or ``{direction}`` for both) for a direction; ``*`` for anything. The pattern
is held against the name without its ending.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.vibration import Dof

_PLACES = {"output": r"(?P<output>[^_]+?)", "input": r"(?P<input>[^_]+?)", "direction": r"(?P<direction>[-+]?r?[xyzXYZ])",
           "output_direction": r"(?P<output_direction>[-+]?r?[xyzXYZ])",
           "input_direction": r"(?P<input_direction>[-+]?r?[xyzXYZ])"}
# A point with its direction as people write it: 5=+x, 5:-z, 5+x, 5x; letters of a point's own name are not directions.
_POINT = re.compile(r"(?P<point>.+?)(?:[=:](?P<way>[-+]?r?[xyz])|(?P<signed>[-+]r?[xyz])|(?<=\d)(?P<plain>r?[xyz]))?",
                    re.IGNORECASE)
PLACE_NAMES = ", ".join("{" + name + "}" for name in _PLACES)


@dataclass(frozen=True)
class NamedDofs:
    """Labels by a file's name: where it was measured and where it was struck, each None where it does not say."""

    output: Dof | None
    input: Dof | None


def dof_of(text: str, direction: str = "+x") -> Dof:
    """Return the Dof of a text such as ``5``, ``5:-z``, ``5=-z``, ``5-z`` or ``5z``; the direction where it names none."""
    match = _POINT.fullmatch(text.strip())
    if match is None:
        raise ToolpointError(f"{text!r}: no point; write POINT or POINT:DIRECTION, for example 5:-z")
    way = match["way"] or match["signed"] or match["plain"] or direction
    point = match["point"]
    return Dof(int(point) if point.lstrip("-").isdigit() else point, way.lower())


def read_names(paths: Sequence[Path], pattern: str) -> list[NamedDofs]:
    """Return what the names of files say by a pattern; raises ToolpointError where the pattern or a name does not fit."""
    expression = _compiled(pattern)
    result = []
    for path in paths:
        match = expression.fullmatch(path.stem)
        if match is None:
            raise ToolpointError(f"`name` {pattern}: does not fit {path.name!r}; write the parts of the name that are the "
                                 f"same, * for what does not matter, and places: {PLACE_NAMES}; for example Point_{{output}}_*")
        groups = match.groupdict()
        shared = groups.get("direction") or "+x"
        result.append(NamedDofs(_dof(groups, "output", shared), _dof(groups, "input", shared)))
    return result


def _dof(groups: dict[str, str | None], side: str, shared: str) -> Dof | None:
    text = groups.get(side)
    return None if text is None else dof_of(text, groups.get(f"{side}_direction") or shared)


def _compiled(pattern: str) -> re.Pattern[str]:
    parts = []
    for part in re.split(r"(\{[^}]*\}|\*)", pattern):
        name = part[1:-1] if part.startswith("{") else ""
        if name and name not in _PLACES:
            raise ToolpointError(f"`name` {pattern}: unknown place {part}; must be one of {PLACE_NAMES}, and * for anything")
        parts.append(_PLACES[name] if name else ".*?" if part == "*" else re.escape(part))
    if not any(f"(?P<{side}>" in "".join(parts) for side in ("output", "input")):
        raise ToolpointError(f"`name` {pattern}: names no point; must hold {{output}} or {{input}}, for example "
                             f"Point_{{output}}_*")
    try:
        return re.compile("".join(parts))
    except re.error:
        raise ToolpointError(f"`name` {pattern}: a place appears twice; must be there once") from None
