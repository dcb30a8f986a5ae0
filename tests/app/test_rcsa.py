"""`toolpoint rcsa`: a gauge struck in a virtual spindle gives back the tool point; wrong inputs say what to do."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.io.binary import hdf5
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml import shaft_file
from toolpoint.studies.cuts.tool_coupling import _chart_doubts, study_tool
from toolpoint.substructuring import PlaneReceptance, SegmentDescription, ShaftDescription, couple_tool
from toolpoint.substructuring.shaft_stiffness import station_stiffness
from toolpoint.vibration import Frf

LINES = np.linspace(100.0, 3000.0, 300)
GAUGE = """toolpoint: 1
segments:
  bar: {length: 60 mm, diameter: 40 mm, loss_factor: 0.1 %}
stations: {a: 55 mm, b: 15 mm}
"""
TOOL = """toolpoint: 1
name: end mill
segments:
  shank: {length: 60 mm, diameter: 16 mm, material: carbide}
  flutes: {length: 40 mm, diameter: 16 mm, material: carbide, fluted: true}
"""


def spindle(plane, lines=LINES):
    values = np.zeros((lines.size, 2, 2), complex) + np.diag([1e-9, 4e-6])
    for f, stiffness, slope in ((600.0, 1e8, 5.0), (1400.0, 2e8 if plane == "x" else 1.5e8, -15.0)):
        values += np.outer([1, slope], [1, slope]) / stiffness / (1 - (lines / f) ** 2 + 0.08j * lines / f)[:, None, None]
    return values


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rcsa")
    (folder / "gauge.yaml").write_text(GAUGE)
    (folder / "tool.yaml").write_text(TOOL)
    gauge = ShaftDescription({"bar": SegmentDescription(0.06, 0.04, loss_factor=1e-3)}, stations={"a": 0.055, "b": 0.015})
    whole = station_stiffness(gauge, LINES)
    values = np.zeros((LINES.size, 4, 4), complex)
    for k, plane in enumerate("xy"):
        matrix = whole.matrix.copy()
        matrix[:, :2, :2] += np.linalg.inv(spindle(plane))
        at = [2 * s for s in whole.sections.values()]
        values[:, 2 * k:2 * k + 2, 2 * k:2 * k + 2] = np.linalg.inv(matrix)[:, at][:, :, at]
    labels = [f"{name}:+{plane}" for plane in "xy" for name in "ab"]
    hdf5.write(Frf(LINES, values, labels, labels), folder / "gauge.h5")
    return folder


def run(capsys, folder, *arguments):
    main(["rcsa", str(folder / "tool.yaml"), *map(str, arguments), "-o", str(folder / "page"), "--json"])
    return json.loads(capsys.readouterr().out)


def test_a_stated_calibration_widens_the_interval(capsys, folder):
    widths = []
    for percent in (0.1, 5):
        result = run(capsys, folder, "--frf", folder / "gauge.h5", "--gauge", folder / "gauge.yaml", "--draws", 40,
                     "--calibration", percent)
        (low, high), _ = result["peaks"][0]["intervals_hz_m_n"]
        widths.append(high - low)
    assert widths[1] > 3 * widths[0]


def test_gauge_to_tool_point_in_both_planes(capsys, folder):
    result = run(capsys, folder, "--frf", folder / "gauge.h5", "--gauge", folder / "gauge.yaml", "--noise", 0.05, "--draws", 40,
                 "--stick-out", "shank=50mm:60mm:2", "--save", folder / "tip.h5")
    tool = ShaftDescription({"shank": SegmentDescription(0.06, 0.016, material="carbide"),
                             "flutes": SegmentDescription(0.04, 0.016, material="carbide", fluted=True)})
    saved = hdf5.read(folder / "tip.h5", Frf)
    assert [str(d) for d in saved.outputs] == ["tool:+x", "tool:+y"] and saved.variance.max() > 0
    for k, plane in enumerate("xy"):
        truth = couple_tool(PlaneReceptance(LINES, spindle(plane), plane), tool).values[:, 0, 0]
        assert np.abs(saved.values[:, k, k] - truth).max() < 1e-7 * np.abs(truth).max()
        peak = next(p for p in result["peaks"] if p["plane"] == plane)
        fine = np.linspace(LINES[0], LINES[-1], 20 * LINES.size)
        size = np.abs(couple_tool(PlaneReceptance(fine, spindle(plane, fine), plane), tool).values[:, 0, 0])
        # Between the lines, which are 9.7 Hz apart.
        assert peak["frequency_hz"] == pytest.approx(fine[size.argmax()], abs=0.3)
        assert peak["receptance_m_n"] == pytest.approx(size.max(), rel=0.02)
    assert [s["length_m"] for s in result["stick_out"]] == [0.05, 0.06]
    assert result["stick_out"][0]["frequency_hz"] > result["stick_out"][1]["frequency_hz"]
    assert (folder / "page" / "index.html").stat().st_size > 1e5


def test_noise_that_is_not_stated_is_taken_from_the_scatter_of_lines_and_said(capsys, folder):
    result = run(capsys, folder, "--frf", folder / "gauge.h5", "--gauge", folder / "gauge.yaml")
    assert any(note.startswith("the noise is not stated") for note in result["notes"])
    (low, high), (least, most) = result["peaks"][0]["intervals_hz_m_n"]
    assert low < result["peaks"][0]["frequency_hz"] < high and least < result["peaks"][0]["receptance_m_n"] < most


def test_a_spindle_whose_noise_nobody_knows_has_no_interval():
    tool = ShaftDescription({"shank": SegmentDescription(0.06, 0.016, material="carbide")})
    result = study_tool([PlaneReceptance(LINES, spindle("x"))], tool)
    assert result.notes[0].startswith("interval: the noise") and result.to_dict()["peaks"][0]["intervals_hz_m_n"] is None


@pytest.mark.parametrize(("arguments", "words"), [
    ([], "neither or both"),
    (["--frf", "gauge.h5"], "--gauge, --at: one of them"),
    (["--frf", "gauge.h5", "--at", "a"], "no response and force at a:+ry"),
    (["--frf", "gauge.h5", "--gauge", "gauge.yaml", "--stick-out", "shank=3:1:2"], "--stick-out"),
    (["--frf", "gauge.h5", "--gauge", "gauge.yaml", "--stick-out", "shk=30mm:40mm:2"], "did you mean 'shank'"),
    (["--frf", "gauge.h5", "--gauge", "tool.yaml"], "gauge's stations"),
    (["--frf", "gauge.h5", "--gauge", "gauge.yaml", "--teeth", "4"], "add --lobes")])
def test_wrong_inputs_say_what_to_do(capsys, folder, monkeypatch, arguments, words):
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit):
        main(["rcsa", "tool.yaml", *arguments, "-o", "page"])
    assert words in " ".join(capsys.readouterr().err.split())


def test_schema_of_shaft_files(capsys):
    main(["schema", "shaft"])
    assert "segments" in json.loads(capsys.readouterr().out)["properties"]


def test_faults_of_a_shaft_file_have_their_lines(capsys, folder):
    (folder / "bad.yaml").write_text(TOOL.replace("diameter: 16 mm, material: carbide}", "diameter: 16 mm, bore: 17 mm}", 1))
    with pytest.raises(SystemExit):
        main(["rcsa", str(folder / "bad.yaml"), "--frf", str(folder / "bad.yaml"), "--gauge", str(folder / "bad.yaml")])
    assert "bad.yaml:4:" in capsys.readouterr().err


@pytest.mark.parametrize(("first", "words"), [("", "toolpoint: missing; write 'toolpoint: 1' as the first line"),
                                              ("toolpoint: 3\n", "file version 3; this program reads version 1")])
def test_a_file_without_its_version_has_one_fault(folder, first, words):
    (folder / "bare.yaml").write_text(first + "segments: {shank: {length: 50 mm, diameter: 16 mm}}\n")
    with pytest.raises(FileFaults) as caught:
        shaft_file.read(folder / "bare.yaml")
    assert words in str(caught.value) and len(caught.value.faults) == 1


def test_what_charts_say_against_their_limits_is_said_of_the_tool():
    sure, weak = SimpleNamespace(status="complete: all"), SimpleNamespace(status="doubtful: the stated error is 40 %")
    lobes = SimpleNamespace(chart=weak, doubts=("the stated error is 40 %", "no resonance in the band"))
    parts = [SimpleNamespace(length=0.04, chart=weak), SimpleNamespace(length=0.06, chart=sure)]
    assert _chart_doubts(lobes, parts) == ("lobes: doubtful: the stated error is 40 %",
                                           "lobes at 40 mm: doubtful: the stated error is 40 %", "no resonance in the band")
    assert _chart_doubts(None, []) == () == _chart_doubts(SimpleNamespace(chart=sure, doubts=()), parts[1:])
