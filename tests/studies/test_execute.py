"""Execution of studies: failures kept, resumed from disk, killed workers, poisoned points, serial and Dask alike."""

import numpy as np
import pytest
from study_functions import deadly_once, failing, poisoned, slow, square

from toolpoint.studies.execute import Dask, Serial, execute

pytestmark = pytest.mark.filterwarnings("ignore")
ENGINES = [Serial(), Dask(2)]


@pytest.fixture(autouse=True)
def _workers_find_the_functions(monkeypatch):
    from pathlib import Path

    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))


def points(count, **more):
    return [{"x": i, **more} for i in range(count)]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES, ids=["serial", "dask"])
def test_all_points_in_their_order(engine):
    seen = []
    run = execute(square, points(23), engine, progress=lambda done, total: seen.append((done, total)))
    np.testing.assert_array_equal(run.stacked("square"), np.arange(23) ** 2)
    assert run.stacked("row").shape == (23, 3)
    assert seen[-1] == (23, 23)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES, ids=["serial", "dask"])
def test_a_failed_point_is_a_result_with_its_reason(engine):
    run = execute(failing, points(6), engine)
    assert run.failures == {3: "ValueError: three is not wanted"}
    assert np.isnan(run.stacked("square")[3])


def test_an_interrupted_study_resumes_from_disk(tmp_path):
    log = tmp_path / "log"
    todo = points(12, log=str(log))

    def stop(done, total):
        if done >= 5:
            raise KeyboardInterrupt
    with pytest.raises(KeyboardInterrupt):
        execute(slow, todo, Serial(), folder=tmp_path / "study", progress=stop, chunk_seconds=0.01)
    first = len(log.read_text().splitlines())
    assert first < 12
    run = execute(slow, todo, Serial(), folder=tmp_path / "study", chunk_seconds=0.01)
    assert run.resumed == first
    assert sorted(map(int, log.read_text().split())) == list(range(12))
    np.testing.assert_array_equal(run.stacked("square"), np.arange(12) ** 2)
    again = execute(slow, todo, Dask(2), folder=tmp_path / "study")
    assert again.resumed == 12


def test_failures_are_kept_on_disk_too(tmp_path):
    execute(failing, points(6), Serial(), folder=tmp_path)
    assert execute(failing, points(6), Serial(), folder=tmp_path).failures == {3: "ValueError: three is not wanted"}


def test_another_study_and_a_damaged_chunk_are_refused(tmp_path):
    execute(square, points(4), Serial(), folder=tmp_path)
    with pytest.raises(ValueError, match="another study"):
        execute(square, points(5), Serial(), folder=tmp_path)
    with pytest.raises(ValueError, match="another study"):
        execute(failing, points(4), Serial(), folder=tmp_path)
    chunk = next(tmp_path.glob("chunk-*.npz"))
    chunk.write_bytes(chunk.read_bytes()[:100])
    with pytest.raises(ValueError, match="delete this file"):
        execute(square, points(4), Serial(), folder=tmp_path)


@pytest.mark.slow
def test_a_killed_worker_loses_nothing(tmp_path):
    run = execute(deadly_once, points(12, marker=str(tmp_path / "marker")), Dask(2))
    assert not run.failures
    np.testing.assert_array_equal(run.stacked("square"), np.arange(12) ** 2)


@pytest.mark.slow
def test_a_point_that_kills_its_worker_is_found_and_the_rest_goes_on():
    run = execute(poisoned, points(14), Dask(2))
    assert set(run.failures) == {7}
    assert "worker process died" in run.failures[7]
    np.testing.assert_array_equal(np.delete(run.stacked("square"), 7), np.delete(np.arange(14) ** 2, 7))
