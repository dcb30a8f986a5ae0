"""Set 58 and 58b of universal files: functions at points (frequency responses, coherences, time records)."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError
from toolpoint.io.uff.labels import NumberedLabels
from toolpoint.io.uff.numbers import regular, twenty_wide
from toolpoint.io.uff.sets import HEADER_LINES, UniversalFile, UniversalSet
from toolpoint.vibration.dof import Dof

TIME_RECORD_TYPE, RESPONSE_TYPE, COHERENCE_TYPE = 1, 4, 6
TITLES = {TIME_RECORD_TYPE: "time record", RESPONSE_TYPE: "frequency response", COHERENCE_TYPE: "coherence"}
DIRECTIONS = {1: "+x", 2: "+y", 3: "+z", 4: "+rx", 5: "+ry", 6: "+rz"}
CODES = {name: code for code, name in DIRECTIONS.items()}
KINDS = {8: "displacement", 11: "velocity", 12: "acceleration", 13: "force", 9: "force"}
EXACT_AXIS_WORDS = "exact axis "
# Rules that give an axis from two numbers and its length: start and step, start and end, start and lines per unit.
AXES: dict[str, Callable[[float, float, int], Array]] = {
    "step": lambda start, step, n: start + np.arange(n) * step,
    # Each rule forms the axis by another operation: only one of them gives the bits of the axis that was written.
    "span": lambda start, stop, n: np.linspace(start, stop, n),
    "rate": lambda start, rate, n: start + np.arange(n) / rate,
}
# Columns of thirteen leave no blank before a minus: 1.0E+00-2.0E+00 are two numbers.
_TOUCHING = re.compile(r"(?<=\d)(?=[-+]\d*\.)")
# A line of -1 alone ends a set; writers differ in its blanks and in their ends of lines.
_CLOSING_LINE = re.compile(rb"(?:^|[\r\n])[ \t]{0,8}-1[ \t]*(?=[\r\n]|$)")
# Fortran drops the letter of an exponent of three digits: 1.234-105.
_UNMARKED = re.compile(r"(\.\d*)([-+]\d{3})(?=[-+\s]|$)")


@dataclass(frozen=True)
class FunctionHeader:
    """A function's header.

    `kind` is the function type (4 frequency response, 6 coherence, 1 time), `data_type` 2, 4 real or 5, 6 complex in
    single or double precision; `numerator` and `denominator` specific data types with their unit labels.
    """

    kind: int
    response: Dof
    reference: Dof | None
    data_type: int
    count: int
    is_even: bool
    axis: str
    start: float
    step: float
    numerator: int
    denominator: int
    numerator_unit: str
    denominator_unit: str
    title: str

    @property
    def is_complex(self) -> bool:
        """Whether values are complex."""
        return self.data_type in (5, 6)


def header(file: UniversalFile, dataset: UniversalSet) -> FunctionHeader:
    """Return the header of a function set, read tolerantly; deviations are noted in the file's repairs."""
    lines = list(dataset.header)
    if len(lines) < 11:
        raise ToolpointError(f"{file.path}: a set 58 of {len(lines)} lines; must have 11 header lines; it is cut short")
    try:
        return _header(file, lines)
    except ToolpointError:
        raise
    except (ValueError, IndexError) as error:
        raise ToolpointError(f"{file.path}: the header of function {lines[0].strip()!r} (set 58): {error}; the file is "
                             "damaged") from None


