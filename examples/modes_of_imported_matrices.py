"""Natural frequencies of stiffness and mass matrices that another finite-element program wrote."""

from pathlib import Path
from tempfile import TemporaryDirectory

from toolpoint.io import read_matrices
from toolpoint.studies import solve_matrix_modes
from toolpoint.vibration.sparse import count_below

HEAD = "%%MatrixMarket matrix coordinate real symmetric\n"


def main() -> float:
    """Return the least eigenvalue of three masses of 1 kg between springs of 1 N/m, rad^2/s^2: 2 - sqrt(2)."""
    with TemporaryDirectory() as folder:
        stiffness, mass = Path(folder, "k.mtx"), Path(folder, "m.mtx")
        stiffness.write_text(HEAD + "3 3 5\n1 1 2.\n2 2 2.\n3 3 2.\n2 1 -1.\n3 2 -1.\n")
        mass.write_text(HEAD + "3 3 3\n1 1 1.\n2 2 1.\n3 3 1.\n")
        result = solve_matrix_modes(read_matrices(stiffness, mass), 3)
    print(result.table())
    held = result.matrices
    print("modes below 0.25 Hz, by the signs of the pivots alone:", count_below(held.stiffness, held.mass, 0.25))
    return float(result.modes.omega[0] ** 2)


if __name__ == "__main__":
    main()
