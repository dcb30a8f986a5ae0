"""Set 58 and 58b of universal files: functions at points (frequency responses, coherences, time records)."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError
from toolpoint.io.uff_sets import UniversalFile, UniversalSet
from toolpoint.vibration.dof import Dof

TIME, RESPONSE, COHERENCE = 1, 4, 6
DIRECTIONS = {1: "+x", 2: "+y", 3: "+z", 4: "+rx", 5: "+ry", 6: "+rz"}
CODES = {name: code for code, name in DIRECTIONS.items()}
KINDS = {8: "displacement", 11: "velocity", 12: "acceleration", 13: "force", 9: "force"}
EXACT = "exact axis "
_TOUCHING = re.compile(r"(?<=\d)(?=[-+]\d*\.)")


@dataclass(frozen=True)
class FunctionHeader:
    """What the header of a function says.

    `kind` is the function type (4 frequency response, 6 coherence, 1 time), `data_type` 2, 4 real or 5, 6 complex in
    single or double precision; `numerator` and `denominator` specific data types with their unit labels.
    """

    kind: int
    response: Dof
    reference: Dof | None
    data_type: int
    count: int
    even: bool
    start: float
    step: float
    numerator: int
    denominator: int
    numerator_unit: str
    title: str

    @property
    def is_complex(self) -> bool:
        """Whether values are complex."""
        return self.data_type in (5, 6)


def header(file: UniversalFile, one: UniversalSet) -> FunctionHeader:
    """Return the header of a function set, read tolerantly; deviations are noted in the file's repairs."""
    lines = list(one.header)
    if len(lines) < 11:
        raise ToolpointError(f"{file.path}: a set 58 of {len(lines)} lines; must have 11 header lines; it is cut short")
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
    start, step = _axis(lines[4], _number(form[3]), _number(form[4]))
    reference = None if not int(dof[8] or 0) else _dof(file, int(dof[8]), int(dof[9] or 0))
    return FunctionHeader(int(dof[0]), _dof(file, int(dof[5] or 0), int(dof[6] or 0)), reference, int(form[0]),
                          int(form[1]), int(form[2]) == 1, start, step, numerator[0], denominator[0], numerator[1],
                          lines[0].strip())


