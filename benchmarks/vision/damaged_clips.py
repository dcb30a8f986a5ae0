"""Mutated clips: every damaged file is read or refused with the package's own error, none hangs or ends the process."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint import ToolpointError
from toolpoint.vision.magnification.writing import write_frames
from toolpoint.vision.reading import files

LONGEST, BATCH = 20.0, 250


def originals(folder: Path) -> list[Path]:
    """Write a small file of every kind."""
    import av

    frames = np.random.default_rng(1).integers(0, 256, (24, 48, 64), dtype=np.uint8)
    np.save(folder / "a.npy", frames)
    write_frames(frames[:2], folder / "images")
    paths = [folder / "a.npy", *sorted((folder / "images").iterdir())[:1]]
    for name, codec in (("a.mp4", "libx264"), ("a.mkv", "ffv1"), ("a.avi", "mjpeg"), ("a.mov", "mpeg4")):
        with av.open(str(folder / name), "w") as container:
            stream = container.add_stream(codec, rate=30)
            stream.height, stream.width = 48, 64
            stream.pix_fmt = {"ffv1": "gray", "mjpeg": "yuvj420p"}.get(codec, "yuv420p")
            for k, frame in enumerate(frames):
                picture = av.VideoFrame.from_ndarray(frame, format="gray")
                picture.pts = k
                container.mux(stream.encode(picture))
            container.mux(stream.encode())
        paths.append(folder / name)
    return paths


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Return a file with bytes changed, cut, doubled or moved, mostly near its start, where headers are."""
    array = bytearray(data)
    for _ in range(int(rng.integers(1, 6))):
        at = int(len(array) * rng.random() ** 3)
        kind = rng.integers(5)
        if kind == 0:
            array[at:at + 1] = bytes([int(rng.integers(256))])
        elif kind == 1:
            array[at:at + 4] = rng.bytes(4)
        elif kind == 2:
            del array[at:at + int(rng.integers(1, 64))]
        elif kind == 3:
            array[at:at] = array[at:at + int(rng.integers(1, 64))]
        else:
            array[at:at + 4] = b"\xff\xff\xff\xff"
    return bytes(array if rng.random() > 0.1 else array[:int(len(array) * rng.random())])


def one_batch(seed: int, count: int) -> dict[str, object]:
    """Read `count` mutated files in this process."""
    rng = np.random.default_rng(seed)
    result: dict[str, object] = {"read": 0, "refused": 0, "slowest": 0.0, "tracebacks": []}
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        sources = [(path, path.read_bytes()) for path in originals(folder)]
        for _ in range(count):
            path, data = sources[int(rng.integers(len(sources)))]
            target = folder / "mutated"
            target.mkdir(exist_ok=True)
            for old in target.iterdir():
                old.unlink()
            name = target / path.name
            name.write_bytes(mutated(data, rng))
            if path.suffix == ".png":
                (target / "frame_000001.png").write_bytes(data)
            begin = time.monotonic()
            try:
                for _ in files.read(target if path.suffix == ".png" else name, 500.0).chunks(16):
                    pass
                result["read"] += 1  # type: ignore[operator]
            except ToolpointError:
                result["refused"] += 1  # type: ignore[operator]
            except Exception as error:  # counted: this is what must not be
                result["tracebacks"].append(f"{path.name}: {type(error).__name__}: {error}"[:200])  # type: ignore[attr-defined]
            result["slowest"] = max(result["slowest"], time.monotonic() - begin)  # type: ignore[type-var]
    return result


def main() -> None:
    """Run batches in processes of their own, so that one that dies is counted."""
    parser = CommandLine(__doc__)
    parser.cases("files", 10_000)
    parser.add_argument("--batch", type=int, help="read one batch of this seed here")
    options = parser.parse_args()
    if options.batch is not None:
        print(json.dumps(one_batch(options.batch, BATCH)))
        return
    total = {"read": 0, "refused": 0, "died": 0, "hung": 0, "tracebacks": [], "slowest": 0.0}
    for seed in range(-(-options.files // BATCH)):
        command = [sys.executable, __file__, "--batch", str(seed)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST * 30, check=False)
        except subprocess.TimeoutExpired:
            total["hung"] += 1
            continue
        if done.returncode:
            total["died"] += 1
            print(f"batch {seed} ended with {done.returncode}: {done.stderr[-200:]}")
            continue
        part = json.loads(done.stdout.splitlines()[-1])
        for key in ("read", "refused", "tracebacks"):
            total[key] += part[key]
        total["slowest"] = max(total["slowest"], part["slowest"])
    print("\n".join(dict.fromkeys(total["tracebacks"])))
    print(f"{total['read'] + total['refused']} mutated files: {total['read']} read, {total['refused']} refused, "
          f"{len(total['tracebacks'])} tracebacks, {total['died']} batches died, {total['hung']} hung, slowest "
          f"{total['slowest']:.2f} s")


if __name__ == "__main__":
    main()
