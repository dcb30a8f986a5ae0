"""Geometric stiffness: pendulums on ideal hinges (A3), a column that buckles, loops cut in different places."""

import numpy as np
import pytest

from toolpoint.machine import assemble, build, static_equilibrium
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    LoadDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.vibration import eigen

G = 9.81


def rod(mass, centre, inertia):
    return BodyDescription(mass=mass, centre=centre, inertia=InertiaDescription(inertia, inertia, inertia))


def frequencies(description):
    return eigen.solve_undamped(assemble(build(description))).frequency


def test_gravity_pendulum_on_an_ideal_hinge():
    machine = MachineDescription("A3", {"rod": rod(2.0, (0, 0, -0.5), 0.02)},
                                 {"hinge": JointDescription("ground", "rod", free=("rx",))}, gravity=(0, 0, -G),
                                 points={"tip": PointDescription("rod", (0, 0, -1))})
    closed = np.sqrt(2 * G * 0.5 / (0.02 + 2 * 0.25)) / (2 * np.pi)
    assert closed == pytest.approx(0.6912783627, abs=2e-10)  # reference case A3
    assert frequencies(machine)[0] == pytest.approx(closed, rel=1e-12)


def test_pendulum_out_of_balance_is_refused():
    machine = MachineDescription("tilted", {"rod": rod(2.0, (0, 0.3, -0.5), 0.02)},
                                 {"hinge": JointDescription("ground", "rod", free=("rx",))}, gravity=(0, 0, -G),
                                 points={"tip": PointDescription("rod", (0, 0, -1))})
    with pytest.raises(ValueError, match="balance"):
        assemble(build(machine))


def test_double_pendulum_by_hand():
    # Two point masses on massless rods of equal length: w^2 = g/l (2 -+ sqrt 2).
    tiny = 1e-12
    machine = MachineDescription(
        "double", {"a": rod(1.0, (0, 0, -0.4), tiny), "b": rod(1.0, (0, 0, -0.8), tiny)},
        {"one": JointDescription("ground", "a", free=("rx",)),
         "two": JointDescription("a", "b", FrameDescription((0, 0, -0.4)), free=("rx",))},
        gravity=(0, 0, -G), points={"p": PointDescription("b")})
    closed = np.sqrt(G / 0.4 * (2 + np.array([-1, 1]) * np.sqrt(2))) / (2 * np.pi)
    np.testing.assert_allclose(frequencies(machine), closed, rtol=1e-9)


def test_inverted_pendulum_loses_stability_at_the_critical_load():
    # Hinge with torsion spring c, axial load P at height h: K = c - P h.
    def stiffness(load):
        machine = MachineDescription(
            "column", {"rod": rod(1.0, (0, 0, 0.5), 0.1)},
            {"hinge": JointDescription("ground", "rod", stiffness={"rx": 100.0, "ry": 100.0})},
            loads=(LoadDescription("top", (0, 0, -load)),), points={"top": PointDescription("rod", (0, 0, 1.0))})
        return assemble(build(machine)).stiffness
    np.testing.assert_allclose(stiffness(40.0), np.diag([60.0, 60.0]), rtol=1e-12)


def test_upside_down_is_said_and_not_shown_as_zero():
    machine = build(MachineDescription(
        "inverted", {"rod": rod(10.0, (0, 0, 0.2), 0.1)},
        {"hinge": JointDescription("ground", "rod", stiffness={"rx": 1.0, "ry": 1.0})}, gravity=(0, 0, -G),
        points={"top": PointDescription("rod", (0, 0, 0.4))}))
    ways = (lambda: eigen.solve_undamped(assemble(machine)), lambda: body_shapes(machine),
            lambda: natural_frequencies(machine, {}))
    for way in ways:
        with pytest.raises(ValueError, match="statically unstable"):
            way()


def four_bar(cut):
    # Two hanging bars and a coupler, all on hinges about x; gravity and a side spring; cut at one of the hinges.
    bodies = {"a": rod(1.0, (0, 0, -0.2), 0.02), "c": rod(2.0, (0, 0.3, -0.4), 0.05), "b": rod(1.5, (0, 0.6, -0.25), 0.03)}
    hinges = {"ga": ("ground", "a", (0, 0, 0)), "ac": ("a", "c", (0, 0, -0.4)), "cb": ("c", "b", (0, 0.6, -0.5)),
              "gb": ("ground", "b", (0, 0.6, 0))}
    joints = {}
    for name, (parent, child, at) in hinges.items():
        if cut == "gb" or name != "cb":
            joints[name] = JointDescription(parent, child, FrameDescription(at), closes_loop=name == cut, **law(name))
        else:
            joints[name] = JointDescription(parent, child, FrameDescription(at), closes_loop=True, **law(name))
    return MachineDescription("four-bar", bodies, joints, gravity=(0, 0, -G),
                              points={"p": PointDescription("c", (0, 0.3, -0.4))})


def law(name):
    return {"stiffness": {"rx": 30.0}} if name == "ga" else {"free": ("rx",)}


