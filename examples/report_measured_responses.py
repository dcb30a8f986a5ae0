"""Modes and lobes straight from measured responses, and their page (as `toolpoint report --frf tip.txt --frf holder.txt`)."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint.io import read_frf
from toolpoint.io.text import frf_table
from toolpoint.pages import first_look_page
from toolpoint.studies import study_machine_and_responses
from toolpoint.vibration import Modes, frequency_response


def main() -> float:
    """Return the first frequency that was picked, Hz; the structure's is 900 Hz."""
    structure = Modes([900.0, 1700.0], 0.02, [[1.0, 0.4], [0.5, -0.6]], ("tip:+x", "holder:+x"))
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / "tip.txt", Path(folder) / "holder.txt"]
        for path in paths:  # Hz, real, imaginary; both struck at the tip
            response = frequency_response.modal(structure, np.arange(2.0, 3000.0, 2.0), outputs=[f"{path.stem}:+x"],
                                                inputs=["tip:+x"])
            frf_table.write(response, path)
        result = study_machine_and_responses(frf=read_frf(paths))
        print(result.table())
        print(first_look_page(result, names=["tip.txt", "holder.txt"]).save(folder))
    assert result.measured is not None and result.measured.modes is not None
    return float(result.measured.modes.frequency[0])


if __name__ == "__main__":
    main()
