"""Where the dynamics of a cut come from on the command line: one file, a file for each direction, labelled files, modes."""

import json

import numpy as np
import pytest
from scipy.io import savemat

from conftest import MACHINES
from toolpoint.app.main import main
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.io import uff
from toolpoint.io.binary import hdf5
from toolpoint.io.text import frf_table
from toolpoint.vibration import Frf, Modes, frequency_response

X, Y, Z = LABELS = ("tip:+x", "tip:+y", "tip:+z")
SHAPE = 4 * np.array([[1.0, 0.1, 0.3], [0.2, 1.1, 0.2], [0.0, 0.1, 0.9]])
TOOL = Modes([600.0, 900.0, 1500.0], [0.03, 0.02, 0.02], SHAPE, LABELS)
LINES = np.arange(0.0, 4000.0, 2.0)
WHOLE = frequency_response.modal(TOOL, LINES)
BAND = ["--band", "80:4000"]
CUT = ["--diameter", "12", "--teeth", "2", "--kt", "600", "--kn", "200", "--direction", "slot", "--speeds", "5000:15000:3"]
MACHINE = str(MACHINES / "three_axis_vertical_drives.yaml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sources")
    accelerance = frequency_response.modal(TOOL, LINES, None, inputs=None, quantity="accelerance")
    numbered = tuple(label.replace("tip", "1") for label in LABELS)
    uff.write(folder / "whole.unv", Frf(LINES, accelerance.values, numbered, numbered, "accelerance"))
    hdf5.write(WHOLE, folder / "whole.h5")
    hdf5.write(TOOL, folder / "modes.h5")
    hdf5.write({"a": TOOL, "b": WHOLE}, folder / "both.h5")
    points = Modes([600.0], 0.03, np.ones((2, 1)), ("1:+x", "2:+x"))
    hdf5.write(frequency_response.modal(points, LINES), folder / "points.h5")
    hdf5.write(frequency_response.modal(points, LINES, ["1:+x"], inputs=["2:+x"]), folder / "apart.h5")
    savemat(folder / "plane.mat", {"f": LINES, "H": WHOLE.values[:, :2, :2]})
    for name, (output, struck) in {"x": (X, X), "y": (Y, Y), "xy": (X, Y), "tip=+x__tip=+x": (X, X), "tip=+y__tip=+y": (Y, Y),
                                   "tip=+x__tip=+y": (X, Y), "tip=+y__tip=+x": (Y, X)}.items():
        frf_table.write(WHOLE.selected([output], [struck]), folder / f"{name}.txt")
    coarse = frequency_response.modal(TOOL, np.arange(20.0, 4200.0, 1.0), [Y], inputs=[Y])
    frf_table.write(coarse, folder / "y_other_lines.txt")
    frf_table.write(Frf(LINES, -WHOLE.values[:, :1, :1], (X,), (X,)), folder / "upside_down.txt")
    opposite = Frf(LINES, -WHOLE.values[:, :1, :1], (X,), ("tip:-x",))
    hdf5.write(opposite, folder / "hammer_opposite.h5")
    changed_over = WHOLE.values[:, :1, :1].imag + 1j * WHOLE.values[:, :1, :1].real
    frf_table.write(Frf(LINES, changed_over, (X,), (X,)), folder / "changed_over.txt")
    return folder


def lobes(capsys, tmp_path, *arguments):
    main(["lobes", *map(str, arguments), *CUT, "-o", str(tmp_path), "--json"])
    found = json.loads(capsys.readouterr().out)
    return [intervals[0][1] for intervals in found["stable_intervals_m"]], " | ".join(found["notes"])


def python_limits(values, like):
    """Limits of the Python call with this 2x2 receptance, over the range of depths that the command line took."""
    frf = Frf(LINES, values, ("t:+x", "t:+y"), ("t:+x", "t:+y")).between(80, 4000)
    problem = MillingProblem(Tool(0.012, 2), Engagement.slot(), CuttingCoefficients(6e8, 2e8), frf)
    return stability.chart(problem, np.array([5000.0, 10000.0, 15000.0]), depth_max=1.5 * max(like)).limit


