"""Modes of measured responses with confidence intervals, saved, and their page (as `toolpoint identify -m modes.h5`)."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint.io import read_frf, read_geometry, write_nouns
from toolpoint.io.uff import MeasuredGeometry, write
from toolpoint.modal_identification import identify
from toolpoint.pages.measured.identification import identification_page
from toolpoint.vibration import Dof, Modes, frequency_response


def main() -> float:
    """Return the largest deviation of an identified frequency from the true one, in per cent."""
    rng = np.random.default_rng(5)
    points = {number: rng.uniform(0, 1, 3) for number in range(1, 7)}
    labels = tuple(Dof(point, way) for point in points for way in ("+x", "+y", "+z"))
    truth = Modes([21.0, 34.0, 52.0], [0.02, 0.03, 0.015], rng.normal(size=(18, 3)), labels)
    frf = frequency_response.modal(truth, np.linspace(5, 80, 601), inputs=[labels[0]], quantity="accelerance")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "test.uff"
        write(file, MeasuredGeometry(tuple(points), np.array(list(points.values()))), frf)
        result = identify(read_frf(file), band=(5, 80))
        print(result.table())
        write_nouns(result.modes, Path(folder) / "modes.h5")
        print(identification_page(result, read_geometry(file), [file.name]).save(folder))
    return float(100 * np.abs(result.modes.frequency / truth.frequency - 1).max())


if __name__ == "__main__":
    main()
