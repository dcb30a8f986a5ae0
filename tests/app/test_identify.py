"""`toolpoint identify`: from a universal file with its geometry to a table, saved modes and a page."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from toolpoint.app.main import main
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.io import uff
from toolpoint.io.binary import hdf5
from toolpoint.io.text import frf_table
from toolpoint.vibration import Dof, Frf, Modes, frequency_response

FREQUENCY, RATIO = np.array([21.0, 34.0, 52.0]), np.array([0.02, 0.03, 0.015])


@pytest.fixture(scope="module")
def measured_file(tmp_path_factory):
    """Accelerances of nine points in three directions with 1 % noise and known modes, as a universal file."""
    rng = np.random.default_rng(5)
    points = {i + 1: xyz for i, xyz in enumerate(rng.uniform(0, 1, (9, 3)))}
    dofs = tuple(Dof(point, way) for point in points for way in ("+x", "+y", "+z"))
    modes = Modes(FREQUENCY, RATIO, rng.normal(size=(27, 3)), dofs)
    frf = frequency_response.modal(modes, np.linspace(5, 80, 601), None, inputs=[dofs[0]], quantity="accelerance")
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
    assert "± Hz" in shown and "3 modes" in shown
    modes = hdf5.read(tmp_path / "modes.h5", Modes)
    np.testing.assert_allclose(modes.frequency, FREQUENCY, rtol=1e-3)
    assert (np.abs(modes.frequency - FREQUENCY) < 3 * modes.frequency_interval).all()
    page = (tmp_path / "page/index.html").read_text()
    for words in ("Stabilization diagram", "AutoMAC", "synthesised", "mode indicators"):
        assert words in page


def test_modes_that_move_tool_against_table(measured_file, tmp_path, capsys):
    """The answer of the command is that of the shapes: |delta|^2 over the highest mode, direction by direction."""
    main(["identify", str(measured_file), "--between", "2,5", "-o", str(tmp_path / "page")])
    assert "2 against 5:" in capsys.readouterr().out
    assert "Tool against table" in (tmp_path / "page/index.html").read_text()
    with pytest.raises(SystemExit):
        main(["identify", str(measured_file), "--between", "2,77", "-o", str(tmp_path / "other")])
    assert "between: 77; must be a point that was measured" in capsys.readouterr().err and not (tmp_path / "other").exists()


def test_output_named_h5_saves_the_modes(measured_file, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main(["identify", str(measured_file), "-o", "modes.h5", "--json"])
    assert len(json.loads(capsys.readouterr().out)["frequency_hz"]) == 3
    assert hdf5.read("modes.h5", Modes).count == 3
    assert (tmp_path / "toolpoint-report/index.html").is_file()


@pytest.mark.parametrize(("arguments", "words"), [
    (["none.uff"], "none.uff"), (["{file}", "--band", "900:1000"], "band"), (["{file}", "--method", "rpf"], "must be one of")])
def test_wrong_input(measured_file, arguments, words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["identify", *(a.format(file=measured_file) for a in arguments)])
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown


@pytest.mark.slow
def test_identified_modes_go_straight_into_lobes_and_a_simulated_cut(tmp_path, capsys):
    """Measured response -> modes -> stability: residuals of the identification stand in nobody's way."""
    rng = np.random.default_rng(1)
    modes = Modes([500.0, 800.0], [0.03, 0.02], [[2.0, 1.2]], ("tip:+x",))
    frf = frequency_response.modal(modes, np.arange(2.0, 1600, 1.0))
    noise = 0.002 * np.sqrt((np.abs(frf.values) ** 2).mean())
    noisy = frf.values + noise * (rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape))
    frf_table.write(Frf(frf.frequency, noisy, frf.outputs, frf.inputs), tmp_path / "tip.txt")
    main(["identify", str(tmp_path / "tip.txt"), "--band", "50:1500", "-m", str(tmp_path / "modes.h5"), "-o", str(tmp_path)])
    cut = ["--diameter", "12", "--teeth", "2", "--direction", "slot", "--kt", "600", "--kn", "200", "-o", str(tmp_path),
           "--json"]
    capsys.readouterr()
    main(["lobes", "--modes", str(tmp_path / "modes.h5"), *cut, "--speeds", "6000:16000:5", "--y", "rigid"])
    found = [rows[0][1] for rows in json.loads(capsys.readouterr().out)["stable_intervals_m"]]
    problem = MillingProblem(Tool(0.012, 2), Engagement.slot(), CuttingCoefficients(6e8, 2e8), modes)
    truth = stability.chart(problem, np.linspace(6000, 16000, 5), depth_max=0.02).limit
    np.testing.assert_allclose(found, np.minimum(truth, max(found)), rtol=0.05)  # the chart ends at some depth
    # Without --y the response across is that along, as for the measured lines themselves.
    main(["lobes", "--modes", str(tmp_path / "modes.h5"), *cut, "--speeds", "6000:16000:5"])
    alike = [rows[0][1] for rows in json.loads(capsys.readouterr().out)["stable_intervals_m"]]
    both = stability.chart(problem.changed(y="same"), np.linspace(6000, 16000, 5), depth_max=0.02).limit
    np.testing.assert_allclose(alike, np.minimum(both, max(alike)), rtol=0.05)
    assert sum(depth < 0.99 * max(found) for depth in found) >= 3
    main(["mill", "--modes", str(tmp_path / "modes.h5"), *cut, "--y", "rigid", "--speed", "9000",
          "--depth", str(5e2 * truth.min())])
    assert not json.loads(capsys.readouterr().out)["chatter"]


