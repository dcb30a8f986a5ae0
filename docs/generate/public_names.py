"""Public names of the package, a line each: `python docs/generate/public_names.py --write` enters new ones.

A listed name stays, or goes through a deprecation (`toolpoint._deprecation`) and the migration notes; a test holds it.
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

LIST = Path(__file__).resolve().parents[1] / "public_names.txt"
ROOMS = ("vibration", "signals", "modal_identification", "joint_identification", "updating", "spatial", "kinematics", "bodies",
         "joints", "substructuring", "machine", "cutting", "drives", "vision", "acquisition", "material_removal", "studies",
         "io", "plot", "project", "pages", "workbench")


def public_names() -> list[str]:
    """Return the public names as they are now: those that `toolpoint` and its rooms export."""
    names = [f"toolpoint.{name}" for name in importlib.import_module("toolpoint").__all__]
    for room in ROOMS:
        module = importlib.import_module(f"toolpoint.{room}")
        names += [f"toolpoint.{room}.{name}" for name in getattr(module, "__all__", ())]
    return sorted(set(names))


def listed_names() -> list[str]:
    """Return the names of the list."""
    return LIST.read_text(encoding="utf-8").split()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    if parser.parse_args().write:
        LIST.write_text("\n".join(public_names()) + "\n", encoding="utf-8")
    gone, new = sorted({*listed_names()} - {*public_names()}), sorted({*public_names()} - {*listed_names()})
    print("\n".join([*(f"gone: {name}" for name in gone), *(f"not listed: {name}" for name in new)]) or "as listed")
