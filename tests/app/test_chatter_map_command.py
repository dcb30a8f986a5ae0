"""`toolpoint map-chatter`: units, the cut's options, resuming, the worst pose named, failed poses told."""

import json
from dataclasses import replace

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint.app.main import main
from toolpoint.cutting import ZeroOrder
from toolpoint.io.yaml import machine_file
from toolpoint.pages.cuts.chatter_map import chatter_map_page
from toolpoint.studies.cuts.chatter_limits import ChatterMap
from toolpoint.studies.cuts.chatter_map import chatter_map

MACHINE = str(MACHINES / "three_axis_vertical_drives.yaml")
GRID = ["--axis", "X=-200mm:0.2m:3", "--axis", "Z=0:300mm:2", "--speeds", "900:1600:8", "--method", "zero-order"]


def run(capsys, *arguments):
    main(["map-chatter", MACHINE, *map(str, arguments), "--json"])
    return json.loads(capsys.readouterr().out)


def test_the_map_is_that_of_the_python_call_with_options_in_their_units(tmp_path, capsys):
    found = run(capsys, *GRID, "--feed-directions", "0,90", "--teeth", "4", "--immersion", "0.3", "-o", tmp_path)
    machine = machine_file.read(MACHINE)
    cut = machine.description.cutting
    expected = chatter_map(machine, {"X": [-0.2, 0.0, 0.2], "Z": [0.0, 0.3]}, cut.replaced(teeth=4, immersion=0.3),
                            speeds=np.linspace(900, 1600, 8), feed_angles=np.radians([0, 90]), method=ZeroOrder())
    np.testing.assert_allclose(found["limit_m"], expected.limit, rtol=1e-9)
    worst = expected.worst()
    assert found["worst"]["pose"] == pytest.approx(worst.pose) and found["worst"]["depth_m"] == pytest.approx(worst.depth)
    page = (tmp_path / "index.html").read_text()
    assert "Chatter limits over the workspace" in page and "4 teeth" in page


def test_the_worst_pose_is_named_and_a_folder_resumes(tmp_path, capsys):
    arguments = ["map-chatter", MACHINE, *GRID, "--feed-directions", "0:90:3", "--folder", str(tmp_path / "study"), "-o",
                 str(tmp_path / "page")]
    main(arguments)
    first = capsys.readouterr()
    shown = " ".join(first.out.split())
    assert "kept in" not in first.err
    main([*arguments, "--json"])  # the same study, from its folder
    again = capsys.readouterr()
    found = json.loads(again.out)
    assert "6 of 6 poses kept in" in " ".join(again.err.split())
    worst = found["worst"]
    told = ", ".join(f"{name} {1e3 * value:g} mm" for name, value in worst["pose"].items())
    # Rounded down to three digits: an error of some nanometres is not printed.
    depth = f"{np.floor(1e5 * worst['depth_m']) / 100:.2f}"
    assert worst["depth_error_m"] < 1e-7
    assert f"Worst: {depth} mm at {told}, feed at {worst['feed_angle_deg']:.4g}°" in shown
    assert found["feed_angle_deg"] == pytest.approx([0, 45, 90])
    with pytest.raises(SystemExit):
        main([*arguments, "--teeth", "3"])
    assert "another study" in capsys.readouterr().err


def test_failed_poses_are_told_and_are_no_numbers():
    limit = np.array([[[1e-3, 2e-3], [np.nan, np.nan]], [[3e-3, np.inf], [4e-3, np.inf]]])
    cut = machine_file.read(MACHINE).description.cutting
    found = ChatterMap({"X": np.array([0.0, 0.1])}, np.radians([0, 90]), np.array([1000.0, 2000.0]), limit,
                        np.where(np.isfinite(limit), 80.0, np.nan), np.array([0.01, 0.01]), cut, {(0, 1): "why"})
    assert found.failed() == ["X 0 mm, feed at 90°: why"]
    text = json.dumps(found.to_dict(), allow_nan=False)
    assert json.loads(text)["limit_m"][0][1] == [None, None] and json.loads(text)["stable_everywhere_m"] == [1e-3, 2e-3]
    html = chatter_map_page(found, machine_file.read(MACHINE)).html()
    assert found.doubts == ()
    rough = replace(found, error=np.array([[[1e-5, 4e-4], [0, 0]], [[1e-5, 0], [1e-5, 0]]]))
    assert len(rough.doubts) == 1 and "20 % at X 0 mm, feed at 0°, 2000 rev/min" in rough.doubts[0]
    assert rough.doubts[0].figure == pytest.approx(0.2) and f"doubt: {rough.doubts[0]}" in rough.table()
    assert rough.to_dict()["doubts"] and "the stated error is more than 10 %" in chatter_map_page(
        rough, machine_file.read(MACHINE)).html()
    assert "Failed poses" in html and "the largest depth looked at is drawn" not in html


@pytest.mark.parametrize(("more", "words"), [
    (["--axis", "X=0:30deg:3"], "linear"), (["--axis", "Q=0:1:3"], "no axis 'Q'"), (["--axis", "X=0:1:3"], "must be within"),
    (["--axis", "X=0:0.1"], "FIRST:LAST:NUMBER"), ([], "Missing option '--axis'"),
    (["--axis", "X=0:0.1:2", "--feed-directions", "a"], "angles in degrees"),
    (["--axis", "X=0:0.1:2", "--method", "zeroorder"], "did you mean 'zero-order'"),
    (["--axis", "X=0:0.1:2", "--teeth", "0"], "teeth")])
def test_wrong_input(more, words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["map-chatter", MACHINE, *more])
    assert stopped.value.code == 2
    shown = " ".join(capsys.readouterr().err.split())
    assert words in shown and "Traceback" not in shown


@pytest.mark.parametrize("number", ["0", "-2", "x"])
def test_a_number_of_feed_directions_below_one_is_told(number, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["map-chatter", MACHINE, *GRID, "--feed-directions", f"0:135:{number}"])
    assert stopped.value.code == 2 and "write angles in degrees" in capsys.readouterr().err
