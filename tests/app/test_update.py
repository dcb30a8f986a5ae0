"""`toolpoint update`: a machine file with wrong stiffnesses and measured modes give the right machine back."""

from pathlib import Path

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.io import hdf5, machine_yaml
from toolpoint.machine import assemble
from toolpoint.vibration import eigen
from toolpoint.vibration import frequency_response as fr

MACHINE = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical.yaml"
WRONG = {"joints.foundation.stiffness.rx": 1.3, "joints.column_foot.stiffness.rx": 0.75, "joints.foundation.stiffness.ry": 1.2}


@pytest.fixture(scope="module")
def measurement(vertical, tmp_path_factory):
    """Modes and responses of the true machine, and a file with three stiffnesses wrong by 20 to 30 per cent."""
    folder = tmp_path_factory.mktemp("update")
    labels = [f"{point}:{way}" for point in vertical.description.points for way in ("+x", "+y", "+z")]
    system = assemble(vertical, outputs=labels)
    hdf5.write(eigen.undamped(system), folder / "modes.h5")
    hdf5.write(fr.direct(system.selected(labels[:3], labels[:1]), np.linspace(10, 70, 241)), folder / "frf.h5")
    wrong = vertical.with_values({path: factor * vertical.value(path) for path, factor in WRONG.items()})
    machine_yaml.write(wrong.description, folder / "wrong.yaml")
    return folder


def test_wrong_stiffnesses_are_found(measurement, vertical, tmp_path, capsys):
    options = [x for path in WRONG for x in ("--parameter", path)]
    main(["update", str(measurement / "wrong.yaml"), "--modes", str(measurement / "modes.h5"),
          "--frf", str(measurement / "frf.h5"), *options, "--machine", str(tmp_path / "right.yaml"),
          "-o", str(tmp_path / "page")])
    found = machine_yaml.read(tmp_path / "right.yaml")
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
