"""Sound files (WAV): samples as shares of the full scale, one channel or several; read only."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.text.columns import Columns

FULL_SCALE = "full scale"


@door("WAV file")
def read_columns(path: str | Path) -> Columns:
    """Return the channels ``channel 1`` .. of a file, integers over their largest value, so within -1 .. 1."""
    from scipy.io import wavfile

    path = Path(path)
    if not path.is_file():
        raise ToolpointError(f"{path}: no such file; check the name and the folder")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # a chunk that is cut off is a warning there
            rate, samples = wavfile.read(path)
    except (ValueError, wavfile.WavFileWarning) as error:
        raise ToolpointError(f"{path}: not a whole WAV file ({error}); save it again, uncompressed") from None
    table = np.atleast_2d(np.asarray(samples).T).T
    if table.dtype == np.uint8:
        table = (table.astype(float) - 128) / 128
    elif table.dtype.kind == "i":
        table = table / float(np.iinfo(table.dtype).max + 1)
    names = tuple(f"channel {k + 1}" for k in range(table.shape[1]))
    return Columns(names, (FULL_SCALE,) * len(names), table.astype(float), float(rate))
