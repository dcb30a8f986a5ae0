"""Shared machines and paths of the tests."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import settings

from toolpoint.io.yaml import machine_file

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
