"""Correlation of a test with a machine: where a change was made is where it shows; laws of COMAC, FRAC and effective mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from four_part_mill import BOXES, four_part_mill

from toolpoint._check import ToolpointError
from toolpoint.machine import assemble
from toolpoint.studies.measured.model_correlation import correlate, effective_mass, with_measured_points
from toolpoint.studies.measured.point_pairing import PointPairing
from toolpoint.vibration import Modes, correlation, eigen, frequency_response


def modes_of(machine, count=8):
    return eigen.solve_undamped(assemble(machine), count)


def test_scale_sign_and_order_of_measured_shapes_do_not_matter():
    mill = four_part_mill()
    true = modes_of(mill)
    turned = Modes(true.frequency, true.damping_ratio, true.shape * np.linspace(-3, 2, true.count), true.dofs, "unscaled")
    found = correlate(mill, turned)
    assert found.pairs.pairs.tolist() == [[i, i] for i in range(8)]
    assert found.coefficients.total == pytest.approx(1)
    assert min(found.comac.values()) == pytest.approx(1) and max(found.ecomac.values()) < 1e-9


def test_the_point_with_a_faulty_sensor_stands_out():
    mill = four_part_mill()
    true = modes_of(mill)
    shape = np.array(true.shape)
    rows = [i for i, d in enumerate(true.dofs) if d.point == "column0"]
    shape[rows] = shape[rows][[1, 2, 0]]
    found = correlate(mill, replace(true, shape=shape))
    assert min(found.comac, key=found.comac.get) == max(found.ecomac, key=found.ecomac.get) == "column0"
    others = [v for p, v in found.ecomac.items() if p != "column0"]
    assert found.ecomac["column0"] > 5 * max(others)


def test_comac_of_points_is_the_known_one_where_each_has_one_direction():
    rng = np.random.default_rng(1)
    mill = four_part_mill()
    true = modes_of(mill).at_dofs([d for d in modes_of(mill).dofs if d.direction == "+x"])
    noisy = replace(true, shape=true.shape + 0.1 * np.abs(true.shape).max() * rng.normal(size=true.shape.shape))
    found = correlate(mill, noisy, lowest_mac=0.0)
    pairs = found.pairs.pairs
    a = noisy.shape[:, pairs[:, 0]]
    b = found.predicted.shape[:, pairs[:, 1]]
    scaled = a * np.diag(correlation.modal_scale_factor(a, b))
    assert list(found.comac.values()) == pytest.approx(correlation.comac(scaled, b), abs=1e-12)


def test_effective_masses_of_all_modes_sum_to_the_moved_mass():
    """Law: with every translation of every body elastic, sum over modes and directions is three times the total mass."""
    mill = four_part_mill()
    total = sum(6800.0 * np.prod(size) for size, _ in BOXES.values())
    assert effective_mass(mill).sum() == pytest.approx(3 * total, rel=1e-9)


def test_frac_over_bands_sees_the_band_that_is_wrong():
    mill = four_part_mill()
    lines = np.arange(5.0, 90.0, 0.25)
    seen = ["nose:+x", "nose:+y"]
    frf = frequency_response.direct(assemble(mill, outputs=seen, inputs=seen), lines)
    wrong = mill.with_values({"joints.column_housing.stiffness.x": 0.6 * mill.value("joints.column_housing.stiffness.x")})
    found = correlate(wrong, modes_of(mill), frf=frf.converted_to("accelerance"), bands=[(5, 30), (30, 90)])
    assert found.frac.shape == (2, 2, 2)
    assert found.frac[0, 0, 0] > 0.95 > 0.5 > found.frac[1, 0, 0]
    same = correlate(mill, modes_of(mill), frf=frf)
    assert same.frac.min() == pytest.approx(1)
    assert len(same.bands) > 2


def test_measured_points_ride_on_their_body():
    mill = four_part_mill()
    at = {7: np.array([0.1, -0.2, 0.9])}
    carried = with_measured_points(mill, at, {"housing": [7]})
    moved = eigen.solve_undamped(assemble(carried, outputs=["7:+x", "nose:+x"]), 4)
    assert moved.shape.shape == (2, 4)
    with pytest.raises(ToolpointError, match="no position"):
        with_measured_points(mill, {}, {"housing": [7]})
    with pytest.raises(ToolpointError, match="no 'houssing'"):
        with_measured_points(mill, at, {"houssing": [7]})


def test_no_common_point_is_refused():
    mill = four_part_mill()
    with pytest.raises(ToolpointError, match="no paired point"):
        correlate(mill, Modes([10.0], 0.01, np.ones((1, 1)), ("elsewhere:x",)))
    with pytest.raises(ToolpointError, match="no paired point"):
        correlate(mill, modes_of(mill), PointPairing.identity(["elsewhere"]))
