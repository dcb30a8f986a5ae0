"""Common frame of the benchmarks: command line, peers that may be absent, measured data beside the project.

A script adds the root of the project to the path, so that it runs from any folder, and takes its options from here:

    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    from benchmarks.frame import CommandLine

    parser = CommandLine(__doc__)
    parser.cases("machines", 20)     # --machines N, or --count N; --quick runs a tenth
    parser.seed(0)                   # --seed N
    options = parser.parse_args()

The last line that a script prints is the figure of its row in `docs/bars.yaml`.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
MACHINE_TEMPLATES = ROOT / "src/toolpoint/app/machines"
MEASURED_DATA = ROOT.parent / "shared" / "data"  # beside the project, not part of it

QUICK_DIVISOR = 10  # cases of a full run for each case of a quick one

SEED_NAMES = ("seed", "first", "first-seed")


class CommandLine(argparse.ArgumentParser):
    """Parser with the names that all benchmarks share; `--help` prints the script's docstring as it is written."""

    def __init__(self, text: str | None) -> None:
        super().__init__(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
        self._cases: str | None = None

    def cases(self, name: str, number: int, about: str = "") -> None:
        """Add how many cases are run: `--name`, also called `--count`; `--quick` runs a tenth of them."""
        self.add_argument(f"--{name}", "--count", type=int, default=number, dest=name, metavar="N",
                          help=f"{about or name.replace('-', ' ')} (default {number})")
        self.add_argument("--quick", action="store_true", help="run a tenth of the cases, for a first look")
        self._cases = name

    def seed(self, number: int, name: str = "seed") -> None:
        """Add the seed of the first case, under each of the names that scripts give it; it is read as `name`."""
        self.add_argument(*(f"--{word}" for word in SEED_NAMES), type=int, default=number, dest=name.replace("-", "_"),
                          metavar="N", help=f"seed of the first case (default {number})")

    def part(self, name: str, *, default: str | None, choices: Sequence[str] | None = None, about: str = "") -> None:
        """Add which part of the script is run: `--name`, also called `--part`."""
        self.add_argument(f"--{name}", "--part", default=default, choices=choices, dest=name,
                          help=f"{about or 'part that is run'} (default {default})")

    def json(self) -> None:
        """Add `--json`: the figures as JSON in place of sentences."""
        self.add_argument("--json", action="store_true", help="print the figures as JSON")

    def peers(self, about: str) -> None:
        """Add the interpreter that has the peers, which need not be installed beside toolpoint."""
        self.add_argument("--peers", default=sys.executable, metavar="PYTHON", help=about)

    def parse_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> Any:
        """Return the options; a quick run has a tenth of the cases, at least one."""
        options = super().parse_args(args, namespace)
        if self._cases is not None and options.quick:
            setattr(options, self._cases, max(1, getattr(options, self._cases) // QUICK_DIVISOR))
        return options


def read_rows(file: Path | None) -> list[dict[str, Any]]:
    """Return the rows that earlier runs kept in a file, a JSON object a line; none where there is no file."""
    return [] if file is None or not file.exists() else [json.loads(line) for line in file.read_text().splitlines()]


def import_peer(name: str) -> Any:
    """Return a module of another package, or None with a line that says that its rows are left out."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        print(f"{name.partition('.')[0]} is left out: {error}", flush=True)
        return None


def needed_peer(name: str) -> Any:
    """Return a module of another package that the whole script is measured against; end with a sentence where it is absent."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise SystemExit(f"not measured: {name.partition('.')[0]} is not installed ({error})") from None


def measured_data(*names: str) -> Path:
    """Return a folder of measured data beside the project; where it is absent, end with a sentence that says so."""
    folder = MEASURED_DATA.joinpath(*names)
    if not folder.exists():
        raise SystemExit(f"not measured: ../{folder.relative_to(ROOT.parent)} is not beside the project")
    return folder
