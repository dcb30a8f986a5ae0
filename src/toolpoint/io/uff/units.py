"""Set 164 of universal files: the units of a file, and what was read past."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.io.uff.functions import FunctionHeader
from toolpoint.io.uff.sets import UniversalFile
from toolpoint.vibration import Dof

GRAVITY = 9.80665


@dataclass(frozen=True)
class Units:
    """Factors of set 164: a value in SI is the file's value over its factor."""

    length: float = 1.0
    force: float = 1.0
    stated: bool = False


def units(file: UniversalFile) -> Units:
    """Return the units of a file; SI, and a repair noted, where it states none."""
    for dataset in file.sets:
        if dataset.number == 164:
            words = file.text(dataset).upper().replace("D", "E").splitlines()
            words = " ".join(words[1:]).split()
            try:
                length, force = float(words[0]), float(words[1])
            except (IndexError, ValueError):
                raise ToolpointError(f"{file.path}: the units set 164 holds no factors of length and force") from None
            if length <= 0 or force <= 0:
                raise ToolpointError(f"{file.path}: the units set 164 has factors {length:g} and {force:g}; must be "
                                     "above zero")
            return Units(length, force, True)
    file.repaired("no units set 164: SI units are assumed")
    return Units()


def gravity(file: UniversalFile, head: FunctionHeader) -> float:
    """Return the factor to m/s^2 of a function whose values are in g, else 1."""
    if head.numerator_unit.strip().lower() in ("g", "g's", "gs"):
        file.repaired("acceleration in g converted to m/s^2")
        return GRAVITY
    return 1.0


def report(file: UniversalFile) -> None:
    """Warn of everything that was read past in a file."""
    if file.repairs:
        warnings.warn(f"{file.path}: {'; '.join(file.repairs)}", ToolpointWarning, stacklevel=3)


def second_channel(file: UniversalFile, dof: Dof, count: int) -> Dof:
    """Return the name of the second, third .. channel at one Dof (point 3 becomes 3_2), and note that it was renamed."""
    name = Dof(f"{dof.point}_{count}", dof.direction, dof.vector)
    file.repaired(f"two channels of {dof}: number {count} is named {name}; check the labels of the test")
    return name
