"""The virtual test rig, and the way of the published machine from hammer blows to modes (P1: 131 points x 3, 0-150 Hz)."""

import numpy as np
import pytest

from toolpoint.modal_identification.identify import identify
from toolpoint.signals.hammer import hammer_test
from toolpoint.signals.setups import join_setups
from toolpoint.studies.machines.virtual_test import Hammer, Imperfections, hammer_records, surface_points, true_modes
from toolpoint.vibration import Dof, frequency_response
from toolpoint.vibration.correlation import mac

WAYS = ("+x", "+y", "+z")


def striking_point(modes):
    """The Dof at which the weakest mode is still seen best."""
    share = np.abs(modes.shape) / np.abs(modes.shape).max(axis=0)
    return modes.dofs[int(np.argmax(share.min(axis=1)))]


@pytest.fixture(scope="module")
def truth(vertical):
    rng = np.random.default_rng(1)
    points = surface_points(vertical, 131, rng)
    return points, true_modes(vertical, points, 0.03)


def test_points_lie_on_their_bodies_and_number_as_asked(truth):
    points, modes = truth
    assert len(points.places) == 131
    assert len(modes.dofs) == 393
    assert set(points.components) == {"base", "saddle", "table", "column", "head", "magazine"}


def test_perfect_record_gives_the_models_response(truth):
    _, modes = truth
    struck = striking_point(modes)
    record = hammer_records(modes, struck, [struck], rng=np.random.default_rng(0), hammer=Hammer(hits=2))
    frf = hammer_test(record, 4.0, highest=100).frf.between(10, 100)
    expected = frequency_response.modal(modes, frf.frequency, [struck], inputs=[struck], quantity="accelerance").values
    # The force is linear between fine samples: sinc^2(58 / 2400) is 0.2 % below one.
    np.testing.assert_allclose(frf.values, expected, atol=5e-3 * np.abs(expected).max())


@pytest.mark.slow
def test_published_machine_from_hammer_blows_to_its_six_modes(truth):
    points, modes = truth
    rng, struck = np.random.default_rng(2), striking_point(modes)
    parts = []
    for point in points.places:
        record = hammer_records(modes, struck, [Dof(point, way) for way in WAYS], rng=rng, hammer=Hammer(),
                                imperfections=Imperfections(noise=0.01))
        parts.append(hammer_test(record, 4.0, highest=150).frf)
    found = identify(join_setups(parts), band=(5, 150)).modes
    assert found.count == 6
    np.testing.assert_allclose(found.frequency, modes.frequency, rtol=1e-3)
    assert np.diag(mac(found.shape_at(modes.dofs), modes.shape)).min() > 0.999


@pytest.mark.slow
def test_force_window_and_offset_leave_the_poles_alone(truth):
    """Without noise only the processing can move a pole: a window that cuts the ringing of filters moved damping by 6e-4."""
    points, modes = truth
    rng, struck = np.random.default_rng(0), striking_point(modes)
    parts = [hammer_test(hammer_records(modes, struck, [Dof(point, way) for way in WAYS], rng=rng, hammer=Hammer(block=8.0)),
                         4.0,
                         highest=150, final=0.01).frf for point in list(points.places)[:24]]
    found = identify(join_setups(parts), band=(5, 150)).modes
    np.testing.assert_allclose(found.frequency, modes.frequency, rtol=1e-6)
    np.testing.assert_allclose(found.damping_ratio, modes.damping_ratio, rtol=2e-5)


def test_imperfections_are_found_by_the_front_end(truth):
    _, modes = truth
    struck = striking_point(modes)
    near = Dof(struck.point, "+z")

    def test(**wrong):
        record = hammer_records(modes, struck, [struck, near], rng=np.random.default_rng(3), hammer=Hammer(hits=4),
                                imperfections=Imperfections(**wrong))
        return hammer_test(record, 4.0, highest=150)
    assert test().used == 4
    double = test(double_hits=(2,))
    assert [bool(hit.reasons) for hit in double.hits] == [False, False, True, False]
    assert "double" in double.status
    weak = test(weak_hits=(1,))
    assert weak.used == 3
    turned = test(wrong_sign=(near,)).frf.values[:, 1, 0]
    np.testing.assert_allclose(turned, -test().frf.values[:, 1, 0], atol=1e-12)
