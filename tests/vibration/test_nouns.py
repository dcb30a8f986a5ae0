"""The nouns: checked when made, read-only, readable, changed only by participles."""

import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint import Dof, Frf, Modes, Record, SecondOrderSystem, StateSpace, ToolpointError, ToolpointWarning
from toolpoint.vibration import eigen, frequency_response
from toolpoint.vibration.frf import join_frfs, relative

F = np.linspace(1, 10, 10)


def frf(outputs=("a:+x", "b:+x"), inputs=("a:+x",), **more):
    rng = np.random.default_rng(0)
    values = rng.normal(size=(10, len(outputs), len(inputs))) + 1j * rng.normal(size=(10, len(outputs), len(inputs)))
    return Frf(F, values, outputs, inputs, **more)


def test_reprs_can_be_read():
    points = [f"{p}:{d}" for p in range(1, 132) for d in ("+x", "+y", "+z")]
    big = Frf(np.linspace(0, 150, 601), np.zeros((601, 393, 2)), points, ["1:+x", "2:+z"])
    assert repr(big) == "Frf(131x3 outputs, 2 inputs, 0..150 Hz, 601 lines, receptance m/N)"
    assert "3 real modes" in repr(Modes([1, 2, 3], 0.01, np.eye(3), ("a:+x", "b:+x", "c:+x")))
    assert "2 coordinates" in repr(SecondOrderSystem(np.eye(2), np.eye(2)))
    assert "1 states" in repr(StateSpace([[-1.0]], [[1.0]], [[1.0]], [[0.0]]))
    assert "2 channels" in repr(Record(np.zeros((5, 2)), 10.0, ("a:+x", "a:+x"), ("force", "acceleration")))


@given(st.sampled_from(["tool:+x", "7:-rz", "-3:y", "a b:rx"]))
def test_labels_read_back(text):
    dof = Dof.parse(text)
    assert Dof.parse(str(dof)) == dof


def test_directions_of_dofs():
    np.testing.assert_allclose(Dof("p", "-ry").unit, [0, 0, 0, 0, -1, 0])
    np.testing.assert_allclose(Dof("p", "oblique", (0.6, 0, 0.8)).unit[:3], [0.6, 0, 0.8])
    assert Dof("p", "rx").is_rotation and not Dof("p", "x").is_rotation
    for wrong in (lambda: Dof("p", "u"), lambda: Dof("", "x"), lambda: Dof("p", "o", (1, 1, 0)), lambda: Dof.parse("tool")):
        with pytest.raises(ValueError, match="Dof"):
            wrong()


def test_an_error_carries_its_argument_as_data():
    for wrong, argument in ((lambda: Frf([2.0, 1.0], np.zeros((2, 1, 1)), ["1:+x"], ["1:+x"]), "Frf.frequency"),
                            (lambda: Dof(1, "+q"), "Dof.direction"), (lambda: Frf("x", 0, [], []), "Frf.frequency")):
        with pytest.raises(ToolpointError) as caught:
            wrong()
        assert caught.value.argument == argument
        copy = pickle.loads(pickle.dumps(caught.value))  # workers hand errors over
        assert (copy.argument, str(copy)) == (argument, str(caught.value))