def test_four_bar_is_the_same_wherever_it_is_cut():
    first, second = frequencies(four_bar("gb")), frequencies(four_bar("cb"))
    assert len(first) == 1
    np.testing.assert_allclose(first, second, rtol=1e-9)


def test_parallelogram_of_hanging_bars_swings_like_its_closed_form():
    # Equal massless bars of length l carry a bar of mass m that only translates: w^2 = g/l. The preload acts through
    # ideal hinges alone.
    tiny = 1e-9
    bodies = {"a": rod(tiny, (0, 0, -0.25), tiny), "c": rod(3.0, (0, 0.3, -0.5), 0.1), "b": rod(tiny, (0, 0.6, -0.25), tiny)}
    hinge = {"free": ("rx",)}
    joints = {"ga": JointDescription("ground", "a", FrameDescription((0, 0, 0)), **hinge),
              "ac": JointDescription("a", "c", FrameDescription((0, 0, -0.5)), **hinge),
              "gb": JointDescription("ground", "b", FrameDescription((0, 0.6, 0)), **hinge),
              "bc": JointDescription("b", "c", FrameDescription((0, 0.6, -0.5)), closes_loop=True, **hinge)}
    machine = MachineDescription("parallelogram", bodies, joints, gravity=(0, 0, -G), points={"p": PointDescription("c")})
    assert frequencies(machine)[0] == pytest.approx(np.sqrt(G / 0.5) / (2 * np.pi), rel=1e-6)


def spatial_loop(cut):
    # Three legs from the ground to a plate on spherical joints with springs: two independent loops.
    angles = np.deg2rad([0, 120, 240])
    bodies = {"plate": BodyDescription(mass=5.0, centre=(0, 0, 0.6), inertia=InertiaDescription(0.3, 0.35, 0.5))}
    joints = {}
    for i, angle in enumerate(angles):
        along = np.array([np.cos(angle), np.sin(angle), 0])
        foot, top = 0.5 * along, 0.2 * along + [0, 0, 0.55]
        middle = tuple((foot + top) / 2)
        bodies[f"leg{i}"] = rod(1.0 + 0.1 * i, middle, 0.02)
        joints[f"foot{i}"] = JointDescription("ground", f"leg{i}", FrameDescription(tuple(foot)),
                                              stiffness={"rx": 400.0, "ry": 300.0, "rz": 200.0})
        joints[f"top{i}"] = JointDescription(f"leg{i}", "plate", FrameDescription(tuple(top)), free=("rx", "ry", "rz"),
                                             closes_loop=i != cut)
    return MachineDescription("tripod", bodies, joints, gravity=(0, 0, -G),
                              points={"p": PointDescription("plate", (0, 0, 0.6))})


def test_spatial_loop_is_the_same_whichever_leg_carries_the_plate():
    results = [frequencies(spatial_loop(cut)) for cut in range(3)]
    assert all(len(r) == len(results[0]) for r in results)
    np.testing.assert_allclose(results[1], results[0], rtol=1e-7)
    np.testing.assert_allclose(results[2], results[0], rtol=1e-7)


def test_tree_cut_with_a_locked_loop_joint_is_the_tree_itself():
    # A body on two half-joints in series equals the same body on one: a loop joint that locks all is a weld.
    def machine(extra):
        bodies = {"a": rod(3.0, (0, 0, 0.2), 0.1), "b": rod(2.0, (0.1, 0, 0.5), 0.05)}
        joints = {"foot": JointDescription("ground", "a", stiffness={"x": 1e5, "ry": 2e3})}
        if extra:
            joints["free"] = JointDescription("ground", "b", free=("x", "y", "z", "rx", "ry", "rz"))
            joints["weld"] = JointDescription("a", "b", FrameDescription((0, 0, 0.4)), closes_loop=True)
        else:
            joints["weld"] = JointDescription("a", "b", FrameDescription((0, 0, 0.4)))
        return MachineDescription("weld", bodies, joints, points={"p": PointDescription("b", (0.1, 0, 0.5))})
    np.testing.assert_allclose(frequencies(machine(True)), frequencies(machine(False)), rtol=1e-9)


def test_reactions_balance_gravity_and_deflection_is_hookes_law():
    machine = MachineDescription(
        "post", {"a": rod(4.0, (0.1, 0, 0.3), 0.1), "b": rod(1.0, (0.5, 0, 0.6), 0.1)},
        {"foot": JointDescription("ground", "a", stiffness={"z": 1e6}),
         "arm": JointDescription("a", "b", FrameDescription((0.3, 0, 0.6)), stiffness={"ry": 1e4})},
        gravity=(0, 0, -G), points={"tip": PointDescription("b", (0.8, 0, 0.6))})
    rest = static_equilibrium(build(machine))
    np.testing.assert_allclose(rest.reactions["foot"][:3], [0, 0, 5 * G], rtol=1e-12)
    np.testing.assert_allclose(rest.reactions["foot"][3:], [0, -(0.1 * 4 + 0.5) * G, 0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(rest.reactions["arm"][4], -0.2 * G, rtol=1e-9)
    sag = 5 * G / 1e6 + 0.2 * G / 1e4 * 0.5
    assert rest.points["tip"][2] == pytest.approx(-sag, rel=1e-9)
