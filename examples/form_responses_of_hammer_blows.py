"""Records of hammer blows to responses, every blow judged, and their page (as `toolpoint frf hit_*.csv --save tip.h5`)."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint.io import read_records, write_frf
from toolpoint.modal_identification import without_window
from toolpoint.pages import records_page
from toolpoint.studies import identify_modes, study_hammer_records
from toolpoint.vibration import Modes, Record
from toolpoint.vibration.simulation.time_response import modal_superposition

TIP = Modes([420.0, 910.0], [0.03, 0.025], [[1.0, 0.7]], ["1:+x"])


def write_hit(file: Path, height: float) -> None:
    """Write what the acquisition would: time, force in N, velocity in m/s."""
    time = np.arange(4096) / 8192
    force = height * np.sin(np.pi * np.clip((time - 0.01) / 0.0008, 0, 1))
    velocity = modal_superposition(TIP, Record(force[:, None], 8192.0, ["1:+x"], "force"), ["1:+x"], kind="velocity").samples
    head = "time [s],force 1:+x [N],velocity 1:+x [m/s]"
    np.savetxt(file, np.column_stack([time, force, velocity]), delimiter=",", header=head, comments="")


def main() -> int:
    """Return the number of blows used; one of the five is far too weak."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"hit_{k}.csv" for k in range(1, 6)]
        for file, height in zip(files, (100, 8, 90, 110, 95), strict=True):
            write_hit(file, height)
        result = study_hammer_records(read_records(files))
        print(result.table())
        # The window damps; its share goes by the modes.
        free = without_window(result.frf, identify_modes(result.frf).modes)
        write_frf(free, Path(folder) / "tip.h5")
        print(records_page(result).save(Path(folder) / "page"))
    return result.used


if __name__ == "__main__":
    main()