def values(file: UniversalFile, one: UniversalSet, head: FunctionHeader) -> tuple[FloatArray, Array]:
    """Return abscissa (n,) and values (n,), real or complex, of a function set."""
    numbers = _binary(file, one, head) if one.binary else _text(file, one, head)
    each = (1 + head.is_complex) + (not head.even)
    if numbers.size != head.count * each:
        whole = min(numbers.size // each, head.count)
        file.repaired(f"function {head.title!r}: {numbers.size} numbers where {head.count * each} are stated")
        if whole < head.count:
            raise ToolpointError(f"{file.path}: function {head.title!r} of {head.response} holds {whole} of {head.count} "
                                 "values; it is cut short")
        numbers = numbers[:head.count * each]
    if head.even:
        abscissa = head.start + np.arange(head.count) * head.step
        return abscissa, _paired(numbers) if head.is_complex else numbers
    table = numbers.reshape(head.count, each)
    ordinate = table[:, 1] + 1j * table[:, 2] if head.is_complex else table[:, 1].copy()
    return table[:, 0].copy(), ordinate


def _paired(numbers: FloatArray) -> Array:
    return np.ascontiguousarray(numbers).view(complex)


def _binary(file: UniversalFile, one: UniversalSet, head: FunctionHeader) -> FloatArray:
    width = 8 if head.data_type in (4, 6) else 4
    raw = file.bytes(one)
    each = (1 + head.is_complex) + (not head.even)
    wanted = head.count * each * width
    if len(raw) != wanted and len(raw.rstrip(b"\r\n")) >= wanted:
        file.repaired("stray line ends behind the data of a binary set")
        raw = raw[:wanted]
    return np.frombuffer(raw[:len(raw) // width * width], dtype=f"{one.order}f{width}").astype(float)


def _text(file: UniversalFile, one: UniversalSet, head: FunctionHeader) -> FloatArray:
    lines = file.text(one).splitlines()[11:]
    body = "\n".join(lines)
    if "D" in body or "d" in body:
        file.repaired("Fortran D exponents")
        body = body.replace("D", "E").replace("d", "e")
    words = body.split()
    try:
        return np.array(words, dtype=float)
    except ValueError:
        pass
    parted = _TOUCHING.sub(" ", body).split()
    try:
        found = np.array(parted, dtype=float)
    except ValueError as error:
        raise ToolpointError(f"{file.path}: function {head.title!r} of {head.response}: {error}; the data are damaged") from None
    file.repaired("numbers that touch each other")
    return found


def _fields(line: str, widths: tuple[int, ...]) -> list[str]:
    found, at = [], 0
    for width in widths:
        found.append(line[at:at + width].strip())
        at += width
    return found


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
    return Dof(point, name if code > 0 else "-" + name[1:])


def _axis(line: str, start: float, step: float) -> tuple[float, float]:
    """Return start and step of an even axis, exactly where this package wrote them in the last identification line."""
    if line.startswith(EXACT):
        words = line[len(EXACT):].split()
        return float.fromhex(words[0]), float.fromhex(words[1])
    return start, step


def written(kind: int, response: Dof, reference: Dof | None, numerator: int, denominator: int, abscissa: FloatArray,
            data: Array, text: bool, units: tuple[str, str] = ("NONE", "NONE")) -> bytes:
    """Return one function as bytes of a set 58 (`text`) or 58b in double precision, exact to the last bit.

    Text holds 13 significant digits, as the format has no more.
    """
    step = float(abscissa[1] - abscissa[0]) if abscissa.size > 1 else 0.0
    even = bool(np.array_equal(abscissa[0] + np.arange(abscissa.size) * step, abscissa))
    is_complex = np.iscomplexobj(data)
    numbers = np.ascontiguousarray(data, complex if is_complex else float).view(float).reshape(abscissa.size, -1)
    if not even:
        numbers = np.column_stack([abscissa, numbers])
    payload = b"" if text else numbers.astype("<f8").tobytes()
    axis = f"{EXACT}{float(abscissa[0]).hex()} {step.hex()}" if even else "NONE"
    point = (lambda d: f"{0:10d}{0:4d}" if d is None else f"{d.point:10d}{code_of(d):4d}")
    spread = (abscissa[0], step) if even else (0.0, 0.0)
    is_time = kind == TIME
    head = [
        f"{'time record' if is_time else 'coherence' if kind == COHERENCE else 'frequency response'}", "NONE", "NONE",
        "NONE", axis,
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{point(response)} {'NONE':10s}{point(reference)}",
        f"{6 if is_complex else 4:10d}{abscissa.size:10d}{int(even):10d}{spread[0]:13.5E}{spread[1]:13.5E}{0.0:13.5E}",
        f"{17 if is_time else 18:10d}{0:5d}{0:5d}{0:5d} {'Time' if is_time else 'Frequency':20s} {'s' if is_time else 'Hz':20s}",
        f"{numerator:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {units[0]:20s}",
        f"{denominator:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {units[1]:20s}",
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}"]
    top = f"    -1\n    58{'' if text else f'b     1     2          11{len(payload):12d}     0     0           0           0'}\n"
    start = top + "".join(f"{line:80s}\n" for line in head)
    if text:
        return (start + _lines(numbers, even, is_complex) + "    -1\n").encode("ascii")
    return start.encode("ascii") + payload + b"\n    -1\n"


def code_of(dof: Dof) -> int:
    """Return the direction code of a Dof; the format knows only numbered points and axes."""
    if dof.vector is not None or not isinstance(dof.point, int) or dof.point < 0:
        raise ToolpointError(f"{dof}: a universal file holds numbered points and the directions +x .. -rz only; give `points`")
    return CODES["+" + dof.direction[1:]] * (-1 if dof.direction[0] == "-" else 1)


def _lines(numbers: FloatArray, even: bool, is_complex: bool) -> str:
    if even:
        flat = numbers.reshape(-1)
        full, rest = divmod(flat.size, 4)
        form = "%20.12E%20.12E%20.12E%20.12E\n" * full + ("%20.12E" * rest + "\n" if rest else "")
        return form % tuple(flat.tolist())
    form = ("%13.5E%20.12E%20.12E\n" if is_complex else "%13.5E%20.12E\n") * numbers.shape[0]
    return form % tuple(numbers.reshape(-1).tolist())
