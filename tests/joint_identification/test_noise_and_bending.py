"""Bending told from the noise of a mode by its phase, and points of a wrong factor that are left out of their body."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.joint_identification.joints.chain import relative_motion_of
from toolpoint.joint_identification.joints.joint_fit import Criterion
from toolpoint.joint_identification.machine.bending_share import bending_share, noisy_modes
from toolpoint.joint_identification.motion.body_misfit import find_suspect
from toolpoint.joint_identification.motion.measured import Component, component
from toolpoint.joint_identification.motion.rigid_motion import rigid_motion
from toolpoint.joint_identification.motion.strangers import MIN_OUTLIER_MISFIT_RATIO, sure_strangers
from toolpoint.joint_identification.motion.wrong_channels import faulty_points
from toolpoint.vibration import Dof, Modes

MODES, POINTS, NOISE = 6, 6, 1e-3
NAMES = ("bed", "column", "head")


def drawn_bodies(seed: int, *, gain_noise: float = 0.0, bending: float = 0.0) -> dict[str, Component]:
    """Return three bodies in random motions with noise of 0.1 %, which is stated.

    gain_noise : of the first mode, a complex factor for each point, common to its directions; bending : of the column in all
    modes, square in z, over its rms motion.
    """
    rng = np.random.default_rng(seed)
    labels = [Dof(point, way) for point in range(3 * POINTS) for way in ("+x", "+y", "+z")]
    places = {point: rng.uniform(-0.5, 0.5, 3) for point in range(3 * POINTS)}
    motions = rng.standard_normal((3, MODES, 2, 3))
    shape = np.array([[(v + np.cross(w, places[dof.point])) @ dof.unit[:3] for v, w in motions[int(dof.point) // POINTS]]
                      for dof in labels], complex)
    is_column = np.array([int(dof.point) // POINTS == 1 for dof in labels])
    square = np.array([places[dof.point][2] ** 2 * (dof.direction == "+x") for dof in labels])
    for mode in range(MODES):
        size = np.sqrt((np.abs(shape[is_column, mode]) ** 2).mean())
        shape[:, mode] += bending * size * square / np.sqrt((square[is_column] ** 2).mean()) * is_column
    gains = gain_noise * (rng.standard_normal(3 * POINTS) + 1j * rng.standard_normal(3 * POINTS)) / np.sqrt(2)
    shape[:, 0] *= 1 + np.repeat(gains, 3)
    shape *= np.exp(1j * rng.uniform(-0.3, 0.3, MODES))
    shape += NOISE * (rng.standard_normal(shape.shape) + 1j * rng.standard_normal(shape.shape)) / np.sqrt(2)
    modes = Modes(10.0 * np.arange(1, MODES + 1), [0.01] * MODES, shape, labels, "modal A",
                  shape_variance=np.full(shape.shape, NOISE**2 / 2 * (1 + 1j)).real)
    return {name: component(name, modes, places, labels=list(range(k * POINTS, (k + 1) * POINTS)))
            for k, name in enumerate(NAMES)}


def shares_of(parts: dict[str, Component]) -> dict[str, float]:
    """Return the shares of bending in the joints of a chain."""
    motions = {name: rigid_motion(part) for name, part in parts.items()}
    relatives = [relative_motion_of(parent, child, parts, motions=motions)
                 for parent, child in (("ground", "bed"), ("bed", "column"), ("column", "head"))]
    share = bending_share(parts, motions, relatives, frequency=10.0 * np.arange(1, MODES + 1), kept=range(MODES),
                          criterion=Criterion())
    return {} if share is None else dict(share.joints)


def test_a_point_whose_response_errs_in_one_mode_is_no_bending() -> None:
    """Errors of the blows' force at a faint mode turned 5 % of it into bending, and a stiffness was known within 30 %."""
    taken = []
    for seed in range(40):
        parts = drawn_bodies(seed, gain_noise=0.05)
        motions = {name: rigid_motion(part) for name, part in parts.items()}
        assert max(motion.excess[0] for motion in motions.values()) > 30, "the noise must be far beyond what is stated"
        noisy = noisy_modes(parts, motions, MODES)
        assert all(modes[0] for modes in noisy.values())
        taken.append(max(shares_of(parts).values(), default=0.0))
    assert sum(share > 0.01 for share in taken) <= 1


@pytest.mark.parametrize("bending", [0.02, 0.05])
def test_what_bends_in_phase_stays_bending_beside_the_noise_of_another_mode(bending: float) -> None:
    for seed in range(10):
        parts = drawn_bodies(seed, gain_noise=0.05, bending=bending)
        motions = {name: rigid_motion(part) for name, part in parts.items()}
        assert not noisy_modes(parts, motions, MODES)["column"][1:].any()
        shares = shares_of(parts)
        assert shares["column"] > 0.1 * bending and shares["head"] > 0.1 * bending


def test_real_shapes_tell_nothing_of_noise_by_phase() -> None:
    parts = drawn_bodies(1, gain_noise=0.05)
    for name, part in parts.items():
        parts[name] = Component(part.name, part.points, part.at, part.rows, part.places, part.ways, part.owner,
                                part.values[:, :MODES], None if part.variance is None else part.variance[:, :MODES])
    motions = {name: rigid_motion(part) for name, part in parts.items()}
    assert not any(modes.any() for modes in noisy_modes(parts, motions, MODES).values())


@pytest.mark.parametrize("factor", [0.833, 1.2, -1.0])
def test_a_point_of_a_wrong_factor_is_sure_to_be_left_out(factor: float) -> None:
    """Of six points, five determine the body: that it is named alone left 5 to 9 % of its motion to bending."""
    for seed in range(10):
        parts = drawn_bodies(seed)
        point = POINTS + seed % POINTS
        column = parts["column"]
        column.values[column.owner == column.points.index(point)] *= factor
        assert sure_strangers(parts) == {"bed": (), "column": (point,), "head": ()}


def test_a_faint_wrong_factor_is_sure_where_it_explains_the_misfit() -> None:
    """Without its factor, a misfit that falls by less than 50 would leave the point in the motion."""
    left_out = []
    for seed in range(20):
        parts = drawn_bodies(seed)
        column = parts["column"]
        rng = np.random.default_rng(1000 + seed)
        column.values[:] += 0.012 * rng.standard_normal(column.values.shape)
        column.values[column.owner == column.points.index(POINTS + 1)] *= 1.12
        suspect = find_suspect(column)
        if suspect is not None and suspect.ratio < MIN_OUTLIER_MISFIT_RATIO and faulty_points(parts):
            left_out.append(sure_strangers(parts)["column"])
    assert len(left_out) > 3 and set(left_out) == {(POINTS + 1,)}


def test_bodies_that_bend_lose_no_point() -> None:
    lost = [sure_strangers(drawn_bodies(seed, bending=bending))["column"]
            for seed in range(60) for bending in (0.01, 0.05, 0.1)]
    assert sum(map(bool, lost)) <= 2
