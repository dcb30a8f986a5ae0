"""The five sources beside toolpoint: the numbers of their pages, and how many rows are reproduced.

    python benchmarks/house/source_pages.py                    counts of every source; the last line is that of all
    python benchmarks/house/source_pages.py --write [NAME]     run the source's examples with 200 draws and keep its numbers
    python benchmarks/house/source_pages.py --draws 20 ...     other draws

Pages: `docs/sources`; rows: `docs/sources/NAME.yaml`; numbers: `docs/sources/numbers.yaml`, from `examples/source_NAME*.py`.
"""

from __future__ import annotations

import runpy
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from ruamel.yaml import YAML

from benchmarks.frame import ROOT, CommandLine

sys.path.insert(0, str(ROOT / "docs"))

from generate import sources_beside

NUMBERS = ROOT / "docs" / "sources" / "numbers.yaml"


def compute(name: str, draws: int) -> dict[str, float | str]:
    """Return the numbers of a source's examples, eight digits of each, and their words."""
    result: dict[str, float | str] = {}
    for path in sources_beside.examples_of(name):
        result |= runpy.run_path(str(path))["main"](draws)
    return {key: value if isinstance(value, (int, str)) else float(f"{value:.8g}") for key, value in result.items()}


def main() -> None:
    """Print the counts, or compute and keep the numbers."""
    parser = CommandLine(__doc__)
    parser.add_argument("name", nargs="?", choices=sources_beside.NAMES, help="one source")
    parser.add_argument("--write", action="store_true", help="run the examples and keep their numbers")
    parser.cases("draws", 200)
    options = parser.parse_args()
    names = [options.name] if options.name else list(sources_beside.NAMES)
    if options.write:
        kept = dict(sources_beside.numbers()) if NUMBERS.is_file() else {}
        for name in names:
            kept[name] = compute(name, options.draws)
            yaml = YAML()
            with NUMBERS.open("w", encoding="utf-8") as file:
                file.write("# Written by `python benchmarks/house/source_pages.py --write`.\n")
                yaml.dump({key: kept[key] for key in sources_beside.NAMES if key in kept}, file)
        return
    total: Counter[str] = Counter()
    for name in names:
        print(f"{name}: {sources_beside.count_words(name)}")
        total += sources_beside.counts(name)
    print(f"all: {sum(total.values())} items; " + "; ".join(f"{total[state]} {state}" for state in sources_beside.STATES))


if __name__ == "__main__":
    main()
