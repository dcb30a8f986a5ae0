"""Five axes: cusps of ends that lean, errors of what they leave, and the servo's part along the normals, by closed forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from toolpoint import studies
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.studies.machining.five_axes.turned_course import TurnedServoCourse
from toolpoint.studies.machining.five_axes.turned_errors import total_along_normals
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.vibration import Modes

MM = 1e-3
FLAT = {"diameter": 10 * MM, "teeth": 4, "tangential": 8e8, "normal": 3e8, "axial": 2e8, "flute_length": 20 * MM}
BALL = {**FLAT, "corner_radius": 5 * MM}
BULL = {**FLAT, "corner_radius": 2 * MM}


def _tip(size: float = 1.0) -> object:
    return studies.modal_dynamics(Modes([900.0, 1080.0, 40_000.0], [0.02] * 3, size * np.diag([1.0, 0.9, 0.7]),
                                        ("tool:+x", "tool:+y", "tool:+z")))


def _run(text: str, cut: dict[str, float], dynamics: object = None, size: tuple[float, ...] = (0, 0, -3, 3, 9, 0),
         spacing: float = 0.5) -> MachiningStudy:
    stock = studies.stock_of("box", [MM * value for value in size])
    setup = studies.describe_machining(stock, CuttingDescription.of(**cut), spacing=spacing * MM)
    return studies.run_five_axes(parse(text, start=(0, 0, 0.05)), setup, dynamics, text=text)


def _axis(lead: float, tilt: float) -> np.ndarray:
    axis = np.array([np.tan(np.radians(lead)), np.tan(np.radians(tilt)), 1.0])
    return axis / np.linalg.norm(axis)


def _raster(axis: np.ndarray, apart: float) -> str:
    """Tracks along x on a plane, the tool leaning."""
    way = "I{:.12f} J{:.12f} K{:.12f}".format(*axis)
    lines = ["S12000", "G0 X-6 Y3 Z20", "G43.5 H1"]
    for k in range(4):
        place = f"Y{3 + k * apart:.6f}"
        lines += [f"G0 X-6 {place} Z10 {way}", f"G0 X-6 {place} Z-1 {way}", f"G1 X9 {place} Z-1 {way} F1200",
                  f"G0 Z10 {way}"]
    return "\n".join([*lines, "G49", "G0 Z50"])


def _outline(cut: dict[str, float], axis: np.ndarray) -> Callable[[float], float]:
    """Lowest height of the tool over y as seen along x, from the support function of its end: a ball rolled over a disc."""
    corner = cut.get("corner_radius", 0.0)
    flat = cut["diameter"] / 2 - corner
    turn = np.linspace(-1.4, 1.4, 200_001)
    down = np.stack([np.zeros(turn.size), np.sin(turn), -np.cos(turn)], axis=1)
    along = down @ axis
    support = corner + flat * np.sqrt(1 - along**2) + corner * along
    return lambda y: float(((y * np.sin(turn) - support) / np.cos(turn)).max())


@pytest.mark.slow
@pytest.mark.parametrize(("cut", "lead", "tilt", "apart"), [(BALL, 17, 11, 1.2), (FLAT, 10, 0, 1.2), (BULL, 10, 8, 0.4)])
def test_cusps_are_those_of_two_outlines_of_the_leaning_tool(cut: dict[str, float], lead: float, tilt: float, apart: float
                                                             ) -> None:
    """Two outlines side by side cross above their lowest points; of a flat end that leans forward by the curvature sin(lead)/R.

    Tracks of 0.4 mm lie nearer than the lines: the cusp of two that lie two apart would be four times as high.
    """
    axis = _axis(lead, tilt)
    outline = _outline(cut, axis)
    y = np.linspace(-6, 6, 241) * MM
    heights = np.array([outline(value) for value in y])
    lowest = y[heights.argmin()]
    crossing = brentq(lambda y: outline(y) - outline(y - apart * MM), lowest, lowest + apart * MM)
    expected = outline(crossing) - heights.min()
    if not tilt:
        radius = cut["diameter"] / 2 / np.sin(np.radians(lead))
        assert expected == pytest.approx((apart * MM) ** 2 / 8 / radius, rel=0.01)
    study = _run(_raster(axis, apart), cut)
    assert study.errors is not None
    cusp = study.errors.columns["cusp"]
    assert np.isfinite(cusp).sum() >= 2
    assert cusp[np.isfinite(cusp)] == pytest.approx(expected, rel=0.002)
    if cut is BALL:
        marks = study.errors.columns["marks"][np.isfinite(cusp)]
        assert marks == pytest.approx((0.02 / 200 / 4) ** 2 / 8 / (5 * MM), rel=0.01)


@pytest.mark.slow
def test_errors_of_a_constant_direction_are_those_of_its_tilted_plane() -> None:
    """What a flat end leaves of a chamfer of 45 degrees, by dexels along it."""
    leg, box = 3.0, (0, 0, -20, 30, 20, 0)
    depth = leg / np.sqrt(2)
    tilted = f"S9000\nG68.2 J45\nG53.1\nG0 X-7 Y0 Z9\nZ-{depth:.6f}\nG1 X37 F1800\nG0 Z9\nG69"
    place = f"Y{depth * np.sin(np.pi / 4):.6f} Z{-depth * np.cos(np.pi / 4):.6f}"
    text = f"S9000\nG43.5\nG0 X-7 {place} J-1 K1\nG1 X37 {place} J-1 K1 F1800\nG49\nG0 Z90"
    setup = studies.describe_machining(studies.stock_of("box", [MM * value for value in box]), CuttingDescription.of(**FLAT),
                                       spacing=0.5 * MM)
    plane = studies.run_stages(parse(tilted, start=(0, 0, 0.05)), setup, _tip()).stages[0]
    study = _run(text, FLAT, _tip(), box)
    assert plane.errors is not None and study.errors is not None
    known = [values[np.isfinite(values)] for values in (plane.errors.columns["floor"], study.errors.columns["floor"])]
    assert known[0].size == known[1].size == 1 and known[0][0] > 0
    assert known[1] == pytest.approx(known[0], rel=0.02)


@pytest.mark.slow
def test_the_total_takes_what_points_along_the_normals() -> None:
    """A deviation of 0.1 mm towards the wall, from it, up from what the end leaves, and along the feed."""
    up = np.array([0.0, -1.0, 1.0]) / np.sqrt(2)
    left = np.cross(up, [1.0, 0.0, 0.0])
    # A step of a shoulder across an edge that a plane of 45 degrees cuts: the wall stands on the right.
    y, z = (3 * left - 5.5 * up)[1:]
    place = f"Y{y:.6f} Z{z:.6f}"
    text = f"S9000\nG43.5\nG0 X-8 {place} J-1 K1\nG1 X14 {place} J-1 K1 F1800\nG49\nG0 Z90"
    study = _run(text, FLAT, _tip(0.1), (0, 0, -20, 6, 20, 0))
    errors, arcs, removed = study.errors, study.arcs, study.removed
    assert errors is not None and errors.walls is not None and errors.floors is not None and arcs is not None
    step = removed.piece[arcs.place]
    course = TurnedServoCourse((), removed.moves.block[step], *[np.zeros(0)] * 5, *[np.zeros(study.laid.path.count)] * 5,
                               step=step, deviation=np.zeros((step.size, 3)))
    k = int(np.flatnonzero(np.isfinite(errors.columns["floor"]))[0])

    def total(way: np.ndarray) -> float:
        moved = replace(course, deviation=np.tile(1e-4 * way, (step.size, 1)))
        return float(total_along_normals(errors.walls, errors.floors, moved, arcs=arcs, removed=removed)[k])

    small = 5e-6
    assert np.isfinite(errors.walls.location[:, 1]).any() and not np.isfinite(errors.walls.location[:, 0]).any()
    assert total(-left) == pytest.approx(-1e-4, abs=small) and total(left) == pytest.approx(1e-4, abs=small)
    assert total(up) == pytest.approx(1e-4, abs=small) and total(-up) == pytest.approx(-1e-4, abs=small)
    assert total(np.array([1.0, 0.0, 0.0])) == pytest.approx(0.0, abs=small)
