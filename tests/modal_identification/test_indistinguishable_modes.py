"""Modes that a narrow band cannot tell apart are refused in words; no factorisation ends the identification."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.modal_identification import identify
from toolpoint.modal_identification.fit import refinement
from toolpoint.vibration import Frf, Modes, frequency_response
from toolpoint.vibration.dof import dofs


def responses(lines):
    labels = dofs(["1:+x", "2:+x"])
    modes = Modes([50.0, 80.0], 0.01, [[1.0, 0.5], [0.4, -1.0]], labels)
    return frequency_response.modal(modes, lines, None, inputs=labels[:1], quantity="accelerance")


def test_two_poles_that_are_one_are_refused_in_words():
    frf = responses(np.linspace(45, 55, 8))
    data = refinement.Data.of(frf, None)
    poles = np.array([-3.14 + 314j, -3.14 + 314j]) / data.scale
    with pytest.raises(ToolpointError, match=r"45 to 55 Hz, 8 lines.*2 modes apart.*wider band"):
        refinement.evaluate(data, poles, np.ones((1, 2), complex), weight=np.ones((2, 1)))
    assert refinement.try_evaluate(data, poles, np.ones((1, 2), complex), weight=np.ones((2, 1))) is None


@pytest.mark.parametrize("cholesky", [True, False])
def test_a_factorisation_that_fails_anywhere_is_no_foreign_error(monkeypatch, cholesky):
    def fail(*_):
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    frf = responses(np.linspace(40, 90, 101))
    monkeypatch.setattr(refinement.np.linalg, "cholesky" if cholesky else "inv", fail)
    with pytest.raises(ToolpointError, match=r"modes apart|normal matrix of the poles|must determine the fit"):
        identify(Frf(frf.frequency, frf.values, frf.outputs, frf.inputs, "accelerance"))
