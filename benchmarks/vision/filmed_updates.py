"""Random soft joints of the small mill, filmed in two planes and updated: does every value lie in its interval?

Two of the four joints are made soft (factors 0.02 to 0.5 of the file's stiffness, other dampers too). Then, with `--slips`, the
same films with the scale stated 10 % wrong, and with the two views exchanged: are they found out?
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from toolpoint import ToolpointError
from toolpoint.io import read_machine
from toolpoint.machine import Machine
from toolpoint.studies.video.filmed_machine import study_videos
from toolpoint.studies.video.video_update import VideoUpdate
from toolpoint.studies.video.virtual_video import film_machine
from toolpoint.updating.fits.wide_search import name_undetermined
from toolpoint.vibration import Dof
from toolpoint.vision.clip import Clip, clip_of
from toolpoint.vision.rendering.scene import Camera
from toolpoint.vision.view import View

MILL = MACHINE_TEMPLATES / "small_mill.yaml"
SHAPE, SCALE, ORIGIN, BAND = (432, 384), 2.5e-3, (192.0, 400.0), (5.0, 200.0)
PLANES = ("xz", "yz")


def random_truth(machine: Machine, rng: np.random.Generator) -> dict[str, float]:
    """Return stiffness and damping of two soft joints."""
    soft = rng.choice(list(machine.description.joints), 2, replace=False)
    truth = {}
    for name in soft:
        joint = machine.description.joints[name]
        for way, value in joint.stiffness.items():
            truth[f"joints.{name}.stiffness.{way}"] = value * float(np.exp(rng.uniform(np.log(0.02), np.log(0.5))))
            truth[f"joints.{name}.damping.{way}"] = joint.damping[way] * float(np.exp(rng.uniform(np.log(0.5), np.log(6.0))))
    return truth


def views(scale: float = SCALE, planes: tuple[str, ...] = PLANES) -> list[View]:
    """Return the stated views."""
    return [View.of_plane(plane, scale, ORIGIN) for plane in planes]


def films(machine: Machine, truth: dict[str, float], rng: np.random.Generator, seed: int, store: Path | None) -> list[Clip]:
    """Return the clips of both planes."""
    clips = []
    for plane in PLANES:
        place = None if store is None else store / f"mill{seed}{plane}.npy"
        if place is not None and place.exists():
            clips.append(clip_of(np.load(place), 960.0, name=plane))
            continue
        view, struck = View.of_plane(plane, SCALE, ORIGIN), Dof("spindle_nose", "+" + plane[0])
        video = film_machine(machine.with_values(truth), view, struck, rng=rng, camera=Camera(SHAPE), frames=720)
        frames = np.concatenate(list(video.clip.chunks()))
        if place is not None:
            np.save(place, frames)
        clips.append(clip_of(frames, 960.0, name=plane))
    return clips


def determined(result: VideoUpdate) -> list[str]:
    """Return the values that the videos determine; the others keep what was assumed of them and count for nothing."""
    return [name for name in result.update.fit.free if name not in name_undetermined(result.update.fit)]


def verdict(result: VideoUpdate, truth: dict[str, float], machine: Machine) -> tuple[list[str], list[str]]:
    """Return determined values outside their intervals, and the doubts."""
    fit = result.update.fit
    outside = []
    for name in determined(result):
        low, high = fit.interval(name)
        true = truth.get(name, machine.value(name))
        if not low <= true <= high:
            outside.append(f"{name} {fit.values[name]:.4g} ({low:.4g} .. {high:.4g}) for {true:.4g}")
    return outside, [str(doubt) for doubt in result.doubts]


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 8)
    parser.seed(0)
    parser.add_argument("--store", type=Path)
    parser.add_argument("--slips", action="store_true")
    options = parser.parse_args()
    machine = read_machine(MILL)
    held, values, wrong, doubted, silent, found = 0, 0, [], 0, 0, {"scale": [], "views": []}
    named = {"scale": 0, "views": 0}
    for seed in range(options.seed, options.seed + options.runs):
        rng = np.random.default_rng([seed, 290])
        truth = random_truth(machine, rng)
        clips = films(machine, truth, rng, seed, options.store)
        begin = time.process_time()
        try:
            result = study_videos(clips, machine, views=views(), update=True, band=BAND).answer
            outside, doubts = verdict(result, truth, machine)
            count = len(determined(result))
        except ToolpointError as error:
            outside, doubts, count = [], [str(error)], 0
        held, values, doubted = held + count - len(outside), values + count, doubted + bool(doubts)
        if outside and not doubts:
            wrong.append(seed)
        silent += not doubts
        print(seed, {k.replace("joints.", ""): f"{v:.4g}" for k, v in truth.items() if "stiff" in k}, count,
              "values, outside", outside,
              "DOUBTS", [d[:160] for d in doubts], f"{time.process_time() - begin:.1f} s", flush=True)
        if options.slips:
            for name, stated in (("scale", views(1.1 * SCALE)), ("views", views(planes=PLANES[::-1]))):
                try:
                    slipped = study_videos(clips, machine, views=stated, update=True, band=BAND).answer.doubts
                except ToolpointError as error:
                    slipped = [str(error)]
                found[name].append(bool(slipped))
                named[name] += bool(slipped) and str(slipped[0]).startswith(name)
                print("  ", name, [str(d)[:140] for d in slipped], flush=True)
    print(f"{options.runs} updates: {held} of {values} values in their intervals, {doubted} doubted, outside and not doubted: "
          f"{wrong}" + (f"; scale doubted {sum(found['scale'])}, by name {named['scale']}; exchanged views "
                      f"{sum(found['views'])}, by name {named['views']}" if options.slips else ""))


if __name__ == "__main__":
    main()
