"""Places of a test's points beside the bodies of its components: their unit, and the frame in which they were measured.

Looked at before any fit: places in another unit or frame give joints that look like joints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.machine.components import Components
from toolpoint.machine.description import BodyDescription
from toolpoint.machine.description.frames import describe_frame
from toolpoint.machine.description.frames import frame as frame_transform
from toolpoint.machine.parts.mass import equivalent_cuboid
from toolpoint.spatial import registration, rotation
from toolpoint.spatial import transform as tf
from toolpoint.studies.measured.point_pairing import EQUAL_FIT_RATIO, axis_turns
from toolpoint.studies.measured.point_registration import unit_slip
from toolpoint.vibration import Modes

MAX_MACHINE_SPAN = 200.0  # m; the longest gantry mills reach over about 100 m
MIN_BODY_DISTANCE = 0.15  # of the machine's size: root-mean-square distance from points' boxes to bodies' that is doubted
MIN_ASKED_DISTANCE = 0.05  # of the machine's size: distance below which a turn that fits better is chance
MIN_BOX_POINTS = 6  # points of a body whose box says where both of its ends are
TINY_DISTANCE = 0.01  # of the machine's size: distance that needs no smaller one
MAX_NAMED_DISTANCE = 0.05  # of the machine's size: residual of points known by name, above which they fix no frame
_UNIT_REMEDY = "write the unit in the first line of a CSV file (point,x [mm],y [mm],z [mm]), or in set 164 of a universal file"
Point = str | int


@dataclass(frozen=True, eq=False)
class TestPlacement:
    """Frame of a test in the machine: `transform` (4, 4) from test to machine frame, m, with doubts."""

    transform: FloatArray
    doubts: tuple[Doubt, ...] = ()

    def places(self, points: Mapping[Point, FloatArray]) -> dict[Point, FloatArray]:
        """Return points in the machine frame, m."""
        return {name: tf.move(self.transform, np.asarray(position, float)[None])[0] for name, position in points.items()}

    def turned(self, modes: Modes) -> Modes:
        """Return modes with their directions in the machine frame."""
        if np.array_equal(self.transform[:3, :3], np.eye(3)):
            return modes
        rotation = self.transform[:3, :3]
        return replace(modes, dofs=tuple(dof.turned(rotation) for dof in modes.dofs),
                       input_dofs=tuple(dof.turned(rotation) for dof in modes.input_dofs))


def place_test(points: Mapping[Point, FloatArray], components: Components) -> TestPlacement:
    """Return the frame in which the points of components were measured.

    A `frame` of the component file is taken as it is. Else the test's frame is the machine's where the boxes of the points lie
    at the boxes of the bodies (uniform cuboids of their inertia); where not, three points that the file places by name fix it,
    or one of the 24 turns of axes onto axes that brings the boxes clearly nearer, as in `correlate`. A frame that was found is
    doubted, with the key that says it.

    Parameters
    ----------
    points : mapping of name to (3,) position in the test's frame, m
    components : Components

    Raises
    ------
    ToolpointError
        For points whose span no machine has, or which another unit than metres explains; for a turned frame that the bodies do
        not tell apart from another.

    >>> import numpy as np
    >>> from toolpoint.machine.components import Components
    >>> points = {name: np.array(place) for name, place in {1: (0, 0, 0), 2: (1, 0, 0), 3: (0, 1, 0)}.items()}
    >>> placement = place_test(points, Components("table", ("ground", "table"), {"table": (1, 2, 3)}))
    >>> np.array_equal(placement.transform, np.eye(4))  # no body says otherwise
    True
    """
    used = {name: np.array([points[point] for point in names if point in points], float).reshape(-1, 3)
            for name, names in components.points.items()}
    used = {name: places for name, places in used.items() if len(places)}
    if not used:
        return TestPlacement(np.eye(4))
    _check_span(np.concatenate(list(used.values())))
    boxes = {name: _body_box(components.bodies[name]) for name in used if name in components.bodies}
    if boxes:
        _check_unit({name: used[name] for name in boxes}, boxes)
    if components.frame is not None:
        stated = frame_transform(components.frame)
        return TestPlacement(stated, _distance_doubts(stated, used, boxes))
    return _find_frame(points, used, boxes, components)


def _check_span(places: FloatArray) -> None:
    span = float(np.ptp(places, axis=0).max())
    if span > MAX_MACHINE_SPAN:
        raise ToolpointError(f"`geometry`: the points of the components span {span:.4g} m; must be at most "
                             f"{MAX_MACHINE_SPAN:g} m, the size of a machine; were they written in mm? {_UNIT_REMEDY}")


def _check_unit(used: Mapping[str, FloatArray], boxes: Mapping[str, FloatArray]) -> None:
    sizes = [float(np.linalg.norm(np.ptp(np.concatenate(list(parts.values())), axis=0))) for parts in (used, boxes)]
    words = unit_slip(sizes[0] / max(sizes[1], 1e-300)) if sizes[0] > 0 else None
    if words is not None:
        raise ToolpointError(f"`geometry`: the points of the components span {sizes[0]:.4g} m, their bodies {sizes[1]:.4g} m: "
                             f"{words}; must be of one size; {_UNIT_REMEDY}, or correct the unit of the bodies")


def _body_box(body: BodyDescription) -> FloatArray:
    """Return the corners (8, 3) of the uniform cuboid of a body's inertia, in the machine frame, m."""
    centre, axes, edges = equivalent_cuboid(body)
    signs = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T
    return np.asarray(tf.move(frame_transform(body.frame), centre + (signs * edges) @ axes.T))


