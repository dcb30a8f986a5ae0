"""`toolpoint identify`: from a universal file with its geometry to a table, saved modes and a page."""

import json

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.io import hdf5, uff
from toolpoint.vibration import Dof, Frf, Modes, frequency_response

FREQUENCY, RATIO = np.array([21.0, 34.0, 52.0]), np.array([0.02, 0.03, 0.015])


@pytest.fixture(scope="module")
def measured_file(tmp_path_factory):
    """Accelerances of nine points in three directions with 1 % noise and known modes, as a universal file."""
    rng = np.random.default_rng(5)
    points = {i + 1: xyz for i, xyz in enumerate(rng.uniform(0, 1, (9, 3)))}
    dofs = tuple(Dof(point, way) for point in points for way in ("+x", "+y", "+z"))
    modes = Modes(FREQUENCY, RATIO, rng.normal(size=(27, 3)), dofs)
    frf = frequency_response.modal(modes, np.linspace(5, 80, 601), None, [dofs[0]], "accelerance")
    noise = 0.01 * np.sqrt((np.abs(frf.values) ** 2).mean(axis=0))
    values = frf.values + noise * (rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape)) / np.sqrt(2)
    path = tmp_path_factory.mktemp("measured") / "test.uff"
    geometry = uff.MeasuredGeometry(tuple(points), np.array(list(points.values())), ((1, 2, 3), (4, 5, 6)))
    uff.write(path, geometry, Frf(frf.frequency, values, frf.outputs, frf.inputs, "accelerance"))
    return path


def test_table_modes_and_page(measured_file, tmp_path, capsys):
    main(["identify", str(measured_file), "--geometry", str(measured_file), "-m", str(tmp_path / "modes.h5"),
          "-o", str(tmp_path / "page")])
    shown = capsys.readouterr().out
    assert "+- Hz" in shown and "3 modes" in shown
    modes = hdf5.read(tmp_path / "modes.h5")
    np.testing.assert_allclose(modes.frequency, FREQUENCY, rtol=1e-3)
    assert (np.abs(modes.frequency - FREQUENCY) < 3 * modes.frequency_interval).all()
    page = (tmp_path / "page/index.html").read_text()
    for words in ("Stabilization diagram", "AutoMAC", "synthesised", "Mode indicator"):
        assert words in page


def test_output_named_h5_saves_the_modes(measured_file, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main(["identify", str(measured_file), "-o", "modes.h5", "--json"])
    assert len(json.loads(capsys.readouterr().out)["frequency_hz"]) == 3
    assert hdf5.read("modes.h5").count == 3
    assert (tmp_path / "toolpoint-report/index.html").is_file()


@pytest.mark.parametrize(("arguments", "words"), [
    (["none.uff"], "none.uff"), (["{file}", "--band", "900:1000"], "band"), (["{file}", "--method", "rpf"], "must be one of")])
def test_wrong_input(measured_file, arguments, words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["identify", *(a.format(file=measured_file) for a in arguments)])
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown
