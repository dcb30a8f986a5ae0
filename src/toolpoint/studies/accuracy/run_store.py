"""Finished blocks of steps of a run on disk: a run that was stopped continues from them to the same numbers."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.vibration.simulation.varying import RunArrays


@dataclass(frozen=True)
class RunStore:
    """Blocks of one run: files of plain arrays in a folder, by name and first step; `identity` is the digest of its inputs."""

    folder: Path
    name: str
    identity: str

    @classmethod
    def of(cls, folder: Path, name: str, *what: object) -> RunStore:
        """Return the store of a run of all this: descriptions, path, setup; another run finds nothing of it."""
        folder.mkdir(parents=True, exist_ok=True)
        digest = hashlib.sha256()
        for part in what:
            _digest(part, digest)
        return cls(folder, name, digest.hexdigest()[:16])

    def _path(self, first_step: int) -> Path:
        return self.folder / f"{self.name}-{self.identity}-{first_step:010d}.npz"

    def load(self, first_step: int, carried: RunArrays) -> tuple[FloatArray, FloatArray] | None:
        """Return motion and base of the block from a step; None where it is not there.

        The state after the block goes into `carried`. Raises ToolpointError for a file that cannot be read.
        """
        path = self._path(first_step)
        if not path.exists():
            return None
        try:
            # No pickles: a file from elsewhere must not run code.
            with np.load(path, allow_pickle=False) as data:
                arrays = {name: data[name] for name in ("state", "delayed", "totals", "out", "base")}
            for name in ("state", "delayed", "totals"):
                getattr(carried, name)[...] = arrays[name]
        except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
            raise ToolpointError(f"folder: {path} cannot be read ({error}); delete this file, and its steps are run again"
                                 ) from None
        return arrays["out"], arrays["base"]

    def save(self, first_step: int, carried: RunArrays, *, out: FloatArray, base: FloatArray) -> None:
        """Keep a finished block: the file appears whole or not at all."""
        # Written beside and renamed: a run that is stopped while it writes leaves no half block.
        handle, draft = tempfile.mkstemp(dir=self.folder, prefix=".run-", suffix=".tmp")
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez(file, state=carried.state, delayed=carried.delayed, totals=carried.totals, out=out, base=base)
            Path(draft).replace(self._path(first_step))
        except BaseException:
            Path(draft).unlink(missing_ok=True)
            raise


def _digest(part: object, digest: hashlib._Hash) -> None:
    """Feed plain data, descriptions and arrays to a digest, every number with all its digits."""
    # Types are part of the digest: 1 and 1.0, or two classes with the same fields, are not the same input.
    digest.update(type(part).__name__.encode())
    if isinstance(part, np.ndarray):
        digest.update(repr(part.shape).encode() + np.ascontiguousarray(part).tobytes())
    elif is_dataclass(part) and not isinstance(part, type):
        for entry in fields(part):
            digest.update(entry.name.encode())
            _digest(getattr(part, entry.name), digest)
    elif isinstance(part, Mapping):
        for key, value in part.items():
            digest.update(str(key).encode())
            _digest(value, digest)
    elif isinstance(part, (tuple, list)):
        for value in part:
            _digest(value, digest)
    else:
        digest.update(repr(part).encode())
