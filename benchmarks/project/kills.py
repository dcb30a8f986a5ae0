"""Kills of a project's run at random moments: the results have the bytes of a run that nobody disturbed.

    python benchmarks/project/kills.py [--kills 100]

A chain of six steps with pauses (tests/project_steps.py), every second run with two workers, killed with all its processes
after 0.2 to 1.0 s; after every fifth kill the run is finished, compared, and begun anew. Last a run with nothing to do, timed
from outside.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import ROOT, CommandLine

TESTS = ROOT / "tests"
sys.path.insert(0, str(TESTS))

from project_steps import chain, results  # noqa: E402
from toolpoint.project.engine.run import run_steps  # noqa: E402

KILLS_A_RUN = 5


def new_folder(place: Path) -> Path:
    """Return a folder with the two files of the chain."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    (place / "a.txt").write_text("alpha\n")
    (place / "b.txt").write_text("beta\n")
    return place


def begin(folder: Path, workers: int) -> subprocess.Popen:
    """Return a process that runs the chain, in a group of its own."""
    return subprocess.Popen([sys.executable, str(TESTS / "project_steps.py"), str(folder), "0.06", str(workers)],
                            start_new_session=True, stderr=subprocess.DEVNULL)


def main() -> None:
    """Kill, compare, print the figure."""
    parser = CommandLine(__doc__)
    parser.cases("kills", 100)
    given = parser.parse_args()
    rng = np.random.default_rng(0)
    alike, runs, hit = 0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        clean = new_folder(Path(name) / "clean")
        run_steps(chain(clean), clean)
        expected = results(clean)
        for kill in range(given.kills):
            folder = Path(name) / "mill"
            if kill % KILLS_A_RUN == 0:
                new_folder(folder)
            process = begin(folder, 1 + kill % 2)
            time.sleep(rng.uniform(0.2, 1.0))
            hit += process.poll() is None
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            if kill % KILLS_A_RUN == KILLS_A_RUN - 1:
                run_steps(chain(folder, pause=0.02), folder)
                runs += 1
                alike += results(folder) == expected
        start = time.perf_counter()
        begin(folder, 1).wait()
        unchanged = time.perf_counter() - start
    print(f"{given.kills} kills ({hit} of a process that was running): same bytes in {alike} of {runs} finished runs; a run "
          f"with nothing to do takes {unchanged:.2f} s")


if __name__ == "__main__":
    sys.exit(main())