def _header(file: UniversalFile, lines: list[str]) -> FunctionHeader:
    if any(len(line.rstrip()) > 80 for line in lines[:5]):
        file.repaired("identification lines longer than 80 columns")
    dof = _fields(lines[5], (5, 10, 5, 10, 11, 10, 4, 11, 10, 4))
    if not _whole(dof[0]) or not _whole(dof[5]) or not _whole(dof[6]):
        dof = _split_dof(lines[5])
        file.repaired("point numbers and directions not in their columns")
    form = _fields(lines[6], (10, 10, 10, 13, 13, 13))
    if not all(_whole(word) for word in form[:3]) or not all(_real(word) for word in form[3:5]):
        form = _TOUCHING.sub(" ", lines[6]).split()
        file.repaired("the data form record not in its columns")
    numerator, denominator = _characteristic(lines[8]), _characteristic(lines[9])
    axis, start, step = _axis(lines[4], _number(form[3]), _number(form[4]))
    reference = None if not int(dof[8] or 0) else _dof(file, int(dof[8]), int(dof[9] or 0))
    return FunctionHeader(int(dof[0]), _dof(file, int(dof[5] or 0), int(dof[6] or 0)), reference, int(form[0]),
                          int(form[1]), int(form[2]) == 1, axis, start, step, numerator[0], denominator[0],
                          numerator[1], denominator[1], lines[0].strip())


