"""Doubts about a component file: masses and sizes of other units, places off the machine, travels and deviations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine.components import Components
from toolpoint.machine.description.extent import shape_size
from toolpoint.studies.machines.check.cut_doubts import question_cut
from toolpoint.studies.machines.check.machine_beliefs import MAX_BOX_DENSITY, MAX_TRAVEL, MIN_BOX_DENSITY, MIN_TRAVEL

# component of direction that the axis name stands for (ISO 841)
AXIS_INDEX_BY_NAME = {"X": 0, "Y": 1, "Z": 2, "A": 0, "B": 1, "C": 2}
COMPONENT_LENGTH_RANGE = (0.02, 25.0)  # m, of the longest side of a component
MAX_SIDE_RATIO = 60.0  # longest over shortest side
MAX_CENTRE_DISTANCE_RATIO = 3.0  # distance from the middle of the others over their spread: no part is farther off
MAX_RELATIVE_DEVIATIONS = {"mass": 0.5, "inertia": 1.0}  # of the number itself
MIN_ROTARY_SPAN = np.radians(5.0)  # rad, of an axis that turns


def question_components(file: Components) -> tuple[Doubt, ...]:
    """Return doubts about the numbers of a component file that are possible and hardly meant."""
    cut = () if file.cutting is None else question_cut(file.cutting)
    return (*_question_bodies(file), *_question_places(file), *_question_axes(file), *_question_deviations(file), *cut)


def _sizes(file: Components) -> dict[str, np.ndarray]:
    return {name: np.asarray(shape_size(body.shape)) for name, body in file.bodies.items() if body.shape is not None}


def _question_bodies(file: Components) -> Iterator[Doubt]:
    for name, size in _sizes(file).items():
        path, longest = f"components.{name}.body", float(size.max())
        odd = (not COMPONENT_LENGTH_RANGE[0] <= longest <= COMPONENT_LENGTH_RANGE[1]
               or longest > MAX_SIDE_RATIO * float(size.min()))
        if odd:
            yield Doubt(f"{path}.shape", f"{' x '.join(f'{v:.3g}' for v in size)} m", "check the unit of every side",
                        figure=longest)
        mass = file.bodies[name].mass
        if mass is None or odd:
            continue
        density = mass / float(np.prod(size))
        if not MIN_BOX_DENSITY <= density <= MAX_BOX_DENSITY:
            yield Doubt(f"{path}.mass", f"{mass:.4g} kg in {' x '.join(f'{v:.3g}' for v in size)} m is {density:.3g} kg/m^3",
                        "check the units of mass and size", figure=density)


def _question_places(file: Components) -> Iterator[Doubt]:
    """Doubt centres and points far off the box of all the others."""
    sizes = _sizes(file)
    centres = {f"components.{name}.body.centre": np.array(body.centre) for name, body in file.bodies.items()}
    points = {f"points.{name}": np.array(point.at) for name, point in file.places.items()}
    longest = float(np.median([size.max() for size in sizes.values()])) if sizes else 1.0
    places = {**centres, **points}
    for path, place in places.items():
        others = np.array([other for name, other in places.items() if name != path])
        if len(others) < 2:
            continue
        middle = np.median(others, axis=0)
        spread = max(float(np.median(np.abs(others - middle), axis=0).max()) * 2, longest)
        distance = float(np.linalg.norm(place - middle))
        if distance > MAX_CENTRE_DISTANCE_RATIO * spread:
            yield Doubt(path, f"{', '.join(f'{v:.4g}' for v in place)} m is {distance:.3g} m from the middle of the other "
                              f"parts, "
                        f"which spread over {spread:.2g} m", "check its unit", figure=distance / spread)


def _question_axes(file: Components) -> Iterator[Doubt]:
    for name, axis in file.axes.items():
        span = axis.limits[1] - axis.limits[0]
        span_min, span_max = (MIN_ROTARY_SPAN, 40 * np.pi) if axis.turns else (MIN_TRAVEL, MAX_TRAVEL)
        longest = max((float(size.max()) for size in _sizes(file).values()), default=MAX_TRAVEL)
        span_max = span_max if axis.turns else min(span_max, 6 * longest)
        span_min = span_min if axis.turns else max(span_min, longest / 300)
        if np.isfinite(span) and not span_min <= span <= span_max:
            yield Doubt(f"axes.{name}.limits", f"travels {np.degrees(span):.4g} degrees" if axis.turns else
                        f"travels {span:.4g} m", "check the unit of its limits", figure=span)
        way = np.abs(np.array(axis.direction))
        if (name in AXIS_INDEX_BY_NAME and axis.turns == (name in "ABC") and way.max() > 0.99
            and way[AXIS_INDEX_BY_NAME[name]] < 0.1):
            yield Doubt(f"axes.{name}", f"{'turns about' if axis.turns else 'moves along'} {'xyz'[int(way.argmax())]}, not its "
                        "own direction", "check `along` or `about`")


def _question_deviations(file: Components) -> Iterator[Doubt]:
    sizes = _sizes(file)
    for name, deviation in file.deviations.items():
        for key, limit in MAX_RELATIVE_DEVIATIONS.items():
            value = getattr(deviation, key)
            if value > limit or 0 < value < 1e-4:
                yield Doubt(f"components.{name}.uncertainty.{key}", f"{100 * value:.4g} %", "a share with its unit: 5 %",
                            figure=value)
        size = float(sizes[name].max()) if name in sizes else 1.0
        if deviation.centre > 0.5 * size or 0 < deviation.centre < 2e-5:
            yield Doubt(f"components.{name}.uncertainty.centre", f"{1e3 * deviation.centre:.4g} mm on a part of {size:.3g} m",
                        "check its unit", figure=deviation.centre / size)
    longest = max((float(size.max()) for size in sizes.values()), default=1.0)
    if file.coordinate_deviation > 0.1 * longest or 0 < file.coordinate_deviation < 2e-6:
        yield Doubt("coordinate_deviation", f"{1e3 * file.coordinate_deviation:.4g} mm of points on parts up to {longest:.3g} "
                    "m", "check its unit", figure=file.coordinate_deviation)
    if file.calibration_deviation is not None and (file.calibration_deviation > 0.3 or 0 < file.calibration_deviation < 1e-4):
        yield Doubt("calibration_deviation", f"{100 * file.calibration_deviation:.4g} %", "a share with its unit: 2 %",
                    figure=file.calibration_deviation)
