"""Two runs that start in one new study folder at the same moment both finish with all outcomes."""

import threading

import numpy as np
from study_functions import square

from toolpoint.studies import execute as module
from toolpoint.studies.execute import Serial, execute


def test_runs_that_begin_together(tmp_path, monkeypatch):
    points = [{"x": i} for i in range(6)]
    both = threading.Barrier(8)
    real = module.os.replace

    def replace_together(source, target):
        """All have written their part before any is put in place: the worst that timing can do."""
        if str(target).endswith("study.json"):
            both.wait(10)
        return real(source, target)

    monkeypatch.setattr(module.os, "replace", replace_together)
    monkeypatch.setattr(module.os, "link", lambda source, target, link=module.os.link: (both.wait(10), link(source, target)))
    results, errors = [], []

    def run():
        try:
            results.append(execute(square, points, Serial(), folder=tmp_path / "new", chunk_seconds=1e-6))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=run) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    for result in results:
        np.testing.assert_array_equal(result.stacked("square"), np.arange(6) ** 2)
    assert not list((tmp_path / "new").glob("*.part"))