def test_modes_for_a_folder_that_is_not_there_are_refused_before_any_work(measured_file, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["identify", str(measured_file), "-m", "nowhere/modes.h5"])
    assert stopped.value.code == 2 and "does not exist" in capsys.readouterr().err


def test_text_files_whose_names_tell_too_little_tell_the_rule(tmp_path, capsys):
    """Plain names are points struck at the first; names with a direction and no input are driving points, which say nothing
    of the responses between them."""
    modes = Modes([500.0], [0.03], [[50.0]], ("tip:+x",))
    for name in ("one.txt", "two.txt", "tip=+x.txt", "tip=+y.txt"):
        frf_table.write(frequency_response.modal(modes, np.arange(2.0, 900, 2.0)), tmp_path / name)
    main(["identify", str(tmp_path / "one.txt"), str(tmp_path / "two.txt"), "-o", str(tmp_path)])
    shown = capsys.readouterr()
    (note,) = [line for line in shown.out.splitlines() if "struck at one:+x" in line]
    assert note.startswith("note: ") and "struck at" not in shown.err  # what was taken is no warning
    page = (tmp_path / "index.html").read_text()
    assert "What was left out, corrected or assumed" in page
    main(["identify", str(tmp_path / "one.txt"), str(tmp_path / "two.txt"), "-o", str(tmp_path), "--json"])
    assert "struck at one:+x" in " ".join(json.loads(capsys.readouterr().out)["notes"])
    with pytest.raises(SystemExit):
        main(["identify", str(tmp_path / "tip=+x.txt"), str(tmp_path / "tip=+y.txt")])
    assert "OUTPUT__INPUT" in capsys.readouterr().err


