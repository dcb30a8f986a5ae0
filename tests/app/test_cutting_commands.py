"""`toolpoint lobes` and `toolpoint mill` from a machine, from measured FRFs and from saved modes."""

import json
from pathlib import Path

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.io import frf_text, hdf5
from toolpoint.vibration import Modes, frequency_response

MACHINE = str(Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical_drives.yaml")
TOOL = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
SLOT = ["--direction", "slot", "--speeds", "5000:25000:3"]
CUT = ["--diameter", "12", "--teeth", "2", "--kt", "600", "--kn", "200"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dynamics")
    hdf5.write(TOOL, folder / "modes.h5")
    frf = frequency_response.modal(TOOL, np.arange(100.0, 6000.0, 1.0), ["tip:+x"], ["tip:+x"])
    frf_text.write(frf, folder / "tip.txt")
    return folder


def run(capsys, *arguments):
    main([*arguments, "--json"])
    return json.loads(capsys.readouterr().out)


def test_lobes_from_modes_are_the_converged_depths(folder, tmp_path, capsys):
    found = run(capsys, "lobes", "--modes", str(folder / "modes.h5"), *CUT, *SLOT, "-o", str(tmp_path))
    # Converged lowest depths of the two-mode slot at 5000, 15000 and 25000 rev/min, mm (three independent routes).
    limits = [1e3 * intervals[0][1] for intervals in found["stable_intervals_m"]]
    np.testing.assert_allclose(limits, [0.047507, 0.114448, 0.530130], rtol=2e-5)
    assert "Chart" in (tmp_path / "index.html").read_text()


def test_lobes_from_a_measured_response_are_near_those_of_its_modes(folder, tmp_path, capsys):
    found = run(capsys, "lobes", "--frf", str(folder / "tip.txt"), "--band", "100:6000", *CUT, *SLOT, "-o", str(tmp_path))
    limits = [1e3 * intervals[0][1] for intervals in found["stable_intervals_m"]]
    np.testing.assert_allclose(limits, [0.047507, 0.114448, 0.530130], rtol=0.02)


def test_lobes_and_cut_of_a_machine_at_a_pose(tmp_path, capsys):
    found = run(capsys, "lobes", MACHINE, "--pose", "X=0.1", "--speeds", "1000:2000:3", "--method", "zero-order",
                "-o", str(tmp_path))
    assert len(found["stable_intervals_m"]) == 3
    stable = run(capsys, "mill", MACHINE, "--speed", "1350", "--depth", "2", "-o", str(tmp_path))
    assert not stable["chatter"]
    wild = run(capsys, "mill", MACHINE, "--speed", "1350", "--depth", "9", "-o", str(tmp_path))
    assert wild["chatter"]
    assert wild["peak_to_peak_m"][0] > stable["peak_to_peak_m"][0]
    assert "Spectrum" in (tmp_path / "index.html").read_text()


@pytest.mark.parametrize(("arguments", "words"), [
    (["lobes"], "none given"), (["lobes", MACHINE, "--immersion", "1.4"], "at most 1"),
    (["lobes", MACHINE, "--teeth", "0"], "teeth"), (["lobes", MACHINE, "--kt", "-5"], "kt"),
    (["lobes", MACHINE, "--speeds", "0:100:3"], "above zero"), (["lobes", MACHINE, "--method", "sdm"], "must be one of"),
    (["mill", MACHINE, "--speed", "0", "--depth", "1"], "above zero"), (["mill", MACHINE, "--speed", "900"], "--depth")])
def test_wrong_input(arguments, words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown
