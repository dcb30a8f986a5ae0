import numpy as np

from toolpoint import vision
from toolpoint.vision.displacement.points import windows_at


def solve(data):
    scanned = vision.scan(vision.clip_of(data["frames"], 500.0))
    windows = windows_at(scanned.reference, data["corners"], int(data["side"]))
    moved = np.asarray(vision.measure(scanned, windows, "lucas-kanade").values)
    return {"x": moved - moved[:1]}
