import tempfile

import numpy as np
from pyidi import LucasKanade, VideoReader


def solve(data):
    method, side = LucasKanade(VideoReader(data["frames"], root=tempfile.mkdtemp(), fps=500)), int(data["side"])
    method.set_points(data["corners"] + (side - 1) // 2)
    method.configure(roi_size=(side, side), show_pbar=False, verbose=0)
    moved = np.asarray(method.get_displacements(autosave=False)).transpose(1, 0, 2)[:, :, ::-1]
    return {"x": moved - moved[:1]}
