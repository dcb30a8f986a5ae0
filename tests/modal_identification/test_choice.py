"""Poles chosen by hand: what is removed goes, what is added comes, a wrong choice is refused, a file brings it again."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.testing import choice_file
from toolpoint.modal_identification import AddedPole, PoleChoice, identify
from toolpoint.vibration import Modes, frequency_response

DOFS = tuple(f"{k}:+x" for k in range(1, 7))


@pytest.fixture(scope="module")
def measured():
    rng = np.random.default_rng(2)
    truth = Modes([21.0, 34.0, 52.0], [0.02, 0.015, 0.02], rng.normal(size=(6, 3)), DOFS)
    frf = frequency_response.modal(truth, np.linspace(5, 80, 500), inputs=DOFS[:1], quantity="accelerance")
    noise = rng.normal(size=(2, *frf.values.shape)) * 0.01 * np.abs(frf.values).max()
    return truth, replace(frf, values=frf.values + noise[0] + 1j * noise[1])


@pytest.fixture(scope="module")
def found(measured):
    return identify(measured[1])


def test_what_is_removed_and_added_again_is_what_was_found(measured, found):
    k = int(np.argmin(np.abs(found.modes.frequency - 34)))
    without = identify(measured[1], choice=PoleChoice(remove=(34.0,)))
    assert without.modes.count == found.modes.count - 1
    assert np.abs(without.modes.frequency - 34).min() > 5
    assert without.fit < found.fit and "by hand: removed 34 Hz" in without.advice[0]
    back = identify(measured[1], choice=PoleChoice((AddedPole(33.8, 0.02),), (34.0,)))
    np.testing.assert_allclose(back.modes.frequency, found.modes.frequency, rtol=1e-3)
    assert back.modes.damping_ratio[k] == pytest.approx(found.modes.damping_ratio[k], rel=0.05)
    assert back.choice is not None and back.modes.covariance is not None


def test_an_empty_choice_changes_nothing(measured, found):
    same = identify(measured[1], choice=PoleChoice())
    np.testing.assert_array_equal(same.modes.frequency, found.modes.frequency)


@pytest.mark.parametrize(("choice", "words"), [
    (PoleChoice(remove=(45.0,)), "nearest is"), (PoleChoice(remove=(34.0, 34.01)), "a second time"),
    (PoleChoice((AddedPole(200.0, 0.02),)), "within the band"), (PoleChoice((AddedPole(40.0, 2.0),)), "two per cent"),
    (PoleChoice((AddedPole(34.0, 0.015),)), "there already")])
def test_a_wrong_choice_is_refused(measured, choice, words):
    with pytest.raises(ToolpointError, match=words):
        identify(measured[1], choice=choice)


def test_a_pole_where_no_mode_is_is_told(measured):
    astray = identify(measured[1], choice=PoleChoice((AddedPole(68.0, 0.001),)))
    at = astray.modes.frequency[np.argmin(np.abs(astray.modes.frequency - 68))]
    told = any("has gone to" in line for line in astray.advice)
    assert told or astray.doubtful[np.argmin(np.abs(astray.modes.frequency - at))] or astray.significance.min() < 100


def test_a_choice_goes_through_its_file(tmp_path):
    choice = PoleChoice((AddedPole(34.25, 0.015),), (52.5, 21.125))
    file = tmp_path / "choice.yaml"
    file.write_text(choice_file.text_of(choice))
    assert choice_file.read(file) == choice


@pytest.mark.parametrize(("text", "words"), [
    ("toolpoint: 1\n", "changes nothing"), ("toolpoint: 1\nadd: [{frequency: -3, damping_ratio: 0.1}]\n", "frequency"),
    ("toolpoint: 1\nadd: [{frequency: 30, damping: 0.1}]\n", "damping"), ("remove: [20]\n", "toolpoint: missing")])
def test_a_faulty_file_is_refused_with_its_place(tmp_path, text, words):
    file = tmp_path / "choice.yaml"
    file.write_text(text)
    with pytest.raises(FileFaults, match=words):
        choice_file.read(file)
