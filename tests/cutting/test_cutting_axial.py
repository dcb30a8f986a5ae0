"""The axial direction: 3x3 response, axial force, rounded edges; laws, closed forms and agreement of the engines."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import Modes, ToolpointError
from toolpoint.cutting import (
    Collocation,
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    MillingProblem,
    MultiFrequency,
    PanelArnoldi,
    SemiDiscretization,
    Tool,
    ZeroOrder,
    stability,
)
from toolpoint.cutting.cut.coefficients import chip_direction, edge_matrix, force_direction, mean_matrix
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.vibration import frequency_response

F, ZETA, K = np.array([600.0, 900, 1400]), np.array([0.03, 0.02, 0.04]), np.array([4e6, 6e6, 9e6])
LABELS = ("tool:+x", "tool:+y", "tool:+z")
SPEEDS = np.array([6000.0, 9000.0])


def problem(axial: float = 0.5, ka: float = 5e8, tool: Tool | None = None, engagement: Engagement | None = None,
            z: str | None = "tool:+z") -> MillingProblem:
    """Three modes in any direction of space; `axial` scales their z components."""
    way = np.array([[0.8, -0.5, 0.3], [0.4, 0.8, -0.6], [0.6, 0.5, 0.9]])
    way[2] *= axial
    modes = Modes(F, ZETA, 2 * np.pi * F / np.sqrt(K) * way, LABELS)
    return MillingProblem(tool or Tool(0.016, 3), engagement or Engagement.down(0.4), CuttingCoefficients(9e8, 3e8, ka), modes,
                          "tool:+x", "tool:+y", z=z)


METHODS = (FloquetDeterminant(tolerance=1e-10), PanelArnoldi(), ZeroOrder())


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize(("axial", "ka"), [(0.0, 5e8), (0.7, 0.0)])
def test_the_plane_is_the_limit(method: object, axial: float, ka: float) -> None:
    """A tool stiff along z, or one without axial force (kappa = 90 degrees): the 2x2 limits to 1e-12."""
    whole = stability.chart(problem(axial, ka), SPEEDS, method, depth_max=0.01).limit  # type: ignore[arg-type]
    plane = stability.chart(problem(axial, ka, z=None), SPEEDS, method, depth_max=0.01).limit  # type: ignore[arg-type]
    assert np.isfinite(plane).all()
    # PanelArnoldi stops where its residual lets it: the arithmetic is not the same with three directions.
    assert whole == pytest.approx(plane, rel=1e-9 if isinstance(method, PanelArnoldi) else 1e-12)


def test_multipliers_of_the_plane_are_the_limit() -> None:
    """The same for the multipliers of collocation and of the one-period map, to 1e-12."""
    for method in (Collocation(), PanelArnoldi()):
        whole = np.abs(method.multipliers(problem(0.0), 8000.0, 2e-3)[:2])
        plane = np.abs(method.multipliers(problem(0.0, z=None), 8000.0, 2e-3)[:2])
        assert whole == pytest.approx(plane, rel=1e-12)


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_turning_about_the_axis_changes_nothing(method: object) -> None:
    """Structure and feed turned together about z: the same limits to 1e-9."""
    first = problem()
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    modes = first.dynamics
    shape = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ modes.shape  # type: ignore[union-attr]
    turned = first.changed(dynamics=Modes(F, ZETA, shape, LABELS), feed_angle=angle)
    a = stability.chart(first, SPEEDS, method, depth_max=0.01).limit  # type: ignore[arg-type]
    b = stability.chart(turned, SPEEDS, method, depth_max=0.01).limit  # type: ignore[arg-type]
    assert b == pytest.approx(a, rel=1e-9)


@pytest.mark.slow
def test_the_axial_force_matters_and_the_engines_agree() -> None:
    """With K_a and cross response: determinant, one-period map, collocation and a 3x3 FRF agree, away from the 2x2 limit."""
    cut = problem()
    exact = stability.chart(cut, SPEEDS, FloquetDeterminant(tolerance=1e-10), depth_max=0.01).limit
    assert stability.chart(cut, SPEEDS, PanelArnoldi(), depth_max=0.01).limit == pytest.approx(exact, rel=1e-9)
    for speed, w in zip(SPEEDS, exact):
        assert np.abs(Collocation().multipliers(cut, speed, w)[0]) == pytest.approx(1, abs=1e-8)
    flat = stability.chart(problem(z=None), SPEEDS, depth_max=0.01).limit
    assert np.abs(exact / flat - 1).max() > 0.1
    frf = frequency_response.modal(cut.dynamics, np.arange(0.5, 9000, 0.5))  # type: ignore[arg-type]
    measured = stability.chart(cut.changed(dynamics=frf), SPEEDS, FloquetDeterminant(), depth_max=0.01).limit
    assert measured == pytest.approx(exact, rel=1e-3)


@pytest.mark.slow
def test_several_teeth_in_cut_with_axial_force() -> None:
    """Four teeth in a slot, K_a and z: MultiFrequency closes in on the exact engines, which agree with helix too; ZeroOrder
    is near, for only the axial row of the matrix varies."""
    slot = problem(tool=Tool(0.016, 4), engagement=Engagement.slot())
    single = stability.chart(slot, SPEEDS, ZeroOrder(), depth_max=0.005).limit
    for method in (FloquetDeterminant(tolerance=1e-9), PanelArnoldi()):
        got = stability.chart(slot, SPEEDS, method, depth_max=0.005).limit
        assert np.abs(got / single - 1).max() < 0.2
    helix = stability.chart(slot.changed(tool=Tool(0.016, 4, helix=0.5)), SPEEDS, FloquetDeterminant(), depth_max=0.005)
    panel = stability.chart(slot.changed(tool=Tool(0.016, 4, helix=0.5)), SPEEDS, PanelArnoldi(), depth_max=0.005)
    assert panel.limit == pytest.approx(helix.limit, rel=1e-7)
    several = stability.chart(slot, SPEEDS[:1], MultiFrequency(8, 60), depth_max=0.005).limit
    assert several == pytest.approx(stability.chart(slot, SPEEDS[:1], depth_max=0.005).limit, rel=1e-3)


def test_edge_matrix_on_a_cylinder_and_at_the_tip() -> None:
    """kappa = 90 degrees: the plane's k n^T and the axial row; kappa = 0: the chip is along z alone."""
    material = CuttingCoefficients(9e8, 3e8, 4e8)
    phi = np.linspace(0, np.pi, 7)
    whole = edge_matrix(material, phi)
    plane = force_direction(material, phi)[:, :, None] * chip_direction(phi)[:, None, :]
    assert whole[:, :2, :2] == pytest.approx(plane, rel=1e-12, abs=1e-3)
    assert whole[:, 2, :2] == pytest.approx(-4e8 * chip_direction(phi), rel=1e-12, abs=1e-3)
    tip = edge_matrix(material, phi, 0.0)
    assert not tip[:, :, :2].any() and tip[:, 2, 2] == pytest.approx(3e8)
    n = 4000
    mid = 0.3 + (np.arange(n) + 0.5) * 1.9 / n
    mean = edge_matrix(material, mid).mean(0) * 1.9 * 3 / (2 * np.pi)
    assert mean_matrix(material, 0.3, 2.2, teeth=3, size=3) == pytest.approx(mean, rel=1e-6, abs=50)


