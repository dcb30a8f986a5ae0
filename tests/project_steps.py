"""Small steps of a project for the tests of the engine: files joined, numbers scaled, with pauses that a kill can hit."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.project.engine.plan import StepPlan, plan_steps
from toolpoint.project.engine.run import run_steps
from toolpoint.project.engine.step import ProjectStep, StepOutcome


def join_files(folder, sources=(), *, factor=1.0, pause=0.0, doubt="", fails="", grave=False):
    """Write the sources one after the other, with the factor, in two files."""
    time.sleep(pause)
    if fails:
        raise ToolpointError(fails)
    text = "".join(Path(source).read_text() for source in ((sources,) if isinstance(sources, Path) else sources))
    (folder / "joined.txt").write_text(f"{factor!r}\n{text}")
    time.sleep(pause)
    (folder / "length.txt").write_text(f"{len(text) > 0}\n")
    return StepOutcome(f"{len(text)} letters", (Doubt("joined", doubt, grave=grave),) if doubt else ())


def ignore_sources(folder, sources):
    """Write what depends on no content of the sources."""
    (folder / "fixed.txt").write_text("fixed\n")
    return StepOutcome("fixed")


def chain(root: Path, *, pause: float = 0.0, factor: float = 0.01, count: int = 4) -> StepPlan:
    """Return a chain of steps from a.txt and b.txt of a folder, with two that do not depend on each other."""
    options = {"factor": factor, "pause": pause}
    steps = [ProjectStep("first", join_files, {"sources": ("a.txt",)}, options, ("joined.txt", "length.txt")),
             ProjectStep("other", join_files, {"sources": ("b.txt",)}, {"pause": pause}, ("joined.txt", "length.txt"))]
    last = ("results/first/joined.txt", "results/other/joined.txt")
    for number in range(count):
        steps.append(ProjectStep(f"next {number}", join_files, {"sources": last}, {"pause": pause},
                                 ("joined.txt", "length.txt")))
        last = (f"results/next {number}/joined.txt",)
    return plan_steps(steps, root)


def results(root: Path) -> dict[str, bytes]:
    """Return all files of the results."""
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in sorted((root / "results").rglob("*"))
            if path.is_file()}


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    run_steps(chain(folder, pause=float(sys.argv[2])), folder, workers=int(sys.argv[3]))