def plane(with_cross):
    values = WHOLE.values[:, :2, :2].copy()
    if not with_cross:
        values[:, 0, 1] = values[:, 1, 0] = 0
    return values


@pytest.mark.slow
def test_different_files_for_x_and_y_give_the_chart_of_the_python_call(folder, tmp_path, capsys):
    pair = ["--frf-x", folder / "x.txt", "--frf-y", folder / "y.txt", *BAND]
    apart, notes = lobes(capsys, tmp_path, *pair)
    np.testing.assert_allclose(apart, python_limits(plane(False), apart), rtol=1e-5)
    assert "along x: x.txt" in notes and "along y: y.txt" in notes and "no cross response" in notes
    crossed, notes = lobes(capsys, tmp_path, *pair, "--frf-xy", folder / "xy.txt")
    np.testing.assert_allclose(crossed, python_limits(plane(True), crossed), rtol=1e-5)
    assert "xy.txt" in notes and "no cross response" not in notes
    assert crossed[0] != pytest.approx(apart[0], rel=0.02)  # the cross response matters here


@pytest.mark.slow
@pytest.mark.parametrize("more", [
    ["--frf", "{}/whole.h5"], ["--frf", "{}/whole.unv"], ["--frf", "{}/both.h5"],
    ["--frf", "{}/plane.mat", "--quantity", "receptance", "--x", "1:+x", "--y", "2:+x"],
    ["--frf", "{}/tip=+x__tip=+x.txt", "--frf", "{}/tip=+y__tip=+y.txt", "--frf", "{}/tip=+x__tip=+y.txt",
     "--frf", "{}/tip=+y__tip=+x.txt"]])
def test_labelled_files_of_every_format_give_the_same_chart(folder, tmp_path, capsys, more):
    found, notes = lobes(capsys, tmp_path, *(part.format(folder) for part in more), *BAND)
    np.testing.assert_allclose(found, python_limits(plane(True), found), rtol=1e-4)
    assert "response along x is" in notes and ", along y " in notes


@pytest.mark.slow
def test_other_lines_are_interpolated_and_told(folder, tmp_path, capsys):
    same, _ = lobes(capsys, tmp_path, "--frf-x", folder / "x.txt", "--frf-y", folder / "y.txt", *BAND)
    other, notes = lobes(capsys, tmp_path, "--frf-x", folder / "x.txt", "--frf-y", folder / "y_other_lines.txt", *BAND)
    np.testing.assert_allclose(other, same, rtol=1e-3)
    assert "other lines" in notes


@pytest.mark.slow
def test_one_direction_is_the_same_across_or_rigid_as_told(folder, tmp_path, capsys):
    alone, notes = lobes(capsys, tmp_path, "--frf", folder / "x.txt", *BAND)
    assert "across is taken as that along" in notes
    again, notes = lobes(capsys, tmp_path, "--frf-x", folder / "x.txt", *BAND)
    assert "the response across is taken as that along x" in notes
    chosen, _ = lobes(capsys, tmp_path, "--modes", folder / "modes.h5", "--x", X, "--y", "same")
    np.testing.assert_allclose(alone, again, rtol=1e-9)
    np.testing.assert_allclose(alone, chosen, rtol=5e-3)
    doubled = np.zeros((LINES.size, 2, 2), complex)
    doubled[:, 0, 0] = doubled[:, 1, 1] = WHOLE.values[:, 0, 0]
    np.testing.assert_allclose(alone, python_limits(doubled, alone), rtol=1e-5)
    rigid, notes = lobes(capsys, tmp_path, "--frf", folder / "x.txt", "--y", "rigid", *BAND)
    assert "rigid along y" in notes
    doubled[:, 1, 1] = 0
    # At the third speed the limit is above the range of the chart.
    np.testing.assert_allclose(rigid[:2], python_limits(doubled, rigid)[:2], rtol=1e-5)


