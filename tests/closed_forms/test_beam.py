"""The beam body as an elastic body of a machine: reference case A5, a steel cantilever of 1 m, 50 x 50 mm."""

import numpy as np
import pytest

from toolpoint.bodies import beam as beams
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.vibration import eigen

MODULUS, DENSITY, LENGTH, SIDE = 210e9, 7850.0, 1.0, 0.05
BETA = np.array([1.8751040687119611, 4.694091132974174, 7.854757438237613])  # cos b cosh b = -1


def closed_form(modulus, density):
    return BETA**2 / (2 * np.pi * LENGTH**2) * np.sqrt(modulus * SIDE**2 / 12 / density)


def cantilever(modes, elements=40, locked=True, held="root"):
    section = beams.rectangle(SIDE, SIDE, MODULUS, density=DENSITY).slender
    body = beams.beam(section, LENGTH, elements, modes=modes)
    placeholder = BodyDescription(mass=1.0, inertia=InertiaDescription(1, 1, 1))
    joint = JointDescription("ground", "beam", child_interface=held,
                             free=() if locked else ("x", "y", "z", "rx", "ry", "rz"))
    description = MachineDescription("cantilever", {"beam": placeholder}, {"clamp": joint},
                                     points={"tip": PointDescription("beam", interface="tip")})
    return build(description, {"beam": body})


def bending(machine):
    # Both bending planes are equal, so every frequency comes twice; axial and torsion lie far above.
    return eigen.solve_undamped(assemble(machine)).frequency[[0, 2, 4]]


def test_reference_frequencies():
    # The reference values belong to E/rho of their steel; the closed form fixes it from the first one.
    reference = np.array([41.77582972, 261.80465593, 733.06061745])
    np.testing.assert_allclose(closed_form(MODULUS, DENSITY) / closed_form(MODULUS, DENSITY)[0], reference / reference[0],
                               rtol=1e-9)
    assert closed_form(MODULUS, DENSITY)[0] == pytest.approx(reference[0], rel=1e-8)


def test_six_fixed_interface_modes_are_as_near_as_the_reference_says():
    # Six fixed-interface bending modes in each of two planes; torsion and axial modes lie among them.
    # Errors quoted: 1.1e-6 3.2e-5 1.9e-4.
    error = bending(cantilever(16)) / closed_form(MODULUS, DENSITY) - 1
    assert (error > -1e-9).all()
    assert (error < [1.2e-6, 3.3e-5, 2.0e-4]).all()


def test_held_at_its_tip_it_is_the_same_cantilever():
    # The joint then holds an interface that moves in the body's own frame.
    np.testing.assert_allclose(bending(cantilever(16, held="tip")), bending(cantilever(16)), rtol=1e-9)


def test_more_modes_come_nearer():
    few = bending(cantilever(4)) / closed_form(MODULUS, DENSITY) - 1
    many = bending(cantilever(16)) / closed_form(MODULUS, DENSITY) - 1
    assert (many < few).all()


def test_free_beam_has_six_rigid_modes():
    modes = eigen.solve_undamped(assemble(cantilever(20, locked=False)))
    assert modes.frequency[:6].max() < 1e-3 * modes.frequency[6]
    # Free-free: cos b cosh b = 1.
    closed = 4.730040744862704**2 / (2 * np.pi) * np.sqrt(MODULUS * SIDE**2 / 12 / DENSITY)
    assert modes.frequency[6] == pytest.approx(closed, rel=1e-4)


def test_rigid_body_on_the_tip_moves_with_it():
    # A mass at the tip of a light beam: f = sqrt(3 E I / m L^3) / 2 pi.
    section = beams.rectangle(SIDE, SIDE, MODULUS, density=1e-3 * DENSITY).slender
    body = beams.beam(section, LENGTH, 10, modes=6)
    tiny = InertiaDescription(1e-9, 1e-9, 1e-9)
    description = MachineDescription(
        "hammer", {"beam": BodyDescription(mass=1.0, inertia=InertiaDescription(1, 1, 1)),
                   "mass": BodyDescription(mass=10.0, centre=(LENGTH, 0, 0), inertia=tiny)},
        {"clamp": JointDescription("ground", "beam", child_interface="root"),
         "weld": JointDescription("beam", "mass", parent_interface="tip")},
        points={"m": PointDescription("mass", (LENGTH, 0, 0))})
    found = eigen.solve_undamped(assemble(build(description, {"beam": body}))).frequency[0]
    stiffness = 3 * MODULUS * SIDE**4 / 12 / LENGTH**3
    light = 33 / 140 * DENSITY * 1e-3 * SIDE**2 * LENGTH
    assert found == pytest.approx(np.sqrt(stiffness / (10.0 + light)) / (2 * np.pi), rel=1e-5)
