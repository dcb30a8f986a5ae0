"""HDF5: every noun comes back equal; damaged, foreign and newer files are told apart."""

from dataclasses import fields

import h5py
import numpy as np
import pytest

from random_systems import random_system
from toolpoint.io import read_geometry
from toolpoint.io.binary import hdf5
from toolpoint.vibration import Dof, Frf, Modes, Record, eigen, state_space
from toolpoint.vibration import frequency_response as fr
from toolpoint.vibration.geometry import Geometry


def nouns():
    rng = np.random.default_rng(0)
    system = random_system(rng, 4)
    frf = fr.direct(system, np.linspace(1, 50, 9))
    labels = (Dof("tool", "+x"), Dof(7, "-rz"), Dof("probe", "oblique", (0.6, 0.0, 0.8)), Dof("a", "y"))
    frf = Frf(frf.frequency, frf.values, labels, frf.inputs, coherence=np.full(frf.values.shape, 0.9), decay=3.0,
              notes=("one", "zwei ä"))
    record = Record(rng.normal(size=(20, 2)), 1024.0, ("1:+x", "2:+z"), ("force", "acceleration"), name="hit")
    return {"system": system, "frf": frf, "modes": eigen.solve_damped(system), "real": eigen.solve_undamped(system),
            "record": record, "state": state_space.physical(system).discretised(1e-3, "first")}


def same(a, b):
    assert type(a) is type(b)
    for field in fields(a):
        one, two = getattr(a, field.name), getattr(b, field.name)
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, two)
        else:
            assert one == two, field.name


def test_places_are_kept_beside_modes(tmp_path):
    """Numbers stay numbers, names names, and the file of modes is a file of points."""
    places = {1: np.array([0.1, 0.2, -0.3]), "tool": np.zeros(3), 12: np.array([1e-9, 2.0, 1 / 3])}
    hdf5.write({"modes": nouns()["modes"], "places": Geometry(places, [(1, "tool")])}, tmp_path / "modes.h5")
    geometry = read_geometry(tmp_path / "modes.h5")
    assert list(geometry.points) == list(places) and geometry.lines == [(1, "tool")]
    for name, place in places.items():
        np.testing.assert_array_equal(geometry.points[name], place)
    same(hdf5.read(tmp_path / "modes.h5", Modes), nouns()["modes"])


@pytest.mark.parametrize("name", list(nouns()))
def test_round_trip(tmp_path, name):
    noun = nouns()[name]
    hdf5.write(noun, tmp_path / "one.h5")
    same(noun, hdf5.read(tmp_path / "one.h5", type(noun)))


def test_several_by_name(tmp_path):
    hdf5.write(nouns(), tmp_path / "all.h5")
    found = hdf5.read_all(tmp_path / "all.h5")
    assert set(found) == set(nouns())
    for name, noun in nouns().items():
        same(noun, found[name])


def test_truncated_foreign_newer_and_missing_files(tmp_path):
    path = tmp_path / "one.h5"
    hdf5.write(nouns()["frf"], path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match="cut off"):
        hdf5.read(path, Frf)
    path.write_text("not hdf5")
    with pytest.raises(ValueError, match="cut off"):
        hdf5.read(path, Frf)
    with h5py.File(path, "w") as file:
        file["x"] = 1
    with pytest.raises(ValueError, match="not one of toolpoint"):
        hdf5.read(path, Frf)
    hdf5.write(nouns()["frf"], path)
    with h5py.File(path, "a") as file:
        file.attrs["version"] = 99
    with pytest.raises(ValueError, match="update it"):
        hdf5.read(path, Frf)
    with pytest.raises(ValueError, match="no such file"):
        hdf5.read(tmp_path / "none.h5", Frf)


def test_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "one.h5"
    hdf5.write(nouns()["record"], path)
    with pytest.raises(ValueError, match="cannot be saved"):
        hdf5.write({"bad": "text"}, path)
    same(nouns()["record"], hdf5.read(path, Record))
    assert [p.name for p in tmp_path.iterdir()] == ["one.h5"]
