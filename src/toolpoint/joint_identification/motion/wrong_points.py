"""Points left out of the motion of their component: exchanged places, exchanged names, then one that lies elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.motion.body_misfit import without_points
from toolpoint.joint_identification.motion.exchanged_names import find_exchanged_names
from toolpoint.joint_identification.motion.exchanged_points import ExchangedPoints, find_exchanged
from toolpoint.joint_identification.motion.measured import Component, Point
from toolpoint.joint_identification.motion.misplaced_points import MisplacedPoint, find_misplaced


@dataclass(frozen=True, eq=False)
class WrongPoints:
    """Points that are not where they are stated, and the components without them.

    parts : components at their stated places, without the exchanged points; places : by point, m, where the left-out ones are.
    """

    exchanged: tuple[ExchangedPoints, ...]
    misplaced: tuple[MisplacedPoint, ...]
    parts: Mapping[str, Component]

    @property
    def places(self) -> dict[Point, FloatArray]:
        """Map from a left-out point to its place (3,), m."""
        places = {point: place for each in self.exchanged for point, place in each.places.items()}
        return {**places, **{each.point: each.place for each in self.misplaced}}

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the left-out points."""
        return (*(each.doubt for each in self.exchanged if each.doubt is not None), *(each.doubt for each in self.misplaced))

    def left_out_of(self, points: Mapping[Point, ArrayLike], components: Mapping[str, Sequence[Point]]
                    ) -> tuple[dict[Point, ArrayLike], dict[str, Sequence[Point]]]:
        """Return the points with the wrong ones where they are, and the components without them."""
        places = self.places
        return {**points, **places}, {name: [point for point in labels if point not in places]
                                      for name, labels in components.items()}

    def restored_to(self, components: Mapping[str, Sequence[Point]]) -> dict[str, Sequence[Point]]:
        """Return the components with the points that were left out: a force at one of them acts on its component."""
        left_out = {name: [point for each in self.exchanged if each.component == name for point in each.places]
                    + [each.point for each in self.misplaced if each.component == name] for name in components}
        return {name: [*labels, *left_out[name]] for name, labels in components.items()}


def find_wrong_points(parts: Mapping[str, Component]) -> WrongPoints:
    """Return the points that are not where they are stated.

    parts : at their stated places, with the variance of noise and coordinates.
    """
    exchanged = find_exchanged(parts)
    parts = _without_exchanged(parts, exchanged)
    names = find_exchanged_names(parts)
    parts = _without_exchanged(parts, names)
    return WrongPoints((*exchanged, *names), tuple(find_misplaced(parts)), parts)


def _without_exchanged(parts: Mapping[str, Component], exchanged: Sequence[ExchangedPoints]) -> dict[str, Component]:
    """Return the components without their exchanged points."""
    result = dict(parts)
    for each in exchanged:
        part = result[each.component]
        result[each.component] = without_points(part, [part.points.index(point) for point in each.places])
    return result