@pytest.mark.slow
def test_a_hammer_from_the_other_side_is_turned_and_a_wrong_sign_is_doubted(folder, tmp_path, capsys):
    right, _ = lobes(capsys, tmp_path, "--frf", folder / "x.txt", *BAND)
    turned, notes = lobes(capsys, tmp_path, "--frf", folder / "hammer_opposite.h5", *BAND)
    np.testing.assert_allclose(turned, right, rtol=1e-9)
    assert "gives off power" not in notes
    main(["lobes", "--frf", str(folder / "upside_down.txt"), *BAND, *CUT, "-o", str(tmp_path)])
    shown = " ".join(capsys.readouterr().out.split())
    assert "gives off power at nearly all lines" in shown and "withheld" in shown


@pytest.mark.slow
def test_columns_changed_over_and_a_mobility_read_as_receptance_are_doubted(folder, tmp_path, capsys):
    """Re G, taken for the imaginary part, is positive below every resonance: power is given off there."""
    _, notes = lobes(capsys, tmp_path, "--frf", folder / "x.txt", *BAND)
    assert "doubt:" not in notes
    _, notes = lobes(capsys, tmp_path, "--frf", folder / "changed_over.txt", *BAND)
    assert "real and imaginary part exchanged" in notes and "order of the columns" in notes


@pytest.mark.slow
def test_a_report_of_labelled_files(folder, tmp_path, capsys):
    main(["report", "--frf", str(folder / "whole.unv"), "-o", str(tmp_path)])
    shown = " ".join(capsys.readouterr().out.split())
    assert "driving-point response of the tool tip, and that of 1:+y across" in shown
    assert "stable at every charted speed" in shown
    main(["report", "--frf", str(folder / "apart.h5"), "-o", str(tmp_path)])
    assert "No stability chart" in capsys.readouterr().out


@pytest.mark.parametrize(("arguments", "words"), [
    ([], "none given"), (["--frf", "x.txt", "--modes", "modes.h5"], "--frf and --modes given; must be one"),
    (["--frf", "x.txt", "--frf-x", "x.txt"], "must be one of them"), (["--frf-y", "y.txt"], "needs --frf-x"),
    (["--frf-x", "x.txt", "--frf-xy", "xy.txt"], "needs --frf-y"),
    (["--frf", "x.txt", "--frf", "y.txt"], "--frf-x FILE --frf-y"), (["--frf-x", "whole.h5"], "3 x 3 responses; must be one"),
    (["--frf", "modes.h5"], "holds Modes; needs one Frf (give it with"),
    (["--modes", "whole.h5"], "holds Frf; needs one Modes"), (["--frf", "points.h5"], "which point cuts"),
    (["--frf", "points.h5", "--x", "3:+x"], "--x 3:+x: not in points.h5"), (["--frf", "apart.h5"], "no driving point"),
    (["--modes", "modes.h5", "--band", "1:2"], "is for measured FRFs"),
    (["--modes", "modes.h5", "--pose", "X=1"], "needs a machine"),
    (["--frf", "whole.h5", "--quantity", "mobility"], "says that it holds receptance"), (["--frf", "none.unv"], "none.unv"),
    (["--frf-x", "x.txt", "--x", "1:+x"], "is for FRFs and modes of several points")])
def test_wrong_sources_are_told(folder, arguments, words, capsys):
    named = [str(folder / part) if "." in part and not part.startswith("-") else part for part in arguments]
    for command in (["lobes"], ["mill", "--speed", "9000", "--depth", "1"], ["turn", "--kf", "800"]):
        with pytest.raises(SystemExit) as stopped:
            main([*command, *named])
        assert stopped.value.code == 2
        shown = capsys.readouterr().err
        assert words in shown and "Traceback" not in shown


def test_a_machine_file_beside_measured_data_is_refused(folder, capsys):
    with pytest.raises(SystemExit):
        main(["lobes", MACHINE, "--frf", str(folder / "x.txt")])
    assert "a machine file and --frf given" in capsys.readouterr().err
