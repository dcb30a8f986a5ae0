"""Receptance coupling: closed forms, pieces against the whole, the gauge as the exact inverse, bands that hold the truth."""

import numpy as np
import pytest
from scipy.linalg import expm

from toolpoint import ToolpointError, ToolpointWarning
from toolpoint._doubt import Doubt
from toolpoint.substructuring import ContactDescription, PlaneReceptance, SegmentDescription, ShaftDescription, couple_tool
from toolpoint.substructuring.gauge import identify_base
from toolpoint.substructuring.receptance import complex_noise, plane_receptance
from toolpoint.substructuring.shaft import shear_coefficient
from toolpoint.substructuring.shaft_stiffness import station_stiffness
from toolpoint.vibration import Frf

LINES = np.linspace(50.0, 5000.0, 200)
MODES = ((300.0, 0.04, 1.2e8, 4.0), (900.0, 0.03, 1.6e8, 12.0), (1700.0, 0.02, 2.5e8, -25.0), (3200.0, 0.03, 4e8, 9.0))


def free_receptance(shaft, frequency):
    """Receptance of the free shaft over (deflection, slope) of base and tip, above 0 Hz."""
    stiffness = station_stiffness(shaft, frequency, None)
    keep = [0, 1, 2 * stiffness.count - 2, 2 * stiffness.count - 1]
    return np.linalg.inv(stiffness.matrix)[:, keep][:, :, keep]


def rod(length, diameter, **more):
    return ShaftDescription({"rod": SegmentDescription(length, diameter, **more)})


def spindle(frequency):
    """A spindle of four modes in deflection and slope, and what lies above them."""
    values = np.zeros((frequency.size, 2, 2), complex) + np.diag([1e-9, 4e-6])
    for f, ratio, stiffness, slope in MODES:
        q = frequency / f
        values += (np.outer([1, slope], [1, slope]) / stiffness) / (1 - q**2 + 2j * ratio * q)[:, None, None]
    return values


def struck(gauge, frequency):
    """What a test of the gauge in the spindle shows at its stations: the assembled whole, inverted with the longest numbers."""
    stiffness = station_stiffness(gauge, frequency)
    whole = stiffness.matrix.astype(np.clongdouble)
    base = spindle(frequency).astype(np.clongdouble)
    turned = np.stack([np.stack([base[:, 1, 1], -base[:, 0, 1]], -1), np.stack([-base[:, 1, 0], base[:, 0, 0]], -1)], -2)
    whole[:, :2, :2] += turned / (base[:, 0, 0] * base[:, 1, 1] - base[:, 0, 1] * base[:, 1, 0])[:, None, None]
    inverse = np.linalg.inv(whole.astype(complex)).astype(np.clongdouble)
    for _ in range(3):  # Newton's steps to the inverse: two double digits become all
        inverse = inverse @ (2 * np.eye(whole.shape[1]) - whole @ inverse)
    at = [2 * k for k in stiffness.sections.values()]
    labels = [f"{name}:+x" for name in gauge.stations]
    return Frf(frequency, inverse[:, at][:, :, at].astype(complex), labels, labels)


GAUGE = ShaftDescription({"gauge": SegmentDescription(0.06, 0.04, loss_factor=1e-3)}, stations={"1": 0.055, "2": 0.015})
TOOL = ShaftDescription({"shank": SegmentDescription(0.1, 0.016, material="carbide"),
                         "flutes": SegmentDescription(0.06, 0.016, material="carbide", fluted=True)})


def clamped_frequency(shaft, guess):
    """Where the tip's static-like stiffness of a held shaft passes zero, by bisection."""
    def stiffness(f):
        return 1 / couple_tool(PlaneReceptance(np.array([f]), np.zeros((1, 2, 2))), shaft).values[0, 0, 0].real
    low, high = 0.995 * guess, 1.005 * guess
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if np.sign(stiffness(middle)) == np.sign(stiffness(low)) else (low, middle)
    return (low + high) / 2


# Frequency equation of the held Timoshenko beam, E 210 GPa, rho 7850, nu 0.3, k = 6(1+nu)/(7+6nu), as published.
@pytest.mark.parametrize(("length", "diameter", "known"), [(0.1, 0.03, (2068.40827, 10413.20367, 23785.88291)),
                                                           (0.125, 0.01, (461.40818, 2831.01375, 7678.23614))])
def test_held_shaft_has_the_frequencies_of_a_timoshenko_beam(length, diameter, known):
    for value in known:
        assert clamped_frequency(rod(length, diameter), value) == pytest.approx(value, rel=2e-8)  # the source's last digit


