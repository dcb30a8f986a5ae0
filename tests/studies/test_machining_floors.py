"""Errors of floors and ball ends: cusps and static deflection in closed form, forced motion beside integration in time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim, lti

from toolpoint import studies
from toolpoint.cutting.build import tool_of
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.material_removal import Stock
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.errors.floor_errors import FLOOR_STEPS, error_along, solve_forced_motion
from toolpoint.vibration import Modes

MM = 1e-3
STOCK = Stock.box(np.array([0, 0, -8]) * MM, np.array([12, 8, 0]) * MM)
BALL = {"diameter": 6 * MM, "teeth": 2, "corner_radius": 3 * MM, "tangential": 8e8, "normal": 3e8, "axial": 1e8}
FLAT = {"diameter": 10 * MM, "teeth": 4, "tangential": 8e8, "normal": 3e8, "axial": 2e8, "flute_length": 20 * MM}
SIZE = 0.7  # mode shape of the tip along z, 1/sqrt(kg)


def tip(frequency=(900.0, 1080.0, 40_000.0)):
    return studies.modal_dynamics(Modes(list(frequency), [0.02] * 3, np.diag([1.0, 0.9, SIZE]),
                                        ("tool:+x", "tool:+y", "tool:+z")))


def run(text, cut, dynamics=None, **values):
    setup = studies.describe_machining(STOCK, CuttingDescription.of(**cut), **{"spacing": 0.25 * MM, **values})
    return studies.run_program(parse(text, start=(0, 0, 0.1)), setup, dynamics, text=text)


def raster(step, slope):
    """Tracks along x, side by side along y on a plane that rises with the slope, of a ball's tip."""
    lines = ["S12000", "G0 X-5 Y1 Z5"]
    for k, y in enumerate(np.arange(1.0, 7.0, step)):
        z = -3.5 + slope * (y - 1)
        ends = (-5, 17) if k % 2 == 0 else (17, -5)
        lines += [f"G1 X{ends[0]} Y{y:.4f} Z{z:.4f} F1200", f"G1 X{ends[1]}"]
    return "\n".join(lines)


@pytest.mark.parametrize("slope", [0.0, 0.5])
def test_cusps_between_tracks_of_a_ball_are_those_of_two_circles(slope):
    """R - sqrt(R^2 - s^2/4), s between the centres along the plane: the intersection of two circles."""
    result = run(raster(0.4, slope), BALL)
    apart = 0.4 * MM * np.hypot(1, slope)
    cusp = result.errors.columns["cusp"]
    tracks = np.isfinite(cusp) & (np.abs(result.laid.path.end - result.laid.path.start)[:, 0] > 10 * MM)
    assert tracks.sum() > 8
    assert np.allclose(cusp[tracks], 3 * MM - np.sqrt((3 * MM) ** 2 - apart**2 / 4), rtol=1e-3)
    chip = 0.02 / 200 / 2
    marks = result.errors.columns["marks"][tracks]
    assert np.allclose(marks, chip**2 / (8 * 3 * MM), rtol=1e-2)  # f^2/(8 R)


@pytest.mark.slow
def test_normals_of_a_ball_on_a_slope_are_those_of_the_plane():
    result = run(raster(0.4, 0.5), BALL, tip())
    normals = result.errors.floors.surface.normal
    expected = np.array([0.0, -0.5, 1.0]) / np.hypot(1, 0.5)
    inner = np.flatnonzero(np.isfinite(result.errors.columns["cusp"]))[4:-4]
    tracks = [k for k in inner if abs(result.laid.path.end[k, 0] - result.laid.path.start[k, 0]) > 10 * MM]
    # Tracks with neighbours on both sides: the band between two cusps lies evenly about the plane's normal.
    assert len(tracks) > 4 and np.allclose(normals[tracks], expected, atol=0.03)


