"""The estimated error of a machine's modes by reduction: never below the truth of all finite elements, at any pose."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag

from toolpoint._doubt import Doubt, place_note
from toolpoint.bodies.imported import ImportedMatrices
from toolpoint.bodies.solid import STEEL, Casting, Cuboid, Patch
from toolpoint.machine import build
from toolpoint.machine.assembly.reduction_error import reduction_note
from toolpoint.machine.assembly.reduction_estimate import can_estimate, estimate_reduction
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
)
from toolpoint.machine.description.beam import BeamDescription, BeamSegment
from toolpoint.machine.description.elastic import CastingBox, ElasticDescription, ElasticMaterial, PatchDescription
from toolpoint.machine.parts.elastic_body import reduce_solid
from toolpoint.machine.parts.imported_body import PointGroup, reduce_matrices
from toolpoint.pages import machine_page
from toolpoint.studies import check_machine, solve_modes
from toolpoint.studies.machines.machine_report import study_modes
from toolpoint.vibration import Dof
from toolpoint.vibration.sparse import modes

SPRINGS = {"x": 2e8, "y": 3e8, "z": 2.5e8, "rx": 1e6, "ry": 2e6, "rz": 8e5}
INERTIA = InertiaDescription(0.05, 0.04, 0.06)


def never_below(error, truth, sure):
    """A true error below 1e-8 is within the truth's own digits."""
    return (error[sure] + 1e-8 >= np.abs(truth[sure])).all()


@pytest.mark.slow
def test_estimates_are_never_below_the_truth_of_random_machines():
    from benchmarks.machine import reduced_castings as bench

    """Two or three castings on feet that close a loop, springs and locked directions, two sliding places, random poses."""
    ratios, seen_errors = [], []
    for seed in range(100, 106):
        castings = bench.Castings(seed)
        for _ in range(3):
            error, truth, sure = bench.compare(castings, castings.pose())
            assert sure.sum() >= 7 and never_below(error, truth, sure), seed
            seen = sure & (np.abs(truth) > 1e-8)
            ratios += list(error[seen] / np.abs(truth[seen]))
            seen_errors += list(truth)
    assert max(seen_errors) > 1e-3  # there was something to see
    assert np.median(ratios) <= 5


@pytest.fixture(scope="module")
def post():
    """A post with a foot and a head, 0.5 m high, in coarse elements."""
    model = Casting((Cuboid([0, 0, 0], [0.1, 0.06, 0.5]),), {"body": STEEL}).meshed(0.13)
    places = {"foot": Patch([0.05, 0.03, 0], [1, 0, 0], [0, -1, 0], 0.1, 0.06),
              "head": Patch([0.05, 0.03, 0.5], [1, 0, 0], [0, 1, 0], 0.1, 0.06)}
    return model, places


def standing(body, springs=SPRINGS, *, mass=20.0, gravity=None, inertia=INERTIA):
    """The post on springs, a mass on springs on its head."""
    bodies = {"post": BodyDescription(mass=1.0, inertia=inertia),
              "load": BodyDescription(mass=mass, inertia=inertia, centre=(0.05, 0.03, 0.55))}
    joints = {"foot": JointDescription("ground", "post", FrameDescription((0.05, 0.03, 0)), springs, child_interface="foot"),
              "top": JointDescription("post", "load", FrameDescription((0.05, 0.03, 0.5)), springs, parent_interface="head")}
    return build(MachineDescription("post", bodies, joints, gravity=gravity), {"post": body})


def whole(model, places):
    """Frequencies of the same with all finite elements."""
    foot, head = (places[name].averages(model).toarray() for name in ("foot", "head"))
    stiffness, mass = (block_diag(m.toarray(), np.zeros((6, 6))) for m in (model.stiffness(), model.mass()))
    # The load's twist is about its centre, 50 mm above the head.
    arm = np.eye(6)
    arm[0, 4], arm[1, 3] = -0.05, 0.05
    for motion in (np.vstack([foot, np.zeros((6, 6))]), np.vstack([-head, arm.T])):
        stiffness += motion @ np.diag(list(SPRINGS.values())) @ motion.T
    mass[-6:, -6:] = np.diag([20.0] * 3 + [0.05, 0.04, 0.06])
    return modes(stiffness, mass, 8).frequency[:8]


@pytest.mark.parametrize("size", [9, 14, None])
def test_a_post_and_its_load(post, size):
    model, places = post
    machine = standing(reduce_solid(model, places, band=900.0, size=size))
    estimate = estimate_reduction(machine, modes=8)
    truth = estimate.frequency / whole(model, places) - 1
    assert never_below(estimate.error, truth, estimate.is_sure) and estimate.is_sure.sum() >= 6
    if size == 9:
        assert truth.max() > 1e-4
        seen = estimate.is_sure & (truth > 1e-8)
        assert np.median(estimate.error[seen] / truth[seen]) < 8


