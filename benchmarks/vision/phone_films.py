"""Random films of ringing, slightly bending bodies: clean, noise, mp4 of a phone, shake, small motion, dropped frames, short.

The camera is `ink_camera.py`, which shares no code with the package. Counted: modes that are believed and are none, modes
that are not found, and whether the 95 % intervals of frequency, damping and shape hold the truth.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.vision import ink_camera as camera
from benchmarks.vision.ringing_films import Scene, _boxes, compared
from toolpoint import ToolpointError
from toolpoint.studies.video.video_study import VideoStudy, study_video
from toolpoint.vision.reading import files

KINDS = ("clean", "noise", "mp4", "shake", "small", "dropped", "short")
SHAPE = (144, 224)
DROP_AFTER = 60  # frames after the blow


def random_scene(rng: np.random.Generator, kind: str) -> Scene:
    """Return a random scene of one of `KINDS`: two or three modes, a close pair in every other short one."""
    rate = float(rng.choice([240.0, 480.0]))
    boxes = _boxes(rng, int(rng.integers(1, 4)))
    frames = 240 if kind == "short" else int(rng.integers(420, 640))
    start = 0.02 if kind == "short" else float(rng.uniform(0.02, 0.1))
    low = max(0.03, 8.0 / frames)
    f: list[float] = []
    while len(f) < int(rng.integers(2, 4)):
        g = float(np.exp(rng.uniform(np.log(low), np.log(0.33))))
        if all(abs(np.log(g / other)) > 0.25 and min(abs(g / other - n) for n in (2, 3)) > 0.1
               and min(abs(other / g - n) for n in (2, 3)) > 0.1 for other in f):
            f.append(g)
    if kind == "short" and rng.random() < 0.5:
        f.append(f[0] * float(rng.uniform(1.05, 1.12)))
    frequency = rate * np.sort(f)
    zeta = np.exp(rng.uniform(np.log(0.004), np.log(0.03), frequency.size))
    poles = 2 * np.pi * frequency * (-zeta + 1j * np.sqrt(1 - zeta**2))
    size = np.exp(rng.uniform(np.log(0.2), np.log(0.6), frequency.size)) if kind != "small" else (
        0.05 * np.exp(rng.uniform(np.log(0.5), 0.0, frequency.size)))
    bodies = []
    for k, box in enumerate(boxes):
        ink = camera.speckle(rng, box, grey=float(rng.uniform(90, 140)), contrast=float(rng.uniform(10, 30)),
                             grain=float(rng.uniform(1.5, 4)))
        motion = np.zeros((frequency.size, 2, 6))
        for r in range(frequency.size):
            turn, bend = rng.normal(0, 0.4), float(np.exp(rng.uniform(np.log(0.003), np.log(0.1))))
            motion[r, :, 0] = rng.normal(0, 0.7, 2)
            motion[r, 0, 2], motion[r, 1, 1] = -turn, turn
            motion[r, :, 1:] += bend * rng.normal(0, 0.5, (2, 5))
            motion[r] *= size[r] / np.sqrt(2)
        bodies.append(camera.Body(f"b{k}", box, ink, motion))
    whole = (0, 0, SHAPE[1], SHAPE[0])
    wall = camera.Body("wall", whole, camera.speckle(rng, whole, grey=200.0, contrast=15.0 if kind == "shake" else 0.0),
                       np.zeros((frequency.size, 2, 6)))
    noise = {"photons": 1e9, "read": 0.01} if kind == "clean" else {
        "photons": float(rng.uniform(20, 120)), "read": float(rng.uniform(0.6, 2.0))}
    light = camera.Light(rate, SHAPE, blur=float(rng.uniform(0.6, 1.2)), **noise)
    if kind == "shake":
        (a, b), (p, q) = rng.uniform(1.0, 4.0, 2), rng.uniform(0, 6, 2)
        light.shake = lambda t: 0.3 * np.column_stack([np.sin(2 * np.pi * a * t + p), np.sin(2 * np.pi * b * t + q)])
    return Scene(bodies, wall, light, poles, start, frames, kind=kind)


def scene_of(seed: int, kind: str, store: Path | None) -> tuple[Scene, np.ndarray]:
    """Return a random scene and its frames, filmed once where they are stored."""
    rng = np.random.default_rng([seed, KINDS.index(kind), 29])
    scene = random_scene(rng, kind)
    place = None if store is None else store / f"random-{kind}{seed}.npy"
    if place is not None and place.exists():
        return scene, np.load(place)
    frames = scene.filmed(rng)
    if place is not None:
        np.save(place, frames)
    return scene, frames


def studied(scene: Scene, frames: np.ndarray, **how: Any) -> VideoStudy:
    """Return the study of a film that was written and read again."""
    from benchmarks.vision.clips import encode

    if scene.kind == "dropped":
        frames = np.delete(frames, dropped(scene), 0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / ("clip.mp4" if scene.kind == "mp4" else "clip.npy")
        if scene.kind == "mp4":
            encode(frames, path, 18)
        else:
            np.save(path, frames)
        return study_video(files.read(path, scene.light.rate), side=12, **({"bodies": scene.regions} | how))


def dropped(scene: Scene) -> int:
    """Return the frame that a scene of that kind lacks."""
    return int(scene.start * scene.light.rate) + DROP_AFTER


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 6, "of each kind")
    parser.seed(0)
    parser.part("kinds", default=",".join(KINDS))
    parser.add_argument("--store", type=Path, help="folder in which films are kept: filming takes most of the time")
    parser.add_argument("--only-film", action="store_true")
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    total: dict[str, dict[str, list[Any]]] = {}
    for seed in range(options.seed, options.seed + options.runs):
        for kind in options.kinds.split(","):
            scene, frames = scene_of(seed, kind, options.store)
            if options.only_film:
                continue
            begin = time.process_time()
            try:
                result = studied(scene, frames)
                row = compared(result, scene) | {"doubts": [list(map(str, result.doubts))]}
            except ToolpointError as error:
                row = {"refused": [f"{seed}: {str(error)[:160]}"]}
            row["seconds"] = [time.process_time() - begin]
            for name, values in row.items():
                total.setdefault(kind, {}).setdefault(name, []).extend(values)
            if options.verbose:
                f = np.abs(scene.poles) / 2 / np.pi
                print(kind, seed, np.round(f, 2).tolist(), {k: (f"{sum(v)}/{len(v)}" if v and isinstance(v[0], bool) else v)
                                                             for k, v in row.items()}, flush=True)
    print_totals(total)


def print_totals(total: dict[str, dict[str, list[Any]]]) -> None:
    """Print a line for every kind and one for all."""
    every: dict[str, list[bool]] = {"frequency": [], "damping": [], "shape": []}
    for kind, row in total.items():
        shares = []
        for name, values in every.items():
            held = row.get(name, [])
            values += held
            shares.append(f"{name} {100 * np.mean(held):.1f} % of {len(held)}" if held else f"{name} none")
        print(f"{kind}: {', '.join(shares)}; false {row.get('false', [])}, not named {row.get('lost', [])}, refused "
              f"{row.get('refused', [])}, {np.mean(row['seconds']):.1f} CPU s a clip")
    print("all: " + json.dumps({name: [round(100 * float(np.mean(values)), 1), len(values)] for name, values in every.items()
                                if values}))


if __name__ == "__main__":
    main()