def test_a_floor_is_lifted_by_the_axial_force_over_the_axial_stiffness():
    """Four teeth in a slot without helix: F_z = K_a b f (sin t + cos t), at most sqrt 2; far below the mode u = F/k."""
    result = run("S6000\nG0 X-10 Y4 Z5\nG0 Z-2\nG1 X25 F1200", FLAT, tip())
    k = int(np.flatnonzero(result.blocks.verdict > 0)[0])
    stiffness = (2 * np.pi * 40_000) ** 2 / SIZE**2
    chip = 0.02 / 100 / 4
    assert result.errors.columns["floor"][k] == pytest.approx(np.sqrt(2) * 2e8 * 2 * MM * chip / stiffness, rel=0.03)
    assert result.errors.columns["total"][k] != 0


@pytest.mark.slow
def test_forced_motion_is_that_of_an_integration_in_time():
    """Two modes of the tip under a periodic force, integrated over 200 passings of the teeth until they have settled."""
    cut = CuttingDescription.of(**{**FLAT, "teeth": 2}, immersion=0.4)
    problem = milling_problem(cut, tip((900.0, 1080.0, 1500.0)).response, "tool:+x", y="tool:+y")
    angle = np.arange(FLOOR_STEPS) / FLOOR_STEPS * np.pi
    force = np.stack([80 * np.sin(angle) ** 2, -60 * np.sin(angle), 30 * np.maximum(np.sin(angle + 0.3), 0)], axis=1)
    speed = 9000.0
    motion = solve_forced_motion(problem, force, speed)
    period = 60 / speed / 2
    fine = 8
    time = np.arange(200 * FLOOR_STEPS * fine) * period / FLOOR_STEPS / fine
    for column, (frequency, shape) in enumerate(((900.0, 1.0), (1080.0, 0.9), (1500.0, SIZE))):
        omega = 2 * np.pi * frequency
        place = (time / period % 1) * FLOOR_STEPS
        load = np.interp(place, np.arange(FLOOR_STEPS + 1), np.append(force[:, column], force[0, column]))
        settled = lsim(lti([shape**2], [1, 2 * 0.02 * omega, omega**2]), load, time)[1][-FLOOR_STEPS * fine::fine]
        assert np.abs(settled - motion[:, column]).max() < 0.01 * np.abs(settled).max()


def test_point_of_a_ball_is_left_by_the_tooth_that_passes_there():
    """A surface that faces -y (feed x) is cut at phi = 0 by a ball, one that faces y at phi = pi: the moments are known."""
    tool = tool_of(CuttingDescription.of(**BALL))
    rotation = np.arange(FLOOR_STEPS) / FLOOR_STEPS * np.pi  # two teeth: a passing is half a turn
    motion = np.stack([np.zeros(FLOOR_STEPS), np.cos(2 * rotation), np.zeros(FLOOR_STEPS)], axis=1)
    assert error_along(motion, tool, np.array([0.0, -1.0, 0.0])) == pytest.approx(-1.0)
    motion = np.stack([np.cos(2 * rotation), np.zeros(FLOOR_STEPS), np.zeros(FLOOR_STEPS)], axis=1)
    assert error_along(motion, tool, np.array([-1.0, 0.0, 0.0])) == pytest.approx(1.0, abs=1e-3)  # at phi = 90 degrees
    lift = np.stack([np.zeros(FLOOR_STEPS), np.zeros(FLOOR_STEPS), 1 + np.cos(2 * rotation)], axis=1)
    assert error_along(lift, tool, np.array([0.0, 0.0, 1.0])) == pytest.approx(0.0, abs=1e-3)  # its lowest moment


def test_unknown_motion_along_the_axis_is_said_and_leaves_no_number():
    plane = studies.modal_dynamics(Modes([900.0, 1080.0], [0.02] * 2, np.diag([1.0, 0.9]), ("tool:+x", "tool:+y")))
    result = run("S6000\nG0 X-10 Y4 Z5\nG0 Z-1\nG1 X25 F1200", FLAT, plane)
    assert np.isnan(result.errors.columns["floor"]).all()
    assert any("response of the tip along its axis is not" in note for note in result.notes)
