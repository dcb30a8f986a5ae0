"""The same task in toolpoint and in each open program that can do it: lines of code, seconds, errors; written as a page.

Every program gets the same virtual data with known truth, in a process of its own. Those told the true frequencies as a hint
are named. A program that is not installed is left out and named. Nothing here is imported by the package.
Usage: python benchmarks/peers/against_peers.py [--peers PYTHON] [--write]
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine

HERE = Path(__file__).resolve().parent
TASKS, PAGE = HERE / "tasks", HERE.parents[1] / "docs" / "how_to" / "against_peers.md"
BEST_OF = 3  # runs, of which the quickest counts
RUN_LIMIT_SECONDS = 300  # s for a program
RUNNER = """
import contextlib, importlib.util, io, json, logging, sys, time, warnings
warnings.simplefilter("ignore"); logging.disable(logging.CRITICAL)
import numpy as np
data = dict(np.load(sys.argv[2]))
try:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        spec = importlib.util.spec_from_file_location("task", sys.argv[1])
        task = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(task)
        seconds = []
        for _ in range(int(sys.argv[3])):
            start = time.process_time()
            found = task.solve(data)
            seconds.append(time.process_time() - start)
    answer = {"f": np.ravel(found["f"]).tolist(), "z": np.ravel(found["z"]).tolist(), "seconds": min(seconds)}
except ImportError as error:
    answer = {"absent": str(error)[:100]}
except Exception as error:
    answer = {"error": f"{type(error).__name__}: {error}"[:120]}
