"""Natural frequencies of matrices that another program assembled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.bodies.imported import ImportedMatrices
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Modes

FREE_BODY_MODES = 6  # rigid motions of one body


@dataclass(frozen=True, eq=False)
class MatrixModes(NotebookText):
    """Lowest modes of imported matrices, with notes of their checks."""

    matrices: ImportedMatrices
    modes: Modes

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on left-out rows, doubts, and the count of the modes."""
        rigid = int(self.modes.is_rigid.sum())
        loose = (Doubt("modes at 0 Hz", f"{rigid} of them; one free body has six",
                       "look for a part that hangs loose, two bodies in one model, or a mechanism"),
                 ) if rigid > FREE_BODY_MODES else ()
        return (*loose, *self.modes.notes)

    def table(self) -> str:
        """Return mass and frequencies as text; rigid-body modes are named."""
        rows = [[str(i + 1), f"{f:.6f}", "rigid body" if f == 0 else ""] for i, f in enumerate(self.modes.frequency)]
        masses = ", ".join(f"{m:.9g}" for m in self.matrices.directional_mass)
        mass = f"mass along x, y, z: {masses} kg" if self.matrices.is_labelled else "without labels: their mass is not known"
        return text_table(f"{self.matrices.size} rows, {mass}", ["mode", "frequency Hz", ""], rows)

    def to_dict(self) -> dict[str, Any]:
        """Return frequencies (Hz), mass by direction (kg; None where rows have no labels) and notes as plain data."""
        mass = self.matrices.directional_mass.tolist() if self.matrices.is_labelled else None
        return {"frequency_hz": self.modes.frequency.tolist(), "rigid_modes": int(self.modes.is_rigid.sum()),
                "mass_kg": mass, "rows": self.matrices.size, "notes": list(self.notes)}


def solve_matrix_modes(matrices: ImportedMatrices, count: int = 12) -> MatrixModes:
    """Return the lowest modes of imported matrices, counted so that none is missing.

    >>> import tempfile
    >>> from pathlib import Path
    >>> from scipy.io import mmwrite
    >>> from scipy.sparse import csc_array
    >>> from toolpoint.io import read_matrices
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     files = [Path(folder, f"{name}.mtx") for name in "km"]
    ...     mmwrite(files[0], csc_array([[2.0, -1.0], [-1.0, 2.0]]), symmetry="symmetric")
    ...     mmwrite(files[1], csc_array([[1.0, 0.0], [0.0, 1.0]]), symmetry="symmetric")
    ...     result = solve_matrix_modes(read_matrices(*files), 2)
    >>> (result.modes.omega**2).round(9).tolist()  # of two masses between three springs
    [1.0, 3.0]
    """
    return MatrixModes(matrices, matrices.modes(count))
