"""Vision: the bars V1-V11, V13, V14 on clips rendered anew, beside pyidi and OpenCV (`--peers PYTHON` that has them).

Parts: `clip` (V1-V6, V10, V11), `robust` (V8, V14), `shake` (V13, over seeds), `compression` (V7, V9), `intervals` (over
seeds), `mill` (P4).
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from benchmarks.vision import frame_scene as bench
from toolpoint.modal_identification import identify
from toolpoint.studies.video.video_study import study_video
from toolpoint.studies.video.virtual_update import update_from_virtual_videos
from toolpoint.vibration.correlation import mac
from toolpoint.vision.clip import Clip, FrameArray, Region
from toolpoint.vision.displacement.measure import measure, scan
from toolpoint.vision.displacement.points import choose_points, grid_windows
from toolpoint.vision.magnification.warp import ShapeWarp
from toolpoint.vision.modes.bodies import fit_bodies
from toolpoint.vision.modes.decay import find_decay
from toolpoint.vision.modes.full_field import full_field
from toolpoint.vision.modes.projection import point_shapes
from toolpoint.vision.reading import files
from toolpoint.vision.rendering.scene import Camera, RenderedFrames, film

HALF = (360, 640)
Row = dict[str, Any]


def timed(run: Callable[[], Any]) -> tuple[Any, float]:
    """Return the result of a second call and its CPU seconds: the first one may compile."""
    run()
    begin = time.process_time()
    result = run()
    return result, time.process_time() - begin


def centred(values: np.ndarray) -> np.ndarray:
    """Values less their mean over time."""
    return values - values.mean(axis=0)


def clip_bars(seed: int, peers: str | None) -> Row:
    """V1-V6, V8, V10, V11 on the full clip."""
    rows: Row = {}
    for name, amplitude in (("syn", bench.SYN), ("low", bench.LOW)):
        rng = np.random.default_rng(seed)
        scene = bench.c_frame(rng, amplitude)
        clip = film(scene, Camera(bench.SHAPE), bench.FRAMES, rng=rng)
        scanned, seconds = timed(lambda clip=clip: scan(clip))
        rows[f"{name} scan, CPU s"] = seconds
        windows = choose_points(scanned.reference, scanned.survey, 500)
        rows |= {f"{name} {key}": value for key, value in _displacement(scene, scanned, windows).items()}
        rows |= {f"{name} {key}": value for key, value in _modes(scene, scanned).items()}
        if peers and name == "syn":
            rows |= _peers(peers, scene, clip, windows)
    return rows


def _displacement(scene: Any, scanned: Any, windows: Any) -> Row:
    owner = bench.owners(scene, windows.centres, windows.side)
    on = (owner >= 0) & (windows.sight == 2)
    truth = centred(bench.true_motion(scene, windows.centres[on], owner[on]))
    middle = windows.corners[on] + windows.side // 2
    bound = np.linalg.inv(scanned.reference.information(windows.side)[middle[:, 0], middle[:, 1]])
    least = float(np.sqrt(np.trace(bound, axis1=1, axis2=2).mean() / 2))
    rows: Row = {"bound, px": least}
    for method in ("templates", "lucas-kanade", "phase"):
        field, seconds = timed(lambda method=method: measure(scanned, windows, method))
        seen = centred(field.values[:, on])
        error = seen - truth
        sigma = np.sqrt(np.einsum("nii->ni", field.covariance[on]))
        rows |= {f"{method}: RMSE over bound": float(np.sqrt((error**2).mean())) / least,
                 f"{method}: slope": float((seen * truth).sum() / (truth**2).sum()), f"{method}: CPU s": seconds,
                 f"{method}: within one sigma, %": 100 * float((np.abs(error) < sigma).mean())}
        if method == "templates":
            decay = find_decay(field)
            shapes = point_shapes(field, bench.poles(), decay.first)
            times = np.arange(len(decay.components)) / bench.RATE
            smooth = np.einsum("nir,tr->tni", shapes.shape[on], np.exp(times[:, None] * bench.poles())).real
            rest = centred(smooth) - centred(bench.true_motion(scene, windows.centres[on], owner[on])[decay.first:])
            rows["RMSE after modal filtering, px"] = float(np.sqrt((rest**2).mean()))
    return rows


def _modes(scene: Any, scanned: Any) -> Row:
    every = grid_windows(scanned.reference, scanned.survey, 32)
    decay = find_decay(measure(scanned, every.selected(np.flatnonzero(every.sight > 0))))
    found = identify(decay.responses(1.0)).modes
    at = [int(np.argmin(np.abs(found.frequency - f))) for f in bench.FREQUENCY]
    rows: Row = {"worst frequency, %": 100 * float(np.abs(found.frequency[at] / bench.FREQUENCY - 1).max()),
                 "worst damping, %": 100 * float(np.abs(found.damping_ratio[at] / bench.RATIO - 1).max())}
    poles = found.poles[at]
    whole, seconds = timed(lambda: full_field(scanned, poles, decay.first, side=32))
    owner = bench.owners(scene, whole.windows.centres, whole.windows.side)
    on = (owner >= 0) & (whole.windows.sight == 2)
    truth = bench.true_shapes(scene, whole.windows.centres, owner)[on].reshape(-1, 2).astype(complex)
    rows["full field, CPU s"] = seconds
    rows["full field, MAC"] = np.diag(mac(whole.shapes.shape[on].reshape(-1, 2), truth)).tolist()
    fine = full_field(scanned, poles, decay.first)
    bodies = fit_bodies(fine.windows, fine.shapes, bench.regions(scene))
    smooth = np.zeros((len(owner), 2, 2), complex)
    for k, body in enumerate(bodies):
        smooth[owner == k] = body.shape_at(whole.windows.centres[owner == k])
    rows["bodies, MAC"] = np.diag(mac(smooth[on].reshape(-1, 2), truth)).tolist()
    rows["bodies, orders"] = [list(body.orders) for body in bodies]
    return rows | _magnified(scene, scanned, poles, bodies=bodies, whole=fine, first=decay.first)


def _magnified(scene: Any, scanned: Any, poles: np.ndarray, *, bodies: Any, whole: Any, first: int) -> Row:
    warp, factor = ShapeWarp(scanned, poles, bodies, whole, first), 20.0
    base = scene.amplitudes
    more = RenderedFrames(scene.changed(lambda times: base(times) * np.array([1.0, factor])), Camera(bench.SHAPE), 2)
    numbers = (first + 4, first + 30, first + 60)
    rows: Row = {}
    for attenuation in (0.0, 0.5):
        ratio = [10 * np.log10(255**2 / ((frame - more.picture(k / bench.RATE)) ** 2).mean())
                 for k, frame in zip(numbers, warp.frames(1, factor, attenuation=attenuation, numbers=numbers))]
        rows[f"magnification x20, attenuation {attenuation:g}, PSNR dB"] = [round(float(value), 2) for value in ratio]
        frames = warp.frames(1, factor, attenuation=attenuation)
        next(frames)
        begin = time.process_time()
        for _ in range(20):
            next(frames)
        rows[f"magnification, attenuation {attenuation:g}, ms a frame"] = 50 * (time.process_time() - begin)
    return rows


def rendered(clip: Clip) -> Any:
    """Return the frames of a clip that was rendered here, (n, rows, columns)."""
    assert isinstance(clip.source, FrameArray)
    return np.asarray(clip.source.frames)


def _peers(python: str, scene: Any, clip: Clip, windows: Any) -> Row:
    owner = bench.owners(scene, windows.centres, windows.side)
    on = (owner >= 0) & (windows.sight == 2)
    frames = rendered(clip)
    with tempfile.TemporaryDirectory() as folder:
        names = [str(Path(folder) / name) for name in ("frames.npy", "points.npy", "truth.npy")]
        for name, array in zip(names, (frames, windows.centres[on],
                                       bench.true_motion(scene, windows.centres[on], owner[on]))):
            np.save(name, array)
        script = str(Path(__file__).with_name("clip_peers.py"))
        done = subprocess.run([python, script, *names, str(windows.side)], capture_output=True, text=True, check=False)
    if done.returncode:
        return {"peers failed": done.stderr[-300:]}
    return {f"{name}, {int(on.sum())} points": values for name, values in json.loads(done.stdout.splitlines()[-1]).items()}


def robust_bars(seed: int) -> Row:
    """V8, V14 at half the size."""
    rows: Row = {}
    lengths = {}
    for name, options in (("steady", {}), ("flicker", {"flicker": 0.02})):
        scene, clip = _half(seed, **options)
        scanned = scan(clip)
        windows = choose_points(scanned.reference, scanned.survey, 200)
        owner = bench.owners(scene, windows.centres, windows.side)
        on = (owner >= 0) & (windows.sight == 2)
        error = centred(measure(scanned, windows).values[:, on]) - centred(bench.true_motion(scene, windows.centres[on],
                                                                                             owner[on]))
        lengths[name] = float(np.sqrt((error**2).mean()))
        if name == "flicker":
            rows["lamp line named"] = [note for note in study_video(clip).notes if "lamp" in note]
    rows["flicker of 2 %: RMSE over that without"] = lengths["flicker"] / lengths["steady"]
    scene, clip = _half(seed, row_delay=1e-3 / HALF[0])
    scanned = scan(clip)
    windows = choose_points(scanned.reference, scanned.survey, 300)
    owner = bench.owners(scene, windows.centres, windows.side)
    on = (owner >= 0) & (windows.sight == 2)
    shapes = point_shapes(measure(scanned, windows), bench.poles()).shape[on]
    truth = bench.true_shapes(scene, windows.centres, owner)[on]
    rows["rolling shutter: worst phase by rows, deg"] = [_phase_by_rows(shapes[:, :, r], truth[:, :, r], windows.centres[on, 1])
                                                         for r in range(2)]
    return rows


def shake_bars(seeds: int) -> Row:
    """V13: rms errors of the poles over seeds, with the camera shaking by a pixel, over those of a steady camera."""
    errors: dict[str, list[Any]] = {"steady": [], "shaken": []}
    for seed in range(1, seeds + 1):
        for name, kept in errors.items():
            shake = None if name == "steady" else _shake
            _, clip = _half(seed, shake=shake, wall_contrast=6.0)
            strips = [Region(4, 4, 632, 50), Region(4, 60, 140, 290), Region(500, 60, 136, 140)]
            found = study_video(clip, background=strips if shake else ()).modes
            at = [int(np.argmin(np.abs(found.frequency - f))) for f in bench.FREQUENCY]
            kept.append([*(found.frequency[at] / bench.FREQUENCY - 1), *(found.damping_ratio[at] / bench.RATIO - 1)])
    size = {name: np.sqrt((np.array(kept) ** 2).mean(axis=0)) for name, kept in errors.items()}
    rows: Row = {f"{name}: rms errors of two frequencies and dampings, %": (100 * value).round(4).tolist()
                 for name, value in size.items()}
    return rows | {"shake 1 px: errors over those of a steady camera": (size["shaken"] / size["steady"]).round(2).tolist()}


def _phase_by_rows(shape: np.ndarray, truth: np.ndarray, rows: np.ndarray) -> float:
    """Largest phase error of the windows of one eighth of the rows together, degrees."""
    worst = 0.0
    for part in np.array_split(np.argsort(rows), 8):
        total = (shape[part] * truth[part]).sum() / -1j
        if (truth[part] ** 2).sum() > 0.05 * (truth**2).sum() / 8:
            worst = max(worst, abs(float(np.degrees(np.angle(total)))))
    return worst


def _half(seed: int, *, contrast: float = 8.0, wall_contrast: float = 0.0, **options: Any) -> tuple[Any, Clip]:
    rng = np.random.default_rng(seed)
    scene = bench.c_frame(rng, bench.SYN, shape=HALF, contrast=contrast, wall_contrast=wall_contrast)
    return scene, film(scene, Camera(HALF, **options), bench.FRAMES, rng=rng)


def _shake(times: np.ndarray) -> np.ndarray:
    return np.column_stack([0.5 * np.sin(2 * np.pi * 2.3 * times) + 0.5 * np.sin(2 * np.pi * 7.7 * times),
                            0.7 * np.sin(2 * np.pi * 4.9 * times + 1)])


def compression_bars(seed: int) -> Row:
    """V7 and V9: what x264 leaves at qualities 10, 18 and 23."""
    rows: Row = {}
    scene, clip = _half(seed)
    with tempfile.TemporaryDirectory() as folder:
        for quality in (10, 18, 23):
            path = encode(rendered(clip)[:480], Path(folder) / f"{quality}.mp4", quality)
            result = study_video(files.read(path, bench.RATE))
            at = int(np.argmin(np.abs(result.poles.frequency - 13)))
            strongest = np.abs(result.shapes.shape[:, :, at]).max()
            rows[f"x264 quality {quality}"] = {"accepted": result.quality.accepts_amplitude, "frequencies": np.round(
                result.poles.frequency, 3).tolist(), "amplitude": float(strongest)}
        rng = np.random.default_rng(seed)
        scene = bench.c_frame(rng, bench.SYN)
        full = film(scene, Camera(bench.SHAPE), bench.FRAMES, rng=rng)
        path = encode(rendered(full), Path(folder) / "full.mp4", 10, "ultrafast")
        del full
        code = ("import json,time,resource;from toolpoint.vision import read_clip;"
                "from toolpoint.studies import study_video;"
                f"t=time.process_time();r=study_video(read_clip({str(path)!r},960.0));"
                "print(json.dumps([time.process_time()-t,resource.getrusage(resource.RUSAGE_SELF).ru_maxrss/1e6,"
                "r.poles.frequency.tolist()]))")
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        seconds, memory, frequencies = json.loads(done.stdout.splitlines()[-1])
        rows["720p clip, quality 10: CPU s, GB, Hz"] = [seconds, memory, frequencies]
        begin = time.process_time()
        for _ in files.read(path, bench.RATE).chunks():
            pass
        rows["of which decoding, CPU s"] = time.process_time() - begin
    return rows


def encode(frames: np.ndarray, path: Path, quality: int, preset: str = "veryfast") -> Path:
    """Write frames by x264 with their grey levels as they are."""
    import av

    rows, columns = frames.shape[1:]
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.height, stream.width, stream.pix_fmt = rows, columns, "yuv420p"
        stream.options = {"crf": str(quality), "preset": preset}
        planes = np.full((rows * 3 // 2, columns), 128, np.uint8)
        for k, frame in enumerate(frames):
            planes[:rows] = frame
            picture = av.VideoFrame.from_ndarray(planes, format="yuv420p")
            picture.pts = k
            container.mux(stream.encode(picture))
        container.mux(stream.encode())
    return path


def interval_bars(seeds: int) -> Row:
    """Coverage of the 95 % intervals of frequency, damping and body shape."""
    shape, frames, held = (180, 320), 480, {"frequency": [], "damping": [], "body shape": []}
    for seed in range(seeds):
        rng = np.random.default_rng(1000 + seed)
        scene = bench.c_frame(rng, (0.2, 0.1), shape=shape, contrast=10.0)
        rigid = type(scene)(tuple(_rigid(body) for body in scene.bodies), scene.amplitudes, scene.background)
        clip = film(rigid, Camera(shape), frames, rng=rng)
        result = study_video(clip, bodies=bench.regions(rigid), side=12)
        modes = result.poles
        for r, (f, zeta) in enumerate(zip(bench.FREQUENCY, bench.RATIO)):
            at = int(np.argmin(np.abs(modes.frequency - f)))
            held["frequency"].append(abs(modes.frequency[at] - f) <= modes.frequency_interval[at])
            held["damping"].append(abs(modes.damping_ratio[at] - zeta) <= modes.damping_interval[at])
            for body in result.bodies:
                held["body shape"] += _shape_held(rigid, body, result, at, r)
    return {f"{name}, % of {len(values)} held": 100 * float(np.mean(values)) for name, values in held.items()}


def _rigid(body: Any) -> Any:
    field = body.field.copy()
    field[:, :, 3:] = 0
    return type(body)(body.name, body.box, body.texture, field)


def _shape_held(scene: Any, body: Any, result: Any, at: int, r: int) -> list[bool]:
    """Whether right and down of the body's centre, against the truth at the start of the decay, lie in their intervals."""
    if "unknown" in body.orders:
        return []
    true = next(part for part in scene.bodies if part.name == body.name)
    place = np.array([true.centre])
    pole = bench.poles()[r]
    start = np.exp(pole * result.decay.first / bench.RATE) * -1j
    error = body.shape_at(place)[0, :, at] - true.shape_at(place)[0, :, r] * start
    spread = np.sqrt(np.einsum("ii->i", body.covariance_at(place)[0, at]) * body.basis_covariance[at, 0, 0])
    return (np.abs(error.real) <= 1.96 * spread).tolist()


