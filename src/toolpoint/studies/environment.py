"""Environment of toolpoint: versions, threads, caches, extras, the browser; missing parts and their remedies."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from toolpoint._notebook import NotebookText
from toolpoint.studies.text_table import text_table

CORE = ("toolpoint", "numpy", "scipy", "numba", "pydantic", "ruamel.yaml", "h5py", "click", "rich", "plotly", "pillow")
# Extra, the distribution that it needs, and what it is for.
EXTRAS = {"app": ("uvicorn", "the workbench in a browser"),
          "video": ("av", "video files"), "bayes": ("emcee", "samples of a posterior"),
          "mesh": ("netgen-mesher", "bodies from STEP files"), "control": ("control", "python-control"),
          "cluster": ("distributed", "worker processes"),
          "acquisition": ("sounddevice", "live tests from sound inputs and, with nidaqmx, NI boards"),
          "sound": ("soundfile", "FLAC, MP3 and Ogg sound"),
          "tdms": ("nptdms", "TDMS records")}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
GOOD_STATE, MISSING_STATE, DOUBTFUL_STATE = "good", "not there", "doubtful"


@dataclass(frozen=True)
class Finding:
    """Part of the environment: its name, state, detail, and the remedy where there is one."""

    part: str
    state: str
    detail: str
    remedy: str = ""


@dataclass(frozen=True)
class Environment(NotebookText):
    """All findings; `is_whole` where nothing that toolpoint needs is missing or doubtful (extras are not needed)."""

    findings: tuple[Finding, ...]

    @property
    def is_whole(self) -> bool:
        """Whether the core is there and nothing is doubtful."""
        return all(finding.state == GOOD_STATE or finding.part.startswith(("extra ", "browser")) for finding in self.findings)

    def table(self) -> str:
        """Return the findings as text."""
        rows = [[f.part, f.state, f.detail, f.remedy] for f in self.findings]
        verdict = "all that is needed is there" if self.is_whole else "something is missing or doubtful: see the remedies"
        return text_table("What toolpoint stands on here", ["part", "state", "what", "remedy"], rows) + f"\n{verdict}"

    def to_dict(self) -> dict[str, Any]:
        """Return the findings as plain data."""
        return {"whole": self.is_whole, "findings": [vars(finding) for finding in self.findings]}


def examine_environment() -> Environment:
    """Return the environment of this process: nothing is installed, loaded or changed.

    Examples
    --------
    >>> [finding.part for finding in examine_environment().findings[:2]]
    ['Python', 'toolpoint']
    """
    return Environment((_python(), *map(_distribution, CORE), _threads(), _cache(), _kernels(), *map(_extra, EXTRAS),
                        _browser()))


def _python() -> Finding:
    version = platform.python_version()
    state = GOOD_STATE if sys.version_info >= (3, 11) else DOUBTFUL_STATE
    return Finding("Python", state, f"{version} on {platform.system()} {platform.machine()}",
                   "" if state == GOOD_STATE else "install Python 3.11 or newer")


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return ""


def _distribution(name: str) -> Finding:
    version = _version(name)
    return Finding(name, GOOD_STATE, version) if version else Finding(name, MISSING_STATE, "not installed",
                                                                      f"pip install {name}")


def core_count() -> int:
    """Return the number of cores that this process may use.

    Examples
    --------
    >>> core_count() >= 1
    True
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _threads() -> Finding:
    cores = core_count()
    stated = {name: os.environ[name] for name in THREADS if name in os.environ}
    crowded = [name for name, value in stated.items() if value.isdigit() and int(value) > cores]
    words = f"{cores} cores; " + (", ".join(f"{name}={value}" for name, value in stated.items()) or "no limits of threads")
    return Finding("threads", DOUBTFUL_STATE if crowded else GOOD_STATE, words,
                   f"set {crowded[0]} to at most {cores}" if crowded else "")


def _is_writable(folder: Path) -> bool:
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK)


def _cache() -> Finding:
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "toolpoint"
    size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()) if folder.is_dir() else 0
    if _is_writable(folder):
        return Finding("cache of elastic bodies", GOOD_STATE, f"{folder}, {size / 1e6:.1f} MB")
    return Finding("cache of elastic bodies", DOUBTFUL_STATE,
                   f"{folder} cannot be written; castings are reduced anew every time",
                   "set XDG_CACHE_HOME to a folder that can be written")


def _kernels() -> Finding:
    source = Path(__file__).resolve().parents[1]
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or source)
    count = sum(1 for _ in folder.rglob("*.nbc"))
    if _is_writable(folder):
        words = f"{count} kept beside {folder}" if count else (
            "none yet: the first use compiles them, half a minute once; doctor --compile does so now")
        return Finding("compiled kernels", GOOD_STATE, words)
    return Finding("compiled kernels", DOUBTFUL_STATE, f"{folder} cannot be written; they are compiled in every process",
                   "set NUMBA_CACHE_DIR to a folder that can be written")


def _extra(name: str) -> Finding:
    distribution, use = EXTRAS[name]
    version = _version(distribution)
    return Finding(f"extra {name}", GOOD_STATE if version else MISSING_STATE,
                   f"{distribution} {version}".strip() + f", for {use}",
                   "" if version else f"pip install 'toolpoint[{name}]'")


def _browser() -> Finding:
    path = next((place for name in BROWSERS if (place := shutil.which(name))), "")
    words = path or "no Chromium; only pictures of pages and tests of pages need it"
    return Finding("browser", GOOD_STATE if path else MISSING_STATE, words, "" if path else "install chromium")