def test_estimates_do_not_change_with_the_units_of_force_or_mass(post):
    """All stiffness times c, all mass times d: the same shapes, the same relative errors, by the scaled form."""
    box = CastingBox((0, 0, 0), (0.1, 0.06, 0.5))
    places = {name: PatchDescription(tuple(place.centre), tuple(place.along), tuple(place.across), place.length, place.width)
              for name, place in post[1].items()}
    elastic = ElasticDescription((box,), places, 900.0, 0.13, {"body": ElasticMaterial(2.1e11, 7850.0)}, size=9)
    joints = standing(reduce_solid(*post, band=900.0)).description.joints

    def machine(c, d):
        turned = InertiaDescription(*(d * value for value in (0.05, 0.04, 0.06)))
        bodies = {"post": BodyDescription(elastic=elastic),
                  "load": BodyDescription(mass=20.0 * d, inertia=turned, centre=(0.05, 0.03, 0.55))}
        stiff = {name: replace(joint, stiffness={way: c * k for way, k in SPRINGS.items()}) for name, joint in joints.items()}
        plain = build(MachineDescription("post", bodies, stiff))
        return plain.with_values({"bodies.post.elastic.materials.body.modulus": c * 2.1e11,
                                  "bodies.post.elastic.materials.body.density": d * 7850.0})

    plain = estimate_reduction(machine(1.0, 1.0), modes=8)
    for c, d in ((2.0, 1.0), (1.0, 0.5), (3.0, 1.7)):
        other = estimate_reduction(machine(c, d), modes=8)
        assert other.error == pytest.approx(plain.error, rel=1e-6)
        assert other.frequency == pytest.approx(plain.frequency * np.sqrt(c / d), rel=1e-9)
        assert other.sure_to == pytest.approx(plain.sure_to * np.sqrt(c / d))


def test_sets_that_scale_apart_are_compared_and_not_estimated():
    boxes = (CastingBox((0, 0, 0), (0.1, 0.06, 0.3)), CastingBox((0, 0, 0.3), (0.1, 0.06, 0.5), material="head"))
    foot = PatchDescription((0.05, 0.03, 0), (1, 0, 0), (0, -1, 0), 0.1, 0.06)
    steel = {name: ElasticMaterial(2.1e11, 7850.0) for name in ("body", "head")}
    joint = JointDescription("ground", "post", FrameDescription((0.05, 0.03, 0)), SPRINGS, child_interface="foot")
    machine = build(MachineDescription("post", {"post": BodyDescription(
        elastic=ElasticDescription(boxes, {"foot": foot}, 900.0, 0.13, steel))}, {"foot": joint}))
    assert can_estimate(machine)
    both = machine.with_values({f"bodies.post.elastic.materials.{name}.modulus": 1e11 for name in ("body", "head")})
    assert can_estimate(both) and "estimate" in reduction_note(both, modes=3)
    apart = machine.with_values({"bodies.post.elastic.materials.head.modulus": 1e11})
    assert not can_estimate(apart) and estimate_reduction(apart) is None
    assert "a comparison and no bound" in reduction_note(apart, modes=3)
    assert solve_modes(apart, count=3).to_dict()["reduction_error"] is None


def test_matrices_of_the_same_post_give_the_same_estimates(post):
    """Interfaces over the points of its ends are other averages; each is never below its own truth."""
    model, _ = post
    dofs = [Dof(int(i) + 1, way) for i in range(len(model.nodes)) for way in ("+x", "+y", "+z")]
    matrices = ImportedMatrices(model.stiffness(), model.mass(), tuple(dofs), {i + 1: at for i, at in enumerate(model.nodes)})
    ends = {name: [int(i) + 1 for i in np.flatnonzero(np.abs(model.nodes[:, 2] - z) < 1e-9)]
            for name, z in (("foot", 0.0), ("head", 0.5))}

    class Averages:
        """Interfaces over points, as `whole` asks for patches."""

        def __init__(self, points):
            self.points = points

        def averages(self, model):
            from scipy.sparse import csc_array

            from toolpoint.machine.parts.imported_body import _weights

            return csc_array(_weights(matrices, "end", PointGroup(self.points), np.mean(
                [matrices.coordinates[point] for point in self.points], axis=0)))

    machine = standing(reduce_matrices(matrices, {name: PointGroup(p) for name, p in ends.items()}, band=900.0, size=9))
    estimate = estimate_reduction(machine, modes=8)
    truth = estimate.frequency / whole(model, {name: Averages(points) for name, points in ends.items()}) - 1
    assert never_below(estimate.error, truth, estimate.is_sure) and truth.max() > 1e-4 and estimate.is_sure.sum() >= 6


