"""Frequency responses from files of any format: the one way in, and the rules by which files and their names give labels."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io import uff
from toolpoint.io.binary import hdf5, mat, numpy_arrays
from toolpoint.io.measured.name_patterns import dof_of, read_names
from toolpoint.io.measured.record_signs import check_responses
from toolpoint.io.suffixes import HDF5, MATLAB, UNIVERSAL
from toolpoint.io.text import frf_table
from toolpoint.signals.setups import join_bands, join_setups
from toolpoint.vibration import Dof, Frf

NAMING = "name files like 2=+x__1=+z.txt (response at 2 in x, force at 1 in z)"
# Names that end in an axis (tip_x, holder-y): they say a direction, but not of what.
_WAY = re.compile(r"(?:^|[_\-. ])([xyz]{1,2})$", re.IGNORECASE)


@dataclass(frozen=True)
class _Label:
    """Label of one response by a file's name: where it was measured, where it was struck (None: it does not say)."""

    output: Dof
    input: Dof | None
    is_plain: bool


def read(paths: str | Path | Sequence[str | Path], *, quantity: str | None = None, names: Sequence[str] | None = None,
         pattern: str | None = None, struck: str | None = None, variables: Mapping[str, str] | None = None) -> Frf:
    """Return the frequency responses of one file or several, assembled into one Frf of one pose, SI.

    How a file, or its name, gives the labels of outputs and inputs:

    - universal files (.uff, .unv), toolpoint's HDF5 (.h5) and NumPy archives (.npz; keys in `numpy_arrays`) hold them;
    - MATLAB files (.mat) may hold them in variables ``outputs`` and ``inputs``; else they are points 1, 2 .. along +x;
    - text whose line of names labels several responses (``real 2:+x / 1:+z``) holds them;
    - other text and .npy tables (Hz, real, imaginary) hold one response each, and the file's name says which:
      ``tip=+x__tip=+y.txt`` is the response at tip in x to a force at tip in y, ``2__1.txt`` that of point 2 to a force
      at point 1, both along x; ``tip=+y.txt`` alone is a driving point;
    - plain names (``tip.txt holder.txt``) are one output each along +x, all struck at the first plain file's point along +x,
      which a note says. Names that end in different axes (``x.txt y.txt``) are refused: they could mean either.

    Parameters
    ----------
    paths : path or sequence of paths
    quantity : str, optional
        ``receptance``, ``mobility`` or ``accelerance``, for files that do not say; where left out they are read as
        receptance, MATLAB files as accelerance, and a note says so.
    names : sequence of str, optional
        What to read in place of the names of the text files, one for each of them in their order: ``tip=+x__tip=+y``.
    pattern : str, optional
        How the names of text files say it: ``Point_{output}_*``, ``P{input}_at{output}``; see `name_patterns`.
    struck : label, optional
        Where text files were struck that name only an output (or measured, that name only an input).
    variables : mapping, optional
        Which variables of MATLAB and NumPy files are ``frequency`` and ``values``.

    Files over different bands of the same responses are joined along their lines, where they do not overlap.

    Raises
    ------
    ToolpointError
        For a file that holds no responses, names that could mean several things, lines or quantities that differ, a
        response that is missing, a stated quantity that is not the one given.

    >>> import tempfile
    >>> import numpy as np
    >>> from toolpoint.io import write_frf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "tip.csv")
    ...     write_frf(Frf([10.0, 20.0, 30.0], np.full((3, 1, 1), 1e-8 + 0j), ["tip:+x"], ["tip:+x"]), file)
    ...     read(file).frequency.tolist()
    [10.0, 20.0, 30.0]
    """
    files = [Path(paths)] if isinstance(paths, (str, Path)) else [Path(path) for path in paths]
    if not files:
        raise ToolpointError("paths: no file with responses; must be at least one")
    if pattern is not None and names is not None:
        raise ToolpointError("`name`, `names`: both given; must be one of them")
    if struck is not None and pattern is None:
        raise ToolpointError("`struck`: given without `name`, the pattern by which names of files say the other side")
    labels = _labels(files, names) if pattern is None else _labels_by_pattern(files, pattern, struck)
    parts = [_read_part(file, quantity, labels.get(k), variables or {}) for k, file in enumerate(files)]
    for file, part in zip(files, parts, strict=True):
        if part.values.ndim > 3:
            raise ToolpointError(f"{file}: responses of {part.values.shape[0]} poses; must be one pose")
    frf = parts[0] if len(parts) == 1 else _assembled(files, parts, labels)
    if pattern is not None and struck is None:
        frf = _struck_note(frf, labels)
    driving_points = [label.output for label in labels.values() if label.is_plain]
    # A guess that is usual and may be wrong: it is said first, as all that follows rests on it.
    if len(driving_points) > 1:
        struck_point = next((label.input for label in labels.values() if label.is_plain), None)
        frf = frf.noted(f"the names of the files do not say where they were struck: {', '.join(map(str, driving_points))} are "
                        f"taken as struck at {struck_point}, the first one's point; else {NAMING}")
    if quantity is None and not all(states_quantity(file) for file in files):
        frf = frf.noted(f"the files do not say what they hold: read as {frf.quantity}; `quantity` for another")
    return frf