def values(file: UniversalFile, dataset: UniversalSet, head: FunctionHeader) -> tuple[FloatArray, Array]:
    """Return abscissa (n,) and values (n,), real or complex, of a function set."""
    if head.data_type not in (2, 4, 5, 6) or head.count < 1:
        raise ToolpointError(f"{file.path}: function {head.title!r} of {head.response} states data type {head.data_type} and "
                             f"{head.count} values; must be type 2, 4 (real), 5 or 6 (complex) and one value at least; "
                             "take the set out")
    numbers = _binary(file, dataset, head) if dataset.binary else _text(file, dataset, head)
    each = (1 + head.is_complex) + (not head.is_even)
    if numbers.size != head.count * each:
        complete_count = min(numbers.size // each, head.count)
        file.repaired(f"function {head.title!r}: {numbers.size} numbers where {head.count * each} are stated")
        if complete_count < head.count:
            raise ToolpointError(f"{file.path}: function {head.title!r} of {head.response} holds {complete_count} of "
                                 f"{head.count} values; it is cut short")
        numbers = numbers[:head.count * each]
    if head.is_even:
        axis = np.asarray(AXES[head.axis](head.start, head.step, head.count))
        return axis, _paired(numbers) if head.is_complex else numbers
    table = numbers.reshape(head.count, each)
    ordinate = table[:, 1] + 1j * table[:, 2] if head.is_complex else table[:, 1].copy()
    return table[:, 0].copy(), ordinate


def _paired(numbers: FloatArray) -> Array:
    return np.ascontiguousarray(numbers).view(complex)


def _binary(file: UniversalFile, dataset: UniversalSet, head: FunctionHeader) -> FloatArray:
    width = 8 if head.data_type in (4, 6) else 4
    raw = file.payload(dataset)
    each = (1 + head.is_complex) + (not head.is_even)
    size = head.count * each * width
    if len(raw) != size and len(raw.rstrip(b"\r\n")) >= size:
        file.repaired("stray line ends behind the data of a binary set")
        raw = raw[:size]
    return np.frombuffer(raw[:len(raw) // width * width], dtype=f"{dataset.order}f{width}").astype(float)


def _text(file: UniversalFile, dataset: UniversalSet, head: FunctionHeader) -> FloatArray:
    data = file.behind(dataset, HEADER_LINES)
    if b"D" in data or b"d" in data:
        file.repaired("Fortran D exponents")
    if dataset.stop == file.size and data[-1:] not in (b"\r", b"\n"):
        data = _less_a_part(data)
    numbers, further_text = regular(data)
    closing = _CLOSING_LINE.search(further_text)  # the next sets were taken for lines of this one, which is cut short
    further_text = further_text if closing is None else further_text[:closing.start()]
    return np.concatenate([numbers,
                           _any_text(file, head, further_text)]) if further_text.strip() or not numbers.size else numbers


def _less_a_part(data: bytes) -> bytes:
    """Return numbers less the last one where the end of the file has cut it: 1.5E-0 of what was 1.5E-08."""
    words = data.split()
    tail = [len(word[word.find(b"."):]) for word in (words[0], words[-1])] if words else [0, 0]
    return data[:len(data) - len(words[-1])] if tail[1] < tail[0] else data


def _any_text(file: UniversalFile, head: FunctionHeader, data: bytes) -> FloatArray:
    """Return the numbers of text in any layout."""
    if not data.strip():  # of which older and newer numpy make the number -1
        return np.empty(0)
    body = "\n".join(data.decode("latin-1").splitlines()).replace("D", "E").replace("d", "e")
    try:
        return _parsed(body)
    except (DeprecationWarning, ValueError):  # older and newer numpy's word for text that is not numbers
        pass
    marked, unmarked = _UNMARKED.subn(r"\1E\2", body)
    parted, touching = _TOUCHING.subn(" ", marked)
    try:
        numbers = np.array(parted.split(), dtype=float)
    except ValueError as error:
        raise ToolpointError(f"{file.path}: function {head.title!r} of {head.response}: {error}; the data are "
                             "damaged") from None
    if unmarked:
        file.repaired("exponents of three digits without E")
    if touching:
        file.repaired("numbers that touch each other")
    return numbers


def _parsed(body: str) -> FloatArray:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        return np.fromstring(body, sep=" ")


def _fields(line: str, widths: tuple[int, ...]) -> list[str]:
    words, start = [], 0
    for width in widths:
        words.append(line[start:start + width].strip())
        start += width
    return words


def _whole(word: str) -> bool:
    return word == "" or word.lstrip("+-").isdigit()


def _real(word: str) -> bool:
    try:
        _number(word)
    except ValueError:
        return False
    return True


def _number(word: str) -> float:
    return float(word.upper().replace("D", "E") or 0)


def _split_dof(line: str) -> list[str]:
    words = line.split()
    if len(words) < 10:
        raise ToolpointError(f"record 6 {line.strip()!r} of a set 58 has {len(words)} fields; must have 10")
    return words


def _characteristic(line: str) -> tuple[int, str]:
    word = line[:10].strip()
    if not _whole(word):
        word = line.split()[0]
    return int(word or 0), line[47:67].strip()


def _dof(file: UniversalFile, point: int, code: int) -> Dof:
    if abs(code) not in DIRECTIONS:
        if code != 0:
            raise ToolpointError(f"{file.path}: direction code {code} of point {point}; must be within -6 .. 6")
        file.repaired(f"point {point} without a direction (scalar): +x is assumed")
        code = 1
    name = DIRECTIONS[abs(code)]
    return file.labels.labelled(Dof(point, name if code > 0 else "-" + name[1:]))


def _axis(line: str, start: float, step: float) -> tuple[str, float, float]:
    """Return kind, start and step of an even axis, exact where this package wrote them in an identification line."""
    words = line[len(EXACT_AXIS_WORDS):].split() if line.startswith(EXACT_AXIS_WORDS) else []
    if len(words) == 3 and words[0] in AXES:
        return words[0], float.fromhex(words[1]), float.fromhex(words[2])
    return "step", start, step


def _even(axis: FloatArray, text: bool) -> tuple[str, float, float] | None:
    """Return the rule that gives an even axis back to the last bit; in text also one that comes near; else None."""
    start, step, n = float(axis[0]), float(axis[1] - axis[0]) if axis.size > 1 else 0.0, axis.size
    mean = float(axis[-1] - axis[0]) / (n - 1) if n > 1 else 0.0
    rules = [("step", start, step), ("step", start, mean), ("span", start, float(axis[-1]))]
    rules += [("rate", start, rate) for rate in {1 / step, 1 / mean, round(1 / mean, 9)}] if step and mean else []
    for rule in rules:
        if np.array_equal(AXES[rule[0]](rule[1], rule[2], n), axis):
            return rule
    return rules[1] if text and np.abs(AXES["step"](start, mean, n) - axis).max() <= 1e-9 * abs(mean) else None


def written(kind: int, response: Dof, reference: Dof | None, *, numerator: int, denominator: int, abscissa: FloatArray,
            data: Array, text: bool, units: tuple[str, str] = ("NONE", "NONE"),
            labels: NumberedLabels | None = None) -> bytes:
    """Return one function as bytes of a set 58 (`text`) or 58b in double precision, exact to the last bit.

    labels : numbers of Dofs that the format cannot hold; they stand in words in the second line.
    Text holds 13 significant digits, as the format has no more.
    """
    rule = _even(abscissa, text)
    is_even = rule is not None
    numbers_of_labels = labels or NumberedLabels.of([dof for dof in (response, reference) if dof is not None])
    numbered = (numbers_of_labels.numbered(response), None if reference is None else numbers_of_labels.numbered(reference))
    is_complex = np.iscomplexobj(data)
    numbers = np.ascontiguousarray(data, complex if is_complex else float).view(float).reshape(abscissa.size, -1)
    if not is_even:
        numbers = np.column_stack([abscissa, numbers])
    payload = b"" if text else numbers.astype("<f8").tobytes()
    axis = f"{EXACT_AXIS_WORDS}{rule[0]} {rule[1].hex()} {rule[2].hex()}" if rule is not None else "NONE"
    spread = (float(abscissa[0]), float(abscissa[-1] - abscissa[0]) / max(abscissa.size - 1, 1)) if is_even else (0.0, 0.0)
    form = f"{6 if is_complex else 4:10d}{abscissa.size:10d}{int(is_even):10d}"
    abscissa_kind = (17, "Time", "s") if kind == TIME_RECORD_TYPE else (18, "Frequency", "Hz")
    head = [
        TITLES[kind], "NONE" if numbered == (response, reference) else _words(response, reference), "NONE", "NONE", axis,
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{_point(numbered[0])} {'NONE':10s}{_point(numbered[1])}",
        form + f"{spread[0]:13.5E}{spread[1]:13.5E}{0.0:13.5E}",
        _described(*abscissa_kind), _described(numerator, "NONE", units[0]), _described(denominator, "NONE", units[1]),
        _described(0, "NONE", "NONE")]
    mark = "" if text else f"b{1:6d}{2:6d}{11:12d}{len(payload):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    start = f"    -1\n    58{mark}\n" + "".join(f"{line:80s}\n" for line in head)
    if text:
        return start.encode("ascii") + _lines(numbers, is_even) + b"    -1\n"
    return start.encode("ascii") + payload + b"\n    -1\n"


def _described(code: int, name: str, unit: str) -> str:
    return f"{code:10d}{0:5d}{0:5d}{0:5d} {name:20s} {unit:20s}"


def _point(dof: Dof | None) -> str:
    if dof is None:
        return f"{0:10d}{0:4d}"
    code = code_of(dof)
    return f"{dof.point:10d}{code:4d}"


def _words(response: Dof, reference: Dof | None) -> str:
    text = str(response) if reference is None else f"{response} / {reference}"
    return text.encode("ascii", "replace").decode("ascii")[:80]


def code_of(dof: Dof) -> int:
    """Return the direction code of a Dof along an axis."""
    return CODES["+" + dof.direction[1:]] * (-1 if dof.direction[0] == "-" else 1)


def _lines(numbers: FloatArray, is_even: bool) -> bytes:
    """Return numbers as lines: four in a line, or the abscissa (six digits) and what belongs to it."""
    text = twenty_wide(numbers[:, 0 if is_even else 1:].reshape(-1))
    if is_even:
        full = text.shape[0] // 4 * 4
        return _ended(text[:full].reshape(-1, 80)) + (text[full:].tobytes() + b"\n" if full < text.shape[0] else b"")
    abscissa = b"".join(b"%13.5E" % number for number in numbers[:, 0].tolist())
    first = np.frombuffer(abscissa, np.uint8).reshape(-1, 13)
    return _ended(np.concatenate([first, text.reshape(first.shape[0], -1)], axis=1))


def _ended(text: np.ndarray) -> bytes:
    lines = np.full((text.shape[0], text.shape[1] + 1), ord("\n"), np.uint8)
    lines[:, :-1] = text
    return lines.tobytes()
