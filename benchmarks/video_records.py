"""Random films of ringing bodies by a camera of its own (`video_camera.py`): do the stated 95 % intervals hold the truth?

Frames are written and read again as a user has them. Part `true`: textures, noise, lamps, shutters, shake, close modes, one to three
bodies at random.
Part `wrong`: one thing is told wrong or is wrong with the film; is it found out?
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import video_camera as camera

from toolpoint import ToolpointError
from toolpoint.studies.video.video_study import VideoStudy, study_video
from toolpoint.vibration import Modes
from toolpoint.vision.clip import Region
from toolpoint.vision.reading import files

SHAPE = (144, 224)


@dataclass
class Scene:
    """Bodies, wall, light, and the modes that they move in."""

    bodies: list[camera.Body]
    wall: camera.Body
    light: camera.Light
    poles: np.ndarray
    start: float
    frames: int
    still: list[Region] = field(default_factory=list)
    kind: str = ""

    def filmed(self, rng: np.random.Generator) -> np.ndarray:
        """Return the frames."""
        return camera.film(self.bodies, self.wall, camera.ringing(self.poles, np.ones(self.poles.size), self.start), self.light,
                           self.frames, rng)

    @property
    def regions(self) -> dict[str, Region]:
        """Where the bodies are told to be."""
        return {body.name: Region(*body.box) for body in self.bodies}


def _boxes(rng: np.random.Generator, count: int) -> list[tuple[int, int, int, int]]:
    rows, columns = SHAPE
    edges = np.linspace(24, columns - 24, count + 1)
    return [(int(low) + 3, int(rng.integers(18, 40)), int(high - low) - 8, int(rng.integers(70, 90)))
            for low, high in zip(edges[:-1], edges[1:], strict=True)]


def _frequencies(rng: np.random.Generator, rate: float, close: bool) -> np.ndarray:
    count = int(rng.integers(1, 4))
    found: list[float] = []
    while len(found) < count:
        f = float(np.exp(rng.uniform(np.log(0.03), np.log(0.33)))) * rate
        if all(abs(np.log(f / other)) > 0.25 and abs(f / other - 2) > 0.1 and abs(f / other - 3) > 0.1
               and abs(other / f - 2) > 0.1 and abs(other / f - 3) > 0.1 for other in found):
            found.append(f)
    if close:
        found.append(found[0] * rng.uniform(1.03, 1.08))
    return np.sort(found)


KINDS = ("plain", "faint", "flicker", "shutter", "shake", "close", "repeated", "depth", "blur", "compressed")


def random_scene(rng: np.random.Generator, kind: str) -> Scene:
    """Return a random scene of one of `KINDS`."""
    rate = float(rng.choice([240.0, 480.0, 960.0]))
    boxes = _boxes(rng, int(rng.integers(1, 4)))
    if kind == "shake":  # room for the wall above and below
        boxes = [(left, 40, width, 64) for left, _, width, _ in boxes]
    f = _frequencies(rng, rate, kind == "close")
    zeta = np.exp(rng.uniform(np.log(0.004), np.log(0.04), f.size))
    poles = 2 * np.pi * f * (-zeta + 1j * np.sqrt(1 - zeta**2))
    bodies = []
    size = np.exp(rng.uniform(np.log(0.1), np.log(0.6), f.size)) * (0.15 if kind == "faint" else 1.0)
    for k, box in enumerate(boxes):
        grey, contrast = float(rng.uniform(90, 140)), float(rng.uniform(8, 30)) * (0.5 if kind == "faint" else 1.0)
        ink = camera.stripes(rng, box, grey=grey, contrast=contrast, period=rng.uniform(6, 12)) if kind == "repeated" else (
            camera.speckle(rng, box, grey=grey, contrast=contrast, grain=rng.uniform(1.5, 4)))
        motion = np.zeros((f.size, 2, 6))
        for r in range(f.size):
            turn = rng.normal(0, 0.4)
            motion[r, :, 0] = rng.normal(0, 0.7, 2)
            motion[r, 0, 2], motion[r, 1, 1] = -turn, turn
            motion[r] *= size[r] / np.sqrt(2)
        bodies.append(camera.Body(f"b{k}", box, ink, motion))
    whole = (0, 0, SHAPE[1], SHAPE[0])
    wall = camera.Body("wall", whole, camera.speckle(rng, whole, grey=200.0, contrast=15.0 if kind == "shake" else 0.0),
                       np.zeros((f.size, 2, 6)))
    light = camera.Light(rate, SHAPE, photons=float(rng.uniform(20, 120)), read=float(rng.uniform(0.6, 2.0)),
                         blur=float(rng.uniform(0.5, 1.2)), exposure=float(rng.choice([0.0, 0.4])))
    scene = Scene(bodies, wall, light, poles, float(rng.uniform(0.02, 0.1)), int(rng.integers(360, 640)), kind=kind)
    if kind == "flicker":
        light.flicker, light.mains, light.slope = float(rng.uniform(0.005, 0.03)), float(rng.choice([50.0, 60.0])), 0.3
    elif kind == "shutter":
        light.row_delay = float(rng.uniform(0.1, 0.9)) / rate / SHAPE[0]
    elif kind == "shake":
        a, b = rng.uniform(2, 9, 2)
        light.shake = lambda t: np.column_stack([0.5 * np.sin(2 * np.pi * a * t), 0.4 * np.sin(2 * np.pi * b * t + 1)])
        low = max(body.box[1] + body.box[3] for body in bodies) + 5
        scene.still = [Region(2, 2, SHAPE[1] - 4, 32), Region(2, low, SHAPE[1] - 4, SHAPE[0] - 2 - low)]
    elif kind == "depth":
        for body in bodies:  # also towards the camera: bodies grow and shrink in the picture
            out = rng.normal(0, 0.2, f.size) * size
            body.field[:, 0, 1] += out
            body.field[:, 1, 2] += out
    elif kind == "blur":
        light.blur = float(rng.uniform(1.5, 2.2))
    return scene


def kept_frames(scene: Scene, rng: np.random.Generator, place: Path | None) -> np.ndarray:
    """Return the frames of a scene, from a file where it was filmed before."""
    if place is not None and place.exists():
        return np.load(place)
    frames = scene.filmed(rng)
    if place is not None:
        np.save(place, frames)
    return frames


def write_clip(frames: np.ndarray, folder: Path, compressed: bool) -> Path:
    """Write frames as a user has them."""
    if compressed:
        from vision import encode

        return encode(frames, folder / "clip.mp4", 10)
    np.save(folder / "clip.npy", frames)
    return folder / "clip.npy"


def compared(result: VideoStudy, scene: Scene) -> dict[str, Any]:
    """Return which intervals hold, false modes and missed ones."""
    rate, modes = scene.light.rate, result.poles
    half = (np.full(modes.count, np.inf),) * 2 if modes.covariance is None else (modes.frequency_interval, modes.damping_interval)
    true = scene.poles / 2 / np.pi
    f, zeta = np.abs(true), -true.real / np.abs(true)
    held: dict[str, Any] = {"frequency": [], "damping": [], "shape": [], "size": [], "shapez": [], "fits": [round(float(np.nanmax(b.fit)),2) for b in result.bodies], "window": [], "false": [], "lost": [], "z": []}
    matched: dict[int, int] = {}
    for i in np.flatnonzero(result.is_mode):
        r = int(np.argmin(np.abs(np.log(f / modes.frequency[i]))))
        if abs(modes.frequency[i] / f[r] - 1) > 0.03 + 2 * zeta[r] or r in matched:
            held["false"].append((round(float(modes.frequency[i]), 2), round(float(modes.damping_ratio[i]), 4), round(float(result.seen[i]), 1)))
            continue
        matched[r] = int(i)
        held["frequency"].append(bool(abs(modes.frequency[i] - f[r]) <= half[0][i]))
        held["z"].append([float((modes.frequency[i] - f[r]) / half[0][i] * 1.96), float((modes.damping_ratio[i] - zeta[r]) / half[1][i] * 1.96)])
        if result.gives_damping:
            held["damping"].append(bool(abs(modes.damping_ratio[i] - zeta[r]) <= half[1][i]))
        wants, seens, spreads = [], [], []
        for body in result.bodies:
            if "unknown" in body.orders:
                continue
            true_body = next(part for part in scene.bodies if part.name == body.name)
            places = np.array([true_body.centre, true_body.centre + 0.7 * np.array([true_body.box[2], true_body.box[3]]) / 2])
            start = np.exp(scene.poles[r] * (result.decay.first / rate - scene.start)) * -1j
            want = np.array([true_body.motion(place)[r] for place in places]) * start
            seen, spread = body.shape_at(places)[:, :, i], body.deviation_at(places)[:, :, i] / np.sqrt(2)
            wants.append(want.ravel())
            seens.append(seen.ravel())
            spreads.append(spread.ravel())
        if wants:
            want, seen, spread = np.concatenate(wants), np.concatenate(seens), np.concatenate(spreads)
            held["size"] += _within(seen - want, spread)
            # The size and phase of a shape are free: no force is known.
            factor = ((want.conj() * seen) / spread**2).sum() / ((np.abs(want) / spread) ** 2).sum()
            held["shape"] += _within(seen - factor * want, spread)
            held["shapez"].append([round(float(np.sqrt((np.abs((seen - factor*want)/spread)**2).mean()/2)),2), round(abs(factor),4), round(float(np.degrees(np.angle(factor))),2)])
    sizes = np.array([max(np.linalg.norm(b.motion(b.centre)[r]) for b in scene.bodies) for r in range(f.size)])
    held["lost"] = [(round(float(f[r]), 2), round(float(zeta[r]), 4), round(float(sizes[r]), 3)) for r in range(f.size) if r not in matched]
    return held


def _within(error: np.ndarray, spread: np.ndarray) -> list[bool]:
    return (np.abs(np.concatenate([error.real / spread, error.imag / spread])) <= 1.96).tolist()


def run_true(seed: int, kind: str, store: Path | None) -> dict[str, Any]:
    """Film, write, read, study."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    scene = random_scene(rng, kind)
    frames = kept_frames(scene, rng, None if store is None else store / f"{kind}{seed}.npy")
    with tempfile.TemporaryDirectory() as folder:
        path = write_clip(frames, Path(folder), kind == "compressed")
        clip = files.read(path, scene.light.rate, row_delay=scene.light.row_delay)
        result = study_video(clip, bodies=scene.regions, background=scene.still, side=12)
    return compared(result, scene) | {"doubts": list(result.doubts), "notes": list(result.notes), "modes": int(result.is_mode.sum()),
                                      "names": [(round(float(f), 2), round(float(s),1), n) for f, s, n in zip(result.poles.frequency, result.seen, result.names, strict=True)]}


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5, help="of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--store", type=Path, help="folder in which films are kept")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    for kind in options.kinds.split(","):
        for k in range(options.runs):
            begin = time.process_time()
            try:
                row = run_true(options.seed + k, kind, options.store)
            except ToolpointError as error:
                row = {"refused": str(error)}
            print(json.dumps({"kind": kind, "seed": options.seed + k, "cpu": round(time.process_time() - begin, 1)} | row), flush=True)


if __name__ == "__main__":
    main()
