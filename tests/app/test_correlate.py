"""`toolpoint correlate`: a test in another frame beside the machine, and a wrong machine whose wrong place is found."""

import json
from dataclasses import replace

import numpy as np
import pytest
from four_part_mill import four_part_mill

from toolpoint.app.main import main
from toolpoint.io.binary import hdf5
from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf
from toolpoint.vibration import Dof, eigen, frequency_response

PATH = "joints.column_housing.stiffness.x"


@pytest.fixture(scope="module")
def test_data(tmp_path_factory):
    """Modes and responses at the machine's points, numbered, in a frame turned by 0.3 rad about z; a wrong machine file."""
    folder, mill = tmp_path_factory.mktemp("correlate"), four_part_mill()
    names = list(mill.description.points)
    turn, shift = rotation.about("z", 0.3), np.array([0.2, -0.1, 0.05])
    place = place_machine(mill)
    lines = ["point,x,y,z"]
    for i, name in enumerate(names):
        at = turn.T @ (place.position(mill.description.points[name])[0] - shift)
        lines.append(",".join([str(i + 1), *map(str, at)]))
    (folder / "geometry.csv").write_text("\n".join(lines) + "\n")
    # The directions of the test are the turned axes: a Dof of the machine along R e_k is the test's +k.
    labels = [Dof(name, f"axis {k}", tuple(turn[:, k])) for name in names for k in range(3)]
    numbered = tuple(Dof(names.index(d.point) + 1, "+" + "xyz"[int(d.direction[-1])]) for d in labels)
    modes = eigen.solve_undamped(assemble(mill, outputs=labels), 6)
    hdf5.write(replace(modes, dofs=numbered, scaling="unscaled"), folder / "modes.h5")
    frf = frequency_response.direct(assemble(mill, None, labels, inputs=labels[:1]), np.linspace(10, 90, 241))
    hdf5.write(replace(frf, outputs=numbered, inputs=numbered[:1]), folder / "frf.h5")
    wrong = mill.with_values({PATH: 0.5 * mill.value(PATH)})
    machine_file.write(wrong.description, folder / "wrong.yaml")
    machine_file.write(mill.description, folder / "right.yaml")
    return folder, names


def arguments(folder, names, machine, *more):
    pairs = [x for i, name in enumerate(names[:4]) for x in ("--pair", f"{i + 1}={name}")]
    return ["correlate", str(folder / machine), str(folder / "modes.h5"), str(folder / "frf.h5"), "--geometry",
            str(folder / "geometry.csv"), *pairs, *more]


def test_the_right_machine_agrees_in_everything_and_the_frame_is_found(test_data, tmp_path, capsys):
    folder, names = test_data
    main(arguments(folder, names, "right.yaml", "-o", str(tmp_path / "page"), "--json"))
    found = json.loads(capsys.readouterr().out)
    assert found["points_paired"] == {str(i + 1): name for i, name in enumerate(names)}
    np.testing.assert_allclose(found["transform"], tf.transform(rotation.about("z", 0.3), [0.2, -0.1, 0.05]), atol=1e-9)
    assert len(found["modes"]) == 6
    assert min(mode["mac"] for mode in found["modes"]) > 1 - 1e-9
    assert found["total"] == pytest.approx(1, abs=1e-6)
    assert min(found["comac"].values()) > 1 - 1e-6 and max(found["ecomac"].values()) < 1e-6
    assert np.min(found["frac"]) > 1 - 1e-6
    page = (tmp_path / "page/index.html").read_text()
    for words in ("Where they differ", "Shapes side by side", "Responses", "From the frame of the test"):
        assert words in page


@pytest.mark.slow
def test_the_wrong_machine_is_shown_beside_the_right_one(test_data, tmp_path, capsys):
    folder, names = test_data
    main(arguments(folder, names, "right.yaml", "--before", str(folder / "wrong.yaml"), "-o", str(tmp_path / "page")))
    shown = capsys.readouterr().out
    assert "FRAC" in shown and "total" in shown
    page = (tmp_path / "page/index.html").read_text()
    assert "MAC before" in page and "model before" in page


def test_components_carry_measured_points_on_the_bodies(test_data, tmp_path, capsys):
    """Three points of the housing and their modes: with components no point of the machine is needed."""
    folder, _ = test_data
    mill = four_part_mill()
    places = {k + 1: np.array(at) for k, at in enumerate([(0.1, -0.3, 0.8), (-0.1, -0.1, 1.1), (0.0, -0.3, 1.0)])}
    (tmp_path / "geometry.csv").write_text("\n".join(f"{k},{','.join(map(str, at))}" for k, at in places.items()) + "\n")
    (tmp_path / "components.yaml").write_text(
        "toolpoint: 1\nname: t\nchain: [ground, housing]\ncomponents:\n  housing: {points: [1, 2, 3]}\n")
    from toolpoint.studies.measured.model_correlation import with_measured_points
    machine = with_measured_points(mill, places, {"housing": [1, 2, 3]})
    modes = eigen.solve_undamped(assemble(machine, outputs=[f"{k}:{way}" for k in places for way in ("+x", "+y", "+z")]), 3)
    hdf5.write(modes, tmp_path / "modes.h5")
    main(["correlate", str(folder / "right.yaml"), str(tmp_path / "modes.h5"), "--geometry", str(tmp_path / "geometry.csv"),
          "--components", str(tmp_path / "components.yaml"), "--lowest-mac", "0.9", "-o", str(tmp_path / "page"), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["points_paired"] == {"1": "1", "2": "2", "3": "3"}
    assert found["total"] == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize(("more", "words"), [
    (["--components", __file__], "needs --geometry"), (["--pair", "1"], "write TEST=MODEL")])
def test_wrong_input(test_data, more, words, capsys):
    folder, _ = test_data
    with pytest.raises(SystemExit) as stopped:
        main(["correlate", str(folder / "right.yaml"), str(folder / "modes.h5"), *more])
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown
