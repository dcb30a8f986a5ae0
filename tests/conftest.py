"""Shared machines and paths of the tests."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

# One thread of linear algebra a worker: more of them only wait for each other, and double the time of the suite. Before NumPy.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

from toolpoint.io.yaml import machine_file  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
# A loaded machine is slow, not wrong: no example has a time limit.
settings.register_profile("toolpoint", deadline=None)
settings.load_profile("toolpoint")
MACHINES = ROOT / "src" / "toolpoint" / "app" / "machines"


def pytest_configure(config):
    """Compile the kernels once, before the workers begin: each of them would compile all of them."""
    is_worker = hasattr(config, "workerinput")
    if not is_worker and getattr(config.option, "numprocesses", None) and not config.option.collectonly:
        subprocess.run([sys.executable, str(ROOT / "tests" / "compile_kernels.py")], check=True)


def pytest_collection_modifyitems(items):
    """What opens a page is marked `browser`, what starts workers `cluster`, by what each test asks for."""
    for item in items:
        if "browser" in getattr(item, "fixturenames", ()):
            item.add_marker("browser")
        if "dask" in item.name or "worker" in item.name:
            item.add_marker("cluster")


def pytest_terminal_summary(terminalreporter):
    """Say what the run took: this process and the workers, browsers and compilers that it waited for."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    minutes = sum(usage.ru_utime + usage.ru_stime for usage in usages) / 60
    terminalreporter.write_line(f"CPU of this run: {minutes:.2f} min, with the compiling of kernels that were not on disk")


@pytest.fixture(scope="session")
def vertical():
    """The published three-axis vertical machining centre, six freedoms."""
    return machine_file.read(MACHINES / "three_axis_vertical.yaml")


@pytest.fixture(scope="session")
def vertical_drives():
    """The same with its feed drives, eighteen freedoms."""
    return machine_file.read(MACHINES / "three_axis_vertical_drives.yaml")


@pytest.fixture(scope="session")
def measured():
    """The folder of measured data, which is not part of the project."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("measured data are not beside the project (../shared/data)")
    return folder
