"""Measured modes and responses of one or several poses, as the update command takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io import frf_files, mode_files
from toolpoint.vibration import Frf, Modes

Poses = Sequence[Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class Measurement:
    """What was measured at one pose: modes, responses or both; `pose` None is the reference pose."""

    modes: Modes | None
    frf: Frf | None
    pose: Mapping[str, float] | None

    @property
    def label(self) -> str:
        """The pose in words, empty at the reference pose."""
        return ", ".join(f"{axis} = {value:g}" for axis, value in (self.pose or {}).items())


def measurements(modes: Sequence[str | Path], frf: Sequence[str | Path], poses: Poses) -> tuple[Measurement, ...]:
    """Return the measurements of files and poses given in order.

    One pose or none: all response files are one measurement, joined by the modes where there is one file of them; more
    files of modes are repeated measurements. Several poses: one file of modes, of responses, or of each, for every pose.

    Raises ToolpointError for files that do not match the poses, and for files that hold something else.
    """
    if not modes and not frf:
        raise ToolpointError("update: neither --modes nor --frf given; needs at least one measurement")
    read = [mode_files.read(path) for path in modes]
    if len(poses) > 1:
        for name, files in (("--modes", modes), ("--frf", frf)):
            if files and len(files) != len(poses):
                raise ToolpointError(f"{name}: {len(files)} files for {len(poses)} poses; must be one for each, in "
                                     f"their order, or none ({name} a.h5 --pose X=0 {name} b.h5 --pose X=0.2)")
        responses = [frf_files.read(path) for path in frf]
        return tuple(Measurement(read[k] if read else None, responses[k] if responses else None, pose)
                     for k, pose in enumerate(poses))
    pose = poses[0] if poses else None
    joined = frf_files.read(frf) if frf else None
    if len(read) <= 1:
        return (Measurement(read[0] if read else None, joined, pose),)
    return (*(Measurement(one, None, pose) for one in read), *([] if joined is None else [Measurement(None, joined, pose)]))

