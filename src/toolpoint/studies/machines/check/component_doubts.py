"""Doubts about a component file: masses and sizes of other units, places off the machine, travels and deviations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine.components import Components
from toolpoint.machine.description.extent import shape_size
from toolpoint.studies.machines.check.cut_doubts import question_cut
from toolpoint.studies.machines.check.machine_beliefs import DENSEST, FURTHEST, LIGHTEST, SHORTEST

NAMED = {"X": 0, "Y": 1, "Z": 2, "A": 0, "B": 1, "C": 2}  # axes whose name says what they move along or about (ISO 841)
SIZE = (0.02, 25.0)  # m, of the longest side of a component
SIDES_APART = 60.0  # longest over shortest side
APART = 3.0  # sizes of the others, from their middle: no part of the machine stands there
MOST_DEVIATION = {"mass": 0.5, "inertia": 1.0}  # shares
LEAST_TURN = np.radians(5.0)


def question_components(file: Components) -> tuple[Doubt, ...]:
    """Return doubts about the numbers of a component file that are possible and hardly meant."""
    cut = () if file.cutting is None else question_cut(file.cutting)
    return (*_bodies(file), *_places(file), *_axes(file), *_deviations(file), *cut)


def _sizes(file: Components) -> dict[str, np.ndarray]:
    return {name: np.asarray(shape_size(body.shape)) for name, body in file.bodies.items() if body.shape is not None}


def _bodies(file: Components) -> Iterator[Doubt]:
    for name, size in _sizes(file).items():
        path, longest = f"components.{name}.body", float(size.max())
        odd = not SIZE[0] <= longest <= SIZE[1] or longest > SIDES_APART * float(size.min())
        if odd:
            yield Doubt(f"{path}.shape", f"{' x '.join(f'{v:.3g}' for v in size)} m", "check the unit of every side",
                        figure=longest)
        mass = file.bodies[name].mass
        if mass is None or odd:
            continue
        density = mass / float(np.prod(size))
        if not LIGHTEST <= density <= DENSEST:
            yield Doubt(f"{path}.mass", f"{mass:.4g} kg in {' x '.join(f'{v:.3g}' for v in size)} m is {density:.3g} kg/m^3",
                        "check the units of mass and size", figure=density)


def _places(file: Components) -> Iterator[Doubt]:
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
        away = float(np.linalg.norm(place - middle))
        if away > APART * spread:
            yield Doubt(path, f"{', '.join(f'{v:.4g}' for v in place)} m is {away:.3g} m from the middle of the other parts, "
                        f"which spread over {spread:.2g} m", "check its unit", figure=away / spread)


def _axes(file: Components) -> Iterator[Doubt]:
    for name, axis in file.axes.items():
        span = axis.limits[1] - axis.limits[0]
        low, high = (LEAST_TURN, 40 * np.pi) if axis.turns else (SHORTEST, FURTHEST)
        longest = max((float(size.max()) for size in _sizes(file).values()), default=FURTHEST)
        high = high if axis.turns else min(high, 6 * longest)
        low = low if axis.turns else max(low, longest / 300)
        if np.isfinite(span) and not low <= span <= high:
            yield Doubt(f"axes.{name}.limits", f"travels {np.degrees(span):.4g} degrees" if axis.turns else
                        f"travels {span:.4g} m", "check the unit of its limits", figure=span)
        way = np.abs(np.array(axis.direction))
        if name in NAMED and axis.turns == (name in "ABC") and way.max() > 0.99 and way[NAMED[name]] < 0.1:
            yield Doubt(f"axes.{name}", f"{'turns about' if axis.turns else 'moves along'} {'xyz'[int(way.argmax())]}, not its "
                        "own direction", "check `along` or `about`")


def _deviations(file: Components) -> Iterator[Doubt]:
    sizes = _sizes(file)
    for name, deviation in file.deviations.items():
        for key, most in MOST_DEVIATION.items():
            value = getattr(deviation, key)
            if value > most or 0 < value < 1e-4:
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
