"""Cartesian machines as chains: linear axes stacked on the tool side and on the table side."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from toolpoint._check import fail, one_of
from toolpoint.kinematics.axis import Axis, Drive
from toolpoint.kinematics.tree import TreeChain


def cartesian(tool_side: Iterable[str], table_side: Iterable[str]) -> TreeChain:
    """Return the chain of a Cartesian machine; axis names X, Y, Z from the ground outward, e.g. (``Z``,) and (``Y``, ``X``).

    The tool-side links come first, then the table-side ones. By ISO 841 a positive axis moves the tool relative to the
    work in the positive direction: table-side axes move the table the other way.

    Raises ToolpointError for other names, and for an axis on both sides.

    Examples
    --------
    A machine whose spindle moves along Z and whose table moves along Y and X:

    >>> chain = cartesian(("Z",), ("Y", "X"))
    >>> chain.relative_position({"X": 0.1, "Z": 0.2}, tool=(0, [0, 0, 0]), table=(2, [0, 0, 0]))[0].tolist()
    [0.1, 0.0, 0.2]
    """
    parents: list[int] = []
    axes: list[Axis] = []
    for side, names in (("tool", list(tool_side)), ("table", list(table_side))):
        previous = -1
        for name in names:
            direction = one_of(f"{side} side", name.lower(), "xyz")
            if any(axis.name == name for axis in axes):
                fail(f"{side} side", f"axis {name} appears twice", "each axis moves one link")
            axes.append(Axis(name, (Drive(len(parents), direction if side == "tool" else "-" + direction),)))
            parents.append(previous)
            previous = len(parents) - 1
    return TreeChain(tuple(parents), np.broadcast_to(np.eye(4), (len(parents), 4, 4)), tuple(axes))
