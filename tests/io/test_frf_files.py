"""One reader of measured responses: the same data in every format give the same labels and values, in every command."""

import json

import numpy as np
import pytest
from scipy.io import savemat

from toolpoint import ToolpointError
from toolpoint.app.main import main
from toolpoint.io import uff
from toolpoint.io.binary import hdf5, numpy_arrays
from toolpoint.io.measured import frf_files
from toolpoint.io.text import frf_table
from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble
from toolpoint.vibration import Frf, Modes, frequency_response

FORMATS = ("text", "universal", "matlab", "hdf5", "numpy")
POINTS = {1: (0.5, 0.4, 0.3), 2: (-0.5, 0.4, 0.3), 3: (0.5, -0.4, 0.3), 4: (0.5, 0.4, -0.3)}
MACHINE = """toolpoint: 1
name: block on springs
bodies:
  block: {mass: 500 kg, centre: [0, 0, 0], shape: {kind: box, size: [1, 0.8, 0.6]}}
joints:
  feet: {parent: ground, child: block, at: [0.1, 0.05, -0.3], stiffness: {rx: 9e7, ry: 8e7, rz: 3e7}}
points:
""" + "".join(f"  {name}: {{body: block, at: {list(at)}}}\n" for name, at in POINTS.items())
MACHINE += "tool: '1'\ndamping_ratio: 0.03\n"
COMPONENTS = """toolpoint: 1
name: block on springs
chain: [ground, block]
components:
  block: {points: [1, 2, 3, 4], body: {mass: 500 kg, centre: [0, 0, 0], shape: {kind: box, size: [1, 0.8, 0.6]}}}
"""
CUT = ["--diameter", "12", "--teeth", "2", "--kt", "600", "--kn", "200", "--direction", "slot"]


def write(frf, folder, kind):
    """Write responses in a format and return the files."""
    if kind == "universal":
        uff.write(folder / "test.unv", frf)
        return [folder / "test.unv"]
    if kind == "matlab":
        savemat(folder / "test.mat", {"f": frf.frequency, "H": frf.values, "quantity": frf.quantity,
                                      "outputs": [str(d) for d in frf.outputs], "inputs": [str(d) for d in frf.inputs]})
        return [folder / "test.mat"]
    if kind == "hdf5":
        hdf5.write(frf, folder / "test.h5")
        return [folder / "test.h5"]
    if kind == "numpy":
        numpy_arrays.write_frf(frf, folder / "test.npz")
        return [folder / "test.npz"]
    paths = []
    for output in frf.outputs:
        for struck in frf.inputs:
            paths.append(folder / f"{output}__{struck}.txt".replace(":", "="))
            frf_table.write(frf.selected([output], [struck]), paths[-1])
    return paths


@pytest.fixture(scope="module")
def test_files(tmp_path_factory):
    """The same responses of the machine, struck at point 1 in x, y and z, in every format; machine, geometry, components."""
    folder = tmp_path_factory.mktemp("formats")
    (folder / "machine.yaml").write_text(MACHINE)
    (folder / "parts.yaml").write_text(COMPONENTS)
    (folder / "points.csv").write_text("".join(f"{name},{x},{y},{z}\n" for name, (x, y, z) in POINTS.items()))
    labels = [f"{point}:+{way}" for point in POINTS for way in "xyz"]
    system = assemble(machine_file.read(folder / "machine.yaml"), None, labels, inputs=labels[:3])
    frf = frequency_response.direct(system, np.arange(40.0, 400.0, 0.5))
    files = {}
    for kind in FORMATS:
        (folder / kind).mkdir()
        files[kind] = [str(path) for path in write(frf, folder / kind, kind)]
    return folder, frf, files


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_gives_the_same_labels_and_values(test_files, kind):
    _, frf, files = test_files
    read = frf_files.read(files[kind])
    assert (read.outputs, read.inputs, read.quantity) == (frf.outputs, frf.inputs, "receptance")
    np.testing.assert_allclose(read.values, frf.values, rtol=1e-12)
    np.testing.assert_allclose(read.frequency, frf.frequency, rtol=1e-12)


def _numbers(value):
    """The numbers of a result in one row; texts and notes, which name the files, are left out."""
    if isinstance(value, dict):
        return [n for key, part in value.items() if key != "notes" for n in _numbers(part)]
    if isinstance(value, list):
        return [n for part in value for n in _numbers(part)]
    return [float(value)] if isinstance(value, (int, float)) else []


COMMANDS = {
    "lobes": ["lobes", "--frf*", "--band", "40:400", *CUT, "--speeds", "3000:9000:3"],
    "turn": ["turn", "--frf*", "--band", "40:400", "--kf", "900", "--speeds", "1000:3000:3"],
    "mill": ["mill", "--frf*", "--band", "40:400", *CUT, "--speed", "3000", "--depth", "0.5", "--revolutions", "8"],
    "identify": ["identify", "*"],
    "correlate": ["correlate", "{}/machine.yaml", "*", "--geometry", "{}/points.csv"],
    "joints": ["joints", "*", "--geometry", "{}/points.csv", "--components", "{}/parts.yaml"],
    "update": ["update", "{}/machine.yaml", "--frf*", "--parameter", "joints.feet.stiffness.rx"]}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_every_command_takes_every_format_alike(test_files, command, tmp_path, capsys):
    folder, _, files = test_files
    results = {}
    for kind in FORMATS:
        arguments = []
        for part in COMMANDS[command]:
            each = [[part[:-1], path] if part != "*" else [path] for path in files[kind]] if part.endswith("*") else [
                [part.format(folder)]]
            arguments += [word for words in each for word in words]
        main([*arguments, "-o", str(tmp_path), "--json"])
        results[kind] = _numbers(json.loads(capsys.readouterr().out))
    for kind in FORMATS[1:]:
        np.testing.assert_allclose(results[kind], results["text"], rtol=1e-6, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS)
