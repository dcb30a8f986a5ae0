"""Frequency responses in text: frequency, then real and imaginary part, magnitude and phase, or complex numbers; read, write.

What the columns are stands in the line of names before the numbers (`frf_header`); three columns without one are Hz, real and
imaginary part.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, ToolpointError
from toolpoint.io.decoding import read_text
from toolpoint.io.door import door
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.io.text.frf_header import FrfLayout, HeaderError, read_layout
from toolpoint.vibration import Dof, Frf

EXPECTED_RESPONSES = "expected text with columns Hz, real, imaginary"
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eEdD][-+]?\d+)?"
# Complex numbers as MATLAB, Python and spreadsheets print them: 1+2i, (1+2j), 1 + 2*i; D as Fortran's exponent.
_COMPLEX = re.compile(rf"\(?\s*({_NUMBER})\s*([-+]\s*(?:\d+(?:\.\d*)?|\.\d+)(?:[eEdD][-+]?\d+)?)\s*\*?\s*[ij]\s*\)?")
_REAL_NUMBER = re.compile(rf"{_NUMBER}|[-+]?nan|[-+]?inf(?:inity)?", re.IGNORECASE)
_MAX_HEADING_LINES = 100  # lines before the numbers that are looked at
_COUNTS = {2: "two", 3: "three", 4: "four", 5: "five"}
_DECIMAL_COMMA = re.compile(r"^\s*[-+]?\d+,\d+(?:[eE][-+]?\d+)?[\s;]")
_MAX_PHASE_DEGREES = 360.5  # degrees: a turn, and rounding


@dataclass(frozen=True, eq=False)
class TabledResponses:
    """Responses of a text file: lines (Hz), values (n_lines, n_responses), what the header states of them, and notes."""

    frequency: FloatArray
    values: ComplexArray
    quantity: str | None
    labels: tuple[tuple[Dof, Dof] | None, ...]
    notes: tuple[str, ...]


@door("table of numbers")
def read(path: str | Path, output: Dof | str = "1:+x", input: Dof | str | None = None, *, quantity: str | None = None) -> Frf:
    """Return one response from a text file; see `read_table` for what it may hold.

    Parameters
    ----------
    path : path
    output, input : labels
        Where it was measured and struck; the file's name does not reach here. The output where `input` is left out.
    quantity : str, optional
        ``receptance`` (m/N), ``mobility`` or ``accelerance``; as the file states, receptance where it does not.

    Raises
    ------
    FileFaults
        With every faulty line, or names of columns that cannot be taken.
    ToolpointError
        For several responses, and a quantity that is not the one that the file states.
    """
    table = read_table(path)
    if table.values.shape[1] != 1:
        raise ToolpointError(f"{path}: {table.values.shape[1]} responses; must be one here")
    driven = output if input is None else input
    label = (lambda d: d if isinstance(d, Dof) else Dof.parse(d))
    return Frf(table.frequency, table.values[:, :, None], (label(output),), (label(driven),),
               _quantity(Path(path), table, quantity), notes=table.notes)


def read_several(path: Path, quantity: str | None = None) -> Frf:
    """Return the responses of a text file of more than one: labelled by its names of columns (``real 2:+x / 1:+z``), else the
    outputs 1, 2 .. along +x, all struck at the first, with a note."""
    table = read_table(path)
    count = table.values.shape[1]
    notes = table.notes
    pairs = [pair for pair in table.labels if pair is not None]
    if len(pairs) != count:
        pairs = [(Dof(k + 1, "+x"), Dof(1, "+x")) for k in range(count)]
        notes += (f"{path.name}: the columns name no points: its {count} responses are taken as points 1, 2 .. along +x, all "
                  "struck at the first",)
    outputs, inputs = tuple(dict.fromkeys(pair[0] for pair in pairs)), tuple(dict.fromkeys(pair[1] for pair in pairs))
    if len(outputs) * len(inputs) != count or len(set(pairs)) != count:
        raise ToolpointError(f"{path}: {count} responses of {len(outputs)} outputs and {len(inputs)} inputs; must be one for "
                             "each output and input, each once")
    values = np.empty((table.frequency.size, len(outputs), len(inputs)), complex)
    for k, (output, driven) in enumerate(pairs):
        values[:, outputs.index(output), inputs.index(driven)] = table.values[:, k]
    return Frf(table.frequency, values, outputs, inputs, _quantity(path, table, quantity), notes=notes)


def states_quantity(path: Path) -> bool:
    """Return whether the lines before the numbers, or the units of columns, say which quantity the responses are."""
    return read_table(path).quantity is not None


def count_responses(path: Path) -> int:
    """Return how many responses a text file holds; one where it cannot be read (the reader has the words for why)."""
    try:
        return int(read_table(path).values.shape[1])
    except ToolpointError:
        return 1


def names_points(path: Path) -> bool:
    """Return whether the names of a text file's columns label its responses; no where it cannot be read."""
    try:
        return None not in read_table(path).labels
    except ToolpointError:
        return False


