"""A record to listen to: a sound file, the sound of a video, or a record of vibration in any format."""

from __future__ import annotations

from pathlib import Path

from toolpoint.io.binary import sound
from toolpoint.io.measured import record_files
from toolpoint.io.suffixes import SOUND, VIDEO, WAV
from toolpoint.vibration import Record


def read(path: str | Path) -> Record:
    """Return the Record of a sound file (WAV, FLAC, MP3, Ogg), of a video's sound, or of vibration (text, TDMS, MATLAB ..).

    Sound has no unit: its samples are shares of the full scale. Raises ToolpointError for files that cannot be read.

    >>> import tempfile
    >>> import numpy as np
    >>> from scipy.io import wavfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     wavfile.write(f"{folder}/cut.wav", 8000, np.array([0, 16384, -16384], np.int16))
    ...     read(f"{folder}/cut.wav").samples[:, 0].tolist()  # of the full scale
    [0.0, 0.5, -0.5]
    """
    kind = Path(path).suffix.lower()
    return sound.read(path) if kind in (*WAV, *SOUND, *VIDEO) else record_files.read(path)
