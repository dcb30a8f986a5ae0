"""Timoshenko beams as bodies: published and closed-form frequencies, convergence, rigid motion, whirl of a spinning shaft."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from toolpoint import ToolpointError
from toolpoint.bodies.beam import join_elements, rectangle, ring
from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    SpinDescription,
)
from toolpoint.machine.description.beam import BeamDescription, BeamSegment, SleeveDescription
from toolpoint.machine.parts.beam_body import beam_basis, beam_mass
from toolpoint.vibration import eigen, frequency_response

NU = 0.3
# Clamped-free, E 210 GPa, rho 7850, nu 0.3, kappa = 6 (1 + nu)/(7 + 6 nu): Timoshenko's equations solved, Hz.
CANTILEVERS = {(0.030, 0.100): (2068.40827, 10413.20367, 23785.88291), (0.010, 0.125): (461.40818, 2831.01375, 7678.23614)}


def steel(diameter):
    return ring(diameter, 0.0, 210e9, density=7850.0, poisson=NU, shear=6 * (1 + NU) / (7 + 6 * NU))


def clamped(diameter, length, elements):
    beam = join_elements(np.linspace(0, length, elements + 1), [steel(diameter)] * elements)
    return np.sqrt(eigh(beam.stiffness[6:, 6:], beam.mass[6:, 6:], eigvals_only=True)) / (2 * np.pi)


def nearest(frequency, reference):
    return np.array([frequency[np.argmin(np.abs(frequency - f))] / f - 1 for f in reference])


@pytest.mark.parametrize("size", CANTILEVERS)
def test_a_stocky_and_a_slender_cantilever_converge_with_the_fourth_power_to_the_published_frequencies(size):
    coarse, fine = (nearest(clamped(*size, n), CANTILEVERS[size]) for n in (6, 12))
    assert (np.log2(coarse / fine) > 3.7).all()
    assert np.abs(nearest(clamped(*size, 40), CANTILEVERS[size])).max() < 2e-6


@pytest.mark.parametrize("size", CANTILEVERS)
def test_a_beam_body_in_a_machine_is_that_cantilever(size):
    diameter, length = size
    material = {"modulus": 210e9, "density": 7850.0, "poisson": NU}
    beam = BeamDescription({"rod": BeamSegment(length, diameter, **material)}, {"foot": 0.0, "tip": length}, 30e3)
    machine = build(MachineDescription("rod", {"rod": BodyDescription(beam=beam)},
                                       {"clamp": JointDescription("ground", "rod", child_interface="foot")},
                                       points={"tip": PointDescription("rod", interface="tip")}))
    frequency = eigen.solve_undamped(assemble(machine)).frequency
    assert np.abs(nearest(frequency, CANTILEVERS[size])).max() < 5e-6


@pytest.mark.parametrize("section", [steel(0.05), rectangle(0.03, 0.08, 210e9, density=7850), steel(0.05).slender,
                                     steel(0.05) + ring(0.08, 0.05, 60e9, density=1600, poisson=0.2, shear=0.6)])
def test_rigid_motion_strains_nothing_and_has_the_mass_of_the_solid(section):
    beam = join_elements(np.array([0.0, 0.1, 0.25, 0.4]), [section] * 3)
    assert np.abs(beam.stiffness @ beam.rigid).max() < 1e-12 * np.abs(beam.stiffness).max()
    mass = beam.rigid.T @ beam.mass @ beam.rigid
    assert mass[0, 0] == pytest.approx(0.4 * section.mass, rel=1e-12)
    assert mass[3, 3] == pytest.approx(0.4 * section.polar, rel=1e-12)
    about_end = section.mass * 0.4**3 / 3 + 0.4 * section.inertia_z
    assert mass[5, 5] == pytest.approx(about_end, rel=1e-12)


def test_the_spin_does_no_work_and_a_rigid_turn_feels_the_momentum_of_the_whole():
    section = steel(0.06)
    beam = join_elements(np.linspace(0, 0.3, 5), [section] * 4)
    assert np.abs(beam.gyroscopic + beam.gyroscopic.T).max() == 0
    rigid = beam.rigid.T @ beam.gyroscopic @ beam.rigid
    expected = np.zeros((6, 6))
    expected[4, 5], expected[5, 4] = 0.3 * section.polar, -0.3 * section.polar
    np.testing.assert_allclose(rigid, expected, atol=1e-12 * section.polar)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_spinning_shaft_on_simple_supports_whirls_as_its_equations_say(axis, sign):
    r"""With :math:`\sin` and :math:`\cos` along the shaft Timoshenko's equations of a shaft that spins at Omega become
    :math:`(\kappa G A b^2 - m \omega^2)(E I b^2 + \kappa G A - j \omega^2 + j_p \Omega \omega) = (\kappa G A b)^2`,
    b = pi/L: forward whirl at positive frequencies."""
    diameter, length, speed = 0.1, 0.5, 2000.0
    segment = BeamSegment(length, diameter, modulus=210e9, density=7850.0, poisson=NU)
    beam = BeamDescription({"shaft": segment}, {"a": 0.0, "b": length}, 6e3, axis)
    along = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}[axis]
    turns = {"x": ("ry", "rz"), "y": ("rx", "rz"), "z": ("rx", "ry")}[axis]
    end = FrameDescription(tuple(length * v for v in along))
    ends = {"near": JointDescription("ground", "shaft", child_interface="a", free=turns),
            "far": JointDescription("ground", "shaft", end, child_interface="b", closes_loop=True,
                                    free=(*turns, axis, "r" + axis))}
    spin = SpinDescription(speed, tuple(float(sign * v) for v in along))
    machine = build(MachineDescription("shaft", {"shaft": BodyDescription(beam=beam, spin=spin)}, ends,
                                       points={"end": PointDescription("shaft", interface="b")}))
    system = assemble(machine)
    n = len(system.mass)
    state = np.block([[np.zeros((n, n)), np.eye(n)],
                      [-np.linalg.solve(system.mass, system.stiffness), -np.linalg.solve(system.mass, system.damping)]])
    computed = np.sort(np.abs(np.linalg.eigvals(state).imag))
    s = steel(diameter)
    b = np.pi / length
    polynomial = np.polymul([-s.mass, 0, s.shear_y * b**2], [-s.inertia_y, s.polar * speed, s.bending_y * b**2 + s.shear_y])
    polynomial[-1] -= (s.shear_y * b) ** 2
    whirl = np.sort(np.abs(np.roots(polynomial).real))[:2]
    assert whirl[1] / whirl[0] > 1.01
    assert np.abs(nearest(computed, whirl)).max() < 1e-5


def test_described_segments_have_the_mass_of_their_solids():
    sleeve = SleeveDescription(0.1, modulus=60e9, density=7650.0)
    segments = {"nose": BeamSegment(0.04, 0.09, 0.03), "rotor": BeamSegment(0.1, 0.06, 0.03, sleeve=sleeve)}
    beam = BeamDescription(segments, {"tip": 0.0}, 3e3, "y")
    mass = beam_mass(beam)
    nose = 7850 * np.pi / 4 * (0.09**2 - 0.03**2) * 0.04
    rotor = np.pi / 4 * (7850 * (0.06**2 - 0.03**2) + 7650 * (0.1**2 - 0.06**2)) * 0.1
    assert mass.mass == pytest.approx(nose + rotor, rel=1e-12)
    np.testing.assert_allclose(mass.centre, [0, (0.02 * nose + 0.09 * rotor) / (nose + rotor), 0], atol=1e-12)
    assert beam_basis(beam).reduced.at(beam.numbers).mass[0, 0] == pytest.approx(mass.mass, rel=1e-12)


FILE = """
toolpoint: 1
name: rod
bodies:
  rod:
    beam: {{band: 3 kHz, axis: z, segments: {{one: {{{segment}}}}}, interfaces: {{foot: {at}}}}}{more}
