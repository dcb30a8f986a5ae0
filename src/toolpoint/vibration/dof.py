"""Dof: the label of one degree of freedom, a point and a direction, shared by all nouns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, fail, floats
from toolpoint._notebook import NotebookText

AXES = ("x", "y", "z", "rx", "ry", "rz")
DIRECTIONS = tuple(sign + axis for sign in "+-" for axis in AXES)
_OBLIQUE_PATTERN = re.compile(r"(.*)<([^<>]*)>")


@dataclass(frozen=True, order=True)
class Dof(NotebookText):
    """One degree of freedom: a point and a direction.

    Parameters
    ----------
    point : str or int
        Name or number of the point.
    direction : str
        One of ``+x -x +y -y +z -z +rx -rx +ry -ry +rz -rz`` (``x`` is read as ``+x``), or, with `vector`, any label.
    vector : 3 floats, optional
        Unit direction in the machine frame for a direction off the axes.

    Raises
    ------
    ToolpointError
        For an empty point, an unknown direction, or a vector that is not of unit length.

    Examples
    --------
    >>> from toolpoint.vibration import Dof
    >>> Dof("tool", "x").text, Dof.parse("7:-rz").is_rotation
    ('tool:+x', True)
    """

    point: str | int
    direction: str
    vector: tuple[float, float, float] | None = field(default=None)

    def __post_init__(self) -> None:
        if not isinstance(self.point, (str, int)) or self.point == "":
            fail("Dof.point", repr(self.point), "must be a name or a number")
        if self.vector is not None:
            self._check_vector()
            return
        direction = self.direction if self.direction[:1] in "+-" else "+" + self.direction
        if direction not in DIRECTIONS:
            fail("Dof.direction", repr(self.direction), "must be one of +x .. -rz", remedy="or give a unit vector and a label")
        object.__setattr__(self, "direction", direction)

    def _check_vector(self) -> None:
        vector = floats("Dof.vector", np.asarray(self.vector, float), (3,))
        length = float(np.linalg.norm(vector))
        if abs(length - 1) > 1e-6:
            fail("Dof.vector", f"length {length:g}", "must be a unit vector", remedy="divide it by its length")
        object.__setattr__(self, "vector", tuple(float(v) for v in vector))

    @classmethod
    def parse(cls, text: str) -> Dof:
        """Read ``"point:direction"``, e.g. ``"tool:+x"``; a bare number is a point number.

        A direction off the axes comes with its unit vector, ``"tool:slant<0.6,0,0.8>"``, as `text` writes it.
        """
        point, separator, direction = text.rpartition(":")
        if not separator or not point:
            fail("Dof", repr(text), "must read point:direction", remedy="for example tool:+x")
        name = int(point) if re.fullmatch(r"-?[0-9]+", point) else point
        oblique = _OBLIQUE_PATTERN.fullmatch(direction)
        if oblique is None:
            return cls(name, direction)
        try:
            x, y, z = (float(number) for number in oblique[2].split(","))
        except ValueError:
            fail("Dof", repr(text), "must give three numbers of a unit vector", remedy="for example tool:slant<0.6,0,0.8>")
        return cls(name, oblique[1], (x, y, z))

    @property
    def text(self) -> str:
        """Label as text that `parse` reads back, with the vector of a direction off the axes."""
        return str(self) if self.vector is None else f"{self}<{','.join(map(repr, self.vector))}>"

    @property
    def is_rotation(self) -> bool:
        """Whether the direction is a rotation."""
        return self.vector is None and "r" in self.direction

    @property
    def unit(self) -> FloatArray:
        """Unit twist (v, w) of the direction, shape (6,)."""
        twist = np.zeros(6)
        if self.vector is not None:
            twist[:3] = self.vector
        else:
            twist[AXES.index(self.direction[1:])] = -1.0 if self.direction[0] == "-" else 1.0
        return twist

    def turned(self, rotation: FloatArray, point: str | int | None = None) -> Dof:
        """Return the Dof with its direction turned by a rotation (3, 3), at another point where one is given.

        A direction within 1e-6 of an axis becomes that axis. Raises ToolpointError for a rotational Dof that is turned off the
        axes, which no label can hold.
        """
        name = self.point if point is None else point
        prefix = "r" if self.is_rotation else ""
        vector = rotation @ (self.unit[3:] if prefix else self.unit[:3])
        largest = int(np.argmax(np.abs(vector)))
        if abs(vector[largest]) > 1 - 1e-6:
            return Dof(name, ("+" if vector[largest] > 0 else "-") + prefix + "xyz"[largest])
        if prefix:
            fail("Dof", f"{self} turned off the axes", "a rotation must be about an axis", remedy="leave rotational Dofs out")
        return Dof(name, f"test {self.direction}", (float(vector[0]), float(vector[1]), float(vector[2])))

    def __str__(self) -> str:
        return f"{self.point}:{self.direction}"


def dofs(labels: Iterable[Dof | str]) -> tuple[Dof, ...]:
    """Return labels as Dofs; text is read by `Dof.parse`."""
    if isinstance(labels, (str, Dof)):
        labels = [labels]
    return tuple(label if isinstance(label, Dof) else Dof.parse(label) for label in labels)


def check_labels(name: str, labels: Iterable[Dof | str], length: int) -> tuple[Dof, ...]:
    """Return labels as Dofs after checking their number; repeated labels are refused."""
    result = dofs(labels)
    if len(result) != length:
        fail(name, f"{len(result)} labels for {length} rows", "must be one label for each")
    if len(set(result)) != length:
        repeated = next(dof for dof in result if result.count(dof) > 1)
        fail(name, f"{repeated} appears twice", "labels must differ", remedy="name the points apart or remove one")
    return result


def positions(name: str, dofs: Iterable[Dof | str | int], labels: Sequence[Dof]) -> list[int]:
    """Return the indices in `labels` of Dofs, their texts or plain indices.

    Raises ToolpointError for a label that is not among them, with some that are.
    """
    if isinstance(dofs, (str, Dof, int)):
        dofs = [dofs]
    # One table for all: looking each label up in the list takes the square of their number.
    places = {label: k for k, label in reversed(list(enumerate(labels)))}
    return [_position(name, dof, labels, places) for dof in dofs]


def _position(name: str, wanted: Dof | str | int, labels: Sequence[Dof], places: Mapping[Dof, int]) -> int:
    """Return the index of a label, or a plain index after checking that it is within the labels."""
    if isinstance(wanted, (int, np.integer)):
        if not -len(labels) <= wanted < len(labels):
            fail(name, f"index {wanted}", f"must be within 0 .. {len(labels) - 1}")
        return int(wanted) % len(labels)
    dof = wanted if isinstance(wanted, Dof) else Dof.parse(wanted)
    index = places.get(dof)
    if index is None:
        listed = ", ".join(str(label) for label in labels[:6]) + (" ..." if len(labels) > 6 else "")
        fail(name, f"no {dof}", f"must be one of {listed}")
    return index


def summary(labels: Sequence[Dof]) -> str:
    """Return a short count of labels for a repr, e.g. ``131x3`` for 131 points with three directions each."""
    points = {label.point for label in labels}
    if len(labels) > 1 and len(points) > 1 and len(labels) % len(points) == 0 and len(labels) != len(points):
        return f"{len(points)}x{len(labels) // len(points)}"
    return str(len(labels))