def test_forces_on_a_ball_in_closed_form() -> None:
    """Half a ball deep: the tangential force is that of a cylinder; normal force pi/4 sideways and 1/2 upwards of K_n f R."""
    r, f, kt, kn = 0.006, 1e-4, 1e9, 4e8
    def made(corner: float, ka: float = 0.0) -> MillingProblem:
        tool = Tool(2 * r, 1, corner_radius=corner)
        modes = Modes(F, ZETA, np.ones((2, 3)), LABELS[:2])
        return MillingProblem(tool, Engagement.slot(), CuttingCoefficients(kt, kn, ka), modes, feed_per_tooth=f)

    turn = np.array([np.pi / 2])
    force = rigid_forces(made(r), r, turn, slices=4000).force[0]
    assert force[0] == pytest.approx(-kn * f * r * np.pi / 4, rel=1e-6)  # phi = 90 degrees: n along x, t along -y
    assert force[1] == pytest.approx(kt * f * r, rel=1e-6)
    assert force[2] == pytest.approx(kn * f * r / 2, rel=1e-6)
    sharp = rigid_forces(made(0.0, 3e8), 1e-3, turn).force[0]
    tiny = rigid_forces(made(1e-9, 3e8), 1e-3, turn, slices=2000).force[0]
    assert tiny == pytest.approx(sharp, rel=1e-5)


def test_torque_of_a_ball_takes_the_local_radius() -> None:
    """Half a ball deep at phi = 90 degrees: torque K_t f times the integral of the radius over height, R^2 pi/4."""
    r, f, kt = 0.006, 1e-4, 1e9
    modes = Modes(F, ZETA, np.ones((2, 3)), LABELS[:2])
    cut = MillingProblem(Tool(2 * r, 1, corner_radius=r), Engagement.slot(), CuttingCoefficients(kt, 0.0), modes,
                         feed_per_tooth=f)
    torque = rigid_forces(cut, r, np.array([np.pi / 2]), slices=4000).torque[0]
    assert torque == pytest.approx(kt * f * r**2 * np.pi / 4, rel=1e-5)


def test_walls_limit_the_arc_at_a_smaller_radius() -> None:
    """A slot stays a slot; up-milling of a quarter immersion reaches cos phi = (R/r) cos phi_ex; beyond the wall it is out."""
    slot = Engagement.slot().at_radius(np.array([1.0, 5.0]))
    assert slot[0] == pytest.approx([0, 0]) and slot[1] == pytest.approx([np.pi, np.pi])
    arc = Engagement.down(0.25)
    entry, leave = arc.at_radius(np.array([1.0, 1.5, 4.0]))
    assert entry == pytest.approx([arc.entry, np.arccos(1.5 * np.cos(arc.entry)), np.pi]) and leave == pytest.approx(np.pi)


def test_a_ball_sees_vibration_along_z() -> None:
    """On a rounded edge vibration along z makes a chip: the limit with z differs from that without, and is collocation's."""
    tool, slot = Tool(0.016, 3, corner_radius=0.008), Engagement.slot()  # whose arc is the same at every radius
    ball = problem(tool=tool, ka=0.0, engagement=slot)
    found = stability.chart(ball, SPEEDS, depth_max=0.01)
    flat = stability.chart(problem(tool=tool, ka=0.0, engagement=slot, z=None), SPEEDS, depth_max=0.01)
    assert found.method == "PanelArnoldi" and np.isfinite(found.limit).all()
    assert (np.abs(found.limit / flat.limit - 1) > 0.02).all()
    for speed, w in zip(SPEEDS, found.limit):
        mu = Collocation(nodes=6, slices=24).multipliers(ball, speed, w)[0]
        assert np.abs(mu) == pytest.approx(1, abs=1e-6)


def test_methods_of_the_plane_refuse_the_axis() -> None:
    """Time-step methods know neither z nor rounded edges; the determinant no rounded edges; pairs no z."""
    with pytest.raises(ToolpointError, match="PanelArnoldi"):
        stability.chart(problem(), SPEEDS, SemiDiscretization())
    with pytest.raises(ToolpointError, match="PanelArnoldi"):
        stability.chart(problem(tool=Tool(0.016, 3, corner_radius=1e-3)), SPEEDS, FloquetDeterminant())
    modes = problem().dynamics
    with pytest.raises(ToolpointError, match="with z"):
        MillingProblem(Tool(0.016, 3), Engagement.slot(), CuttingCoefficients(9e8, 3e8), (modes, modes), z="tool:+z")