def test_a_report_takes_every_format_alike(test_files, kind, tmp_path, capsys):
    files = test_files[2]
    main(["report", *(word for path in files[kind] for word in ("--frf", path)), "--band", "40:400", "-o", str(tmp_path)])
    shown = " ".join(capsys.readouterr().out.split())
    assert "response of 1:+x to 1:+x as driving-point response of the tool tip, and that of 1:+y across" in shown


@pytest.fixture
def crossed(tmp_path):
    """A cross response between two points, under a name that says so."""
    modes = Modes([600.0, 900.0], 0.03, [[4.0, 1.0], [1.0, -4.0]], ("1:+z", "2:+x"))
    path = tmp_path / "2=+x__1=+z.txt"
    frf_table.write(frequency_response.modal(modes, np.arange(2.0, 2000.0, 2.0), outputs=["2:+x"], inputs=["1:+z"]), path)
    return path


def test_a_cross_response_is_no_driving_point_in_any_command(crossed, tmp_path, capsys):
    for arguments in (["lobes", "--frf", crossed, *CUT], ["turn", "--frf", crossed, "--kf", "900"],
                      ["mill", "--frf", crossed, *CUT, "--speed", "3000", "--depth", "1"],
                      ["lobes", "--frf-x", crossed, *CUT]):
        with pytest.raises(SystemExit):
            main([*map(str, arguments), "-o", str(tmp_path)])
        assert "no driving point" in " ".join(capsys.readouterr().err.split())
    main(["report", "--frf", str(crossed), "-o", str(tmp_path)])
    shown = capsys.readouterr().out
    assert "No stability chart" in shown and "no driving point" in shown and "Lobes from the measured FRF" not in shown


def test_the_pair_of_plain_names_works_wherever_the_data_suffice(tmp_path, capsys):
    """tip.txt holder.txt: two points, both struck at the tip: the lobes are those of tip.txt alone."""
    modes = Modes([600.0, 900.0], 0.03, [[4.0, 1.0], [1.0, -4.0]], ("tip:+x", "holder:+x"))
    for name in ("tip", "holder"):
        frf_table.write(frequency_response.modal(modes, np.arange(2.0, 2000.0, 2.0), outputs=[f"{name}:+x"],
                                                 inputs=["tip:+x"]), tmp_path / f"{name}.txt")
    pair = [str(tmp_path / "tip.txt"), str(tmp_path / "holder.txt")]
    frf = frf_files.read(pair)
    assert [str(d) for d in (*frf.outputs, *frf.inputs)] == ["tip:+x", "holder:+x", "tip:+x"]
    assert any("struck at tip:+x" in note for note in frf.notes)
    limits = []
    for files in (pair, pair[:1]):
        main(["lobes", *(word for path in files for word in ("--frf", path)), *CUT, "--speeds", "9000:18000:3", "--json",
              "-o", str(tmp_path)])
        limits.append(json.loads(capsys.readouterr().out)["stable_intervals_m"])
    assert limits[0] == limits[1]
    main(["identify", *pair, "--json", "-o", str(tmp_path)])
    np.testing.assert_allclose(json.loads(capsys.readouterr().out)["frequency_hz"], [600, 900], rtol=1e-3)


def test_names_and_the_first_point_label_tables(tmp_path):
    frf = Frf(np.arange(1.0, 9), np.ones((8, 1, 1)) + 0j, ("1:+x",), ("1:+x",))
    (tmp_path / "a.txt").write_text("".join(f"{line} 1 0\n" for line in range(1, 9)))
    np.save(tmp_path / "b.npy", np.column_stack([frf.frequency, np.full(8, 2.0), np.zeros(8)]))
    files = [tmp_path / "a.txt", tmp_path / "b.npy"]
    read = frf_files.read(files, names=["tip=+y__tip=+y", "5=-z__tip=+y"], quantity="accelerance")
    assert [str(d) for d in (*read.outputs, *read.inputs)] == ["tip:+y", "5:-z", "tip:+y"]
    np.testing.assert_array_equal(read.values[0, :, 0], [1, 2])
    with pytest.raises(ToolpointError, match="1 names for 2 files"):
        frf_files.read(files, names=["tip"])


@pytest.mark.parametrize(("names", "words"), [
    (("x.txt", "y.txt"), "does not say its direction"), (("d/a.txt", "a.txt"), "two files are named a"),
    (("tip=+x.txt", "tip=+y.txt"), "OUTPUT__INPUT")])
def test_names_that_could_mean_several_things_are_refused(tmp_path, names, words):
    (tmp_path / "d").mkdir()
    for name in names:
        frf_table.write(Frf(np.arange(1.0, 9), np.ones((8, 1, 1)) + 0j, ("1:+x",), ("1:+x",)), tmp_path / name)
    with pytest.raises(ToolpointError, match=words):
        frf_files.read([tmp_path / name for name in names])


def test_numpy_files_without_their_keys_or_with_objects_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", frequency=np.arange(3.0))
    with pytest.raises(ToolpointError, match="no array values, outputs, inputs"):
        frf_files.read(tmp_path / "a.npz")
    np.save(tmp_path / "b.npy", np.array([{"a": 1}], object), allow_pickle=True)
    with pytest.raises(ToolpointError, match="not a NumPy file of numbers"):
        frf_files.read(tmp_path / "b.npy")