def mill_bars(seed: int) -> Row:
    """P4: two planes, ranking, FRAC."""
    from toolpoint.app.commands.demos import MILL_FILE
    from toolpoint.io import read_machine
    from toolpoint.studies import FILMED_TRUTH

    machine = read_machine(MACHINE_TEMPLATES / MILL_FILE)
    rows: Row = {}
    for method in ("templates", "phase"):
        result = update_from_virtual_videos(machine, FILMED_TRUTH, "spindle_nose", rng=np.random.default_rng(seed),
                                            method=method)
        rows[f"P4 by {method}"] = {"first two": [e.joint for e in result.update.ranking.interfaces[:2]],
                                   "FRAC": result.frac[:, 1].tolist()}
    with tempfile.TemporaryDirectory() as folder:
        def recorded(video: Any, plane: str) -> Clip:
            return files.read(encode(rendered(video.clip), Path(folder) / f"{plane}.mp4", 10), bench.RATE)
        result = update_from_virtual_videos(machine, FILMED_TRUTH, "spindle_nose", rng=np.random.default_rng(seed),
                                            recorded=recorded)
    rows["P4 by x264 at quality 10"] = {"first two": [e.joint for e in result.update.ranking.interfaces[:2]],
                                         "FRAC": result.frac[:, 1].tolist()}
    return rows


def main() -> None:
    """Run the parts asked for and print their figures."""
    parser = CommandLine(__doc__)
    parser.part("parts", default="clip,robust,shake,compression,intervals,mill")
    parser.seed(1)
    parser.cases("seeds", 50, "of the intervals and the shake")
    parser.add_argument("--peers", help="a Python that has pyidi and OpenCV")
    parser.json()
    options = parser.parse_args()
    parts: dict[str, Callable[[], Row]] = {
        "clip": lambda: clip_bars(options.seed, options.peers), "robust": lambda: robust_bars(options.seed),
        "shake": lambda: shake_bars(options.seeds), "compression": lambda: compression_bars(options.seed),
        "intervals": lambda: interval_bars(options.seeds), "mill": lambda: mill_bars(options.seed)}
    rows: Row = {}
    for part in options.parts.split(","):
        for name, value in parts[part]().items():
            rows[name] = value
            if not options.json:
                print(f"{name:<62}{value if not isinstance(value, float) else format(value, '.5g')}", flush=True)
    rows["largest memory, GB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(json.dumps(rows) if options.json else f"largest memory {rows['largest memory, GB']:.2f} GB")


if __name__ == "__main__":
    main()
