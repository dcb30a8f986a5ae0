"""The 3-RPS head with elastic limbs from its file: symmetry laws, all finite elements, the cache, faults of an elastic body."""


import numpy as np
import pytest

from conftest import MACHINES
from toolpoint import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.io.yaml import machine_file
from toolpoint.machine.assembly.reduction_error import reduction_error, reduction_note
from toolpoint.machine.assembly.reduction_estimate import estimate_reduction
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.parts import body_store
from toolpoint.studies import solve_modes
from toolpoint.vibration.eigen import solve_undamped

TEXT = (MACHINES / "three_rps_elastic_head.yaml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bodies")


@pytest.fixture(scope="module", autouse=True)
def _cold():
    """What other tests of this process keep in memory is forgotten: it would not be written."""
    body_store._load_or_reduce.cache_clear()


@pytest.fixture(autouse=True)
def _cache(folder, monkeypatch):
    monkeypatch.setenv("TOOLPOINT_CACHE", str(folder))


@pytest.fixture
def head():
    return machine_file.read(MACHINES / "three_rps_elastic_head.yaml")


def frequencies(machine, tilt, azimuth, count=6):
    return solve_undamped(assemble(machine, {"Z": -0.9, "tilt": tilt, "azimuth": azimuth}), count).frequency


@pytest.mark.slow
def test_modes_have_the_symmetry_of_the_head(head):
    """P3: modes 1 and 2 coincide at home and split with tilt; distributions over the plane repeat every 120 degrees."""
    home, tilted = frequencies(head, 0.0, 0.0), frequencies(head, 0.4, 0.2)
    assert home[1] == pytest.approx(home[0], rel=1e-9) and tilted[1] > 1.05 * tilted[0]
    for turn in (2 * np.pi / 3, 4 * np.pi / 3):
        assert frequencies(head, 0.4, 0.2 + turn) == pytest.approx(tilted, rel=1e-8)


@pytest.mark.slow
def test_bodies_are_kept_on_disk_by_content(head, folder):
    kept = list(folder.glob("body-*.npz"))
    assert len(kept) == 1  # three limbs of one description
    body = body_store.read_body(kept[0]).nominal
    body_store._load_or_reduce.cache_clear()
    again = machine_file.read(MACHINES / "three_rps_elastic_head.yaml")
    assert np.array_equal(again.bodies[1].mass, body.mass) and again.bodies[1].notes == head.bodies[1].notes
    pose = {"Z": -0.9, "tilt": 0.2, "azimuth": 0.0}
    assert np.array_equal(estimate_reduction(again, pose).error, estimate_reduction(head, pose).error)
    assert np.array_equal(again.bodies[1].interfaces["guide"].slide.values, head.bodies[1].interfaces["guide"].slide.values)
    kept[0].write_bytes(b"cut off")
    body_store._load_or_reduce.cache_clear()
    assert np.allclose(machine_file.read(MACHINES / "three_rps_elastic_head.yaml").bodies[1].stiffness, body.stiffness)


@pytest.mark.slow
def test_what_the_reduction_does_is_said_at_every_pose(head, tmp_path):
    """Against richer bodies; a body too small for its band is doubted first."""
    pose = {"Z": -0.9, "tilt": 0.3, "azimuth": 0.0}
    error = reduction_error(head, pose, 6)
    assert error.min() > -1e-6 and error.max() < 2e-3
    assert reduction_note(head, pose, 6).startswith("reduction of elastic bodies: the first 6 frequencies are within")
    (tmp_path / "head.yaml").write_text(TEXT.replace("size: 36", "size: 9"))
    small = machine_file.read(tmp_path / "head.yaml")
    note = reduction_note(small, pose, 6)
    assert isinstance(note, Doubt) and note.what == "reduction of elastic bodies"
    assert solve_modes(small, pose, 6).to_dict()["doubts"] == [note]


@pytest.mark.slow
def test_reduced_limbs_are_those_of_all_finite_elements(head):
    from benchmarks.machine import elastic_head as bench

    for z, tilt, azimuth in bench.POSES[1:4:2]:
        pose = {"Z": z, "tilt": tilt, "azimuth": azimuth}
        exact = bench.full(head, pose)
        assert solve_undamped(assemble(head, pose), 6).frequency == pytest.approx(exact, rel=2e-3)
        estimate = estimate_reduction(head, pose, 6)
        assert (estimate.error >= np.abs(estimate.frequency / exact - 1)).all() and estimate.is_sure.all()


@pytest.mark.parametrize(("old", "new", "words"), [
    ("band: 500 Hz", "bnad: 500 Hz", "did you mean 'band'"),
    ("high: [50 mm, 50 mm, 0 mm]", "high: [50 mm, 50 mm]", "three each"),
    ("{low: [-42 mm, -42 mm, -830 mm], high: [42 mm, 42 mm, -822 mm]}", "{low: [90 mm, 0, 0], high: [95 mm, 5 mm, 5 mm]}",
     "pieces"),
    ("slide: [-220 mm, 285 mm]", "slide: [-320 mm, 285 mm]", "leaves its rail"),
    ("    elastic: &limb", "    mass: 3 kg\n    elastic: &limb", "given beside elastic")])
def test_faults_of_an_elastic_body_are_named(tmp_path, old, new, words):
    assert old in TEXT
    (tmp_path / "head.yaml").write_text(TEXT.replace(old, new, 1))
    with pytest.raises(ToolpointError, match=words):
        machine_file.read(tmp_path / "head.yaml")


@pytest.mark.slow
def test_a_limb_beyond_its_way_is_refused(tmp_path):
    (tmp_path / "head.yaml").write_text(TEXT.replace("slide: [-220 mm, 285 mm]", "slide: [-50 mm, 50 mm]").replace(
        "size: 36", "size: 30"))
    machine = machine_file.read(tmp_path / "head.yaml")
    with pytest.raises(ToolpointError, match=r"body limb\d, interface guide: .*must be within its way"):
        assemble(machine, {"Z": -0.75, "tilt": 0.0, "azimuth": 0.0})