def test_a_beam_has_the_same_estimates_along_any_axis():
    """Asked for far beyond its band, so that there is something to see; the springs turn with the beam."""
    found = []
    for axis, order in (("x", (0, 1, 2)), ("y", (1, 2, 0)), ("z", (2, 0, 1))):
        ways = [("x", "y", "z")[k] for k in order]
        springs = dict(zip(ways, (3e8, 2e8, 1.5e8), strict=True))
        springs |= {f"r{way}": value for way, value in zip(ways, (4e4, 9e4, 7e4), strict=True)}
        beam = BeamDescription({"a": BeamSegment(0.3, diameter=0.06), "b": BeamSegment(0.2, diameter=0.04)},
                               {"left": 0.05, "right": 0.45}, 1200.0, axis)
        at = np.zeros(3)
        at[order[0]] = 1.0
        joints = {name: JointDescription("ground", "shaft", FrameDescription(tuple(place * at)), springs, child_interface=name,
                                         closes_loop=name == "right") for name, place in (("left", 0.05), ("right", 0.45))}
        machine = build(MachineDescription("shaft", {"shaft": BodyDescription(beam=beam)}, joints))
        found.append(estimate_reduction(machine, modes=16).error)
    held = found[0] < 1.0
    assert held.sum() > 8 and found[0][held].max() > 1e-3
    for other in found[1:]:
        assert other[held] == pytest.approx(found[0][held], rel=1e-5, abs=1e-9)


def test_weight_changes_estimates_little(post):
    """The post bears 20 kg: geometric stiffness is a thousandth of the springs', and so is what it does to the estimate."""
    body = reduce_solid(*post, band=900.0, size=9)
    plain = estimate_reduction(standing(body), modes=6)
    heavy = estimate_reduction(standing(body, gravity=(0.0, 0.0, -9.80665)), modes=6)
    assert heavy.frequency != pytest.approx(plain.frequency, rel=1e-9)
    assert heavy.error == pytest.approx(plain.error, rel=2e-3)


def test_what_is_beyond_the_reach_or_too_coarse_is_doubted(post):
    narrow = standing(reduce_solid(*post, band=200.0))
    estimate = estimate_reduction(narrow, modes=8)
    beyond = estimate.frequency > 200.0 * 1.5 / 1.4
    assert 0 < beyond.sum() < 8 and not estimate.is_sure[beyond].any()
    note = reduction_note(narrow, modes=8)
    assert isinstance(note, Doubt) and f"{beyond.sum()} of 8 modes above 214.3 Hz" in note.why and "band" in note.remedy
    shown = solve_modes(narrow, count=8)
    assert [value is None for value in shown.to_dict()["reduction_error"]] == (~estimate.is_sure).tolist()
    assert shown.table().count("doubt") >= beyond.sum()
    assert note in shown.to_dict()["doubts"] and f"doubt: {note}" in shown.table()
    few = standing(reduce_solid(*post, band=900.0, size=3))
    coarse = estimate_reduction(few, modes=6)
    assert coarse.error.max() > 0.05 and not coarse.is_sure.all()
    assert "too large to believe" in reduction_note(few, modes=6)
    assert not isinstance(reduction_note(standing(reduce_solid(*post, band=900.0)), modes=3), Doubt)


def test_a_doubted_reduction_stands_first_in_the_check_the_report_and_the_page(post):
    """At its poses: marked in text, apart in plain data, under the answer of the page; what is good is an assumption there."""
    narrow, good = (standing(reduce_solid(*post, band=band)) for band in (200.0, 900.0))
    checked = check_machine(narrow)
    assert "reduction of elastic bodies" in checked.table().splitlines()[0] and checked.reduction == ()
    for machine, is_doubted in ((narrow, True), (good, False)):
        study = replace(study_modes(machine), notes=(place_note(reduction_note(machine, modes=3), "reference pose"),))
        line = study.notes[0]
        assert line.startswith("reference pose: reduction of elastic bodies: ")
        assert (f"doubt: {line}" in study.table()) == is_doubted == (line in study.to_dict()["doubts"])
        assert (line in study.table()) and line in study.to_dict()["notes"]
        page = machine_page(study, "", "post.yaml")
        assert (line in page.doubts) == is_doubted == isinstance(page.doubts[-1] if page.doubts else "", Doubt)


def test_a_machine_of_rigid_bodies_has_no_estimate():
    machine = build(MachineDescription("block", {"block": BodyDescription(mass=10.0, inertia=INERTIA)}, {
        "foot": JointDescription("ground", "block", FrameDescription(), SPRINGS)}))
    assert estimate_reduction(machine) is None and reduction_note(machine) == ""
    assert solve_modes(machine, count=3).to_dict()["reduction_error"] is None
