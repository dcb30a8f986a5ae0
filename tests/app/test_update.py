"""`toolpoint update`: a machine file with wrong stiffnesses and measured modes give the right machine back."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.io.binary import hdf5
from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble
from toolpoint.machine.description import parameters
from toolpoint.vibration import Modes, eigen
from toolpoint.vibration import frequency_response as fr

MACHINE = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical.yaml"
WRONG = {"joints.foundation.stiffness.rx": 1.3, "joints.column_foot.stiffness.rx": 0.75, "joints.foundation.stiffness.ry": 1.2}


@pytest.fixture(scope="module")
def measurement(vertical, tmp_path_factory):
    """Modes and responses of the true machine, and a file with three stiffnesses wrong by 20 to 30 per cent."""
    folder = tmp_path_factory.mktemp("update")
    labels = [f"{point}:{way}" for point in vertical.description.points for way in ("+x", "+y", "+z")]
    system = assemble(vertical, outputs=labels)
    hdf5.write(eigen.solve_undamped(system), folder / "modes.h5")
    hdf5.write(fr.direct(system.selected(labels[:3], labels[:1]), np.linspace(10, 70, 241)), folder / "frf.h5")
    wrong = vertical.with_values({path: factor * vertical.value(path) for path, factor in WRONG.items()})
    machine_file.write(wrong.description, folder / "wrong.yaml")
    return folder


def test_wrong_stiffnesses_are_found(measurement, vertical, tmp_path, capsys):
    options = [x for path in WRONG for x in ("--parameter", path)]
    main(["update", str(measurement / "wrong.yaml"), "--modes", str(measurement / "modes.h5"),
          "--frf", str(measurement / "frf.h5"), *options, "--machine", str(tmp_path / "right.yaml"),
          "-o", str(tmp_path / "page")])
    found = machine_file.read(tmp_path / "right.yaml")
    for path in WRONG:
        assert found.value(path) == pytest.approx(vertical.value(path), rel=1e-3)
    page = (tmp_path / "page/index.html").read_text()
    for words in ("Modes before and after", "Responses before and after", "Shapes before and after", "Identifiability"):
        assert words in page


@pytest.mark.parametrize(("arguments", "words"), [
    ([], "neither --modes nor --frf"), (["--modes", "none.h5"], "no such file"),
    (["--modes", "{modes}", "--parameter", "joints.fundation.stiffness.rx"], "did you mean 'foundation'")])
def test_wrong_input(measurement, arguments, words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["update", str(MACHINE), *(a.format(modes=measurement / "modes.h5") for a in arguments)])
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown


def test_measured_points_that_the_machine_lacks_are_told_with_the_file_to_write_them_in(tmp_path, capsys):
    hdf5.write(Modes([20.0], 0.02, np.ones((2, 1)), ("tool:+x", "17:+x")), tmp_path / "test.h5")
    with pytest.raises(SystemExit):
        main(["update", str(MACHINE), "--modes", str(tmp_path / "test.h5")])
    shown = " ".join(capsys.readouterr().err.split())
    for words in ("test.h5: measured at 17;", "has no such points", "section 'points:'", "17: {body: ",
                  "toolpoint joints --machine"):
        assert words in shown
    assert "at tool" not in shown


@pytest.fixture(scope="module")
def two_poses(vertical_drives, tmp_path_factory):
    """Modes at two table positions, and a file with two stiffnesses wrong."""
    folder = tmp_path_factory.mktemp("poses")
    axis = next(iter(vertical_drives.description.axes))
    low, high = vertical_drives.description.axes[axis].limits
    places = [f"{axis}={low + share * (high - low):.3f}" for share in (0.1, 0.9)]
    labels = [f"{point}:{way}" for point in vertical_drives.description.points for way in ("+x", "+y", "+z")]
    for k, place in enumerate(places):
        pose = {axis: float(place.split("=")[1])}
        system = assemble(vertical_drives, pose, labels)
        hdf5.write(eigen.solve_undamped(system, 8), folder / f"modes{k}.h5")
        hdf5.write(fr.direct(system.selected(labels[:2], labels[:1]), np.linspace(10, 60, 101)), folder / f"frf{k}.h5")
    paths = [p for p in parameters(vertical_drives.description) if ".stiffness." in p][:2]
    wrong = vertical_drives.with_values({p: f * vertical_drives.value(p) for p, f in zip(paths, (1.3, 0.75), strict=True)})
    machine_file.write(wrong.description, folder / "wrong.yaml")
    return folder, places, paths


@pytest.mark.parametrize("kinds", [("modes",), ("modes", "frf")])
def test_measurements_at_several_poses_are_fitted_together(two_poses, vertical_drives, tmp_path, capsys, kinds):
    folder, places, paths = two_poses
    options = [x for k, place in enumerate(places) for kind in kinds
               for x in (f"--{kind}", str(folder / f"{kind}{k}.h5"), *(("--pose", place) if kind == "modes" else ()))]
    main(["update", str(folder / "wrong.yaml"), *options, *(x for p in paths for x in ("--parameter", p)),
          "-o", str(tmp_path / "page"), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["status"].startswith("converged")
    for path in paths:
        assert found["values"][path] == pytest.approx(vertical_drives.value(path), rel=1e-3)
    page = (tmp_path / "page/index.html").read_text()
    assert page.count("Modes before and after, measurement") >= 2 and "measurement 2 at" in page


@pytest.mark.slow
def test_samples_of_the_posterior_are_on_the_page(measurement, vertical, tmp_path, capsys):
    pytest.importorskip("emcee")
    options = [x for path in list(WRONG)[:2] for x in ("--parameter", path)]
    (tmp_path / "start.yaml").write_text((measurement / "wrong.yaml").read_text())
    main(["update", str(tmp_path / "start.yaml"), "--modes", str(measurement / "modes.h5"), *options, "--samples", "150",
          "-o", str(tmp_path / "page"), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert "steps of 8 walkers" in found["samples"]
    for path in list(WRONG)[:2]:
        low, high = found["intervals"][path]
        assert low < found["values"][path] < high
    page = (tmp_path / "page/index.html").read_text()
    assert "Posterior" in page and "95 % of the samples" in page


def test_samples_without_emcee_name_the_remedy_before_anything_is_fitted(measurement, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(SystemExit) as stopped:
        main(["update", str(MACHINE), "--modes", str(measurement / "modes.h5"), "--samples", "10"])
    assert stopped.value.code == 2
    assert "pip install 'toolpoint[bayes]'" in capsys.readouterr().err


def test_files_and_poses_must_match(two_poses, capsys):
    folder, places, _ = two_poses
    with pytest.raises(SystemExit) as stopped:
        main(["update", str(folder / "wrong.yaml"), "--modes", str(folder / "modes0.h5"), "--pose", places[0],
              "--pose", places[1]])
    assert stopped.value.code == 2
    assert "1 files for 2 poses" in capsys.readouterr().err
