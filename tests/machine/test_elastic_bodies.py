"""Elastic bodies in machines: a carriage on an elastic rail and a limb through its frame, against full finite elements."""

import numpy as np
import pytest
from scipy.linalg import block_diag, eigh

from toolpoint import ToolpointError
from toolpoint.bodies.imported import ImportedMatrices
from toolpoint.bodies.solid import STEEL, Casting, Cuboid, Patch
from toolpoint.machine import build
from toolpoint.machine.assembly.reduction_estimate import estimate_reduction
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.parts.elastic_body import SlidingPatch, reduce_solid
from toolpoint.machine.parts.imported_body import PointGroup, reduce_matrices
from toolpoint.studies.machines.check.machine_check import check_machine
from toolpoint.vibration import Dof
from toolpoint.vibration.eigen import solve_undamped

LENGTH, WIDTH, HEIGHT, BLOCK, MASS = 0.8, 0.06, 0.05, 0.08, 12.0
FOOT = {"x": 2e8, "y": 2e8, "z": 2e8, "rx": 1e6, "ry": 2e6, "rz": 2e6}
GUIDE = {"x": 4e7, "y": 6e7, "z": 5e7, "rx": 2e5, "ry": 2e5, "rz": 1e5}
INERTIA = InertiaDescription(0.05, 0.04, 0.06)


@pytest.fixture(scope="module")
def beam():
    return Casting((Cuboid([0, 0, 0], [LENGTH, WIDTH, HEIGHT]),), {"body": STEEL}).meshed(0.08)


@pytest.fixture(scope="module")
def rail(beam):
    """The beam with a foot at its left end and a way on its top, from 50 to 750 mm."""
    foot = Patch([0, WIDTH / 2, HEIGHT / 2], [0, 0, 1], [0, 1, 0], HEIGHT, WIDTH)
    top = Patch([0.4, WIDTH / 2, HEIGHT], [1, 0, 0], [0, 1, 0], BLOCK, 0.04)
    return reduce_solid(beam, {"foot": foot, "way": SlidingPatch(top, np.array([1.0, 0, 0]), -0.35, 0.35, BLOCK / 2)},
                        band=900.0)


def full(beam, at):
    """Natural frequencies with a rigid carriage on the beam at x = at, from all finite elements."""
    foot = Patch([0, WIDTH / 2, HEIGHT / 2], [0, 0, 1], [0, 1, 0], HEIGHT, WIDTH).averages(beam).toarray()
    way = Patch([at, WIDTH / 2, HEIGHT], [1, 0, 0], [0, 1, 0], BLOCK, 0.04).averages(beam).toarray()
    k, m = (block_diag(a.toarray(), np.zeros((6, 6))) for a in (beam.stiffness(), beam.mass()))
    held, guided = np.vstack([foot, np.zeros((6, 6))]), np.vstack([-way, np.eye(6)])
    k += held @ np.diag(list(FOOT.values())) @ held.T + guided @ np.diag(list(GUIDE.values())) @ guided.T
    m[-6:, -6:] += np.diag([MASS] * 3 + [0.05, 0.04, 0.06])
    return np.sqrt(eigh(k, m, eigvals_only=True, subset_by_index=[0, 7])) / (2 * np.pi)


def carriage_on_rail(rail, low=-0.35, high=0.35):
    bodies = {"beam": BodyDescription(mass=1.0, inertia=INERTIA),
              "carriage": BodyDescription(mass=MASS, inertia=INERTIA, centre=(0.4, WIDTH / 2, HEIGHT))}
    joints = {"foot": JointDescription("ground", "beam", FrameDescription((0, WIDTH / 2, HEIGHT / 2)), FOOT,
                                       child_interface="foot"),
              "guide": JointDescription("beam", "carriage", FrameDescription((0.4, WIDTH / 2, HEIGHT)), GUIDE,
                                        parent_interface="way")}
    return build(MachineDescription("slide", bodies, joints, {"X": AxisDescription("guide", "x", (low, high))},
                                    {"tool": PointDescription("carriage", (0.4, WIDTH / 2, HEIGHT))}), {"beam": rail})


def limb_through_frame(rail):
    """The same parts with roles swapped: the carriage stands on the ground's springs, the beam slides through it."""
    bodies = {"carriage": BodyDescription(mass=MASS, inertia=INERTIA, centre=(0.4, WIDTH / 2, HEIGHT)),
              "beam": BodyDescription(mass=1.0, inertia=INERTIA)}
    joints = {"foot": JointDescription("ground", "carriage", FrameDescription((0.4, WIDTH / 2, HEIGHT)), FOOT),
              "guide": JointDescription("carriage", "beam", FrameDescription((0.4, WIDTH / 2, HEIGHT)), GUIDE,
                                        child_interface="way", elastic_at="parent")}
    return build(MachineDescription("limb", bodies, joints, {"X": AxisDescription("guide", "x", (-0.3, 0.3))},
                                    {"end": PointDescription("beam", interface="foot")}), {"beam": rail})