def write(frf: Frf, path: str | Path) -> None:
    """Write one response (one output, one input, one pose) as three columns that read back to the same numbers."""
    if frf.values.ndim != 3 or frf.values.shape[1:] != (1, 1):
        raise ToolpointError(f"frf: {frf!r}; a text file holds one response; take frf.selected([output], [input])")
    values = frf.values[:, 0, 0]
    header = f"# {frf.quantity} {frf.unit}, output {frf.outputs[0]}, input {frf.inputs[0]}\n# Hz\treal\timaginary\n"
    lines = (f"{f!r}\t{v.real!r}\t{v.imag!r}\n"
             for f, v in zip(frf.frequency.tolist(), values.tolist(), strict=True))
    Path(path).write_text(header + "".join(lines), encoding="utf-8")


@door("table of numbers")
def read_table(path: str | Path) -> TabledResponses:
    """Return the responses of a text file in SI.

    Separators may be blanks, tabs, commas or semicolons; decimal commas are read where semicolons or tabs separate. Raises
    FileFaults with every faulty line: no numbers, another count of them, not finite, a frequency that does not increase.
    """
    path = Path(path)
    try:
        state = path.stat()
    except OSError:
        return _table(path, 0, 0)  # which tells why it cannot be read
    return _table(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=256)  # a file is asked what it holds before it is read
def _table(path: Path, changed: int, size: int) -> TabledResponses:
    text = read_text(path, EXPECTED_RESPONSES)
    lines = text.splitlines()
    separator = _separator(lines)
    head, rows, numbers, faults = _parsed(lines, separator)
    if not rows:
        raise FileFaults(str(path), text, faults[:5] or [Fault(1, 1, "", f"no line with three numbers; {EXPECTED_RESPONSES}")])
    table = np.array(rows)
    faults += _value_faults(table, numbers)
    if faults:
        raise FileFaults(str(path), text, faults[:50])
    is_complex = bool(np.iscomplexobj(table))
    cells = [_cells(line.strip().lstrip("#%! "), separator, is_head=True) for line in head]
    try:
        layout = read_layout(cells, "\n".join(head), count=table.shape[1], is_complex=is_complex)
        values, notes = _responses(table, layout)
    except HeaderError as error:
        raise FileFaults(str(path), text, [Fault(max(numbers[0] - 1, 1), 1, "", str(error))]) from None
    labels = tuple(column.labels for column in layout.columns if column.part not in ("imaginary", "phase", "coherence"))
    return TabledResponses(table[:, 0].real * layout.frequency, values, layout.quantity, labels,
                    tuple(f"{path.name}: {note}" for note in (*layout.notes, *notes)))


def _quantity(path: Path, table: TabledResponses, quantity: str | None) -> str:
    if None not in (quantity, table.quantity) and quantity != table.quantity:
        raise ToolpointError(f"`quantity` {quantity}: {path.name} says that it holds {table.quantity}; leave it out")
    return quantity or table.quantity or "receptance"


def _separator(lines: Sequence[str]) -> str | None:
    """Return what separates the numbers of the last line of numbers: semicolon, tab, comma, or blanks (None)."""
    body = next((line for line in reversed(lines) if re.match(r"^\s*\"?[-+]?[\d.]", line)), "").strip()
    marks = (";", "\t") if _DECIMAL_COMMA.match(body) else (";", "\t", ",")
    return next((mark for mark in marks if mark in body.rstrip(";,")), None)


def _cells(line: str, separator: str | None, is_head: bool = False) -> list[str]:
    if separator is None and is_head:
        return re.findall(r"\S+(?:\s*[\[(][^\])]*[\])])?", line)
    if separator is None:
        return line.replace('"', "").split()
    return [cell.strip().strip('"') for cell in line.strip().rstrip(separator).split(separator)]


def _parsed(lines: Sequence[str], separator: str | None) -> tuple[list[str], list[list[complex]], list[int], list[Fault]]:
    """Return the lines before the numbers, the numbers with those of their lines, and faulty lines behind the first.

    A table has the commonest count of numbers in a line: counts and rates that a program writes above it are no table.
    """
    comma = separator in (";", "\t")
    remarks = [not line.strip() or line.lstrip()[:1] in "#%!" for line in lines]
    parsed = [None if remark else _numbers(_cells(line.strip(), separator), comma)
              for line, remark in zip(lines, remarks, strict=True)]
    counts = Counter(len(row) for row in parsed if row is not None and len(row) > 1)
    width = max(counts, key=lambda count: (counts[count], count), default=0)
    head, rows, numbers, faults = list[str](), list[list[complex]](), list[int](), list[Fault]()
    for number, (line, row, is_remark) in enumerate(zip(lines, parsed, remarks, strict=True), start=1):
        if row is not None and len(row) == width > 1:
            rows.append(row)
            numbers.append(number)
        elif separator != "," and not is_remark and _DECIMAL_COMMA.match(line):
            faults.append(Fault(number, 1, "", "decimal comma; write decimal points"))
        elif rows and not is_remark:
            words = f"{line.strip()[:60]!r} is not {_COUNTS.get(width, str(width))} numbers as in the other lines"
            faults.append(Fault(number, 1, "", words))
        elif line.strip() and not rows:
            head = [*head, line][-_MAX_HEADING_LINES:]
    return head, rows, numbers, faults