@pytest.mark.slow
def test_text_files_with_other_lines_are_named_and_their_quantity_is_told(tmp_path, capsys):
    modes = Modes([30.0, 50.0], 0.02, [[1.0, 0.5], [0.5, -1.0]], ["1:+x", "2:+x"])
    frf = frequency_response.modal(modes, np.arange(5.0, 80, 0.1), None, inputs=["1:+x"])
    for number, lines in ((1, slice(None)), (2, slice(600))):
        frf_table.write(Frf(frf.frequency[lines], frf.values[lines, number - 1:number], [f"{number}:+x"], ["1:+x"]),
                       tmp_path / f"{number}=+x__1=+x.txt")
    names = sorted(str(path) for path in tmp_path.glob("*.txt"))
    with pytest.raises(SystemExit):
        main(["identify", *names, "-o", str(tmp_path)])
    assert "2=+x__1=+x.txt has other frequency lines" in capsys.readouterr().err
    main(["identify", names[0], "-o", str(tmp_path)])
    shown = capsys.readouterr()
    assert "read as" not in shown.err and "* stands out" in shown.out  # its header says receptance
    bare = tmp_path / "tip.txt"
    bare.write_text("".join(line for line in Path(names[0]).read_text().splitlines(True) if line[0] != "#"))
    main(["identify", str(bare), "-o", str(tmp_path)])
    assert "read as receptance; --quantity for another" in capsys.readouterr().out
    main(["identify", str(bare), "--quantity", "receptance", "-o", str(tmp_path)])
    assert "read as" not in capsys.readouterr().err


def test_what_a_matlab_file_does_not_say_is_told(tmp_path, capsys):
    modes = Modes([30.0, 50.0], 0.02, [[1.0, 0.5], [0.5, -1.0]], ["1:+x", "1:+y"])
    frf = frequency_response.modal(modes, np.arange(5.0, 80, 0.1), None, inputs=["1:+x"], quantity="accelerance")
    scipy.io.savemat(tmp_path / "m.mat", {"f": frf.frequency, "H": frf.values[:, :, 0]})
    main(["identify", str(tmp_path / "m.mat"), "-o", str(tmp_path)])
    shown = capsys.readouterr().out
    assert "its 2 responses are taken as points 1, 2 .. along +x" in shown and "read as accelerance" in shown
    assert "names no points" in (tmp_path / "index.html").read_text()


@pytest.mark.slow
def test_poles_added_and_removed_by_hand_are_brought_again_by_the_command_of_the_page(tmp_path, capsys):
    """Options and choice file are the same choice; the page's command is that of the run without it."""
    rng = np.random.default_rng(4)
    modes = Modes([21.0, 34.0, 52.0], [0.02, 0.015, 0.02], rng.normal(size=(4, 3)), [f"{k}:+x" for k in range(1, 5)])
    frf = frequency_response.modal(modes, np.linspace(5, 80, 400), inputs=["1:+x"])
    noisy = frf.values + 1e-3 * np.abs(frf.values).max() * rng.normal(size=frf.values.shape)
    file = tmp_path / "test.h5"
    hdf5.write(replace(frf, values=noisy), file)
    given = ["identify", str(file), "--band", "10:75"]
    main([*given, "--remove", "52", "--json", "-o", str(tmp_path / "a")])
    first = json.loads(capsys.readouterr().out)
    (tmp_path / "choice.yaml").write_text("toolpoint: 1\nremove: [52 Hz]\n")
    main([*given, "--choice", str(tmp_path / "choice.yaml"), "--json", "-o", str(tmp_path / "b")])
    second = json.loads(capsys.readouterr().out)
    assert first["frequency_hz"] == second["frequency_hz"] and max(first["frequency_hz"]) < 40
    assert "by hand: removed 52 Hz" in first["status"]
    for page in ("a", "b"):
        text = (tmp_path / page / "index.html").read_text()
        assert f'"command":"toolpoint identify {file} --band 10:75 --json -o {tmp_path / page}"' in text
    main(["identify", str(file), "--json", "-o", str(tmp_path / "c")])
    whole = json.loads(capsys.readouterr().out)
    command = re.search(r'"command":"toolpoint (identify [^"]*)"', (tmp_path / "c" / "index.html").read_text())[1].split()
    assert command[-2] == "--band" and command[-1] != "5:80"  # lines at the ends show nothing but noise
    main(command)
    assert json.loads(capsys.readouterr().out)["frequency_hz"] == whole["frequency_hz"]
    with pytest.raises(SystemExit):
        main([*given, "--remove", "45"])
    assert "the nearest is" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main([*given, "--add", "45"])
    assert "for example 34.2,1.5" in " ".join(capsys.readouterr().err.split())
