"""Labels of a measurement or of modes that are x, y and z of the tool, for every question about a cut."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.vibration import Dof, Frf, Modes

MAX_LISTED_LABELS = 4  # in a message


@dataclass(frozen=True)
class ToolDirections:
    """Labels of the directions of a cut: x in the cutting plane, y across (``same``: as x; None: rigid), z axial or None.

    notes : what was assumed.
    """

    x: str
    y: str | None
    z: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def labels(self) -> list[str]:
        """Labels of the known directions, x first."""
        return list(dict.fromkeys([self.x, *(label for label in (self.y, self.z) if label not in (None, "same"))]))


def driving_points(response: Modes | Frf) -> tuple[Dof, ...]:
    """Return the labels with both response and force: all of modes, of responses those among outputs and inputs."""
    return response.dofs if isinstance(response, Modes) else tuple(dof for dof in response.outputs if dof in response.inputs)


def check_driving_points(frf: Frf, what: str = "the data") -> tuple[Dof, ...]:
    """Return the labels of the driving points; raises ToolpointError where the responses have none (cross responses only)."""
    labels = driving_points(frf)
    if not labels:
        raise ToolpointError(f"{what}: no driving point: responses at {list_labels(frf.outputs)}, forces at "
                             f"{list_labels(frf.inputs)}; the cut needs the response where the force acts")
    return labels


def tool_directions(labels: Sequence[Dof], x: str | None = None, y: str | None = None, *, what: str = "the data"
                    ) -> ToolDirections:
    """Return which of the labels of driving points are x, y and z of the tool.

    Parameters
    ----------
    labels : sequence of Dof
        With response and force, see `driving_points`.
    x, y : label such as ``tip:+x``, optional
        Where left out: x is the only label along an x axis, else the only label; y that of x's point along y, else ``same``
        (as along x, which a note says). y may be ``same`` or ``rigid``.
    what : str
        What the labels are of, for messages.

    z is the label of x's point along z where there is one. Raises ToolpointError where several points could be meant, or a
    label is not there.
    """
    # Rotations and oblique directions have no axis of the tool.
    straight = [dof for dof in labels if dof.vector is None and not dof.is_rotation]
    chosen = _only_x(straight, labels, what) if x is None else _find_label(x, labels, "x", what)
    axial = Dof(chosen.point, "+z")
    z = str(axial) if axial in labels and chosen != axial else None
    if y == "rigid":
        return ToolDirections(str(chosen), None, z, ("the tool is taken as rigid along y",))
    if y not in (None, "same"):
        return ToolDirections(str(chosen), str(_find_label(str(y), labels, "y", what)), z)
    across_labels = [dof for dof in straight
                     if dof.point == chosen.point and dof.direction[1:] == "y" and chosen.direction[1:] == "x"]
    if y is None and len(across_labels) == 1:
        return ToolDirections(str(chosen), str(across_labels[0]), z)
    return ToolDirections(str(chosen), "same", z, (f"the response across is taken as that along ({chosen}); `y` rigid takes "
                                                   "none",))


def _only_x(straight: Sequence[Dof], labels: Sequence[Dof], what: str) -> Dof:
    if not straight:
        raise ToolpointError(f"{what}: no point with both response and force, which the cut needs")
    along = [dof for dof in straight if dof.direction[1:] == "x"] or straight
    if len(along) != 1:
        raise ToolpointError(f"{what}: which point cuts? It holds {list_labels(labels)}; name x with `x`, for example "
                             f"`x` {along[0]}")
    return along[0]


def _find_label(label: str, labels: Iterable[Dof], argument: str, what: str) -> Dof:
    dof = Dof.parse(label)
    if dof not in labels:
        raise ToolpointError(f"`{argument}` {label}: not in {what}; it holds {list_labels(list(labels))}")
    return dof


def list_labels(labels: Sequence[Dof]) -> str:
    """Return the first labels in words."""
    return ", ".join(map(str, labels[:MAX_LISTED_LABELS])) + (" ..." if len(labels) > MAX_LISTED_LABELS else "")


def along_positive_axes(frf: Frf) -> Frf:
    """Return responses with outputs and forces along negative axes turned round.

    A hammer from the other side gives the opposite sign. Where both senses of a direction were measured, each keeps its label.
    """
    (rows, signs), (columns, turns) = _positive_directions(frf.outputs), _positive_directions(frf.inputs)
    draws = None if frf.draws is None else frf.draws * np.outer(signs, turns)
    return replace(frf, values=frf.values * np.outer(signs, turns), outputs=tuple(rows), inputs=tuple(columns), draws=draws)


def _positive_directions(labels: tuple[Dof, ...]) -> tuple[list[Dof], list[int]]:
    positive = [Dof(dof.point, "+" + dof.direction[1:]) if dof.vector is None else dof for dof in labels]
    if len(set(positive)) < len(positive):
        return list(labels), [1] * len(labels)
    return positive, [1 if dof.vector is not None or dof.direction[0] == "+" else -1 for dof in labels]