def test_other_shear_coefficient_gives_its_published_frequencies():
    shaft = rod(0.125, 0.01, modulus=200e9, density=7800.0, poisson=0.29, shear="hutchinson")
    for value in (451.75, 2774.0, 7531.25):  # published on a grid of 0.25 Hz
        assert clamped_frequency(shaft, value) == pytest.approx(value, abs=0.13)
    assert shear_coefficient(0.3) == pytest.approx(7.8 / 8.8)
    assert shear_coefficient(0.3, 0.9999) == pytest.approx(24 * 1.3 / (4 * 8.8 + 23.6), rel=1e-3)  # a thin tube


@pytest.mark.parametrize("frequency", [0.0, 10.0, 2000.0, 5e4, 2e6])
def test_transfer_matrix_is_the_exponential(frequency):
    from toolpoint.substructuring import segment_kernel as kernel

    row = SegmentDescription(0.1, 0.03, loss_factor=0.01).row
    density, modulus, shear, area, second, length, _ = row
    omega = 2 * np.pi * frequency
    z = np.zeros((4, 4), complex)
    z[0, 1], z[0, 2], z[1, 3], z[2, 0] = 1, 1 / (shear * area), 1 / (modulus * second), -density * area * omega**2
    z[3, 1], z[3, 2] = -density * second * omega**2, -1
    pieces = kernel._pieces(omega, density.real, modulus, shear, area.real, second.real, length.real)
    out = np.empty((4, 4), complex)
    kernel._transfer(omega, density.real, modulus, shear, area.real, second.real, length.real / pieces, out)
    size = np.array([length.real, 1, (modulus * second / length**2).real, (modulus * second / length).real])
    assert np.abs((out - expm(z * length / pieces)) / size[:, None] * size).max() < 1e-10


def test_pieces_are_the_whole_up_to_beta_l_30():
    frequency = np.linspace(20, 18500, 300)
    whole = rod(0.35, 0.012, loss_factor=1e-3)
    parts = [0.37, 0.4, 0.23]
    split = ShaftDescription({str(k): SegmentDescription(0.35 * p, 0.012, loss_factor=1e-3) for k, p in enumerate(parts)})
    omega = 2 * np.pi * frequency[-1]
    assert (7850 * omega**2 * 16 / (210e9 * 0.012**2)) ** 0.25 * 0.35 > 30
    base = PlaneReceptance(frequency, spindle(frequency))
    first, second = couple_tool(base, whole).values, couple_tool(base, split).values
    assert np.max(np.abs(first - second) / np.abs(first)) < 1e-9


def test_two_free_halves_joined_by_receptances_are_the_whole():
    frequency = np.linspace(20, 18500, 200)
    left, right, whole = (free_receptance(rod(length, 0.012, loss_factor=1e-3), frequency) for length in (0.14, 0.21, 0.35))
    joint = np.linalg.inv(left[:, 2:, 2:] + right[:, :2, :2])
    tip = right[:, 2:, 2:] - right[:, 2:, :2] @ joint @ right[:, :2, 2:]
    assert np.max(np.abs(tip - whole[:, 2:, 2:]) / np.abs(whole[:, 2:, 2:])) < 1e-9
    base = spindle(frequency)
    held = np.linalg.inv(whole[:, :2, :2] + base)
    coupled = whole[:, 2:, 2:] - whole[:, 2:, :2] @ held @ whole[:, :2, 2:]
    carried = couple_tool(PlaneReceptance(frequency, base), rod(0.35, 0.012, loss_factor=1e-3)).values
    assert np.max(np.abs(coupled - carried) / np.abs(carried)) < 1e-9


def test_contact_adds_its_compliance_and_a_stiff_one_nothing():
    base = PlaneReceptance(LINES, spindle(LINES))
    def held(k, turning):
        return ShaftDescription({"rod": SegmentDescription(0.08, 0.02, contact=ContactDescription(k, turning))})
    rigid, stiff = couple_tool(base, rod(0.08, 0.02)).values, couple_tool(base, held(1e17, 1e15)).values
    assert np.abs(stiff / rigid - 1).max() < 1e-6
    softened = PlaneReceptance(LINES, spindle(LINES) + np.diag([1e-8, 1e-5]))
    by_hand, by_contact = couple_tool(softened, rod(0.08, 0.02)).values, couple_tool(base, held(1e8, 1e5)).values
    assert np.abs(by_contact / by_hand - 1).max() < 1e-12


