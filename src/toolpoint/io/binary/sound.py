"""Sound files: WAV by SciPy, FLAC, MP3 and Ogg by soundfile (extra `sound`), the sound track of a video by PyAV."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.binary import wav
from toolpoint.io.door import door
from toolpoint.io.suffixes import SOUND, VIDEO, WAV
from toolpoint.vibration import Dof, Record

UNIT = "full scale"  # a microphone without calibration has no pressure
MAX_SECONDS = 600.0  # of a record: an hour of sound is no cut
# Bytes with which files begin, and the ending that such a file should have.
_BEGINNINGS = {b"fLaC": ".flac", b"OggS": ".ogg", b"ID3": ".mp3", b"RIFF": ".wav", b"RF64": ".wav"}


@door("sound file")
def read(path: str | Path) -> Record:
    """Return the sound of a file as a Record of shares of the full scale, channels ``sound 1:+x`` ..

    Raises
    ------
    ToolpointError
        For a file that is missing, empty, longer than ten minutes, of another format than its name says, or whose reader is
        not installed.
    """
    path = Path(path)
    if not path.is_file():
        raise ToolpointError(f"{path}: no such file; check the name and the folder")
    _check_beginning(path)
    samples, rate = _decode(path)
    if samples.shape[0] == 0:
        raise ToolpointError(f"{path}: holds no samples; record again")
    if samples.shape[0] > MAX_SECONDS * rate:
        raise ToolpointError(f"{path}: {samples.shape[0] / rate:.0f} s of sound; must be at most {MAX_SECONDS:.0f} s; cut out "
                             "the part with the cut")
    if not np.isfinite(samples).all():
        raise ToolpointError(f"{path}: holds samples that are not finite; it is damaged: save it again")
    labels = tuple(Dof(f"sound-{k + 1}", "+x") for k in range(samples.shape[1]))
    return Record(samples, rate, labels, ("sound",) * len(labels), (UNIT,) * len(labels), name=path.name)


def _decode(path: Path) -> tuple[FloatArray, float]:
    kind = path.suffix.lower()
    if kind in WAV:
        columns = wav.read_columns(path)
        return columns.samples, float(columns.sample_rate or 0.0)
    if kind in VIDEO:
        from toolpoint.vision.reading.sound_track import read_sound_track

        return read_sound_track(path)
    if kind in SOUND:
        samples, rate = _library().read(str(path), dtype="float64", always_2d=True)
        return samples, float(rate)
    raise ToolpointError(f"{path}: ending {kind or 'missing'!r}; sound is read from {', '.join((*WAV, *SOUND, *VIDEO))}; "
                         "convert it to WAV")


def _check_beginning(path: Path) -> None:
    """Refuse a file whose first bytes are those of another format than its name says."""
    with path.open("rb") as file:
        head = file.read(12)
    if not head:
        raise ToolpointError(f"{path}: is empty; record again")
    is_of = next((ending for begin, ending in _BEGINNINGS.items() if head.startswith(begin)), None)
    if head[4:8] == b"ftyp":
        is_of = ".mp4"
    kind = path.suffix.lower()
    same_format = {".oga": ".ogg", ".wave": ".wav", ".m4a": ".mp4", ".mov": ".mp4", ".m4v": ".mp4",
                   ".3gp": ".mp4", ".opus": ".ogg"}
    is_riff_video = is_of == ".wav" and kind == ".avi"
    if is_of is not None and same_format.get(kind, kind) != is_of and not is_riff_video:
        raise ToolpointError(f"{path}: begins like a {is_of} file and is called {kind or 'without ending'}; give it the ending "
                             f"{is_of}")


def _library() -> Any:
    try:
        import soundfile
    except ImportError:
        raise ToolpointError("sound: reading FLAC, MP3 and Ogg needs soundfile; install it with  pip install "
                             "'toolpoint[sound]'  or convert the file to WAV") from None
    return soundfile
