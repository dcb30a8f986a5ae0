"""`toolpoint mill` and `lobes` as a stranger calls them: measured lines, too short simulations, numbers in another unit."""

import json

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint.app import console
from toolpoint.app.main import main
from toolpoint.io.binary import hdf5
from toolpoint.io.text import frf_table
from toolpoint.studies.cuts import tool_dynamics as dynamics
from toolpoint.vibration import Modes, frequency_response

MACHINE = str(MACHINES / "three_axis_vertical_drives.yaml")
TOOL = Modes([700.0, 950.0], [0.03, 0.02], np.diag([1.0, 1.2]) * 4, ("tip:+x", "tip:+y"))
CUT = ["--diameter", "12", "--teeth", "2", "--kt", "600", "--kn", "200", "--direction", "slot"]
SPEEDS = ["--speeds", "5000:15000:3"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cuts")
    hdf5.write(TOOL, folder / "modes.h5")
    for way in "xy":
        frf = frequency_response.modal(TOOL, np.arange(2.0, 5000.0, 2.0), [f"tip:+{way}"], inputs=[f"tip:+{way}"])
        frf_table.write(frf, folder / f"{way}.txt")
    rng = np.random.default_rng(1)
    noise = frf.values * 0 + 1e-7 * (rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape))
    frf_table.write(type(frf)(frf.frequency, noise, frf.outputs, frf.inputs), folder / "noise.txt")
    return folder


def run(capsys, *arguments):
    main([*map(str, arguments), "--json"])
    return json.loads(capsys.readouterr().out)


@pytest.mark.slow
def test_a_cut_from_measured_lines_is_that_of_their_modes(folder, tmp_path, capsys, monkeypatch):
    """x and y differ and do not answer each other: the modes of both files side by side."""
    common = [*CUT, "--speed", 9000, "--depth", 0.05, "-o", tmp_path]
    pair = ["--frf-x", folder / "x.txt", "--frf-y", folder / "y.txt"]
    expected = run(capsys, "mill", "--modes", folder / "modes.h5", *common)
    measured = run(capsys, "mill", *pair, *common)
    assert measured["state"] == expected["state"] == "stable"
    np.testing.assert_allclose(measured["peak_to_peak_m"], expected["peak_to_peak_m"], rtol=0.01)
    wild = run(capsys, "mill", *pair, *CUT, "--speed", 9000, "--depth", 2, "-o", tmp_path)
    assert wild["chatter"] is True
    main(["mill", *map(str, [*pair, *common])])
    assert "2 identified from x.txt, y.txt (700, 950 Hz)" in " ".join(capsys.readouterr().out.split())
    with pytest.raises(SystemExit):
        main(["mill", "--frf", str(folder / "noise.txt"), *map(str, common)])
    assert "no mode found" in capsys.readouterr().err
    monkeypatch.setattr(dynamics, "MIN_LINE_FIT", 1.1)
    with pytest.raises(SystemExit):
        main(["mill", *map(str, [*pair, *common])])
    assert "explain only 100 % of a response; identify them with care" in capsys.readouterr().err


@pytest.mark.slow
def test_a_best_cut_from_too_short_a_band_is_doubted(folder, tmp_path, capsys):
    """The response ends on a resonance: no cut is recommended; with the whole band one is."""
    for band, doubted in (("20:900", True), ("20:4900", False)):
        main(["lobes", "--frf", str(folder / "y.txt"), "--band", band, *CUT, *SPEEDS, "-o", str(tmp_path)])
        assert ("withheld: y.txt, y:+x: what vibrates above" in capsys.readouterr().out) == doubted


@pytest.mark.slow
def test_a_short_simulation_does_not_take_the_start_for_chatter(tmp_path, capsys):
    """The slowest mode of the machine, 21.5 Hz at 3 %, needs more than a second to forget the start."""
    cut = ["mill", MACHINE, "--speed", 1350, "--depth", 2, "-o", tmp_path]
    short = run(capsys, *cut, "--revolutions", 3)
    assert short["state"] == "undecided" and short["chatter"] is None
    assert run(capsys, *cut)["chatter"] is False
    fast = run(capsys, "mill", MACHINE, "--speed", 9000, "--depth", 0.5, "-o", tmp_path)
    assert fast["state"] == "stable"  # 60 revolutions, 0.4 s, would be too few at this speed


