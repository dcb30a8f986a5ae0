"""Commands on random machines, each output in every format that is offered: no foreign error, files read back equal.

The machines: benchmarks/joint_identification/joint_machines.py (three to six boxes in a chain or a tree), some of their points
with names that formats have no room for. Every machine: `frf --save` (five formats, relative and named points), `rcsa --save`
(five), `plan --test --geometry`, `joints --machine` from saved modes, `next-test` on what it wrote, `update --machine` by modes
and by responses.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/app/doors.py [--first 0] [--machines 50] [--seconds 600]
        [--without plan]

A foreign error is anything but an exit code of the command (2 for a refusal in words). The run ends before a machine that
would begin after `--seconds`; the last line is the figure of those that ran.
"""

from __future__ import annotations

import contextlib
import io as streams
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification import joint_machines as jm
from toolpoint import Frf, Modes, ToolpointError, io
from toolpoint.app.main import main as command
from toolpoint.io import uff
from toolpoint.io.binary import hdf5
from toolpoint.io.yaml.testing import test_file
from toolpoint.machine import Machine, assemble, build
from toolpoint.machine.description import PointDescription, parameters
from toolpoint.studies import study_responses_of_machine
from toolpoint.studies.machines.virtual_test import surface_points, true_modes
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import eigen

FORMATS = (".uff", ".h5", ".mat", ".npz", ".csv")
ODD_NAMES = ("Spindle Nose", "Größe 3", "tip/2, (left)", "9:b", "100 %")
DAMPING = 0.03
TOOL = """toolpoint: 1
name: end mill
segments:
  shank: {length: 60 mm, diameter: 16 mm, material: carbide}
  flutes: {length: 40 mm, diameter: 16 mm, material: carbide, fluted: true}
"""


