"""Modulus, density, loss factors and sections of elastic bodies as parameters: laws against differences and scaling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.bodies.solid import CAST_IRON as IRON
from toolpoint.bodies.solid.faces import outer_triangles, thin_triangles
from toolpoint.machine import assemble, build
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.derivatives import matrix_derivatives
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    SpinDescription,
    parameters,
)
from toolpoint.machine.description.beam import BeamDescription, BeamSegment, SleeveDescription
from toolpoint.machine.description.elastic import (
    CAST_IRON,
    CastingBox,
    ElasticDescription,
    ElasticMaterial,
    PatchDescription,
)
from toolpoint.machine.parts import body_store
from toolpoint.machine.pose.placement import place_machine
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies import study_sensitivity
from toolpoint.studies.machines.machine_modes import solve_modes
from toolpoint.studies.measured.machine_update import systems
from toolpoint.vibration import Dof, frequency_response
from toolpoint.vibration.eigen import solve_damped, solve_undamped

SPRINGS = {"x": 2e8, "y": 2e8, "z": 3e8, "rx": 2e6, "ry": 2e6, "rz": 1e6}
POST = ElasticDescription(
    (CastingBox((0, 0, 0), (0.08, 0.06, 0.4)), CastingBox((0.08, 0.0, 0.0), (0.1, 0.06, 0.4), material="rail")),
    {"foot": PatchDescription((0.04, 0.03, 0.0), (1, 0, 0), (0, -1, 0), 0.08, 0.06),
     "head": PatchDescription((0.04, 0.03, 0.4), (1, 0, 0), (0, 1, 0), 0.08, 0.06)},
    1500.0, 0.06, {"rail": ElasticMaterial(210e9, 7850.0, 0.3, 1e-3)})
SPINDLE = BeamDescription(
    {"rear": BeamSegment(0.15, 0.05, 0.02, modulus=210e9, density=7850.0, loss_factor=1e-3),
     "rotor": BeamSegment(0.2, 0.06, 0.02, modulus=210e9, density=7850.0,
                          sleeve=SleeveDescription(0.1, modulus=60e9, density=7000.0)),
     "front": BeamSegment(0.12, 0.07, 0.02, modulus=210e9, density=7850.0)},
    {"back": 0.05, "seat": 0.38, "nose": 0.47}, 2500.0)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("TOOLPOINT_CACHE", str(tmp_path))


def post_machine(elastic=POST):
    return build(MachineDescription(
        "post", {"post": BodyDescription(elastic=elastic)},
        {"foot": JointDescription("ground", "post", FrameDescription((0.04, 0.03, 0.0)), SPRINGS, child_interface="foot")},
        points={"head": PointDescription("post", interface="head")}))


def spindle_machine(beam=SPINDLE, speed=0.0):
    bearing = {"x": 3e8, "y": 3e8, "z": 1e8}
    held = {"rz": 1e3, "rx": 1e4, "ry": 1e4}
    return build(MachineDescription(
        "spindle", {"shaft": BodyDescription(beam=beam, spin=SpinDescription(speed) if speed else None)},
        {"back": JointDescription("ground", "shaft", FrameDescription((0, 0, 0.05)), bearing | held, child_interface="back"),
         "seat": JointDescription("ground", "shaft", FrameDescription((0, 0, 0.38)), bearing, free=("rx", "ry", "rz"),
                                  closes_loop=True, child_interface="seat")},
        points={"nose": PointDescription("shaft", interface="nose")}))


def frequencies(machine, count=6):
    return solve_undamped(assemble(machine, modal_damping=False)).frequency[:count]


def slopes(machine, path, count=6):
    """d f/d p of simple modes by the exact matrix derivatives."""
    system = assemble(machine, modal_damping=False)
    squares, shapes = np.linalg.eigh(np.linalg.inv(np.linalg.cholesky(system.mass)) @ system.stiffness
                                     @ np.linalg.inv(np.linalg.cholesky(system.mass)).T)
    shapes = np.linalg.inv(np.linalg.cholesky(system.mass)).T @ shapes[:, :count]
    change = matrix_derivatives(machine, [path])
    k = 0.0 if change.stiffness is None else change.stiffness[0]
    m = 0.0 if change.mass is None else change.mass[0]
    rate = [s @ (k * np.ones((1, 1)) - w * m) @ s for s, w in zip(shapes.T, squares, strict=False)]
    return np.array(rate) / (2 * np.sqrt(squares[:count])) / (2 * np.pi)


def differences(machine, path, step=1e-3):
    value = machine.value(path)
    f = [frequencies(machine.with_values({path: value * (1 + k * step)})) for k in (-2, -1, 1, 2)]
    return (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * step * value)


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


def test_cast_iron_of_descriptions_is_that_of_solids():
    assert (CAST_IRON.modulus, CAST_IRON.density, CAST_IRON.poisson, CAST_IRON.loss_factor) == (
        IRON.modulus, IRON.density, IRON.poisson, IRON.loss_factor)


def test_numbers_of_sets_and_segments_are_listed():
    listed = [*parameters(post_machine().description), *parameters(spindle_machine().description)]
    for path in ("bodies.post.elastic.materials.body.modulus", "bodies.post.elastic.materials.rail.density",
                 "bodies.shaft.beam.segments.rotor.diameter", "bodies.shaft.beam.segments.rotor.sleeve.modulus",
                 "bodies.shaft.beam.segments.rear.loss_factor"):
        assert path in listed
    assert not any("mesh_size" in path or "interfaces" in path for path in listed)


@pytest.mark.parametrize("path", ["body.modulus", "rail.modulus", "body.density", "rail.density"])
def test_derivatives_of_a_casting_are_its_differences(path):
    machine, whole = post_machine(), f"bodies.post.elastic.materials.{path}"
    assert relative(slopes(machine, whole), differences(machine, whole)) < 1e-6


@pytest.mark.parametrize("path", ["rear.modulus", "rotor.sleeve.density", "front.density"])
def test_derivatives_of_a_beam_are_its_differences(path):
    machine, whole = spindle_machine(), f"bodies.shaft.beam.segments.{path}"
    assert relative(slopes(machine, whole), differences(machine, whole)) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("path", [*(pytest.param(path, marks=pytest.mark.slow) for path in ("rear.diameter", "front.bore")),
                                  "rotor.sleeve.diameter"])
def test_derivatives_of_sections_are_those_of_beams_reduced_anew(path):
    machine, whole = spindle_machine(), f"bodies.shaft.beam.segments.{path}"
    assert relative(slopes(machine, whole), differences(machine, whole)) < 2e-4  # shapes kept against shapes of each beam


def test_the_spin_of_a_heavier_rotor_turns_more():
    machine, path = spindle_machine(speed=2000.0), "bodies.shaft.beam.segments.rotor.sleeve.density"
    value = machine.value(path)
    above, below = (assemble(machine.with_values({path: value * (1 + s)})).damping for s in (0.01, -0.01))
    exact = matrix_derivatives(machine, [path]).damping[0]
    assert np.abs(exact).max() > 0
    # The null-space basis of the loop does not depend on densities.
    assert relative(exact, (above - below) / (0.02 * value)) < 1e-9


def test_scaled_is_what_reducing_anew_gives():
    plain = replace(POST, boxes=POST.boxes[:1], materials={})
    machine = post_machine(plain)
    values = {"bodies.post.elastic.materials.body.modulus": 150e9, "bodies.post.elastic.materials.body.density": 6000.0}
    scaled = frequencies(machine.with_values(values))
    anew = frequencies(post_machine(replace(plain, materials={"body": ElasticMaterial(150e9, 6000.0, 0.26)})))
    assert scaled == pytest.approx(anew, rel=2e-6)  # shapes of a free body are the same; responses keep their number


def test_sets_scaled_apart_stay_near_a_body_reduced_anew_and_say_so():
    machine = post_machine().with_values({"bodies.post.elastic.materials.rail.modulus": 1.5 * 210e9})
    rail = replace(POST.materials["rail"], modulus=1.5 * 210e9)
    anew = post_machine(replace(POST, materials={"rail": rail}))
    assert frequencies(machine) == pytest.approx(frequencies(anew), rel=3e-3)
    assert "before modulus changed by set (rail x 1.5)" in " ".join(machine.bodies[0].notes)
    assert "changed by set" not in " ".join(anew.bodies[0].notes)


def test_nothing_is_reduced_again(monkeypatch):
    machine = post_machine()

    def refuse(description):
        raise AssertionError("reduced again")

    monkeypatch.setattr(body_store, "reduce_once", refuse)
    changed = machine.with_values({"bodies.post.elastic.materials.rail.modulus": 2e11})
    changed = changed.with_values({"bodies.post.elastic.materials.rail.loss_factor": 0.1})
    assert frequencies(changed)[0] < frequencies(machine)[0]
    with pytest.raises(AssertionError, match="reduced again"):
        machine.with_values({"bodies.post.elastic.boxes.1.high.0": 0.12})


def test_one_loss_factor_everywhere_is_a_complex_stiffness():
    eta = 0.02
    lossy = {name: replace(m, loss_factor=eta) for name, m in POST.materials.items()}
    machine = post_machine(replace(POST, materials=lossy))
    joint = replace(machine.description.joints["foot"], loss_factor=eta)
    machine = build(replace(machine.description, joints={"foot": joint}))
    lines = np.linspace(20.0, 1200.0, 50)
    frf = frequency_response.direct(assemble(machine, None, ["head:+x"]), lines).values[:, 0, 0]
    bare = post_machine(replace(POST, materials={n: replace(m, loss_factor=0.0) for n, m in POST.materials.items()}))
    modes = solve_undamped(assemble(bare, None, ["head:+x"]))
    omega = 2 * np.pi * modes.frequency
    sums = (modes.shape[0] ** 2 / (omega**2 * (1 + 1j * eta) - (2 * np.pi * lines[:, None]) ** 2)).sum(axis=1)
    assert relative(frf, sums) < 1e-9


def test_loss_factors_of_parts_add_by_their_strain_energy():
    machine = spindle_machine()
    whole = machine.with_values({f"bodies.shaft.beam.segments.{name}.loss_factor": 0.01
                                 for name in ("rear", "rotor", "rotor.sleeve", "front")})
    body = whole.bodies[0]
    assert relative(body.structural_damping, 0.01 * body.stiffness) < 1e-9
    path = "bodies.shaft.beam.segments.front.loss_factor"
    slope = matrix_derivatives(machine, [path]).structural_damping[0]
    ahead = assemble(machine.with_values({path: 0.01})).structural_damping - assemble(machine).structural_damping
    assert relative(slope * 0.01, ahead) < 1e-9


def test_sensitivity_adds_up_over_all_springs_and_moduli():
    study = study_sensitivity(post_machine(), modes=4)
    stiff = [k for k, kind in enumerate(study.kinds) if kind in ("stiffness", "modulus")]
    heavy = [k for k, kind in enumerate(study.kinds) if kind == "density"]
    assert study.frequency[stiff].sum(axis=0) == pytest.approx(np.full(4, 0.5), abs=1e-9)
    assert study.frequency[heavy].sum(axis=0) == pytest.approx(np.full(4, -0.5), abs=1e-9)


def test_a_length_has_no_exact_derivative_and_a_missing_modulus_is_named():
    machine = spindle_machine()
    with pytest.raises(ToolpointError, match="length moves nodes"):
        matrix_derivatives(machine, ["bodies.shaft.beam.segments.front.length"])
    bare = replace(SPINDLE, segments={"front": BeamSegment(0.4, 0.07)}, interfaces={"back": 0.05, "seat": 0.3, "nose": 0.4})
    with pytest.raises(ToolpointError, match="modulus: not given; what stands for it"):
        spindle_machine(bare).value("bodies.shaft.beam.segments.front.modulus")


def test_losses_are_the_damping_ratios_of_shapes_and_of_the_command():
    eta = 0.02
    lossy = {name: replace(m, loss_factor=eta) for name, m in POST.materials.items()}
    machine = post_machine(replace(POST, materials=lossy))
    both = build(replace(machine.description, joints={"foot": replace(machine.description.joints["foot"], loss_factor=eta)}))
    assert body_shapes(both, None, 6).damping_ratio == pytest.approx(np.full(6, eta / 2), rel=1e-9)
    # The joint alone and the materials alone add up, as their strain energies do.
    joint = build(replace(both.description, bodies={"post": BodyDescription(elastic=replace(POST, materials={
        name: replace(m, loss_factor=0.0) for name, m in POST.materials.items()}))}))
    parts = body_shapes(machine, None, 6).damping_ratio, body_shapes(joint, None, 6).damping_ratio
    assert parts[0] + parts[1] == pytest.approx(np.full(6, eta / 2), rel=1e-9)
    assert min(parts[0].min(), parts[1].min()) > 0
    result = solve_modes(both, count=6)
    assert "damping %" in result.table() and "1.000" in result.table()
    assert result.to_dict()["damping_ratio"] == pytest.approx([eta / 2] * 6)


def test_dampers_of_joints_are_those_of_complex_modes():
    machine = post_machine(replace(POST, materials={n: replace(m, loss_factor=0.0) for n, m in POST.materials.items()}))
    foot = replace(machine.description.joints["foot"], damping={"x": 300.0, "ry": 5.0})
    damped = build(replace(machine.description, joints={"foot": foot}))
    exact = solve_damped(assemble(damped))
    assert body_shapes(damped, None, 4).damping_ratio == pytest.approx(exact.damping_ratio[:4], rel=1e-3, abs=1e-9)


def test_elastic_bodies_are_drawn_bent():
    for machine, point in ((post_machine(), "head"), (spindle_machine(), "nose")):
        scene, moved = machine_shapes(machine, None, 5)
        at = place_machine(machine).position(machine.description.points[point])[0]
        # Drawn nodes around a point move on average as the point does, by the machine's own equations.
        modes = solve_undamped(assemble(machine, None, [f"{point}:+{way}" for way in "xyz"]))
        names = np.array(scene.body_names)[scene.node_body]
        if point == "nose":
            around = (names == "shaft") & (np.abs(scene.nodes[:, 2] - at[2]) < 1e-9)
            for k in range(5):
                mean = moved.displacement[k, around].real.mean(axis=0)
                assert np.abs(mean) == pytest.approx(np.abs(modes.shape[:, k]), abs=1e-6 * np.abs(modes.shape).max())
        mark = names == "points"
        for k in range(5):
            drawn = np.abs(moved.displacement[k, mark].real.mean(axis=0))
            assert drawn == pytest.approx(np.abs(modes.shape[:, k]), abs=1e-6 * np.abs(modes.shape).max())
        body = ~mark
        arms = scene.nodes[body] - scene.nodes[body].mean(axis=0)
        rigid = np.concatenate([np.tile(np.eye(3), (body.sum(), 1)), np.cross(np.eye(3)[None], arms[:, None]).transpose(
            0, 2, 1).reshape(-1, 3)], axis=1)
        shape = moved.displacement[-1, body].real.ravel()
        left = shape - rigid @ np.linalg.lstsq(rigid, shape, rcond=None)[0]
        assert np.linalg.norm(left) > 0.05 * np.linalg.norm(shape)


def test_a_surface_of_many_nodes_is_thinned():
    model = replace(POST, mesh_size=0.02).model
    used, triangles = outer_triangles(model)
    chosen, left = thin_triangles(model.nodes[used], triangles, 80)
    assert 20 < len(chosen) <= 80 < len(used)
    assert len(left) < len(triangles) and left.max() < len(chosen)
    assert np.ptp(model.nodes[used][chosen], axis=0) == pytest.approx([0.1, 0.06, 0.4])
    # Flat faces stay flat: every triangle lies in one of the six sides of the post.
    corners = model.nodes[used][chosen][left]
    sides = [np.abs(corners[..., axis] - at).max(axis=1) < 1e-12 for axis, at in (
        (0, 0.0), (0, 0.1), (1, 0.0), (1, 0.06), (2, 0.0), (2, 0.4))]
    assert np.any(sides, axis=0).all() and np.all([side.any() for side in sides])


def test_a_mechanism_left_free_is_named():
    hinged = replace(post_machine().description.joints["foot"], stiffness={k: v for k, v in SPRINGS.items() if k != "ry"},
                     free=("ry",))
    machine = build(replace(post_machine().description, joints={"foot": hinged}))
    result = solve_modes(machine, count=4)
    assert result.frequency[0] < 1e-3 * result.frequency[1]
    assert result.notes[0].startswith("modes at 0 Hz: nothing holds foot.ry")
    assert not any("0 Hz" in note for note in solve_modes(post_machine(), count=4).notes)


@pytest.mark.parametrize("speed", [0.0, 2000.0])
def test_modes_above_the_band_of_a_beam_are_doubted(speed):
    result = solve_modes(spindle_machine(speed=speed), count=12)
    beyond = result.frequency > SPINDLE.band
    doubts = [note for note in result.notes if "2500 Hz" in note]
    assert 0 < beyond.sum() < 12
    assert doubts and doubts[0].startswith(f"modes {12 - beyond.sum() + 1} to 12: above 2500 Hz")
    lower = solve_modes(spindle_machine(speed=speed), count=int(12 - beyond.sum()))
    assert not any("2500 Hz" in note for note in lower.notes)


@pytest.mark.slow
def test_sensitivity_of_a_spinning_shaft_is_that_at_standstill():
    spinning, still = (study_sensitivity(spindle_machine(speed=speed), modes=4) for speed in (2000.0, 0.0))
    at = [spinning.paths.index(path) for path in still.paths]
    assert spinning.frequency[at] == pytest.approx(still.frequency, abs=1e-9)
    path = "bodies.shaft.beam.segments.rotor.sleeve.density"
    with pytest.raises(ToolpointError, match="at standstill"):
        systems(spindle_machine(speed=2000.0), [path], None, outputs=(Dof("nose", "+x"),), inputs=(Dof("nose", "+x"),))
