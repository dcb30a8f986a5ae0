"""Text tables of any name, in two bands, to one universal file (as `toolpoint convert *.txt --name ... --to test.uff`)."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint.io import read_frf, write_frf
from toolpoint.vibration import Modes, frequency_response


def main() -> float:
    """Return the largest difference between what was measured and what the file holds, over the largest response."""
    modes = Modes([42.0, 97.0], [0.02, 0.03], [[1.0, 0.5], [0.4, -0.8]], ["1:+x", "2:+x"])
    frf = frequency_response.modal(modes, np.arange(10.0, 130.0), inputs=["1:+x"])
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for band, part in (("low", frf.between(10, 60)), ("high", frf.between(61, 130))):
            for k, dof in enumerate(part.outputs):
                files.append(Path(folder) / f"{band}_Point_{dof.point}_CH1.txt")
                values = part.values[:, k, 0]
                np.savetxt(files[-1], np.column_stack([part.frequency, values.real, values.imag]), fmt="%.17g")
        joined = read_frf(files, pattern="*_Point_{output}_*", struck="1:+x", quantity="receptance")
        write_frf(joined, Path(folder) / "test.uff")
        back = read_frf(Path(folder) / "test.uff")
        print(back)
    return float(np.abs(back.values - frf.values).max() / np.abs(frf.values).max())


if __name__ == "__main__":
    main()