def states_quantity(path: str | Path) -> bool:
    """Return whether a file says which quantity its responses are (or refuses to be read where it does not)."""
    kind = Path(path).suffix.lower()
    if kind == ".npz":
        return numpy_arrays.states_quantity(path)
    if kind in MATLAB:
        return mat.states_quantity(path)
    return kind in (*UNIVERSAL, *HDF5) or (kind != ".npy" and frf_table.states_quantity(Path(path)))


def _labels(files: Sequence[Path], names: Sequence[str] | None) -> dict[int, _Label]:
    """Return the labels of every file of one response, by its place among the files."""
    tables = [k for k, file in enumerate(files) if _is_one_response(file) and (names is not None or not _names_points(file))]
    if names is not None and len(names) != len(tables):
        raise ToolpointError(f"names: {len(names)} names for {len(tables)} files of one response; must be one for each")
    stems = [files[k].stem for k in tables] if names is None else list(names)
    plain_stems = [stem for stem in stems if not {"=", "__"} & _marks(stem)]
    if len(plain_stems) > 1:
        _check_plain([file for file, stem in zip((files[k] for k in tables), stems, strict=True) if stem in plain_stems],
                     plain_stems)
    first = _dof(plain_stems[0]) if plain_stems else None
    return {k: _label(stem, first) for k, stem in zip(tables, stems, strict=True)}


def _is_one_response(file: Path) -> bool:
    """Return whether a file holds one response, which its name labels."""
    kind = file.suffix.lower()
    return kind == ".npy" or (kind not in _READERS and frf_table.count_responses(file) == 1)


def _names_points(file: Path) -> bool:
    """Return whether a text file labels its response itself, in the names of its columns."""
    return file.suffix.lower() not in (".npy", *_READERS) and frf_table.names_points(file)


def _labels_by_pattern(files: Sequence[Path], pattern: str, struck: str | None) -> dict[int, _Label]:
    """Return the labels of the text files by a pattern: the side that it does not name is `struck`, else the first point."""
    tables = [k for k, file in enumerate(files) if _is_one_response(file)]
    said = read_names([files[k] for k in tables], pattern)
    other = None if struck is None else dof_of(struck)
    first = next((dof for name in said for dof in (name.output, name.input) if dof is not None), Dof(1, "+x"))
    labels = {k: _Label(name.output or other or first, name.input or other or first, False)
              for k, name in zip(tables, said, strict=True)}
    labelled_files: dict[tuple[Dof, Dof | None], Path] = {}
    for k, label in labels.items():
        key = (label.output, label.input)
        if key in labelled_files and pattern.count("{") > 0 and not _other_band(labelled_files[key], files[k]):
            raise ToolpointError(f"`name` {pattern}: {labelled_files[key].name} and {files[k].name} would both be "
                                 f"{label.output} struck at {label.input}; let the pattern name what differs")
        labelled_files[key] = files[k]
    return labels


def _other_band(first: Path, second: Path) -> bool:
    """Return whether two text files hold other lines, so that they may be two bands of one response."""
    lines = [frf_table.read(path).frequency for path in (first, second)]
    return bool(lines[0][-1] < lines[1][0] or lines[1][-1] < lines[0][0])


def _struck_note(frf: Frf, labels: dict[int, _Label]) -> Frf:
    """Return the responses with a note where the pattern names one side only."""
    inputs, outputs = {label.input for label in labels.values()}, {label.output for label in labels.values()}
    if len(labels) < 2 or min(len(inputs), len(outputs)) > 1:
        return frf
    side, dof = ("struck", inputs.pop()) if len(inputs) == 1 else ("measured", outputs.pop())
    return frf.noted(f"the names of the files do not say where they were {side}: all are taken as {side} at {dof}; `struck` "
                     "for another place")