print(json.dumps(answer))
"""
# Task: what it is, and the programs that can do it, each with its file and whether it was told the true frequencies.
QUESTIONS = {
    "modes": ("Modes of 30 measured responses, six modes, two of them 3 % apart, 1 % noise",
              {"toolpoint": False, "sdypy_ema": True, "pyfbs": True, "sdynpy": True}),
    "work": ("Modes of a machine at work: five minutes of eight accelerations, no force measured, 5 % noise",
             {"toolpoint": False, "pyoma2": True}),
    "beam": ("First three bending frequencies of a steel cantilever, 20 elements", {"toolpoint": False, "scikit_fem": False}),
}
NAMES = {"toolpoint": "toolpoint", "sdypy_ema": "sdypy-EMA", "pyfbs": "pyFBS", "sdynpy": "SDynPy", "pyoma2": "pyOMA2",
         "scikit_fem": "scikit-fem"}
BETA = np.array([1.8751040687119611, 4.694091132974174, 7.854757438237613])  # cos b cosh b = -1


def modal_data() -> dict[str, np.ndarray]:
    """Return accelerances of a plate-like structure with six modes, 1 % noise, and the truth."""
    rng = np.random.default_rng(36)
    frequency, damping = np.array([45.0, 97.0, 100.0, 181.0, 290.0, 402.0]), np.array([2.0, 1.5, 1.2, 1.0, 2.5, 1.8]) / 100
    lines, shape = np.arange(2000) * 0.25, rng.normal(size=(30, 6))
    s, pole = 2j * np.pi * lines, 2 * np.pi * frequency * (-damping + 1j * np.sqrt(1 - damping**2))
    residue = shape * shape[:1] / (2j * pole.imag)
    # A pole and its conjugate, each over all lines (2000, 30).
    both = [(residue[:, k], pole[k]) for k in range(6)] + [(residue[:, k].conj(), pole[k].conj()) for k in range(6)]
    values = s[:, None] ** 2 * sum(r / (s[:, None] - p) for r, p in both)
    noise = rng.normal(size=(2, *values.shape)) * 0.01 * np.abs(values) / np.sqrt(2)
    return {"lines": lines, "values": (values + noise[0] + 1j * noise[1])[:, :, None], "hint": frequency,
            "true_f": frequency, "true_z": damping}


def work_data() -> dict[str, np.ndarray]:
    """Return accelerations of four modes under white loads, 5 % noise, and the truth."""
    rng = np.random.default_rng(37)
    frequency, damping, rate, count = np.array([21.0, 33.0, 47.0, 62.0]), np.array([2.0, 1.5, 2.5, 1.8]) / 100, 256.0, 256 * 300
    shape, samples = rng.normal(size=(8, 4)), np.zeros((count, 8))
    lines = np.fft.rfftfreq(count, 1 / rate)
    for k in range(4):
        load = np.fft.rfft(rng.normal(size=count))
        response = -(lines**2) / (frequency[k]**2 - lines**2 + 2j * damping[k] * frequency[k] * lines)
        samples += np.fft.irfft(load * response, count)[:, None] * shape[:, k]
    samples += 0.05 * samples.std(axis=0) * rng.normal(size=samples.shape)
    return {"samples": samples, "rate": np.array(rate), "hint": frequency, "true_f": frequency, "true_z": damping}


def beam_data() -> dict[str, np.ndarray]:
    """Return a steel cantilever of 1 m, 50 x 50 mm, and its closed form."""
    modulus, density, length, side = 210e9, 7850.0, 1.0, 0.05
    frequency = BETA**2 / (2 * np.pi * length**2) * np.sqrt(modulus * side**2 / 12 / density)
    return {"modulus": np.array(modulus), "density": np.array(density), "length": np.array(length), "side": np.array(side),
            "bending_stiffness": np.array(modulus * side**4 / 12), "line_mass": np.array(density * side**2),
            "hint": frequency, "true_f": frequency, "true_z": np.zeros(3)}


def main() -> None:
    parser = CommandLine(__doc__)
    parser.peers("interpreter that has the other programs")
    parser.add_argument("--write", action="store_true", help="write the table into the page of the manual")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for task, (words, programs) in QUESTIONS.items():
            data = {"modes": modal_data, "work": work_data, "beam": beam_data}[task]()
            path = Path(folder, f"{task}.npz")
            np.savez(path, **data)
            rows += [_row(task, words, program, is_told, path, data, options.peers) for program, is_told in programs.items()]
    table = ["| task | program | lines of code | CPU s | frequency, worst error | damping, worst error | remark |",
             "| --- | --- | --- | --- | --- | --- | --- |", *(f"| {' | '.join(row)} |" for row in rows)]
    print("\n".join(table))
    if options.write:
        text = PAGE.read_text(encoding="utf-8")
        head, tail = text.split("<!-- table -->")[0], text.split("<!-- end of table -->")[1]
        PAGE.write_text(f"{head}<!-- table -->\n\n" + "\n".join(table) + f"\n\n<!-- end of table -->{tail}", encoding="utf-8")
    measured = [row for row in rows if row[3] != "-"]
    print(f"{len(measured)} of {len(rows)} runs measured; toolpoint's worst error of a frequency "
          f"{', '.join(row[4] for row in rows if row[1] == 'toolpoint')}")


def _row(task: str, words: str, program: str, is_told: bool, path: Path, data: dict[str, np.ndarray], peers: str) -> list[str]:
    """Run one program and return its row of the table."""
    file = TASKS / f"{task}_{program}.py"
    lines = sum(bool(line.strip()) and not line.strip().startswith("#") for line in file.read_text("utf-8").splitlines())
    interpreter = sys.executable if program == "toolpoint" else peers
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        run = subprocess.run([interpreter, "-c", RUNNER, str(file), str(path), str(BEST_OF)], capture_output=True, text=True,
                             timeout=RUN_LIMIT_SECONDS, env=environment, check=False)
        answer = json.loads(run.stdout.splitlines()[-1]) if run.returncode == 0 else {"error": f"ended with {run.returncode}"}
    except subprocess.TimeoutExpired:
        answer = {"error": f"took more than {RUN_LIMIT_SECONDS} s"}
    name = NAMES[program]
    if "absent" in answer:
        return [words, name, str(lines), "-", "-", "-", "not installed where this ran"]
    if "error" in answer:
        return [words, name, str(lines), "-", "-", "-", answer["error"].replace("|", "/")]
    f, z, true_f, true_z = np.array(answer["f"]), np.array(answer["z"]), data["true_f"], data["true_z"]
    if f.size == 0:
        return [words, name, str(lines), f"{answer['seconds']:.2g}", "-", "-", "no mode"]
    places = [int(np.argmin(np.abs(f - target))) for target in true_f]
    error_f = 100 * np.abs(f[places] / true_f - 1).max()
    error_z = f"{100 * np.abs(z[places] / true_z - 1).max():.2g} %" if true_z.any() else "-"
    remark = "told the true frequencies" if is_told else ""
    if not is_told and f.size != true_f.size:
        remark = f"{f.size} modes of {true_f.size}"
    return [words, name, str(lines), f"{answer['seconds']:.2g}", f"{error_f:.2g} %", error_z, remark]


if __name__ == "__main__":
    main()