def test_gauge_gives_back_the_base():
    """To 1e-12 of the driving points of an entry's row and column, near the resonances of the held gauge too."""
    for gauge in (GAUGE, ShaftDescription({"taper": SegmentDescription(0.02, 0.05), "bar": SegmentDescription(
            0.05, 0.03, contact=ContactDescription(3e8, 2e5, 0.02))}, stations={"a": 0.0, "b": 0.04, "c": 0.07})):
        result = identify_base(struck(gauge, LINES), gauge, draws=0)
        exact = spindle(LINES)
        size = np.sqrt(np.abs(np.einsum("fii->fi", exact)))
        assert np.max(np.abs(result.values - exact) / (size[:, :, None] * size[:, None, :])) < 1e-12


def test_gauge_needs_driving_points_at_two_stations():
    frf = struck(GAUGE, LINES)
    with pytest.raises(ToolpointError, match="strike the other station too"):
        identify_base(frf.selected(["1:+x", "2:+x"], ["1:+x"]), GAUGE, draws=0)
    with pytest.raises(ToolpointError, match="at least two"):
        identify_base(frf, ShaftDescription(GAUGE.segments, stations={"1": 0.05}), draws=0)
    with pytest.raises(ToolpointError, match="apart"):
        identify_base(frf, ShaftDescription(GAUGE.segments, stations={"1": 0.05, "2": 0.0500001}), draws=0)


def test_responses_of_another_gauge_are_doubted():
    gauge = ShaftDescription(GAUGE.segments, stations={"1": 0.055, "2": 0.015, "3": 0.035})
    frf = struck(gauge, LINES)
    turned = Frf(LINES, frf.values[:, ::-1, ::-1], frf.outputs, frf.inputs)
    with pytest.warns(ToolpointWarning, match="which response is which"):
        assert isinstance(identify_base(turned, gauge, draws=0).notes[0], Doubt)


@pytest.mark.slow
def test_band_of_the_tool_point_holds_the_truth():
    generator = np.random.default_rng(7)
    truth = couple_tool(PlaneReceptance(LINES, spindle(LINES)), TOOL).values[:, 0, 0]
    clean = struck(GAUGE, LINES)
    variance = (0.002 * np.abs(clean.values)) ** 2
    held = []
    for _ in range(20):
        noisy = Frf(LINES, clean.values + complex_noise(variance, 1, generator)[0], clean.outputs, clean.inputs,
                    variance=variance)
        low, high = couple_tool(identify_base(noisy, GAUGE, draws=120, generator=generator), TOOL).band()
        held += [(low.real <= truth.real) & (truth.real <= high.real), (low.imag <= truth.imag) & (truth.imag <= high.imag)]
    assert 0.90 < np.mean(held) < 0.99


def test_deviations_of_the_tool_are_carried():
    base = PlaneReceptance(LINES, spindle(LINES))
    unsure = ShaftDescription(TOOL.segments, equivalent_deviation=0.03)
    with pytest.raises(ToolpointError, match="generator"):
        couple_tool(base, unsure)
    low, high = couple_tool(base, unsure, generator=np.random.default_rng(1)).band()
    values = couple_tool(base, TOOL).values[:, 0, 0]
    assert np.mean((low.real <= values.real) & (values.real <= high.real)) > 0.95


def test_computed_base_needs_its_rotations_and_takes_their_sign():
    labels = ["nose:+x", "nose:+ry"]
    sign = np.array([1, -1])
    frf = Frf(LINES, sign[:, None] * spindle(LINES) * sign, labels, labels)
    assert np.array_equal(plane_receptance(frf, "nose").values, spindle(LINES))
    with pytest.raises(ToolpointError, match="gauge"):
        plane_receptance(frf.selected(["nose:+x"], ["nose:+x"]), "nose")


def test_faults_of_a_shaft_name_the_place():
    with pytest.raises(ToolpointError, match=r"segments\.rod\.bore: 12 mm in a diameter of 10 mm"):
        rod(0.1, 0.01, bore=0.012)
    with pytest.raises(ToolpointError, match=r"segments\.rod\.length"):
        rod(-0.1, 0.01)
    with pytest.raises(ToolpointError, match=r"stations\.far: 70 mm"):
        ShaftDescription(GAUGE.segments, stations={"far": 0.07})
    with pytest.raises(ToolpointError, match="did you mean 'shank'"):
        TOOL.with_length("shnk", 0.1)
