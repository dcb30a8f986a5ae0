"""MATLAB files: both formats give the same responses; faults have clear errors."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from toolpoint import ToolpointError
from toolpoint.io.binary import mat, numpy_arrays

RNG = np.random.default_rng(0)
AXIS = np.arange(1.0, 21)
VALUES = RNG.standard_normal((20, 3, 2)) + 1j * RNG.standard_normal((20, 3, 2))


def version_73(path, arrays) -> None:
    """Write arrays as MATLAB 7.3 does: HDF5 with a user block, reversed axes, complex as a compound of real and imag."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in arrays.items():
            turned = np.atleast_2d(value).T if np.ndim(value) < 3 else np.transpose(value)
            if np.iscomplexobj(turned):
                raw = np.empty(turned.shape, [("real", "f8"), ("imag", "f8")])
                raw["real"], raw["imag"] = turned.real, turned.imag
                turned = raw
            file.create_dataset(name, data=turned).attrs["MATLAB_class"] = np.bytes_("double")


@pytest.mark.parametrize("write", [lambda p, a: savemat(p, a), version_73])
@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (1, 0, 2)])
def test_both_formats_and_any_place_of_the_lines(tmp_path, write, order):
    path = tmp_path / "frf.mat"
    write(path, {"freq": AXIS, "H": np.transpose(VALUES, order), "fs": np.array([[2048.0]])})
    found = mat.read_frf(path, quantity="accelerance")
    assert np.array_equal(found.values, VALUES)
    assert np.array_equal(found.frequency, AXIS)
    assert found.quantity == "accelerance"


def test_fields_of_a_structure_and_labels(tmp_path):
    path = tmp_path / "frf.mat"
    savemat(path, {"test": {"f": AXIS, "H": VALUES[:, :, 0], "name": "beam"}})
    found = mat.read_frf(path, "test.f", "test.H", outputs=["1:+z", "2:+z", "3:+z"], inputs=["1:+z"])
    assert np.array_equal(found.values[:, :, 0], VALUES[:, :, 0])
    assert str(found.outputs[2]) == "3:+z"
    with pytest.raises(ToolpointError, match=r"no variable 'test.HH'.*did you mean 'test.H'"):
        mat.read_frf(path, "test.f", "test.HH")


def test_faults_are_named(tmp_path):
    path = tmp_path / "frf.mat"
    savemat(path, {"f": AXIS, "g": AXIS, "H": VALUES})
    with pytest.raises(ToolpointError, match="several fit as frequency"):
        mat.read_frf(path)
    savemat(path, {"f": AXIS[:5], "H": VALUES})
    with pytest.raises(ToolpointError, match="none fits as values"):
        mat.read_frf(path)
    with pytest.raises(ToolpointError, match="one axis must be the lines"):
        mat.read_frf(path, "f", "H")
    path.write_text("hello")
    with pytest.raises(ToolpointError, match="not a MATLAB file"):
        mat.read_frf(path)
    with pytest.raises(ToolpointError, match="cannot be read"):
        mat.variables(tmp_path / "none.mat")
    broken = VALUES.copy()
    broken[3, 0, 0] = np.nan
    savemat(path, {"f": AXIS, "H": broken})
    with pytest.raises(ToolpointError, match="not finite"):
        mat.read_frf(path)


@pytest.mark.parametrize("name", ["w", "omega", "data.omega", "freq_rad_s"])
def test_lines_named_as_angular_are_taken_in_rad_a_second_and_said(tmp_path, name):
    lines = 2 * np.pi * np.arange(1.0, 9)
    group, _, field = name.rpartition(".")
    savemat(tmp_path / "a.mat", {group: {field: lines, "G": np.ones(8) + 0j}} if group else {name: lines, "G": np.ones(8) + 0j})
    frf = mat.read_frf(tmp_path / "a.mat")
    np.testing.assert_allclose(frf.frequency, np.arange(1.0, 9))
    assert any("rad/s" in note for note in frf.notes)
    np.savez(tmp_path / "a.npz", **{field: lines, "G": np.ones(8) + 0j})
    frf = numpy_arrays.read_named(tmp_path / "a.npz", field, "G")
    np.testing.assert_allclose(frf.frequency, np.arange(1.0, 9))
    assert any("rad/s" in note for note in frf.notes)