def _numbers(cells: Sequence[str], comma: bool) -> list[complex] | None:
    """Return the numbers of cells, None where one is none."""
    result: list[complex] = []
    for cell in cells:
        text = cell.replace(",", ".") if comma else cell
        if _REAL_NUMBER.fullmatch(text):
            result.append(float(text if "inf" in text.lower() else text.lower().replace("d", "e")))
        elif match := _COMPLEX.fullmatch(text):
            real, imaginary = (float(part.replace(" ", "").lower().replace("d", "e")) for part in match.groups())
            result.append(complex(real, imaginary))
        else:
            return None
    return result


MAX_EXCHANGED_SHARE = 0.1  # of the lines may go back before the first column is no frequency at all
MIN_UNNAMED_LINES, MAX_TIME_STEP = 500, 1e-3  # steps; s: no response has lines of a millihertz, a record of hits has samples
_NAMED_RECORD = ("a record of blows must name its columns in a line before the numbers, time first, for example: "
                 "time [s],force [N],acceleration [m/s^2]")


def _value_faults(table: Array, numbers: list[int]) -> list[Fault]:
    faults = [Fault(numbers[i], 1, "", "a value that is not finite; remove the line or measure again")
              for i in np.flatnonzero(~np.isfinite(table).all(axis=1)).tolist()]
    lines = table[:, 0].real
    not_increasing = np.flatnonzero(np.diff(lines) <= 0) + 1
    if len(lines) >= MIN_UNNAMED_LINES and not_increasing.size > MAX_EXCHANGED_SHARE * len(lines):  # no fault of single lines
        return [Fault(numbers[0], 1, "", f"the first column does not increase ({not_increasing.size} of {len(lines)} lines): "
                      f"it is no frequency; {_NAMED_RECORD}")]
    faults += [Fault(numbers[i], 1, "", f"frequency {lines[i]:g} Hz follows {lines[i - 1]:g} Hz; must increase")
               for i in not_increasing.tolist()]
    if np.isfinite(lines[0]) and lines[0] < 0:
        faults.append(Fault(numbers[0], 1, "", f"frequency {lines[0]:g} Hz; must not be negative"))
    return faults


def _responses(table: Array, layout: FrfLayout) -> tuple[ComplexArray, list[str]]:
    """Return the responses (n_lines, n_responses) in SI, and what was assumed of phases and decibels."""
    _check_unnamed(table, layout)
    kept = [(column, table[:, k + 1]) for k, column in enumerate(layout.columns) if column.part != "coherence"]
    responses, notes, k = list[Array](), list[str](), 0
    while k < len(kept):
        column, values = kept[k]
        if column.part == "complex":
            responses.append(column.scale * values)
            k += 1
            continue
        other, further_values = kept[k + 1]
        if column.part == "real":
            responses.append(column.scale * values.real + 1j * (other.scale if other.has_unit else column.scale)
                             * further_values.real)
        else:
            size = values.real if column.part == "magnitude" else 10 ** (values.real / 20)
            # A phase beyond a turn cannot be in rad where it is wrapped, and unwrapped ones state their unit: so it is in
            # degrees.
            degrees = not other.has_unit and np.abs(further_values.real).max() > 2 * np.pi + 0.1
            if not other.has_unit:
                notes.append(f"the phase has no unit: taken in {'degrees' if degrees else 'rad'}")
            if column.part == "decibel" and not column.has_unit:
                notes.append("decibels name no reference: taken re 1 SI unit")
            responses.append(column.scale * size * np.exp(1j * (np.pi / 180 if degrees else other.scale) * further_values.real))
        k += 2
    return np.stack(responses, axis=1).astype(complex), list(dict.fromkeys(notes))


def _check_unnamed(table: Array, layout: FrfLayout) -> None:
    """Raise HeaderError where columns that nobody named look like magnitude and phase: as real and imaginary parts they would
    give a response that nobody measured."""
    steps = np.diff(table[:, 0].real)
    if not layout.is_named and len(steps) >= MIN_UNNAMED_LINES and steps.max() < MAX_TIME_STEP:
        raise HeaderError(f"the first column runs to {table[-1, 0].real:.4g} in {len(steps)} steps of {steps.mean():.3g}: "
                          f"these are times, no frequencies; {_NAMED_RECORD}")
    if [(c.part, c.has_unit) for c in layout.columns] != [("real", False), ("imaginary", False)] or len(table) < 8:
        return
    size, turn = table[:, 1].real, np.abs(table[:, 2].real)
    if layout.is_named or (size
                           < 0).any() or not 1.5 < turn.max() <= _MAX_PHASE_DEGREES or np.median(turn) < 20 * np.median(size):
        return
    raise HeaderError("the second column is never negative and the third stays within a turn: magnitude and phase? Name "
                      "the columns in a line before the numbers: Hz,magnitude,phase [deg], or else Hz,real,imaginary")
