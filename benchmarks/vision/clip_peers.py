"""Peers on a clip that `clips.py` saved: pyidi's Lucas-Kanade and OpenCV's; run by a Python that has them. Prints JSON."""

from __future__ import annotations

import json
import sys
import tempfile
import time

import numpy as np


def main() -> None:
    """Track the points of both files with every peer that is installed."""
    frames, points = np.load(sys.argv[1], mmap_mode="r"), np.load(sys.argv[2])
    truth, side = np.load(sys.argv[3]), int(sys.argv[4])
    result = {}
    for name, track in (("pyidi Lucas-Kanade", _pyidi), ("OpenCV PyrLK", _opencv)):
        try:
            begin = time.process_time()
            motion = track(frames, points, side)
            seconds = time.process_time() - begin
        except ImportError:
            continue
        error = motion - motion.mean(axis=0) - truth + truth.mean(axis=0)
        centred = truth - truth.mean(axis=0)
        gain = float((motion * centred).sum() / (centred**2).sum())
        result[name] = {"rmse": float(np.sqrt((error**2).mean())), "cpu": seconds, "gain": gain}
    print(json.dumps(result))


def _pyidi(frames: np.ndarray, points: np.ndarray, side: int) -> np.ndarray:
    import pyidi

    video = pyidi.VideoReader(np.asarray(frames), root=tempfile.mkdtemp())
    method = pyidi.LucasKanade(video)
    method.configure(roi_size=(side, side), processes=1, show_pbar=False, reference_image=(0, 64))
    method.set_points(points[:, ::-1])
    motion = np.asarray(method.get_displacements(autosave=False))  # (points, frames, (y, x))
    return motion.transpose(1, 0, 2)[:, :, ::-1]


def _opencv(frames: np.ndarray, points: np.ndarray, side: int) -> np.ndarray:
    import cv2

    cv2.setNumThreads(1)
    start = points.astype(np.float32)[:, None]
    first = np.asarray(frames[0])
    result = np.empty((len(frames), len(points), 2))
    last = start.copy()
    for k, frame in enumerate(frames):
        last, _, _ = cv2.calcOpticalFlowPyrLK(first, np.asarray(frame), start, last.copy(), winSize=(side, side), maxLevel=0,
                                              flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
                                              criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 1e-3))
        result[k] = (last - start)[:, 0]
    return result


if __name__ == "__main__":
    main()
