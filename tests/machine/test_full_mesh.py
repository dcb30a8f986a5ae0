"""Machine files with all elements of their meshes: against one assembled matrix, the reduced bodies and what these state."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh, null_space
from scipy.sparse import csc_array

from beam_on_block import GUIDE, WAYS, pair
from toolpoint import ToolpointError
from toolpoint.app.main import main
from toolpoint.bodies.solid import STEEL, Casting, Cuboid, NamedNodes, Patch
from toolpoint.io import read_machine
from toolpoint.machine import build
from toolpoint.machine.assembly.full_mesh import link_full_meshes
from toolpoint.machine.assembly.reduction_estimate import estimate_reduction
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
)
from toolpoint.machine.parts.elastic_body import reduce_in_parts
from toolpoint.studies import compare_full_mesh
from toolpoint.substructuring.linked_bodies import FreeBody, LinkedBodies


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    return read_machine(pair(tmp_path_factory.mktemp("pair")))


def assembled(machine, position):
    """Frequencies of one dense matrix, the foot held by the null space of its mean motion."""
    block, beam = (machine.description.bodies[name].elastic.model for name in ("block", "beam"))
    k, m = (np.zeros((block.size + beam.size,) * 2) for _ in range(2))
    for model, start in ((block, 0), (beam, block.size)):
        part = slice(start, start + model.size)
        k[part, part], m[part, part] = (matrix.toarray() for matrix in model.assembled())
    place = Patch([0.3 - position, 0.05, 0], [1, 0, 0], [0, 1, 0], 0.08, 0.06)
    top = Patch([0.1, 0.05, 0.1], [1, 0, 0], [0, 1, 0], 0.08, 0.06)
    motion = np.vstack([-top.averages(block).toarray(), place.averages(beam).toarray()])
    k += motion @ np.diag(GUIDE) @ motion.T
    foot = np.zeros((len(k), 6))
    foot[:block.size] = Patch([0.1, 0.05, 0], [1, 0, 0], [0, -1, 0], 0.2, 0.1).averages(block).toarray()
    free = null_space(foot.T)
    return np.sqrt(eigh(free.T @ k @ free, free.T @ m @ free, eigvals_only=True, subset_by_index=[0, 7])) / (2 * np.pi)


@pytest.mark.parametrize("position", [0.0, 0.0873, -0.131])
def test_all_elements_are_those_of_one_matrix_and_the_reduced_within_what_they_state(machine, position):
    result = compare_full_mesh(machine, {"X": position}, 8)
    assert result.frequency == pytest.approx(assembled(machine, position), rel=1e-8)
    assert result.stated is not None and (np.abs(result.rise) <= result.stated + 1e-7).all()
    assert result.counted_below > result.frequency[-1]
    assert not result.to_dict()["doubts"]


def test_a_stated_error_that_is_too_small_is_doubted(machine):
    result = compare_full_mesh(machine, {}, 4)
    wrong = replace(result, frequency=result.frequency * 0.9)
    assert "modes 1, 2, 3, 4 differ from those of all elements by more than their stated error" in wrong.table()


def test_a_spring_much_stiffer_than_the_body_is_a_lock(tmp_path):
    locked = link_full_meshes(read_machine(pair(tmp_path))).linked.modes(6, shift=1e6)
    words = ", stiffness: {" + ", ".join(f"{way}: 1e14" for way in WAYS) + "}"
    held = link_full_meshes(read_machine(pair(tmp_path, words))).linked.modes(6, shift=1e6)
    assert held.frequency == pytest.approx(locked.frequency, rel=1e-6)


def test_a_machine_left_free_has_six_motions_at_zero(tmp_path):
    free = link_full_meshes(read_machine(pair(tmp_path, ", free: [x, y, z, rx, ry, rz]"))).linked.modes(9, shift=1e6)
    assert free.rigid_count == 6 and free.frequency[6] > 10


def test_the_count_knows_a_mode_that_is_missing(machine):
    linked = link_full_meshes(machine).linked
    squares = linked.modes(6, shift=1e6).squares
    assert [linked.count_below(1.0001 * square) for square in squares[[0, 2, 5]]] == [1, 3, 6]


def test_links_that_repeat_each_other_change_nothing():
    # Two masses of 1 kg, springs of 4 and 9 N/m to the ground, tied twice: (4 + 9)/2 rad^2/s^2.
    stiffness, mass = csc_array([[4.0, 0.0], [0.0, 9.0]]), csc_array(np.eye(2))
    third = FreeBody(csc_array(np.diag([30.0, 50.0, 90.0])), csc_array(np.eye(3)), csc_array((3, 2)))
    tied = FreeBody(stiffness, mass, csc_array([[1.0, 2.0], [-1.0, -2.0]]))
    pairs = LinkedBodies({"tied": tied, "apart": third}, np.zeros(2)).modes(2, shift=1.0)
    assert pairs.squares == pytest.approx([6.5, 30.0], rel=1e-9)


@pytest.mark.parametrize(("extra", "words"), [
    ("gravity: [0, 0, -9.81]\n", "are not carried by full meshes"),
    ("loads: [{point: end, force: [0, 0, -2 kN]}]\n", "are not carried by full meshes"),
])
def test_what_full_meshes_do_not_carry_is_refused(tmp_path, extra, words):
    with pytest.raises(ToolpointError, match=words):
        compare_full_mesh(read_machine(pair(tmp_path, extra=extra)))


@pytest.mark.parametrize("size", [None, 14, 9])
def test_a_body_with_held_nodes_states_its_error(size):
    # The foot is one rigid piece on springs: a shape that is missing shows in the estimate.
    model = Casting([Cuboid((0, 0, 0), (0.1, 0.1, 0.6))], {"body": STEEL}).meshed(0.1)
    feet = np.flatnonzero(model.nodes[:, 2] < 1e-9)
    model = replace(model, node_sets={"FIXED": feet})
    springs = np.array([2e8, 2e8, 3e8, 2e6, 2e6, 1e6])
    head = Patch([0.05, 0.05, 0.6], [1, 0, 0], [0, 1, 0], 0.1, 0.1)
    body = reduce_in_parts(model, {"head": head}, band=900.0, size=size, held=NamedNodes("FIXED")).nominal
    joint = JointDescription("ground", "column", FrameDescription((0.05, 0.05, 0)), dict(zip(WAYS, springs, strict=True)),
                             child_interface="held")
    load = BodyDescription(60.0, (0.05, 0.05, 0.7), InertiaDescription(0.5, 0.5, 0.5))
    mount = JointDescription("column", "load", FrameDescription((0.05, 0.05, 0.6)), {"rx": 1e5}, parent_interface="head")
    bodies = {"column": BodyDescription(mass=1.0, inertia=InertiaDescription(1.0, 1.0, 1.0)), "load": load}
    machine = build(MachineDescription("held", bodies, {"foot": joint, "mount": mount}), {"column": body})
    estimate = estimate_reduction(machine, None, 6)
    linked = link_full_meshes_of(machine, model, springs)
    rise = estimate.frequency / linked - 1
    assert (rise > -1e-9).all() and (rise <= estimate.error + 1e-9).all()
    assert estimate.error.max() < (1e-4 if size is None else 0.2)


def link_full_meshes_of(machine, model, springs):
    """Frequencies of all elements: the foot as a rigid piece on springs, the load on the mean motion of the head."""
    feet = model.node_sets["FIXED"]
    stiffness, mass = (matrix.toarray() for matrix in model.assembled())
    free, centre = model.free_coordinates(feet), np.array([0.05, 0.05, 0.0])
    carried = np.zeros((model.size, len(free) + 6))
    carried[free, np.arange(len(free))] = 1.0
    fixed = np.setdiff1d(np.arange(model.size), free)
    carried[fixed, -6:] = model.rigid_motion(tuple(centre))[fixed]
    head = Patch([0.05, 0.05, 0.6], [1, 0, 0], [0, 1, 0], 0.1, 0.1).averages(model).toarray().T @ carried
    stiffness, mass = carried.T @ stiffness @ carried, carried.T @ mass @ carried
    stiffness[-6:, -6:] += np.diag(springs)
    # The load follows the head, and nods about x on a spring.
    motion = np.vstack([head, np.zeros((1, head.shape[1]))])
    motion = np.hstack([motion, np.zeros((7, 1))])
    motion[6, -1] = 1.0
    twist = motion[:6] + np.outer(np.eye(6)[3], motion[6])
    twist[:3] += np.cross(twist[3:].T, [0.0, 0.0, 0.1]).T
    total_k, total_m = (np.pad(matrix, (0, 1)) for matrix in (stiffness, mass))
    total_k[-1, -1] += 1e5
    total_m += twist.T @ np.diag([60.0] * 3 + [0.5] * 3) @ twist
    return np.sqrt(eigh(total_k, total_m, eigvals_only=True, subset_by_index=[0, 5])) / (2 * np.pi)


def test_a_machine_without_meshes_is_refused():
    machines = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
    with pytest.raises(ToolpointError, match="no body with a mesh"):
        compare_full_mesh(read_machine(machines / "three_axis_vertical.yaml"))


def test_the_command_shows_both(tmp_path, capsys):
    main(["modes", str(pair(tmp_path)), "--full-mesh", "--count", "4", "--pose", "X=20mm"])
    out = capsys.readouterr().out
    assert "all elements Hz" in out and "stated at most %" in out and "(counted)" in out