joints:
  clamp: {{parent: ground, child: rod, child_interface: foot, at: [0, 0, 0]}}
points:
  foot: {{body: rod, interface: foot}}
"""


@pytest.mark.parametrize(("segment", "at", "more", "words"), [
    ("length: 100 mm", "0 mm", "", "diameter.*missing"),
    ("length: 100 mm, diameter: 20 mm, bore: 30 mm", "0 mm", "", "bore.*below the diameter"),
    ("length: 100 mm, diameter: 20 mm", "120 mm", "", "interfaces.foot.*must be on the beam"),
    ("length: 100 mm, diameter: 20 mm, width: 10 mm", "0 mm", "", "width.*beside a diameter"),
    ("length: 100 mm, width: 20 mm, height: 10 mm, bore: 3 mm", "0 mm", "", "bore.*rectangular"),
    ("length: 100 mm, diameter: 20 mm", "0 mm", "\n    mass: 3 kg", "mass.*beside beam"),
    ("length: 100 mm, diameter: 20 mm", "0 mm", "\n    spin: {speed: 100 rpm, axis: x}", "spin.axis.*along it"),
])
def test_faults_of_a_described_beam_are_named(tmp_path, segment, at, more, words):
    path = tmp_path / "rod.yaml"
    path.write_text(FILE.format(segment=segment, at=at, more=more))
    with pytest.raises(ToolpointError, match=words):
        assemble(machine_file.read(path))


def test_a_file_with_a_beam_is_written_and_read_back(tmp_path):
    path = tmp_path / "rod.yaml"
    path.write_text(FILE.format(segment="length: 100 mm, diameter: 20 mm", at="0 mm", more=""))
    described = machine_file.read(path).description
    machine_file.write(described, tmp_path / "again.yaml")
    assert machine_file.read(tmp_path / "again.yaml").description == described


def test_modes_above_a_frequency_count_by_their_static_part():
    """The response is exact at 0 Hz, and below the kept modes wrong by the square of the frequency over the lowest left out."""
    beam = BeamDescription({"rod": BeamSegment(0.3, 0.03)}, {"foot": 0.0, "tip": 0.3}, 30e3, damping_ratio=0.01)
    machine = build(MachineDescription("rod", {"rod": BodyDescription(beam=beam)},
                                       {"clamp": JointDescription("ground", "rod", child_interface="foot")},
                                       points={"tip": PointDescription("rod", interface="tip")}))
    modes = eigen.solve_damped(assemble(machine, None, ["tip:+x", "tip:+y"]))
    few = frequency_response.condense_above(modes, 3000.0)
    assert few.count < modes.count / 4 and "static part" in few.notes[-1]
    lines = np.array([0.0, 50.0, 100.0, 1000.0])
    exact, near = (frequency_response.modal(each, lines).values[:, 0, 0] for each in (modes, few))
    error = np.abs(near / exact - 1)
    assert error[0] < 1e-12 and error[3] < 0.06
    dropped = np.delete(exact, 0) - frequency_response.modal(replace(few, upper_residual=None), lines[1:]).values[:, 0, 0]
    share = np.abs(near - exact)[1:] / np.abs(dropped)
    assert (share < 1.1 * (lines[1:] / modes.frequency[few.count]) ** 2 + 0.03 * lines[1:] / 3000).all()
