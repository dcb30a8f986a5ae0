"""Random machines from raw hammer records in files to answers by a project, nobody choosing.

The tests: benchmarks/project/raw_tests.py, WAV, universal and text files in turn, a slip in every second one: those of
random_projects.py and those that only raw records have. Every machine: files, a project folder, `Project.run`, then
`Project.limits` at six random poses beside the true machine's least limit over twelve speeds.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/project/raw_projects.py [--first 0] [--seeds 20] [--draws 24]
        [--slip NAME] [--results FILE] (resumes from it) [--keep FOLDER]

Words of the figures as in random_projects.py. Named: one doubt or message holds what tells the slip (a point, a file, a joint).
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, read_rows
from benchmarks.joint_identification import joint_machines as jm
from benchmarks.project.random_projects import asked, is_named, summary
from benchmarks.project.raw_tests import GENERAL_SLIPS, HEAVIEST_SENSOR, RAW_SLIPS, SLIPS, random_test, write_raw
from toolpoint._check import ToolpointError
from toolpoint.project import Project

COEFFICIENT_DEVIATION = 0.02
PROJECT = """toolpoint: 1
name: random
tests:
  first: {test: records/test.yaml{sensor}}
geometry: points.csv
components: components.yaml
cuts:
  half: {diameter: 50 mm, teeth: 4, immersion: 0.5, tangential: 800 MPa, normal: 300 MPa, speeds: 800 4000 rpm,
         coefficient_deviation: 2 %}
goals:
  rough: {speed: 2500 rpm, depth: 4 mm}
"""


def slip_of(seed: int) -> str:
    """Return the slip of every second machine: raw ones and general ones in turn."""
    if seed % 2 == 0:
        return ""
    number = seed // 2
    return RAW_SLIPS[number // 2 % len(RAW_SLIPS)] if number % 2 == 0 else GENERAL_SLIPS[number // 2 % len(GENERAL_SLIPS)]


def run_case(seed: int, slip: str, given) -> dict:
    """Return what one machine gave."""
    law = jm.LAWS[(seed // 2) % 4]
    test, keep = random_test(seed, law, slip, given.heaviest), given.keep
    # A universal file has no description of its channels here: the project tells the mass.
    told = f", sensor_mass: {1e3 * test.sensor_mass:.3g} g" if test.kind == "uff" and test.is_mass_told else ""
    row = {"seed": seed, "law": law, "slip": slip, "kind": test.kind, "bodies": len(test.masses), "named": None}
    with tempfile.TemporaryDirectory() as name:
        write_raw(test, Path(name))
        (Path(name) / "project.yaml").write_text(PROJECT.replace("{sensor}", told))
        start = time.process_time()
        try:
            results = Project.open(name).run()
            row |= {"doubts": [f"{entry['step']}: {entry['what']}: {entry['why']}" for entry in results.data["doubts"]],
                    "failed": [step["words"] for step in results.data["steps"] if step["state"] in ("failed", "stopped")],
                    "answers": list(results.answers), "foreign": ""}
        except ToolpointError as error:
            row |= {"doubts": [], "failed": [str(error)], "answers": [], "foreign": ""}
        except Exception as error:  # what a user must never meet is what is looked for
            row |= {"doubts": [], "failed": [], "answers": [], "foreign": f"{type(error).__name__}: {error}"}
        row["run s"] = time.process_time() - start
        row["named"] = is_named(test.words, row["doubts"] + row["failed"]) if slip else None
        row["answered"] = not row["failed"] and not row["foreign"]
        if row["answered"]:
            rng = np.random.default_rng(90_000 + seed)
            row |= asked(test.case, Project.open(name), rng, draws=given.draws, changes=results.data["changes"],
                         coefficients=COEFFICIENT_DEVIATION)
        row["cpu s"] = time.process_time() - start
        if keep is not None:
            shutil.copytree(name, keep / f"{seed}{slip.replace(' ', '_')}", dirs_exist_ok=True)
    return row


def line_of(row: dict) -> str:
    """Return a row in a line."""
    error = f"error {100 * max(row['error'], key=abs):+.1f} % inside {sum(row['inside'])} unsafe {sum(row['unsafe'])} width " \
            f"{100 * float(np.median(row['width'])):.0f} %" if row["answered"] else "no answer"
    return (f"{row['seed']} {row['law']} {row['kind']} {row['bodies']} bodies, {row['slip'] or 'no slip'}: {error}, named "
            f"{row['named']}, {row['run s']:.0f}/{row['cpu s']:.0f} s {row['foreign']} "
            f"{[text[:300] for text in row['failed'][:1]]} "
            f"{[text[:170] for text in row['doubts'][:4]]}")


def main() -> None:
    """Run, print each machine and the figures."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 20)
    parser.add_argument("--draws", type=int, default=24)
    parser.add_argument("--slip", choices=["none", *SLIPS], help="the same slip in all")
    parser.add_argument("--heaviest", type=float, default=HEAVIEST_SENSOR, help="sensor, kg; the mass is 0.1 to 1 of it")
    parser.add_argument("--results", type=Path)
    parser.add_argument("--keep", type=Path, help="folder in which the projects stay")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = read_rows(given.results)
    done = {(row["seed"], row["slip"]) for row in rows}
    for seed in range(given.first, given.first + given.seeds):
        slip = {"none": "", None: slip_of(seed)}.get(given.slip, given.slip)
        if (seed, slip) in done:
            continue
        row = run_case(seed, slip, given)
        rows.append(row)
        print(line_of(row), flush=True)
        if given.results is not None:
            with given.results.open("a") as file:
                file.write(json.dumps(row) + "\n")
    foreign = [row for row in rows if row["foreign"]]
    lines = summary(rows)
    print("\n".join([*lines[:-1], f"foreign errors: {len(foreign)} of {len(rows)}", lines[-1]]))


if __name__ == "__main__":
    sys.exit(main())
