"""Sound track of a video by PyAV (extra `video`)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.vision.reading.video import library


def read_sound_track(path: Path) -> tuple[FloatArray, float]:
    """Return the first sound track of a video, shape (n_samples, n_channels), within -1 .. 1, and its samples per second.

    Raises
    ------
    ToolpointError
        Where PyAV is missing, or the file has no sound that can be decoded.
    """
    av = library()
    try:
        with av.open(str(path)) as container:
            if not container.streams.audio:
                fail("path", f"{path.name} has no sound track", "must have one", remedy="switch the microphone on")
            stream = container.streams.audio[0]
            rate = float(stream.rate)
            to_float = av.AudioResampler(format="fltp", layout=stream.layout, rate=stream.rate)
            blocks = [block.to_ndarray() for frame in container.decode(stream) for block in to_float.resample(frame)]
            blocks += [block.to_ndarray() for block in to_float.resample(None)]
    except ToolpointError:
        raise
    except Exception as error:  # the library raises an error of its own for every fault of a file
        raise ToolpointError(f"path: {path.name} holds no sound that can be decoded ({type(error).__name__}: "
                             f"{str(error)[:200]}); save the sound as WAV", argument="path") from None
    if not blocks:
        fail("path", f"{path.name} has an empty sound track", "must hold samples")
    return np.concatenate(blocks, axis=1).T.astype(float), rate