@pytest.mark.slow
def test_carriage_on_an_elastic_rail_is_that_of_all_finite_elements(beam, rail):
    machine = carriage_on_rail(rail)
    for x in (-0.2766, 0.0567, 0.2789):
        error = solve_undamped(assemble(machine, {"X": x}), 8).frequency / full(beam, 0.4 + x) - 1
        assert error.min() > -1e-6 and error.max() < 1e-3
        # All shapes are kept, so what is left is the table's between its entries, of either sign: the estimate holds it.
        estimate = estimate_reduction(machine, {"X": x}, 8)
        assert (estimate.error + 1e-8 >= np.abs(error)).all() and estimate.error.max() < 1e-4
    values = natural_frequencies(machine, {"X": np.linspace(-0.3, 0.3, 7)}, 4)
    assert values[3] == pytest.approx(solve_undamped(assemble(machine, {"X": 0.0}), 4).frequency)
    at = {"X": np.random.default_rng(0).uniform(-0.3, 0.3, 40)}
    assert natural_frequencies(machine, at, 8, path="compiled") == pytest.approx(natural_frequencies(machine, at, 8), rel=1e-12)
    for k in (0, 39):
        one_pose = solve_undamped(assemble(machine, {"X": at["X"][k]}), 8).frequency
        assert natural_frequencies(machine, at, 8)[k] == pytest.approx(one_pose, rel=1e-9)
    assert "beam: elastic, reduced from" in assemble(machine).notes[0]


def test_limb_through_its_frame_is_that_of_all_finite_elements(beam, rail):
    machine = limb_through_frame(rail)
    for x in (-0.2766, 0.1234):
        at = 0.4 - x  # what of the limb is in the frame
        way = Patch([at, WIDTH / 2, HEIGHT], [1, 0, 0], [0, 1, 0], BLOCK, 0.04).averages(beam).toarray()
        k, m = (block_diag(a.toarray(), np.zeros((6, 6))) for a in (beam.stiffness(), beam.mass()))
        guided = np.vstack([way, -np.eye(6)])
        k += guided @ np.diag(list(GUIDE.values())) @ guided.T
        k[-6:, -6:] += np.diag(list(FOOT.values()))
        m[-6:, -6:] += np.diag([MASS] * 3 + [0.05, 0.04, 0.06])
        exact = np.sqrt(eigh(k, m, eigvals_only=True, subset_by_index=[0, 7])) / (2 * np.pi)
        error = solve_undamped(assemble(machine, {"X": x}), 8).frequency / exact - 1
        assert error.min() > -1e-6 and error.max() < 1e-3


def test_a_carriage_off_its_rail_and_a_point_on_a_way_are_refused(rail):
    machine = carriage_on_rail(rail, -0.5, 0.5)
    with pytest.raises(ToolpointError, match=r"body beam, interface way: .*position 0\.4 m; must be within its way"):
        assemble(machine, {"X": 0.4})
    checked = check_machine(machine)
    assert [str(doubt).partition(" m;")[0] for doubt in checked.doubts if "axes.X" in doubt] == [
        f"axes.X: at X {end} mm, an end of its travel: body beam, interface way: way: position {value}"
        for end, value in (("-500", "-0.5"), ("500", "0.5"))]
    assert checked.reduction[0].startswith("reference pose, the worst of 1 poses: reduction of elastic bodies: the first 6")
    with pytest.raises(ToolpointError, match="slides: it can be held by a joint only"):
        rail.participation("way")


def test_rigid_motion_of_an_elastic_body_is_that_of_its_mass(beam, rail):
    assert rail.mass[0, 0] == pytest.approx(STEEL.density * LENGTH * WIDTH * HEIGHT, rel=1e-9)
    assert np.abs(rail.mass[:6, 6:]).max() == 0


def test_imported_matrices_become_a_body(beam, rail):
    """The same beam by its matrices and points: all free modes; an interface over points moves as their rigid motion."""
    dofs = [Dof(int(i) + 1, way) for i in range(len(beam.nodes)) for way in ("+x", "+y", "+z")]
    matrices = ImportedMatrices(beam.stiffness(), beam.mass(), tuple(dofs), {i + 1: at for i, at in enumerate(beam.nodes)})
    left = [int(i) + 1 for i in np.flatnonzero(beam.nodes[:, 0] < 1e-9)]
    right = [int(i) + 1 for i in np.flatnonzero(beam.nodes[:, 0] > LENGTH - 1e-9)]
    body = reduce_matrices(matrices, {"foot": PointGroup(left), "end": PointGroup(right)}, band=900.0)
    free = np.sqrt(np.diag(rail.stiffness)[:4]) / (2 * np.pi)
    assert np.sqrt(np.diag(body.stiffness)[:4]) / (2 * np.pi) == pytest.approx(free, rel=1e-6)
    assert body.mass[:6, :6] == pytest.approx(rail.mass[:6, :6], rel=1e-9, abs=1e-9)
    assert body.interfaces["end"].position == pytest.approx([LENGTH, WIDTH / 2, HEIGHT / 2])
    machine = build(MachineDescription("beam", {"beam": BodyDescription(mass=1.0, inertia=INERTIA)}, {"foot": JointDescription(
        "ground", "beam", FrameDescription((0, WIDTH / 2, HEIGHT / 2)), FOOT, child_interface="foot")},
        points={"end": PointDescription("beam", interface="end")}), {"beam": body})
    assert machine.size == 6 + body.modal_count
    # With shear and a soft foot it is below Euler and Bernoulli's held beam of 50 mm height: 41.776 Hz m^2.
    assert 0.3 < solve_undamped(assemble(machine), 1).frequency[0] / (41.776 / LENGTH**2) < 1
    faults = (([left[0]], "one point"), ([left[0], right[0]], "leaves a rotation open"), ([99999], "points of the"))
    for points, words in faults:
        with pytest.raises(ToolpointError, match=words):
            reduce_matrices(matrices, {"foot": PointGroup(points)}, band=900.0)
    with pytest.raises(ToolpointError, match="none for 1 points"):
        reduce_matrices(ImportedMatrices(matrices.stiffness, matrices.mass, matrices.dofs,
                                         {k: v for k, v in matrices.coordinates.items() if k > 1}), {}, band=900.0)
