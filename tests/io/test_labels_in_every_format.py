"""A written response reads back equal, labels of every kind included, in every format that is offered."""

import numpy as np
import pytest

from toolpoint import Dof, Frf, io
from toolpoint.io.measured import frf_writing

LABELS = [Dof("tool-table", "+x"), Dof("Spindle Nose", "-y"), Dof(7, "+rz"), Dof("phase/real, (left)", "+z"),
          Dof("tool", "slant", (0.6, 0.0, 0.8)), Dof('say "100 %"', "+x"), Dof("Größe", "+x"), Dof(-3, "+y")]


def response(outputs, inputs, quantity="receptance"):
    rng = np.random.default_rng(len(outputs))
    values = rng.normal(size=(5, len(outputs), len(inputs), 2)) @ np.array([1.0, 1j])
    return Frf(np.array([1.0, 2.5, 3.0, 7.0, 9.1]), values, outputs, inputs, quantity)


@pytest.mark.parametrize("kind", frf_writing.KINDS)
@pytest.mark.parametrize("count", [1, 2, 8])
def test_a_written_response_reads_back_equal(tmp_path, kind, count):
    for quantity in ("receptance", "mobility", "accelerance"):
        frf = response(LABELS[-count:], LABELS[:min(count, 2)], quantity)
        path = tmp_path / f"x{kind}"
        io.write_frf(frf, path)
        back = io.read_frf([path])
        assert back.outputs == frf.outputs and back.inputs == frf.inputs and back.quantity == quantity
        np.testing.assert_array_equal(back.frequency, frf.frequency)
        np.testing.assert_allclose(back.values, frf.values, rtol=1e-15)


def test_a_column_that_names_its_points_needs_no_name_of_its_file(tmp_path):
    (tmp_path / "any.csv").write_text("frequency [Hz],real Tip:+x / Tip:-y [um/N],imaginary Tip:+x / Tip:-y [um/N]\n"
                                      "1,2,3\n2,3,4\n3,4,5\n")
    frf = io.read_frf([tmp_path / "any.csv"])
    assert frf.outputs == (Dof("Tip", "+x"),) and frf.inputs == (Dof("Tip", "-y"),)
    np.testing.assert_allclose(frf.values[0, 0, 0], 2e-6 + 3e-6j)
