"""The same task in toolpoint and in each open program that can do it: lines of code, seconds, errors; written as a page.

Every program gets the same virtual data with known truth, in a process of its own. Those told the true frequencies as a hint
are named. A program that is not installed is left out and named. Nothing here is imported by the package. Programs may need
interpreters of their own: --peers takes several with commas between, and each program runs in the first that has it.
Usage: python benchmarks/peers/against_peers.py [--peers PYTHON[,PYTHON ...]] [--only TASK] [--write]
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

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
    answer = {key: np.ravel(value).tolist() for key, value in found.items()} | {"seconds": min(seconds)}
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
    "rotor": ("First three bending frequencies of a shaft between two bearings, 20 elements, at rest",
              {"toolpoint": False, "ross": False}),
    "chain": ("Frequencies of five masses joined by springs", {"toolpoint": False, "exudyn": False}),
    "arm": ("Places of the flange of a six-axis arm at 1000 poses", {"toolpoint": False, "pinocchio": False}),
    "film": ("Motion of 30 windows in a film of 200 frames, 0.4 pixels at most, noise of 1 % of the range",
             {"toolpoint": False, "pyidi": False}),
    "lobes": ("Depth limits at nine speeds, two teeth, one mode along the feed, half immersion",
              {"toolpoint": False, "milling_analyzer": False}),
    "beam": ("First three bending frequencies of a steel cantilever, 20 elements", {"toolpoint": False, "scikit_fem": False}),
}
NAMES = {"toolpoint": "toolpoint", "sdypy_ema": "sdypy-EMA", "pyfbs": "pyFBS", "sdynpy": "SDynPy", "pyoma2": "pyOMA2",
         "scikit_fem": "scikit-fem", "ross": "ROSS", "exudyn": "Exudyn", "pinocchio": "Pinocchio", "pyidi": "pyidi",
         "milling_analyzer": "milling-analyzer"}
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


def rotor_data() -> dict[str, np.ndarray]:
    """Return a slender steel shaft between pinned ends, and its closed form; each frequency comes twice, in both planes."""
    modulus, density, length, diameter = 210e9, 7850.0, 1.0, 0.02
    order = np.arange(1, 4)
    frequency = (order * np.pi / length) ** 2 * np.sqrt(modulus * diameter**2 / 16 / density) / (2 * np.pi)
    return {"modulus": np.array(modulus), "density": np.array(density), "length": np.array(length),
            "diameter": np.array(diameter), "true_f": frequency, "true_z": np.zeros(3)}


def chain_data() -> dict[str, np.ndarray]:
    """Return five equal masses in a row, the first on the ground, and their closed form."""
    mass, stiffness, count = 20.0, 4e6, 5
    order = np.arange(1, count + 1)
    frequency = np.sqrt(stiffness / mass) / np.pi * np.sin((2 * order - 1) * np.pi / 2 / (2 * count + 1))
    return {"mass": np.array(mass), "stiffness": np.array(stiffness), "count": np.array(count), "true_f": frequency,
            "true_z": np.zeros(count)}


def arm_data() -> dict[str, np.ndarray]:
    """Return six axes by direction and place at rest, angles, and the flange by the product of exponentials."""
    names = np.array(list("zyyxyx"))
    places = np.array([[0, 0, 0.4], [0.1, 0, 0.4], [0.1, 0, 1.0], [0.5, 0, 1.0], [0.9, 0, 1.0], [1.0, 0, 1.0]])
    flange, angles = np.array([1.1, 0.0, 1.0]), np.random.default_rng(38).uniform(-3, 3, (1000, 6))
    truth = np.tile(flange, (1000, 1))
    for k in range(5, -1, -1):
        axis, arm = np.eye(3)["xyz".index(str(names[k]))], truth - places[k]
        c, s = np.cos(angles[:, k, None]), np.sin(angles[:, k, None])
        truth = places[k] + arm * c + np.cross(axis, arm) * s + (arm @ axis)[:, None] * axis * (1 - c)
    return {"axes": names, "places": places, "flange": flange, "angles": angles, "true_x": truth}


def film_data() -> dict[str, np.ndarray]:
    """Return a film of a smooth random texture that moves as a whole, its windows, and their motion, pixels right and down."""
    rng, side, count = np.random.default_rng(39), 21, 200
    waves, phases = rng.normal(scale=0.45, size=(60, 2)), rng.uniform(0, 2 * np.pi, 60)
    time = np.arange(count) / 500.0
    motion = 0.4 * np.stack([np.sin(2 * np.pi * 20 * time), 0.5 * np.sin(2 * np.pi * 33 * time)], axis=-1)
    rows, columns = np.mgrid[0:160, 0:200].astype(float)
    frames = np.empty((count, 160, 200), np.uint8)
    for k, (right, down) in enumerate(motion):
        angles = waves[:, 0, None, None] * (columns - right) + waves[:, 1, None, None] * (rows - down) + phases[:, None, None]
        picture = 128 + 14 * np.cos(angles).sum(axis=0) / np.sqrt(30) + rng.normal(scale=2.55, size=rows.shape)
        frames[k] = np.clip(np.round(picture), 0, 255)
    corners = np.stack(np.meshgrid(np.arange(20, 120, 22), np.arange(20, 160, 24), indexing="ij"), axis=-1).reshape(-1, 2)
    return {"frames": frames, "corners": corners, "side": np.array(side),
            "true_x": np.repeat((motion - motion[:1])[:, None], len(corners), axis=1)}


def lobes_data() -> dict[str, np.ndarray]:
    """Return a cut with one mode along the feed, and its limits by the map of one tooth passing on 400 intervals, bisected."""
    data = {"frequency": 922.0, "damping": 0.011, "mass": 0.03993, "kt": 6e8, "kn": 2e8, "immersion": 0.5, "deepest": 4e-3}
    speeds, count = np.linspace(6000, 22000, 9), 400
    steps = np.arange(count * 20)
    angle = (steps + 0.5) * np.pi / steps.size  # of one tooth over its pitch of half a turn; the other is half a turn on
    force = sum(np.where((phi > np.arccos(2 * data["immersion"] - 1)) & (phi < np.pi),
                         (data["kt"] * np.cos(phi) + data["kn"] * np.sin(phi)) * np.sin(phi), 0.0) for phi in (
                             angle, angle + np.pi)).reshape(count, 20).mean(axis=1)
    limits = []
    for speed in speeds:
        depths = np.linspace(0, data["deepest"], 41)[1:]  # an island narrower than 0.1 mm would be missed
        high = next(depth for depth in depths if _growth(depth, speed, force, data) > 1)
        low = high - depths[0]
        for _ in range(12):
            middle = (low + high) / 2
            low, high = (low, middle) if _growth(middle, speed, force, data) > 1 else (middle, high)
        limits.append((low + high) / 2)
    return {**{key: np.array(value) for key, value in data.items()}, "speeds": speeds, "true_x": np.array(limits)}


def _growth(depth: float, speed: float, force: np.ndarray, data: dict[str, float]) -> float:
    """Return the largest multiplier of the map of one tooth passing: constant force in each interval, a delay between two."""
    from scipy.linalg import expm

    count, step = force.size, 30 / speed / force.size  # s
    state = np.eye(count + 2)
    w, inertia = 2 * np.pi * data["frequency"], data["mass"]
    for h in force * depth / inertia:
        system = np.array([[0, 1, 0], [-w * w - h, -2 * data["damping"] * w, h], [0, 0, 0]])
        p = expm(system * step)
        moved = p[:2, :2] @ state[:2] + np.outer(p[:2, 2], (state[count] + state[count + 1]) / 2)
        state = np.concatenate([moved, state[:1], state[2:-1]])
    return float(np.abs(np.linalg.eigvals(state)).max())


def main() -> None:
    parser = CommandLine(__doc__)
    parser.peers("interpreter that has the other programs")
    parser.add_argument("--only", choices=QUESTIONS, help="one task alone")
    parser.add_argument("--write", action="store_true", help="write the table into the page of the manual")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        makers = {"modes": modal_data, "work": work_data, "beam": beam_data, "rotor": rotor_data, "chain": chain_data,
                  "arm": arm_data, "film": film_data, "lobes": lobes_data}
        for task, (words, programs) in QUESTIONS.items():
            if options.only not in (None, task):
                continue
            data = makers[task]()
            path = Path(folder, f"{task}.npz")
            np.savez(path, **data)
            rows += [_row(task, words, program, is_told, path, data, options.peers) for program, is_told in programs.items()]
    table = ["| task | program | lines of code | CPU s | worst error (of a frequency, or as said) | damping, worst error | "
             "remark |", "| --- | --- | --- | --- | --- | --- | --- |", *(f"| {' | '.join(row)} |" for row in rows)]
    print("\n".join(table))
    if options.write:
        text = PAGE.read_text(encoding="utf-8")
        head, tail = text.split("<!-- table -->")[0], text.split("<!-- end of table -->")[1]
        PAGE.write_text(f"{head}<!-- table -->\n\n" + "\n".join(table) + f"\n\n<!-- end of table -->{tail}", encoding="utf-8")
    measured = [row for row in rows if row[3] != "-"]
    print(f"{len(measured)} of {len(rows)} runs measured; toolpoint's worst errors "
          f"{', '.join(row[4] for row in rows if row[1] == 'toolpoint')}")


def _row(task: str, words: str, program: str, is_told: bool, path: Path, data: dict[str, np.ndarray], peers: str) -> list[str]:
    """Run one program and return its row of the table."""
    file = TASKS / f"{task}_{program}.py"
    lines = sum(bool(line.strip()) and not line.strip().startswith("#") for line in file.read_text("utf-8").splitlines())
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    answer: dict[str, Any] = {}
    for interpreter in [sys.executable] if program == "toolpoint" else peers.split(","):
        answer = _answer_of([interpreter, "-c", RUNNER, str(file), str(path), str(BEST_OF)], environment)
        if "absent" not in answer:
            break
    name = NAMES[program]
    if "absent" in answer:
        return [words, name, str(lines), "-", "-", "-", f"did not load where this ran: {answer['absent']}"]
    if "error" in answer:
        return [words, name, str(lines), "-", "-", "-", answer["error"].replace("|", "/")]
    if "x" in answer:
        return [words, name, str(lines), f"{answer['seconds']:.2g}", *_error_of_places(task, answer["x"], data["true_x"]), ""]
    f, z, true_f, true_z = np.array(answer["f"]), np.array(answer["z"]), data["true_f"], data["true_z"]
    if f.size == 0:
        return [words, name, str(lines), f"{answer['seconds']:.2g}", "-", "-", "no mode"]
    places = [int(np.argmin(np.abs(f - target))) for target in true_f]
    error_f = 100 * np.abs(f[places] / true_f - 1).max()
    error_z = f"{100 * np.abs(z[places] / true_z - 1).max():.2g} %" if true_z.any() else "-"
    remark = "told the true frequencies" if is_told else ""
    if not is_told and f.size != true_f.size and task in ("modes", "work"):
        remark = f"{f.size} modes of {true_f.size}"
    return [words, name, str(lines), f"{answer['seconds']:.2g}", f"{error_f:.2g} %", error_z, remark]


def _answer_of(command: list[str], environment: dict[str, str]) -> dict[str, Any]:
    """Return what a program answered in a process of its own, or what became of it."""
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=RUN_LIMIT_SECONDS, env=environment, check=False)
    except subprocess.TimeoutExpired:
        return {"error": f"took more than {RUN_LIMIT_SECONDS} s"}
    answer: dict[str, Any] = json.loads(run.stdout.splitlines()[-1]) if run.returncode == 0 else {
        "error": f"ended with {run.returncode}"}
    return answer


def _error_of_places(task: str, found: list[float], truth: np.ndarray) -> tuple[str, str]:
    """Return the error of places (the largest, m) or of motions in a film (root mean square, pixels)."""
    error = np.array(found) - np.ravel(truth)
    if task == "lobes":
        return f"{100 * np.abs(error / np.ravel(truth)).max():.2g} % of a limit", "-"
    words = f"{np.sqrt(np.mean(error**2)):.2g} pixels rms" if task == "film" else f"{np.abs(error).max():.1g} m"
    return words, "-"


if __name__ == "__main__":
    main()
