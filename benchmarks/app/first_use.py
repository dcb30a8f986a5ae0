"""First seconds of a new user: CPU seconds of a command that compiles its kernels, and of the same command again; install size.

    python benchmarks/app/first_use.py [--case lobes|report|finite-elements]

Kernels are kept in a folder of the run, which is empty before the first call. The size is that of the files of toolpoint and of
what its installation brings, without compiled Python. Last line: CPU seconds of the first and the second call, and the size.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.frame import MACHINE_TEMPLATES, ROOT, CommandLine

MACHINE = str(MACHINE_TEMPLATES / "three_axis_vertical.yaml")
CASES = {"lobes": ["lobes", MACHINE], "report": ["report", MACHINE], "finite-elements": ["demo", "finite-element-mill"]}


def cpu_of(arguments: list[str], folder: Path) -> float:
    """Return CPU seconds (user and system, workers too) of one call whose kernels are kept in a folder."""
    kept = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "kernels"), "TOOLPOINT_CACHE": str(folder / "bodies")}
    process = subprocess.Popen([sys.executable, "-m", "toolpoint", *arguments, "-o", str(folder / "page")], env=kept,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
    _, status, usage = os.wait4(process.pid, 0)
    assert os.waitstatus_to_exitcode(status) == 0, arguments
    return usage.ru_utime + usage.ru_stime


def install_sizes() -> dict[str, float]:
    """Return the megabytes of toolpoint and of every distribution that its installation brings."""
    sizes, waiting = {"toolpoint": sum(path.stat().st_size for path in (ROOT / "src").rglob("*") if path.is_file()
                                       and "__pycache__" not in path.parts) / 1e6}, metadata.requires("toolpoint") or []
    while waiting:
        words = waiting.pop()
        name = re.match(r"[\w.-]+", words).group().lower()
        if "extra ==" in words or name in sizes:
            continue
        try:
            part = metadata.distribution(name)
        except metadata.PackageNotFoundError:  # of another system or an older Python
            continue
        files = [part.locate_file(file) for file in part.files or ()]
        sizes[name] = sum(Path(str(file)).stat().st_size for file in files if Path(str(file)).is_file()) / 1e6
        waiting += part.requires or []
    return sizes


def main() -> None:
    parser = CommandLine(__doc__)
    parser.add_argument("--case", choices=CASES, default="lobes")
    options = parser.parse_args()
    sizes = install_sizes()
    for name, size in sorted(sizes.items(), key=lambda item: -item[1])[:8]:
        print(f"{name:16s}{size:8.1f} MB")
    with tempfile.TemporaryDirectory() as folder:
        first, second = (cpu_of(CASES[options.case], Path(folder)) for _ in range(2))
    print(f"{options.case}: {first:.1f} CPU s the first time, {second:.1f} the second; installed {sum(sizes.values()):.0f} MB")


if __name__ == "__main__":
    main()