def test_nouns_cannot_be_changed():
    one = frf()
    with pytest.raises(ValueError, match="read-only"):
        one.values[0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        one.quantity = "mobility"


def test_source_arrays_are_not_shared():
    values = np.ones((10, 1, 1))
    made = Frf(F, values, ("a:+x",), ("a:+x",))
    values[:] = 5
    assert made.values[0, 0, 0] == 1


def test_participles_select_and_keep_everything_beside():
    one = frf(variance=np.full((10, 2, 1), 4.0), coherence=np.full((10, 2, 1), 0.5), decay=2.0, notes=("n",))
    part = one.between(3, 5).selected(["b:+x"])
    assert part.values.shape == part.variance.shape == part.coherence.shape == (3, 1, 1)
    assert part.decay == 2.0 and part.notes == ("n",)
    np.testing.assert_allclose(one.converted_to("mobility").variance[:, 0, 0], 4 * (2 * np.pi * F) ** 2)


def test_interpolation_is_exact_on_lines_and_never_outside():
    one = frf()
    np.testing.assert_allclose(one.interpolated(F).values, one.values)
    np.testing.assert_allclose(one.interpolated([1.5]).values[0], (one.values[0] + one.values[1]) / 2)
    with pytest.raises(ValueError, match="extrapolated"):
        one.interpolated([0.5])


def test_joined_puts_parts_side_by_side_and_names_what_differs():
    both = join_frfs([frf(("a:+x",)), frf(("b:+x",))])
    assert both.values.shape == (10, 2, 1)
    assert join_frfs([frf(), frf(inputs=("b:+x",))], "inputs").values.shape == (10, 2, 2)
    for other, words in ((frf(quantity="mobility"), "quantity"), (frf().between(2, 9), "lines"), (frf(decay=1.0), "decay")):
        with pytest.raises(ValueError, match=words):
            join_frfs([frf(("c:+x",)), other])


def test_relative_response_is_the_quadratic_form():
    labels = ("t:+x", "t:+y", "w:+x", "w:+y")
    rng = np.random.default_rng(1)
    values = rng.normal(size=(10, 4, 4)) + 0j
    found = relative(Frf(F, values, labels, labels), "t", "w", directions=("x", "y"))
    expected = values[:, :2, :2] - values[:, :2, 2:] - values[:, 2:, :2] + values[:, 2:, 2:]
    np.testing.assert_allclose(found.values, expected)
    assert str(found.outputs[0]) == "t-w:+x"


@pytest.mark.parametrize(("make", "words"), [
    (lambda: Frf([1, 1, 2], np.zeros((3, 1, 1)), ("a:x",), ("a:x",)), "increase"),
    (lambda: Frf([-1, 1], np.zeros((2, 1, 1)), ("a:x",), ("a:x",)), "negative"),
    (lambda: Frf(F, np.full((10, 1, 1), np.nan), ("a:x",), ("a:x",)), "10 of 10 values are not finite"),
    (lambda: Frf(F, np.zeros((9, 1, 1)), ("a:x",), ("a:x",)), "shape"),
    (lambda: Frf(F, np.zeros(10), ("a:x",), ("a:x",)), r"values\[:, None, None\]"),
    (lambda: Frf(F, np.zeros((10, 2, 1)), ("a:x", "a:x"), ("a:x",)), "twice"),
    (lambda: Frf(F, np.zeros((10, 1, 1)), ("a:x",), ("a:x",), "receptence"), "did you mean 'receptance'"),
    (lambda: Frf(F, np.zeros((10, 1, 1)), ("a:x",), ("a:x",), coherence=np.full((10, 1, 1), 1.5)), "within 0"),
    (lambda: Modes([-1.0], 0.1, np.eye(1), ("a:x",)), "negative"),
    (lambda: Modes([1.0, 2.0], 0.1, np.eye(3), ("a:x", "b:x", "c:x")), "shape"),
    (lambda: Modes([1.0], 0.1, np.eye(1), ("a:x",), scaling="mass"), "unit modal mass"),
    (lambda: SecondOrderSystem(np.eye(2), np.array([[1, 2], [0, 1.0]])), "symmetric"),
    (lambda: SecondOrderSystem(np.diag([1, -1.0]), np.eye(2)), "negative mass"),
    (lambda: SecondOrderSystem(np.eye(2), np.eye(3)), "stiffness"),
    (lambda: StateSpace(np.eye(2), np.ones((3, 1)), np.ones((1, 2)), [[0.0]]), r"StateSpace\.b"),
    (lambda: Record(np.zeros((0, 1)), 10.0, ("a:x",), ("force",)), "at least one sample"),
    (lambda: Record(np.zeros((5, 1)), 0.0, ("a:x",), ("force",)), "above zero")])
def test_wrong_input_names_the_argument(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_mode_that_does_not_vibrate_is_marked_once_or_refused():
    """A ratio of 3 is 3 % written wrongly, or two real poles: with a scaling of poles it is no mode at all."""
    with pytest.warns(ToolpointWarning, match=r"3 in mode 2, 300 % of critical.*3 % is written 0\.03"):
        doubtful = Modes([10.0, 20.0], [0.02, 3.0], np.eye(2), ("a:+x", "b:+x"))
    assert len(doubtful.notes) == 1
    assert doubtful.selected([1]).notes == doubtful.notes  # no second warning: it would be an error here
    with pytest.warns(ToolpointWarning, match="no vibration mode"):
        Modes([10.0], 0.02, np.eye(1), ("a:+x",)).with_damping(2.0)
    for scaling in ("modal A", "unscaled"):
        with pytest.raises(ValueError, match="two modes of ratio 1, a real pole each"):
            Modes([10.0], 3.0, np.eye(1), ("a:+x",), scaling)
        assert Modes([10.0, 12.0], [1.0, -1.0], np.eye(2), ("a:+x", "b:+x"), scaling).notes == ()  # real poles
    assert Modes([0.0], 0.0, np.eye(1), ("a:+x",)).is_rigid.all()


def test_an_overdamped_model_has_the_response_of_its_equation_and_says_so():
    """m x'' + c x' + k x = f with c three times critical: 1/(k - m w^2 + i c w), from modes too."""
    m, k = 2.0, 800.0
    c = 3 * 2 * np.sqrt(k * m)
    modes = eigen.solve_undamped(SecondOrderSystem([[m]], [[k]], [[c]]))
    assert modes.damping_ratio[0] == pytest.approx(3) and "no vibration mode" in modes.notes[-1]
    w = 2 * np.pi * F
    np.testing.assert_allclose(frequency_response.modal(modes, F).values[:, 0, 0], 1 / (k - m * w**2 + 1j * c * w), rtol=1e-12)
    real = eigen.solve_damped(SecondOrderSystem([[m]], [[k]], [[c]]))
    np.testing.assert_allclose(real.damping_ratio, [1, 1])
    np.testing.assert_allclose(frequency_response.modal(real, F).values[:, 0, 0], 1 / (k - m * w**2 + 1j * c * w), rtol=1e-10)


def test_modes_are_selected_with_all_they_carry():
    modes = Modes([1.0, 2, 3], [0.1, 0.2, 0.3], np.arange(9.0).reshape(3, 3), ("a:x", "b:x", "c:x"),
                  covariance=np.stack([np.diag([i, i]) for i in (1.0, 4.0, 9.0)]), shape_variance=np.ones((3, 3)))
    part = modes.selected([2, 0]).at_dofs(["c:+x"])
    np.testing.assert_allclose(part.frequency, [3, 1])
    np.testing.assert_allclose(part.shape, [[8, 6]])
    np.testing.assert_allclose(part.frequency_interval, 1.959964 * np.array([3, 1]))
    assert "± Hz" in part.table()
    assert modes.between(1.5, 2.5).count == 1
    with pytest.raises(ValueError, match="interval"):
        _ = Modes([1.0], 0.1, np.eye(1), ("a:x",)).frequency_interval


def test_record_parts():
    record = Record(np.arange(20.0).reshape(10, 2), 10.0, ("a:+x", "b:+x"), ("acceleration", "acceleration"))
    assert record.between(0.2, 0.5).samples.shape == (4, 2)
    np.testing.assert_allclose(record.selected(["b:+x"]).samples[:, 0], np.arange(1, 20, 2))
    assert record.units == ("m/s^2", "m/s^2")
    assert record.duration == 1.0


def test_state_space_in_python_control():
    pytest.importorskip("control", reason="python-control is not installed")
    system = StateSpace([[-1.0, 2], [0, -3]], [[0], [1.0]], [[1.0, 0]], [[0.0]], ("u",), ("y",), ("p", "q"))
    other = system.to_control()
    np.testing.assert_allclose(other.A, system.a)
    assert tuple(other.input_labels) == ("u",)


def test_a_line_on_an_undamped_pole_is_refused_in_words():
    integrator = StateSpace([[0.0]], [[1.0]], [[1.0]], [[0.0]])
    with pytest.raises(ToolpointError, match="frequency: a line on an undamped pole"):
        integrator.response([0.0, 1.0])
