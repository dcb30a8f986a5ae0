"""Shared machines and paths of the tests."""

from __future__ import annotations

import ctypes
import gc
import importlib
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

# Collecting makes millions of objects that stay: looking for garbage among them took a third of its time.
gc.disable()
# Compiled modules are kept on disk, also where the shell says otherwise: each worker would compile package and tests anew, and
# so would every command that a test starts. The kernels of numba lie beside them already.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# One thread of linear algebra a worker: more of them only wait for each other, and double the time of the suite. Before NumPy.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numba  # noqa: E402
import numpy as np  # noqa: E402
import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402
from numba.core.dispatcher import Dispatcher  # noqa: E402

import slow_browser  # noqa: E402
from toolpoint.io.yaml import machine_file  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
# A loaded machine is slow, not wrong: no example has a time limit.
settings.register_profile("toolpoint", deadline=None, max_examples=40)
settings.register_profile("thorough", deadline=None, max_examples=200)
settings.load_profile("toolpoint")
MACHINES = ROOT / "src" / "toolpoint" / "app" / "machines"
CHROMIUM_ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                      "--disable-background-networking", "--no-first-run"]


def pytest_configure(config):
    """Compile the kernels once, before the workers begin: each of them would compile all of them."""
    is_worker = hasattr(config, "workerinput")
    if is_worker or not getattr(config.option, "numprocesses", None) or config.option.collectonly:
        return
    # Running all kernels takes four seconds, also where every one is on disk: only once for each state of their sources.
    stamp, state = _kernel_stamp(), _kernel_state()
    if not stamp.is_file() or stamp.read_text(encoding="utf-8") != state:
        subprocess.run([sys.executable, str(ROOT / "tests" / "compile_kernels.py")], check=True)
        stamp.write_text(state, encoding="utf-8")


def pytest_runtest_logreport(report):
    """Name what fails when it fails: a run of an hour that is stopped has not said it yet."""
    if report.failed and "PYTEST_XDIST_WORKER" not in os.environ:
        print(f"\nFAILED {report.nodeid} ({report.when})", file=sys.__stderr__, flush=True)


def _kernel_stamp():
    """The file that says which kernels are compiled, beside them: it goes where they go."""
    folder = Path(os.environ.get("NUMBA_CACHE_DIR", ROOT / "src/toolpoint/cutting/stability/floquet/__pycache__"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder / "compiled_for_tests.txt"


def _kernel_state():
    """Sources of kernels with their times, as numba compares them, and what else a compiled kernel depends on."""
    sources = [path for path in sorted((ROOT / "src/toolpoint").rglob("*.py")) if b"njit" in path.read_bytes()]
    words = [numba.__version__, np.__version__, os.environ.get("NUMBA_CPU_NAME", ""), sys.version]
    return "\n".join([*words, *(f"{path.relative_to(ROOT)} {path.stat().st_mtime_ns}" for path in sources)])


@pytest.hookimpl(tryfirst=True)  # before `-m` leaves out what is slow
def pytest_collection_modifyitems(items):
    """What opens a page is marked `browser`, what starts workers `cluster`, by what each test asks for; an overflow or a
    number that is none fails a test that is not slow."""
    _make_further_cases_slow(items)
    for item in items:
        if item.get_closest_marker("slow") is None:
            for kind in ("RuntimeWarning", "scipy.linalg.LinAlgWarning"):
                item.add_marker(pytest.mark.filterwarnings(f"error::{kind}"))
        if "browser" in getattr(item, "fixturenames", ()):
            item.add_marker("browser")
        if "dask" in item.name or "worker" in item.name:
            item.add_marker("cluster")


def _make_further_cases_slow(items):
    """Mark as slow what `default_cases` leaves over of a law's cases: those that stay are spread evenly over them."""
    cases = {}
    for item in items:
        if item.get_closest_marker("default_cases") is not None:
            cases.setdefault(item.nodeid.split("[")[0], []).append(item)
    for group in cases.values():
        kept = np.linspace(0, len(group) - 1, group[0].get_closest_marker("default_cases").args[0]).round()
        for item in (each for number, each in enumerate(group) if number not in kept):
            item.add_marker("slow")


def pytest_collection_finish():
    """Look for garbage again, but never among what was collected."""
    gc.freeze()
    gc.enable()


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


@pytest.fixture
def without_other_cuts(monkeypatch):
    """Lobes of the command line make no table of other cuts unasked: eighteen charts more, which have tests of their own."""
    monkeypatch.setattr("toolpoint.studies.cuts.lobes_study.MAX_QUICK_MODES", -1)


@pytest.fixture
def interpreted(monkeypatch):
    """Return a function that lets the kernels of modules run as plain Python.

    The law of kernels that few tests need is held on a small case so, with indices checked, and without half a minute of
    compiling; their compiled twins are slow tests.
    """
    def interpret(*names):
        for name in names:
            importlib.import_module(f"toolpoint.{name}")
        for module, name, kernel in _kernels():
            monkeypatch.setattr(module, name, kernel.py_func)

    yield interpret
    late = {module.__name__ for module, _, _ in _kernels()}
    assert not late, f"loaded after the test began, so its kernels were compiled: {sorted(late)}"


def _kernels():
    """Return every compiled function of the modules that are loaded, with its module and its name there."""
    modules = [module for name, module in sys.modules.items() if name.startswith("toolpoint.")]
    return [(module, name, value) for module in modules for name, value in list(vars(module).items())
            if isinstance(value, Dispatcher)]


@pytest.fixture
def interpreted_solver(interpreted, monkeypatch):
    """The sparse solver as plain Python: also what its kernels leave to numba, a call by address and a choice by type."""
    from toolpoint.vibration.sparse import dense_calls, kernels

    def call(address, arguments):
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(arguments))(int(address))(*map(int, arguments))

    def gather(*arguments):
        kernels._gather_of(*arguments)(*arguments)

    interpreted("vibration.sparse.multifrontal", "vibration.sparse.elimination")
    monkeypatch.setattr(dense_calls, "call", call)
    monkeypatch.setattr(kernels, "_gather", gather)
    with np.errstate(over="ignore"):  # sums of keys tell patterns apart: they go round, as 64 bits do
        yield


@pytest.fixture(scope="session")
def browser():
    """One headless Chromium a session and worker: a second Playwright beside it is refused by its own loop."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
    if path is None:
        pytest.skip("no Chromium or Chrome on this machine")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=CHROMIUM_ARGUMENTS)
        slow_browser.be_patient(chromium)
        yield chromium
        chromium.close()