@pytest.mark.slow
def test_wrong_units_are_doubted(folder, tmp_path, capsys):
    def told(*more):
        main(["lobes", *map(str, more), *SPEEDS, "-o", str(tmp_path)])
        return " ".join(capsys.readouterr().out.split())

    modes = ["--modes", folder / "modes.h5", "--direction", "slot"]
    assert "--diameter is in mm" in told(*modes, "--diameter", 0.012)
    assert "--kt is in N/mm^2" in told(*modes, "--kt", 6e8)
    assert "--feed is in mm per tooth" in told(*modes, "--feed", 9)
    with pytest.raises(SystemExit):
        told(*modes, "--feed", 100)
    assert "--feed: 100 mm; must be at least 0 mm and at most 10 mm (Feed per tooth)" in capsys.readouterr().err
    assert "the axial force moves nothing here" in told(*modes, "--ka", 300)
    assert "doubtful" not in told(*modes, *CUT)
    # A receptance taken for an accelerance has the other sign: no structure has it, no cut is advised, and that is said.
    bare = tmp_path / "x.txt"  # without the header that says receptance
    bare.write_text("".join(line for line in (folder / "x.txt").read_text().splitlines(True) if line[0] != "#"))
    shown = told("--frf", bare, "--quantity", "accelerance", *CUT)
    assert "gives off power at nearly all lines" in shown and "--quantity" in shown and "withheld" in shown


@pytest.mark.parametrize(("arguments", "words"), [
    (["lobes", "{}/x.txt"], "a machine is a YAML file; measured FRFs are given with --frf"),
    (["lobes", "--modes", "{}/x.txt"], "saved modes are HDF5 files"),
    (["lobes", "--frf", "{}/x.txt", "--band", "6000:9000"], "holds 0 lines"),
    (["lobes", "--frf", "{}/x.txt", *SPEEDS, "--method", "panel"], "toolpoint identify FILE -m modes.h5"),
    (["lobes", MACHINE, "--speeds", "9000:3000:5"], "the last above the first"),
    (["lobes", MACHINE, "--speeds", "900:900:3"], "or one speed"),
    (["lobes", MACHINE, "--speeds", "nan:900:3"], "write FIRST:LAST:NUMBER"),
    (["mill", MACHINE, "--speed", "1350", "--depth", "5000"], "--depth: 5000 mm"),
    (["mill", MACHINE, "--speed", "1e9", "--depth", "2"], "at most 1e+06"),
    (["mill", MACHINE, "--speed", "0.1", "--depth", "2"], "time steps"),
    (["mill", MACHINE, "--speed", "1350", "--depth", "2", "--feed", "0"], "--feed: 0 mm; must be above zero"),
    (["mill", MACHINE, "--speed", "1350", "--depth", "2", "--revolutions", "0"], "--revolutions"),
    (["speeds", "--chatter", "850", "--teeth", "4", "--highest", "900", "--lowest", "1000"], "0 <= lowest < highest"),
    (["lobes", MACHINE, *SPEEDS, "--method", "zero-order", "-o", "/proc/none/x"], "nothing can be written")])
def test_wrong_input_is_answered_in_the_words_of_the_command_line(folder, arguments, words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main([part.format(folder) for part in arguments])
    assert stopped.value.code == 2
    shown = " ".join(capsys.readouterr().err.split())
    assert words in shown and "Traceback" not in shown


def test_speeds_of_far_lobes_are_no_advice(capsys):
    main(["speeds", "--chatter", "850", "--teeth", "4", "--highest", "18000"])
    assert "note" not in capsys.readouterr().out
    main(["speeds", "--chatter", "850", "--teeth", "4", "--highest", "300"])
    assert "lobe 43; beyond lobe 10" in capsys.readouterr().out  # 60 * 850/(4 * 43) = 296.5 rev/min


def test_places_in_files_are_not_read_as_emoji(capsys):
    """':100:' in a file name with a line number is the code of a picture to the library that prints."""
    console.error("machine.yaml:100:7: a very long message " + 60 * "x")
    shown = capsys.readouterr().err
    assert "machine.yaml:100:7" in shown and shown.count("\n") == 1  # and lines are left whole


def test_files_that_cannot_be_written_are_told(capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["map", MACHINE, "--axis", "X=0:0.1:2", "--folder", "/proc/none"])
    assert stopped.value.code == 2
    assert "/proc/none" in capsys.readouterr().err
