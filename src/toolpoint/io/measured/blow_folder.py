"""Folder of a live test: every blow in a file of its own, written so that nothing loses it, beside the test file of them all.

A blow is written to a draft, brought to the disk, and renamed: a name that is there is whole. The test file names the blows by
a pattern, so it is written once. What has to be left out for a reason that the samples do not show lies in ``set_aside``, with
the reason beside it.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.acquisition.blow_capture import CapturedBlow
from toolpoint.io.binary import numpy_arrays
from toolpoint.io.measured.live_input import LiveInput
from toolpoint.io.yaml.testing import test_file
from toolpoint.signals.test_description import HammerTestDescription, RecordsDescription

TEST_FILE, BLOW_PATTERN, DRAFT_ENDING, ASIDE_FOLDER = "test.yaml", "blow_*.npz", ".part", "set_aside"


class BlowFolder:
    """Folder in which the blows of one test are kept.

    Parameters
    ----------
    folder : path
        Made where it is not there; the blows of an earlier call stay, and the test goes on with them.
    live : LiveInput
        Its channels must be those of the earlier call.
    duration : float, optional
        Length of a block, s, for the test file.

    Raises
    ------
    ToolpointError
        For a folder that cannot be written, or that holds a test of other channels, block or rate.

    >>> import tempfile
    """

    def __init__(self, folder: str | Path, live: LiveInput, duration: float | None = None) -> None:
        self.folder = Path(folder)
        self._names = [f"channel {k + 1}" for k in range(len(live.inputs.channels))]
        self._rate = live.device.rate
        # The name is what a page of the test begins with: what the input falsifies must not be left behind.
        title = "; ".join(["Live tap test", *(f"{doubt.what}: {doubt.why}" for doubt in live.device.doubts)])
        description = HammerTestDescription(title, (RecordsDescription((BLOW_PATTERN,)),), live.described,
                                            block=duration)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            for draft in self.folder.glob("*" + DRAFT_ENDING):  # of a call that was killed while it wrote
                draft.unlink()
            self._begin(description)
        except OSError as error:
            raise ToolpointError(f"{self.folder}: cannot be written ({error.strerror or error}); choose another "
                                 "folder") from None
        self.kept = tuple((path.name, self._read(path)) for path in sorted(self.folder.glob(BLOW_PATTERN)))

    @property
    def test_file(self) -> Path:
        """The test file, for `frf` and `tap`."""
        return self.folder / TEST_FILE

    @property
    def decisions(self) -> dict[str, bool]:
        """Decisions of a person about blows, as they stand in the test file."""
        return {name: word == "accepted" for name, word in test_file.read(self.test_file).hits.items()}

    def keep(self, blow: CapturedBlow) -> str:
        """Keep a blow under the next number; it is on the disk when this returns."""
        path = self.folder / f"blow_{self._next_number():04d}.npz"
        self._write(path, lambda file: np.savez(file, samples=blow.volts, fs=blow.rate, channels=np.array(self._names)))
        return path.name

    def set_aside(self, name: str, reason: str) -> None:
        """Move a blow out of those that the test file names, with the reason beside it."""
        target = self.folder / ASIDE_FOLDER
        target.mkdir(exist_ok=True)
        (target / name).with_suffix(".txt").write_text(reason + "\n", encoding="utf-8")
        os.replace(self.folder / name, target / name)

    def _next_number(self) -> int:
        paths = [*self.folder.glob(BLOW_PATTERN), *(self.folder / ASIDE_FOLDER).glob(BLOW_PATTERN)]
        return 1 + max((int(digits) for path in paths if (digits := path.stem.removeprefix("blow_")).isdigit()), default=0)

    def _begin(self, description: HammerTestDescription) -> None:
        """Write the test file, or compare with the one that is there."""
        if not self.test_file.exists():
            text = test_file.text_of(description)
            self._write(self.test_file, lambda file: file.write(text.encode()))
            return
        earlier = test_file.read(self.test_file)
        if earlier.channels != description.channels or earlier.block != description.block:
            raise ToolpointError(f"{self.folder}: holds a test of other channels or another block ({self.test_file}); choose "
                                 "another folder, or describe the channels as there")

    def _read(self, path: Path) -> FloatArray:
        columns = numpy_arrays.read_columns(path)
        if columns.sample_rate is None or abs(columns.sample_rate / self._rate - 1) > 1e-6:
            raise ToolpointError(f"{path}: {columns.sample_rate} samples a second beside {self._rate:g} of the device; choose "
                                 "another folder")
        return columns.samples

    def _write(self, path: Path, write: Callable[[BinaryIO], object]) -> None:
        """Write a file that is whole, and on the disk, when this returns."""
        draft = path.with_name(path.name + DRAFT_ENDING)
        try:
            with draft.open("wb") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(draft, path)
            _sync_folder(path.parent)
        except OSError as error:
            draft.unlink(missing_ok=True)
            raise ToolpointError(f"{path}: not written ({error.strerror or error})") from None


def _sync_folder(folder: Path) -> None:
    """Bring the names of a folder to the disk, where the system has that (Windows has not)."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)

