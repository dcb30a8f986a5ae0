"""Reader of matrix files: the format by suffix and content, stiffness and mass from one file or two."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array

from toolpoint._check import ToolpointError
from toolpoint.bodies.imported import ImportedMatrices
from toolpoint.io.binary import mat_variables, numpy_arrays
from toolpoint.io.door import check_regular
from toolpoint.io.matrices import abaqus_mtx, ansys_full, bulk_model, dmig, harwell_boeing, matrix_market, op4
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix
from toolpoint.io.suffixes import MATRICES
from toolpoint.machine.description.matrices import Units
from toolpoint.vibration import Dof

Reader = Callable[[Path], list[LabelledMatrix]]
_BY_SUFFIX: dict[str, Reader] = {
    ".full": ansys_full.read, ".op4": op4.read, ".pch": dmig.read, ".bdf": dmig.read, ".dat": dmig.read, ".nas": dmig.read,
    ".hb": harwell_boeing.read, ".rsa": harwell_boeing.read, ".rua": harwell_boeing.read, ".psa": harwell_boeing.read,
    ".mm": matrix_market.read,
    ".mat": lambda path: _of_arrays(path, mat_variables.square_matrices(path)),
    **dict.fromkeys((".npz", ".npy"), lambda path: _of_arrays(path, numpy_arrays.square_matrices(path)))}


def _of_arrays(path: Path, matrices: dict[str, csc_array]) -> list[LabelledMatrix]:
    """Return the square arrays of a file, without labels."""
    if not matrices:
        raise ToolpointError(f"{path}: holds no square matrix; must hold stiffness and mass, such as K and M")
    return [LabelledMatrix(name, matrix) for name, matrix in matrices.items()]


def read_labelled(path: str | Path) -> list[LabelledMatrix]:
    """Return all matrices of a file; an .mtx file is Matrix Market where it says so, else Abaqus."""
    source = Path(path)
    check_regular(source)
    if source.suffix.lower() == ".mtx":
        with source.open("rb") as stream:
            is_market = stream.read(14).lower() == b"%%matrixmarket"
        return matrix_market.read(source) if is_market else abaqus_mtx.read(source)
    reader = _BY_SUFFIX.get(source.suffix.lower())
    if reader is None:
        raise ToolpointError(f"{path}: suffix {source.suffix!r}; must be one of {', '.join(MATRICES)}; "
                             "scipy.io.mmwrite writes an array as .mtx")
    return reader(source)


def read_matrices(
    stiffness: str | Path, mass: str | Path | None = None, *, names: tuple[str, str] | None = None, units: Units = "m-kg-s"
) -> ImportedMatrices:
    """Return stiffness and mass from one file that holds both, or from two.

    Parameters
    ----------
    stiffness, mass : path
        Files; with `mass` left out the first must hold both. Bulk data (.bdf, .nas, .dat, .pch) with grid points may hold bars,
        rods, springs, bushings, point masses and ties beside its matrices, or without any: `io.matrices.bulk_model`.
    names : (str, str), optional
        Names of stiffness and mass where a file holds several matrices; else the only one, or those whose names begin with K
        and M (or hold STIF, MASS).
    units : str
        ``m-kg-s`` (SI), or ``mm-t-s`` (N/mm, t), in which many finite-element models are made.

    >>> import tempfile
    >>> import numpy as np
    >>> from scipy.io import mmwrite
    >>> from scipy.sparse import csc_array
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     stiffness, mass = Path(folder, "K.mtx"), Path(folder, "M.mtx")
    ...     mmwrite(stiffness, csc_array([[2e6, -1e6], [-1e6, 1e6]]), symmetry="symmetric")
    ...     mmwrite(mass, csc_array(np.eye(2)), symmetry="symmetric")
    ...     read_matrices(stiffness, mass).stiffness.diagonal().tolist()
    [2000000.0, 1000000.0]
    """
    if mass is None and bulk_model.holds_model(Path(stiffness)):
        return bulk_model.read(Path(stiffness), names, units=units)
    first = read_labelled(stiffness)
    second = first if mass is None else read_labelled(mass)
    k = _chosen(stiffness, first, names[0] if names else None, ("K", "STIF"))
    m = _chosen(mass or stiffness, second, names[1] if names else None, ("M",))
    if m is k:
        raise ToolpointError(f"{stiffness}: holds {k.name} alone; must hold mass too (or give the mass as a second file)")
    unused = [matrix.name for matrix in first if matrix not in (k, m)] if mass is None else []
    k, m, notes = _matched(stiffness, k, m)
    if unused:
        verb = "is" if len(unused) == 1 else "are"
        notes = (*notes, f"{', '.join(unused)} of the file {verb} not used: stiffness is {k.name}, mass {m.name}, and the "
                         "modes are undamped")
    rows = k.rows or _numbered(k.matrix.shape[0])
    (stiff, stiffness_loss), (heavy, imaginary) = _real_part(k.matrix), _real_part(m.matrix)
    if imaginary:
        raise ToolpointError(f"{mass or stiffness}: {m.name} has imaginary parts up to {imaginary:.2g} of its largest entry; "
                             "a mass must be real")
    if stiffness_loss:
        notes = (*notes, f"imaginary parts of the stiffness (up to {stiffness_loss:.2g} of its largest entry: structural "
                         "damping) are left out: the modes are undamped")
    try:
        return _in_si(stiff, heavy, rows, units=units, notes=notes, is_labelled=bool(k.rows))
    except ToolpointError as error:
        source = mass if mass is not None and error.argument.endswith(".mass") else stiffness
        raise ToolpointError(f"{source}: {error}", argument=error.argument) from None


def _real_part(matrix: csc_array) -> tuple[csc_array, float]:
    """Return the real part, and the largest imaginary part over the largest entry."""
    if not np.iscomplexobj(matrix):
        return matrix, 0.0
    largest = max(float(np.abs(matrix.data).max(initial=0.0)), 1e-300)
    return csc_array(matrix.real), float(np.abs(matrix.data.imag).max(initial=0.0)) / largest


def _in_si(stiffness: csc_array, mass: csc_array, rows: tuple[Dof, ...], *, units: Units, notes: tuple[str, ...],
           is_labelled: bool) -> ImportedMatrices:
    if units == "m-kg-s":
        return ImportedMatrices(stiffness, mass, rows, notes=notes, is_labelled=is_labelled)
    # N/mm and t are a thousand of their SI units, N mm and t mm^2 a thousandth, N and t mm one: both matrices alike.
    root = diags_array(np.array([1e-3 if dof.is_rotation else 1e3 for dof in rows]) ** 0.5)
    return ImportedMatrices(csc_array(root @ stiffness @ root), csc_array(root @ mass @ root), rows, notes=notes,
                            is_labelled=is_labelled)


def _chosen(path: str | Path, matrices: Sequence[LabelledMatrix], name: str | None, marks: tuple[str, ...]) -> LabelledMatrix:
    listed = ", ".join(m.name for m in matrices)
    if name is not None:
        fitting = [m for m in matrices if m.name.upper() == name.upper()]
    else:
        fitting = list(matrices) if len(matrices) == 1 else [m for m in matrices if m.name.upper().startswith(marks)]
    if len(fitting) != 1:
        what = f"called {name}" if name else f"whose name begins with {' or '.join(marks)}"
        raise ToolpointError(f"{path}: {len(fitting) or 'no'} matrices {what} among {listed}; must be one; give the names of "
                             "stiffness and mass (--matrices KAA,MAA; names= in Python)")
    return fitting[0]


def _matched(path: str | Path, k: LabelledMatrix, m: LabelledMatrix) -> tuple[LabelledMatrix, LabelledMatrix, tuple[str, ...]]:
    """Return both with the same rows: those of the stiffness; what one file leaves out is held or has no mass."""
    notes = tuple(dict.fromkeys((*k.notes, *m.notes)))
    if k.matrix.shape == m.matrix.shape and (k.rows == m.rows or not (k.rows and m.rows)):
        return k, m, notes
    if not k.rows or not m.rows:
        raise ToolpointError(f"{path}: stiffness {k.matrix.shape}, mass {m.matrix.shape}; must be of one size, "
                             "as rows have no labels")
    place = {dof: i for i, dof in enumerate(m.rows)}
    without_stiffness = [dof for dof in m.rows if dof not in set(k.rows)]
    if without_stiffness:
        raise ToolpointError(f"{path}: mass has {len(without_stiffness)} rows without stiffness, the first "
                             f"{without_stiffness[0]}; take both of one model")
    mass_rows = np.array([place.get(dof, -1) for dof in k.rows])
    entries = m.matrix.tocoo()
    stiffness_rows = np.full(len(m.rows), -1)
    stiffness_rows[mass_rows[mass_rows >= 0]] = np.flatnonzero(mass_rows >= 0)
    i, j = (stiffness_rows[c] for c in entries.coords)
    return k, LabelledMatrix(m.name, csc_array(coo_array((entries.data, (i, j)), shape=k.matrix.shape)), k.rows, k.rows), notes


def _numbered(size: int) -> tuple[Dof, ...]:
    return tuple(Dof(i + 1, "+x") for i in range(size))