class Ledger:
    """What every case gave: ok, refused in words, other on reading back, or foreign."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.bad: list[str] = []

    def run(self, title: str, arguments: list[str], check: Callable[[], str] | None = None) -> bool:
        """Run a command, then a check of what it wrote that returns what differs; print the case as it ends."""
        start, verdict = time.process_time(), "ok"
        with contextlib.redirect_stdout(streams.StringIO()), contextlib.redirect_stderr(streams.StringIO()) as told, \
                warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                command(arguments)
            except SystemExit as ended:
                verdict = "ok" if not ended.code else "refused: " + " ".join(told.getvalue().split())[:160]
                verdict = verdict if ended.code in (0, 2, None) else f"foreign: exit code {ended.code}"
            except BaseException as error:
                verdict = f"foreign: {type(error).__name__}: {error} at {traceback.extract_tb(error.__traceback__)[-1][:2]}"
            if verdict == "ok" and check is not None:
                try:
                    if differs := check():
                        verdict = f"other: {differs}"
                except Exception as error:
                    verdict = f"other: reading back: {type(error).__name__}: {error}"
        kind = verdict.split(":")[0]
        self.counts[kind] += 1
        if kind in ("foreign", "other"):
            self.bad.append(f"{title}: {verdict}")
        print(f"  {title}: {verdict[:200]} ({time.process_time() - start:.1f} s)", flush=True)
        return kind == "ok"


def compare_responses(expected: Frf, path: Path) -> str:
    """Return what differs between responses and those of a file, nothing where they are equal to the last digits."""
    back = io.read_frf([path])
    for name in ("outputs", "inputs", "quantity"):
        if getattr(back, name) != getattr(expected, name):
            return f"{name} {getattr(back, name)}"
    if not np.array_equal(back.frequency, expected.frequency):
        return "lines"
    error = float(np.abs(back.values - expected.values).max() / np.abs(expected.values).max())
    return "" if error < 1e-12 else f"values by {error:.1g}"


def compare_machines(path: Path, folder: Path) -> str:
    """Return what differs where a written machine is read, written and read again."""
    first = io.read_machine(path)
    again = folder / f"again_{path.name}"
    io.write_machine(first.description, again)
    second = io.read_machine(again)
    return "" if second.description == first.description else "the machine written again"


def respond(ledger: Ledger, machine: Machine, file: Path, folder: Path) -> None:
    """`frf --save` of relative, named and numbered points in every format."""
    odd = [name for name in machine.description.points if name in ODD_NAMES]
    labels = ["tool-table:+x", *(f"{name}:-y" for name in odd), f"{odd[0]}-tool:+z", "1:+z"]
    lines = np.linspace(5.0, 200.0, 40)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = study_responses_of_machine(machine, None, labels, frequency=lines).frfs[0]
    for kind in FORMATS:
        out = folder / f"frf{kind}"
        ledger.run(f"frf --save {kind}", [
            "frf", str(file), *(word for label in labels for word in ("--at", label)), "--lines", "5:200:40", "--save",
            str(out), "-o", str(folder / "page")], lambda out=out: compare_responses(expected, out))


def couple(ledger: Ledger, file: Path, folder: Path) -> None:
    """`rcsa --save` in every format: all read back as the HDF5 file."""
    (folder / "tool.yaml").write_text(TOOL)
    for kind in (".h5", *(each for each in FORMATS if each != ".h5")):
        out = folder / f"tip{kind}"
        ledger.run(f"rcsa --save {kind}", [
            "rcsa", str(folder / "tool.yaml"), "--machine", str(file), "--at", "tool", "--lines", "20:3000:100", "--draws",
            "20", "--save", str(out), "-o", str(folder / "page")],
            lambda out=out: compare_responses(hdf5.read(folder / "tip.h5", Frf), out))


def plan(ledger: Ledger, machine: Machine, file: Path, folder: Path) -> None:
    """`plan` with both its files, from points spread over the bodies."""
    def check() -> str:
        points = io.read_geometry(folder / "points.csv").points
        test = test_file.read(folder / "test.yaml")
        return "" if len(points) == 8 and test.records and all(np.isfinite(at).all() for at in points.values()) else "the plan"

    highest = 1.05 * float(true_modes(machine, surface_points(machine, 40, np.random.default_rng(1)), DAMPING).frequency[3])
    ledger.run("plan --test --geometry", [
        "plan", str(file), "--points", "8", "--struck", "1", "--hits", "1", "--highest", f"{highest:.6g}", "--test",
        str(folder / "test.yaml"), "--geometry", str(folder / "points.csv"), "-o", str(folder / "page")], check)


def identify(ledger: Ledger, case: jm.Case, folder: Path, kind: str) -> None:
    """`joints --machine` from saved modes, and `next-test` on the machine that it wrote."""
    modes = true_modes(case.machine, case.points, DAMPING)
    for path in (folder / "modes.h5", folder / "modes.uff"):
        (hdf5.write(modes, path) if path.suffix == ".h5" else uff.write(path, modes))
    arguments = jm.write_test(case, jm.responses(case, np.random.default_rng(1)), folder)
    arguments[1] = str(folder / f"modes{kind}")
    found = folder / "found.yaml"
    if ledger.run(f"joints --machine ({kind})", [*arguments, "--machine", str(found), "-o", str(folder / "page")],
                  lambda: compare_machines(found, folder)):
        ledger.run("next-test", ["next-test", str(found), "--json"])


def update(ledger: Ledger, machine: Machine, folder: Path, rng: np.random.Generator) -> None:
    """`update --machine` of a machine with wrong stiffnesses, by modes and by responses, in the formats that they come in."""
    every = [p for p in parameters(machine.description) if ".stiffness." in p]
    names = rng.choice(every, 2, replace=False).tolist()
    wrong = machine.with_values({n: machine.value(n) * float(np.exp(0.05 * rng.normal())) for n in names})
    io.write_machine(wrong.description, folder / "wrong.yaml")
    points = list(machine.description.points)
    labels = [f"{name}:{way}" for name in points[:4] for way in ("+x", "+y", "+z")]
    lines = np.linspace(5.0, 120.0, 100)
    frf = jm.full_response(machine, lines, labels, labels[:1]).converted_to("accelerance")
    system = assemble(machine, outputs=labels)
    modes: Modes = eigen.solve_undamped(replace(system, damping=None))
    sources = {f"--frf {kind}": ("--frf", folder / f"meas{kind}") for kind in FORMATS[int(rng.integers(5)):][:1]}
    for _, path in sources.values():
        io.write_frf(frf, path)
    hdf5.write(modes.selected(range(min(6, modes.count))), folder / "meas_modes.h5")
    sources["--modes .h5"] = ("--modes", folder / "meas_modes.h5")
    for title, (option, path) in sources.items():
        out = folder / f"updated{option}.yaml"
        ledger.run(f"update {title} --machine", ["update", str(folder / "wrong.yaml"), option, str(path), "--machine", str(out),
                                                 *(word for n in names for word in ("--parameter", n)),
                                                 "-o", str(folder / "page")], lambda out=out: compare_machines(out, folder))


def run_machine(seed: int, ledger: Ledger, without: list[str]) -> None:
    """Run all commands on the machine of a seed."""
    rng = np.random.default_rng(seed)
    case = jm.random_case(seed, jm.law_of(seed))
    machine = with_measured_points(case.machine, case.points.coordinates, case.points.components)
    bodies = list(machine.description.bodies)
    odd = {name: PointDescription(str(rng.choice(bodies)), tuple(map(float, rng.uniform(-0.3, 0.3, 3))))
           for name in rng.choice(ODD_NAMES, 2, replace=False).tolist()}
    machine = build(replace(machine.description, points={**machine.description.points, **odd}))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "machine.yaml"
        io.write_machine(machine.description, file)
        if differs := compare_machines(file, folder):
            ledger.bad.append(differs)
        if "frf" not in without:
            respond(ledger, machine, file, folder)
        if "rcsa" not in without:
            couple(ledger, file, folder)
        if "plan" not in without:
            plan(ledger, machine, file, folder)
        if "joints" not in without:
            identify(ledger, case, folder, (".h5", ".uff")[seed % 2])
        if "update" not in without:
            update(ledger, machine, folder, rng)


def main() -> None:
    """Run the machines and print the figure."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("machines", 50)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--without", nargs="*", default=[], choices=["frf", "rcsa", "plan", "joints", "update"])
    options = parser.parse_args()
    ledger, ran, start = Ledger(), 0, time.perf_counter()
    for seed in range(options.first, options.first + options.machines):
        if time.perf_counter() - start > options.seconds:
            break
        print(f"machine {seed}", flush=True)
        try:
            run_machine(seed, ledger, options.without)
        except ToolpointError as error:
            ledger.bad.append(f"machine {seed}: {error}")
        ran += 1
        print(f"  so far {ran} machines: {dict(ledger.counts)}", flush=True)
    for line in ledger.bad:
        print("BAD", line)
    total = sum(ledger.counts.values())
    print(f"{ran} machines, {total} commands: {ledger.counts['foreign']} foreign errors, {ledger.counts['other']} files read "
          f"back otherwise, {ledger.counts['refused']} refused in words")


if __name__ == "__main__":
    main()
