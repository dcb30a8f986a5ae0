"""Set 164 of universal files: the units of a file, and what was read past."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.io.quantities.sensitivities import GRAVITY_UNIT, QUANTITY_BY_UNIT, motion_over_force
from toolpoint.io.uff.functions import KINDS, FunctionHeader
from toolpoint.io.uff.sets import UniversalFile
from toolpoint.vibration import Dof


@dataclass(frozen=True)
class Units:
    """Factors of set 164: a value in SI is the file's value over its factor.

    >>> millimetres = Units(length=1000.0, force=1.0, stated=True)
    >>> 250.0 / millimetres.length  # a coordinate of 250 in the file, m
    0.25
    """

    length: float = 1.0
    force: float = 1.0
    stated: bool = False


def units(file: UniversalFile) -> Units:
    """Return the units of a file; SI, and a repair noted, where it states none.

    >>> import tempfile
    >>> from pathlib import Path
    >>> from toolpoint.io import uff
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "points.uff")
    ...     uff.write(path, uff.MeasuredGeometry((1, 2), [[0, 0, 0], [1, 0, 0]]))
    ...     units(uff.UniversalFile(path)).length  # written in SI
    1.0
    """
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
    file.repaired("no units set 164: unit labels are followed, else SI is assumed")
    return Units()


def factor_to_si(file: UniversalFile, head: FunctionHeader, scale: Units, *, is_response: bool) -> float:
    """Return SI units in one unit of a function's values, by the units set or, where there is none, by the unit labels; of a
    response (motion over force, whatever it states) or of the time history of one channel.

    Beside a units set only g is taken from a label (it is no unit of length over time); a label that contradicts the set, and
    one that is not known where there is no set, are noted.
    """
    numerator, denominator = (label.strip() for label in (head.numerator_unit, head.denominator_unit))
    motion, force = _labelled(numerator), _labelled(denominator)
    is_force = KINDS.get(head.numerator) == "force"
    if scale.stated:
        of_set = scale.force / scale.length if is_response else 1 / (scale.force if is_force else scale.length)
        if numerator.lower() in ("g", "g's", "gs"):
            file.repaired("acceleration in g converted to m/s^2")
            return of_set * GRAVITY_UNIT
        if not is_force and motion not in (None, 1.0) and abs(motion * scale.length - 1) > 1e-3:
            file.repaired(f"unit label {numerator!r} beside a units set of {scale.length:g} units in a metre: the set is "
                          "followed")
        return of_set
    unknown = [label for label, factor in ((numerator, motion), (denominator, force)) if factor is None]
    if unknown:
        file.repaired(f"unit label {unknown[0]!r} is not known: SI is assumed")
        return 1.0
    result = (motion or 1.0) / (force or 1.0)
    if result != 1.0:
        over = "" if denominator.upper() in ("", "NONE") else f"/{denominator}"
        file.repaired(f"values in {numerator}{over} by their unit labels, converted to SI")
    return result


def _labelled(label: str) -> float | None:
    """Return SI units in a unit label: 1 where it says nothing, None where it is not known."""
    lowered = label.lower()
    if lowered in ("", "none", "unknown", "eu"):
        return 1.0
    if lowered in QUANTITY_BY_UNIT:
        return QUANTITY_BY_UNIT[lowered][1]
    try:
        return motion_over_force(label)[0]  # the whole unit of a response in the label of its numerator
    except ValueError:
        return None


def report(file: UniversalFile) -> None:
    """Warn of everything that was read past in a file."""
    if file.repairs:
        warnings.warn(f"{file.path}: {'; '.join(file.repairs)}", ToolpointWarning, stacklevel=3)


def second_channel(file: UniversalFile, dof: Dof, count: int) -> Dof:
    """Return the name of the second, third .. channel at one Dof (point 3 becomes 3_2), and note that it was renamed."""
    name = Dof(f"{dof.point}_{count}", dof.direction, dof.vector)
    file.repaired(f"two channels of {dof}: number {count} is named {name}; check the labels of the test")
    return name