def _label(stem: str, first: Dof | None) -> _Label:
    output, _, struck = stem.partition("__")
    if struck:
        return _Label(_dof(output), _dof(struck), False)
    return _Label(_dof(stem), None, False) if "=" in stem else _Label(_dof(stem), first, True)


def _marks(stem: str) -> set[str]:
    return {mark for mark in ("=", "__") if mark in stem}


def _dof(text: str) -> Dof:
    return Dof.parse(text.replace("=", ":") if "=" in text else f"{text}:+x")


def _check_plain(files: Sequence[Path], stems: Sequence[str]) -> None:
    repeated = sorted({stem for stem in stems if stems.count(stem) > 1})
    if repeated:
        raise ToolpointError(f"{files[stems.index(repeated[0])]}: two files are named {repeated[0]}; their points could not be "
                             "told apart; rename one")
    ways = [match[1].lower() for stem in stems if (match := _WAY.search(stem))]
    if len(ways) == len(stems) and len(set(ways)) > 1:
        raise ToolpointError(f"{', '.join(file.name for file in files)}: {len(files)} files, and {files[0].name} does not say "
                             "its direction: x and y may be two points or two axes; read each axis apart, or name text files "
                             "like tip=+x__tip=+y.txt (response at tip in x, force at tip in y)")


def _read_part(path: Path, quantity: str | None, label: _Label | None, variables: Mapping[str, str]) -> Frf:
    check_responses(path)
    if label is None and variables and path.suffix.lower() in (*MATLAB, ".npz"):
        return _read_variables(path, quantity, variables)
    if label is None:
        return _READERS.get(path.suffix.lower(), frf_table.read_several)(path, quantity)
    struck = label.output if label.input is None else label.input
    if path.suffix.lower() == ".npy":
        table = numpy_arrays.read_table(path)
        return Frf(table[:, 0], (table[:, 1] + 1j * table[:, 2])[:, None, None], (label.output,), (struck,),
                   quantity or "receptance")
    return frf_table.read(path, label.output, struck, quantity=quantity)


def _read_hdf5(path: Path, quantity: str | None) -> Frf:
    frf = hdf5.read(path, Frf)
    if quantity not in (None, frf.quantity):
        raise ToolpointError(f"`quantity` {quantity}: {path.name} says that it holds {frf.quantity}; leave it out")
    return frf


def _read_mat(path: Path, quantity: str | None) -> Frf:
    frf = mat.read_frf(path, quantity=quantity)
    if mat.states_labels(path):
        return frf
    return frf.noted(f"{path.name}: this MATLAB file names no points: its {len(frf.outputs)} responses are taken as points 1, "
                     "2 .. along +x, in their order")


def _read_variables(path: Path, quantity: str | None, variables: Mapping[str, str]) -> Frf:
    unknown = set(variables) - {"frequency", "values"}
    if unknown:
        raise ToolpointError(f"`variables` {unknown.pop()}: responses have frequency and values")
    reader = mat.read_frf if path.suffix.lower() in MATLAB else numpy_arrays.read_named
    frf = reader(path, variables.get("frequency"), variables.get("values"), quantity=quantity)
    return frf.noted(f"{path.name}: its responses are taken as {len(frf.outputs)} outputs and {len(frf.inputs)} inputs in the "
                     "order of the variables, points 1, 2 .. along +x where it names none")


_READERS: dict[str, Callable[[Path, str | None], Frf]] = {
    **dict.fromkeys(UNIVERSAL, uff.read_frf), **dict.fromkeys(HDF5, _read_hdf5), **dict.fromkeys(MATLAB, _read_mat),
    ".npz": numpy_arrays.read_frf}


def _assembled(files: Sequence[Path], parts: Sequence[Frf], labels: dict[int, _Label]) -> Frf:
    try:
        return join_setups(join_bands(parts))
    except ToolpointError as fault:
        error = re.sub(r"set-up (\d+)", lambda number: files[int(number[1])].name, str(fault))
        without_input = [files[k].name for k, label in labels.items() if label.input is None or label.is_plain]
        if not without_input or "are missing" not in error:
            raise ToolpointError(error) from None
        raise ToolpointError(f"{error}\nA text file without a name of the form OUTPUT__INPUT ({without_input[0]}) is taken as "
                             f"a driving point; {NAMING}") from None
