"""Frequency responses in text: columns frequency (Hz), real, imaginary; any usual separator; read and write."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.vibration import Dof, Frf

_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eEdD][-+]?\d+)?|[-+]?nan|[-+]?inf(?:inity)?"
_LINE = re.compile(rf"^\s*({_NUMBER})(?:[\s,;]+({_NUMBER}))(?:[\s,;]+({_NUMBER}))\s*[,;]?\s*$", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"^\s*[-+]?\d+,\d+(?:[eE][-+]?\d+)?[\s;]")


@door("table of numbers")
def read(path: str | Path, output: Dof | str = "1:+x", input: Dof | str | None = None, *, quantity: str = "receptance") -> Frf:
    """Return one response from a text file of three columns: Hz, real part, imaginary part.

    Parameters
    ----------
    path : path
        Separators may be blanks, tabs, commas or semicolons; lines before the first line of numbers are a header.
    output, input : labels
        Where it was measured and struck; the file does not say. The output where `input` is left out.
    quantity : str
        ``receptance`` (m/N), ``mobility`` or ``accelerance``.

    Raises
    ------
    FileFaults
        With every faulty line: not three numbers, not finite, a frequency that does not increase, a decimal comma.
    """
    path = Path(path)
    table = _table(path, _text(path))
    driven = output if input is None else input
    label = (lambda d: d if isinstance(d, Dof) else Dof.parse(d))
    values = (table[:, 1] + 1j * table[:, 2])[:, None, None]
    return Frf(table[:, 0], values, (label(output),), (label(driven),), quantity)


def write(frf: Frf, path: str | Path) -> None:
    """Write one response (one output, one input, one pose) as three columns that read back to the same numbers."""
    if frf.values.ndim != 3 or frf.values.shape[1:] != (1, 1):
        raise ToolpointError(f"frf: {frf!r}; a text file holds one response; take frf.selected([output], [input])")
    values = frf.values[:, 0, 0]
    header = f"# {frf.quantity} {frf.unit}, output {frf.outputs[0]}, input {frf.inputs[0]}\n# Hz\treal\timaginary\n"
    lines = (f"{f!r}\t{v.real!r}\t{v.imag!r}\n"
             for f, v in zip(frf.frequency.tolist(), values.tolist(), strict=True))
    Path(path).write_text(header + "".join(lines), encoding="utf-8")


def _text(path: Path) -> str:
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    if b"\0" in raw[:4096]:
        raise ToolpointError(f"{path}: a binary file; expected text with columns Hz, real, imaginary")
    return raw.decode("utf-8-sig", errors="replace")


def _table(path: Path, text: str) -> FloatArray:
    rows: list[tuple[str, str, str]] = []
    numbers: list[int] = []
    faults: list[Fault] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip()[:1] in "#%!":
            continue
        match = _LINE.match(line)
        if match is None:
            if _DECIMAL_COMMA.match(line):
                faults.append(Fault(number, 1, "", "decimal comma; write decimal points"))
            elif rows:
                faults.append(Fault(number, 1, "", f"{line.strip()[:60]!r} is not three numbers: Hz, real, imaginary"))
            continue
        rows.append((match[1], match[2], match[3]))
        numbers.append(number)
    if not rows:
        faults = faults[:5] or [Fault(1, 1, "", "no line with three numbers; expected columns Hz, real, imaginary")]
        raise FileFaults(str(path), text, faults)
    table = np.array([[v.lower().replace("d", "e") if "inf" not in v.lower() else v for v in row] for row in rows], float)
    faults += _value_faults(table, numbers)
    if faults:
        raise FileFaults(str(path), text, faults[:50])
    return table


def _value_faults(table: FloatArray, numbers: list[int]) -> list[Fault]:
    faults = [Fault(numbers[i], 1, "", "a value that is not finite; remove the line or measure again")
              for i in np.flatnonzero(~np.isfinite(table).all(axis=1))]
    back = np.flatnonzero(np.diff(table[:, 0]) <= 0) + 1
    faults += [Fault(numbers[i], 1, "", f"frequency {table[i, 0]:g} Hz follows {table[i - 1, 0]:g} Hz; must increase")
               for i in back]
    if np.isfinite(table[0, 0]) and table[0, 0] < 0:
        faults.append(Fault(numbers[0], 1, "", f"frequency {table[0, 0]:g} Hz; must not be negative"))
    return faults