def _extents(places: FloatArray) -> FloatArray:
    return np.stack([places.min(axis=0), places.max(axis=0)])


def _distance(matrix: FloatArray, used: Mapping[str, FloatArray], boxes: Mapping[str, FloatArray]) -> float:
    """Return the root-mean-square difference of the ends of points' boxes and bodies' boxes, m.

    Of a body with few points only what lies outside its box counts: three points span no box.
    """
    gaps = []
    for name, box in boxes.items():
        gap = _extents(tf.move(matrix, used[name])) - _extents(box)
        gaps.append(gap if len(used[name]) >= MIN_BOX_POINTS else np.array([np.minimum(gap[0], 0), np.maximum(gap[1], 0)]))
    return float(np.sqrt(np.mean(np.square(gaps))))


def _machine_size(boxes: Mapping[str, FloatArray]) -> float:
    return float(np.linalg.norm(np.ptp(np.concatenate(list(boxes.values())), axis=0)))


def _distance_doubts(matrix: FloatArray, used: Mapping[str, FloatArray], boxes: Mapping[str, FloatArray]
                     ) -> tuple[Doubt, ...]:
    """Doubt points that do not lie at their bodies, naming the component that is farthest away."""
    if not boxes or _distance(matrix, used, boxes) < MIN_BODY_DISTANCE * _machine_size(boxes):
        return ()
    gaps = {name: _distance(matrix, used, {name: box}) for name, box in boxes.items()}
    farthest = max(gaps, key=lambda name: gaps[name])
    return (Doubt("frame",
                  f"the points of {farthest} lie {1e3 * gaps[farthest]:.3g} mm from the box of its body (root mean square "
                  "of the ends): the test's frame, its points or the body's centre may be wrong",
                  "check centre and points, or say the test's frame with `frame: {at: .., rotation: ..}`",
                  figure=gaps[farthest] / _machine_size(boxes)),)


def _find_frame(points: Mapping[Point, FloatArray], used: Mapping[str, FloatArray], boxes: Mapping[str, FloatArray],
                components: Components) -> TestPlacement:
    named = _named_frame(points, components)
    if named is not None:
        return TestPlacement(named, _frame_doubts(named, "as the points of the same names say"))
    if not boxes:
        return TestPlacement(np.eye(4))
    size, unmoved_distance = _machine_size(boxes), _distance(np.eye(4), used, boxes)
    fits = sorted(((_distance(matrix, used, boxes), k, matrix) for k, matrix in enumerate(_placings(used, boxes))),
                  key=lambda fit: fit[:2])
    best, _, matrix = fits[0]
    if unmoved_distance < MIN_BODY_DISTANCE * size:
        return TestPlacement(np.eye(4), _turned_doubts(fits, unmoved_distance, size))
    if EQUAL_FIT_RATIO * best > unmoved_distance or best > MIN_BODY_DISTANCE * size:
        return TestPlacement(np.eye(4), _distance_doubts(np.eye(4), used, boxes))
    equal_fits = [fit for fit in fits if fit[0] < EQUAL_FIT_RATIO * best or fit[0] < TINY_DISTANCE * size]
    unturned = next((fit for fit in equal_fits if np.allclose(fit[2][:3, :3], np.eye(3))), None)
    if unturned is not None:  # moved only: of placings that fit alike, the one that turns nothing
        best, _, matrix = unturned
    elif len(equal_fits) > 1:
        raise ToolpointError(
            f"`frame`: the points lie {1e3 * unmoved_distance:.3g} mm from the boxes of their bodies, so the test's frame is "
            f"another than "
            f"the machine's; {_frame_text(matrix)} ({1e3 * best:.3g} mm) and {_frame_text(fits[1][2])} ({1e3 * fits[1][0]:.3g} "
            "mm) fit alike; write the right one into the component file, or place three points of the test under points:")
    return TestPlacement(matrix, _frame_doubts(matrix, f"{1e3 * best:.3g} mm from the bodies' boxes, "
                                                       f"{1e3 * unmoved_distance:.3g} mm as "
                                               "measured"))


def _turned_doubts(fits: Sequence[tuple[float, int, FloatArray]], unmoved_distance: float, size: float) -> tuple[Doubt, ...]:
    """Doubt a frame that fits, but far worse than a turned one: of a machine about as wide as high.

    fits : (distance in m, number, transform) of the 24 turns, the nearest first; size : of the machine, m.
    """
    best, _, matrix = fits[0]
    unturned = min(fit[0] for fit in fits if np.allclose(fit[2][:3, :3], np.eye(3)))
    # Where a mere move explains as much, or the unmoved frame is as good as boxes can say, no turn is asked about.
    if EQUAL_FIT_RATIO * best > min(unturned, unmoved_distance) or unmoved_distance < MIN_ASKED_DISTANCE * size:
        return ()
    return (Doubt("frame", f"the points lie {1e3 * unmoved_distance:.3g} mm from the boxes of their bodies, and "
                  f"{1e3 * best:.3g} mm with {_frame_text(matrix)}: the test may be turned; it was taken as it is",
                  "write the right frame into the component file, or place three points of the test under points:",
                  figure=unmoved_distance / size),)


def _placings(used: Mapping[str, FloatArray], boxes: Mapping[str, FloatArray]) -> list[FloatArray]:
    """Return the 24 turns of axes onto axes, each moved so that the boxes lie nearest."""
    result = []
    for turn in axis_turns():
        shift = np.mean([(_extents(box) - _extents(used[name] @ turn.T)).mean(axis=0) for name, box in boxes.items()], axis=0)
        result.append(tf.transform(turn, shift))
    return result


def _named_frame(points: Mapping[Point, FloatArray], components: Components) -> FloatArray | None:
    """Return the frame that points placed by the file and measured under the same name fix, None for fewer than three."""
    measured = {str(name): np.asarray(position, float) for name, position in points.items()}
    shared = [name for name in components.places if name in measured]
    try:
        fit = registration.rigid([measured[name] for name in shared], [components.places[name].at for name in shared])
    except ToolpointError:  # fewer than three, or on one line
        return None
    size = float(np.linalg.norm(np.ptp([measured[name] for name in shared], axis=0)))
    return fit.transform if fit.residual < MAX_NAMED_DISTANCE * size else None


def _frame_doubts(matrix: FloatArray, why: str) -> tuple[Doubt, ...]:
    if np.allclose(matrix, np.eye(4), atol=0.02):
        return ()
    angle = float(np.degrees(np.linalg.norm(rotation.to_vector(matrix[:3, :3]))))
    shift = 1e3 * float(np.linalg.norm(matrix[:3, 3]))
    return (Doubt("frame", f"the test's frame is turned by {angle:.3g} deg and moved by {shift:.4g} mm against that of the "
                  f"bodies ({why}); points and directions were taken through it",
                  f"say so in the component file with `{_frame_text(matrix)}`, or correct the places"),)


def _frame_text(matrix: FloatArray) -> str:
    """Return the key of a component file that says a frame."""
    described = describe_frame(matrix)
    origin = ", ".join(f"{v:.6g}" for v in np.round(described.at, 6) + 0.0)
    angles = ", ".join(f"{v:.6g} deg" for v in np.round(np.degrees(described.rotation), 4) + 0.0)
    return f"frame: {{at: [{origin}], rotation: [{angles}]}}"
