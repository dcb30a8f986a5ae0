"""`toolpoint lobes` and `toolpoint mill` from a machine, from measured FRFs and from saved modes."""

import json
from pathlib import Path

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, SpeedVariation, Tool, stability
from toolpoint.io.binary import hdf5
from toolpoint.io.text import frf_table
from toolpoint.vibration import Modes, frequency_response

MACHINE = str(Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical_drives.yaml")
TOOL = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
SLOT = ["--direction", "slot", "--speeds", "5000:25000:3"]
CUT = ["--diameter", "12", "--teeth", "2", "--kt", "600", "--kn", "200"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dynamics")
    hdf5.write(TOOL, folder / "modes.h5")
    frf = frequency_response.modal(TOOL, np.arange(100.0, 6000.0, 1.0), ["tip:+x"], inputs=["tip:+x"])
    frf_table.write(frf, folder / "tip.txt")
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


@pytest.mark.slow
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


def python_limits(problem, speeds, depth_max):
    chart = stability.chart(problem, np.array(speeds), depth_max=depth_max)
    return [chart.intervals(i)[0][1] for i in range(len(speeds))]


@pytest.mark.slow
def test_every_option_of_the_tool_reaches_the_chart(folder, tmp_path, capsys):
    """The chart of the command line is that of the Python problem with the same tool, in its own units."""
    options = ["--modes", str(folder / "modes.h5"), *CUT, "--direction", "up", "--immersion", "0.4",
               "--speeds", "10000:10000:1"]
    plain = MillingProblem(Tool(0.012, 2), Engagement.up(0.4), CuttingCoefficients(6e8, 2e8), TOOL)
    pitch = np.radians([150.0, 210.0])
    cases = [
        (["--helix", "40"], plain.changed(tool=Tool(0.012, 2, helix=np.radians(40))), "PanelArnoldi"),
        (["--pitch", "150,210"], plain.changed(tool=Tool(0.012, 2, pitch=pitch)), "PanelArnoldi"),
        (["--corner-radius", "3"], plain.changed(tool=Tool(0.012, 2, corner_radius=3e-3)), "PanelArnoldi"),
        (["--process-damping", "400", "--damping-friction", "0.1"], plain.changed(process_damping=400, damping_friction=0.1),
         "PanelArnoldi"),
        (["--speed-variation", "0.2,3,45"], plain.changed(speed_variation=SpeedVariation(0.2, 3, np.pi / 4)), "PanelArnoldi"),
        (["--entry", "30", "--exit", "90"], plain.changed(engagement=Engagement(np.pi / 6, np.pi / 2)), "FloquetDeterminant"),
        (["--material", "al7075:2"], plain.changed(coefficients=CuttingCoefficients(600.5e6, 181e6)), "FloquetDeterminant")]
    for more, problem, method in cases:
        mine = options[:-4] + options[-2:] if "--entry" in more else options
        if "--material" in more:
            mine = mine[:mine.index("--kt")] + mine[mine.index("--kn") + 2:]
        found = run(capsys, "lobes", *mine, *more, "-o", str(tmp_path))
        limits = [intervals[0][1] for intervals in found["stable_intervals_m"]]
        assert found["method"] == method
        # Search levels depend on the range of depths, so the roots are equal only within the stated tolerance.
        np.testing.assert_allclose(limits, python_limits(problem, [10000.0], 1.3 * max(limits)), rtol=1e-4)


def test_panel_and_auto_agree_and_a_machine_file_says_its_own_cut(folder, tmp_path, capsys):
    modes = ["lobes", "--modes", str(folder / "modes.h5"), *CUT, "--direction", "slot", "--speeds", "15000:15000:1"]
    auto, panel = (run(capsys, *modes, "--method", name, "-o", str(tmp_path)) for name in ("auto", "panel"))
    assert (auto["method"], panel["method"]) == ("FloquetDeterminant", "PanelArnoldi")
    assert auto["stable_intervals_m"][0][0][1] == pytest.approx(panel["stable_intervals_m"][0][0][1], rel=1e-4)
    more = "  pitch: [60 deg, 84 deg, 60 deg, 84 deg, 72 deg]\n  axial: 300 MPa\n"
    text = Path(MACHINE).read_text().replace("  source: chosen\n\nreference", f"{more}\nreference")
    assert "pitch" in text
    (tmp_path / "own.yaml").write_text(text)
    found = run(capsys, "lobes", str(tmp_path / "own.yaml"), "--speeds", "1500:1500:1", "-o", str(tmp_path))
    assert found["method"] == "PanelArnoldi"
    main(["check", str(tmp_path / "own.yaml")])
    assert "pitch 60/84/60/84/72 deg" in capsys.readouterr().out


@pytest.mark.slow
def test_simulated_cut_takes_feed_runout_and_edge_forces(folder, tmp_path, capsys):
    """Mean power of a stable cut: work of the tangential force, K_t times the volume removed plus the edge's friction."""
    common = ["mill", "--modes", str(folder / "modes.h5"), "--diameter", "12", "--teeth", "2", "--direction", "slot", "--speed",
              "15000", "--depth", "0.02", "--kt", "600", "--kn", "200", "-o", str(tmp_path)]
    fast, edged = run(capsys, *common, "--feed", "0.2"), run(capsys, *common, "--feed", "0.1", "--kte", "20")
    volume = 2 * 15000 / 60 * 0.012 * 0.02e-3
    assert fast["power_w"] == pytest.approx(600e6 * 0.2e-3 * volume, rel=0.02)
    friction = 20e3 * 0.02e-3 * np.pi * 0.012 * 15000 / 60  # one of two teeth is in the slot
    assert edged["power_w"] == pytest.approx(600e6 * 0.1e-3 * volume + friction, rel=0.02)
    out = run(capsys, *common, "--runout", "20", "--runout-angle", "30")
    assert out["peak_to_peak_m"] != run(capsys, *common)["peak_to_peak_m"]


def test_materials_of_the_literature_are_listed(capsys):
    main(["lobes", "--materials"])
    shown = capsys.readouterr().out
    assert "Al 7075:4" in shown and "1319.4" in shown and "10.1186/s10033-021-00536-9" in shown and "VDI 3323" in shown


TRIED = ["--speeds", "8000:20000:25", "--immersion", "0.05", "--direction", "down"]


def test_probability_and_advice_of_uncertain_cuts(folder, tmp_path, capsys):
    modes = ["--modes", str(folder / "modes.h5")]
    found = run(capsys, "lobes", *modes, *CUT, *TRIED, "--probability", "40", "--uncertainty", "1,-,5,10",
                "--tried", "16000:0.5:stable", "-o", str(tmp_path))
    advice = {row[0]: (float(row[1]), float(row[2])) for row in found["advice"]}
    chart, certain = advice["best cut of the chart"], advice["best cut with 95 % certainty"]
    at = found["speed_rpm"].index(min(found["speed_rpm"], key=lambda n: abs(n - chart[0])))
    assert chart[1] <= 1e3 * found["stable_intervals_m"][at][0][1] * 0.9 * 1.01
    assert certain[0] * certain[1] <= 1.05 * chart[0] * chart[1] / 0.9
    page = (tmp_path / "index.html").read_text()
    assert "Probability of stability" in page and "What to measure better" in page
    assert "damping ratios: 10 % (assumed)" in page and found["contradictions"] == []


@pytest.mark.slow
def test_no_cut_is_certain_while_a_tried_cut_contradicts_the_model(folder, tmp_path, capsys):
    common = ["lobes", "--modes", str(folder / "modes.h5"), *CUT, *TRIED, "--probability", "40", "--uncertainty", "1,-,5,10",
              "--tried", "16000:0.5:stable", "--tried", "13000:2:chatter", "-o", str(tmp_path)]
    found = run(capsys, *common)
    advice = {row[0]: row for row in found["advice"]}
    assert advice["best cut with 95 % certainty"][1:3] == ["-", "-"]
    assert all("a tried cut contradicts the model" in row[3] for row in advice.values())
    assert len(found["contradictions"]) == 1 and "13000 rev/min and 2 mm" in found["contradictions"][0]
    main(common)
    assert "no depth is certain" in " ".join(capsys.readouterr().out.replace("│", " ").split())
    page = (tmp_path / "index.html").read_text()
    assert "Not to be relied on: a tried cut contradicts the model" in page
    # 13000 rev/min lies in the widest lobe, where the two-mode cut is stable beyond 2 mm whatever the sample.
    assert "13000 rev/min and 2 mm contradicts the model" in page and "16000 rev/min and 0.5 mm contradicts" not in page


def test_speeds_from_a_chatter_frequency_alone(capsys):
    """60 f / (N k): 850 Hz, three teeth."""
    found = run(capsys, "speeds", "--chatter", "850", "--teeth", "3", "--highest", "24000", "--lowest", "5000")
    assert [one["speed_rpm"] for one in found] == pytest.approx([17000, 8500, 17000 / 3])


@pytest.mark.parametrize(("arguments", "words"), [
    (["lobes", MACHINE, "--tried", "12000:1:stable"], "--probability"),
    (["lobes", MACHINE, "--probability", "9", "--tried", "12000:1"], "SPEED:DEPTH:OUTCOME"),
    (["lobes", MACHINE, "--probability", "9", "--uncertainty", "1,2"], "four numbers"),
    (["lobes", MACHINE, "--probability", "9", "--uncertainty", "1,2,-3,4"], "none below zero"),
    (["lobes", MACHINE, "--speeds", "900:1500:3", "--probability", "2", "--tried", "9000:1:stable"], "within the chart"),
    (["speeds", "--chatter", "50", "--teeth", "4", "--highest", "300", "--lowest", "260"], "no lobe"),
    (["speeds", "--chatter", "0", "--teeth", "4", "--highest", "300"], "above zero"),
    (["lobes", MACHINE, "--helix", "30,40"], "one for each of the 5 teeth"),
    (["lobes", MACHINE, "--pitch", "90,90"], "5 teeth"),
    (["lobes", MACHINE, "--material", "al 7065"], "did you mean 'Al 7075'"), (["lobes", MACHINE, "--helix", "a"], "separated"),
    (["lobes", MACHINE, "--speed-variation", "1,2,3,4"], "SHARE,REVOLUTIONS"), (["lobes", MACHINE, "--entry", "20"], "exit"),
    (["lobes", MACHINE, "--corner-radius", "50"], "ball"), (["lobes", MACHINE, "--speed-variation", "0.95,4"], "0.9"),
    (["lobes", MACHINE, "--entry", "20", "--exit", "90", "--immersion", "0.3"], "left out"),
    (["lobes", MACHINE, "--process-damping", "-3"], "must be at least 0 N/m"), (["lobes", MACHINE, "--ka", "-3"], "ka"),
    (["lobes", MACHINE, "--material", "c45", "--kn", "300"], "feed_per_tooth"),
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


def test_values_taken_from_the_example_are_named_and_only_those(folder, tmp_path, capsys):
    modes = ["--modes", str(folder / "modes.h5"), "--speeds", "9000:12000:2", "-o", str(tmp_path)]
    main(["lobes", *modes, *CUT, "--direction", "slot"])
    assert "example" not in capsys.readouterr().out
    main(["lobes", *modes, "--diameter", "12", "--kt", "600", "--direction", "slot"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "taken from an example: 4 teeth, kn" in shown


def test_json_states_error_and_chatter_frequency_of_every_limit(folder, tmp_path, capsys):
    found = run(capsys, "lobes", "--modes", str(folder / "modes.h5"), *CUT, *SLOT, "-o", str(tmp_path))
    assert all(0 < error < 1e-8 for error in found["limit_error_m"])
    # Two equal modes at 922 Hz: chatter a little above.
    assert all(900 < f < 1000 for f in found["chatter_frequency_hz"])
    main(["lobes", "--modes", str(folder / "modes.h5"), *CUT, *SLOT, "-o", str(tmp_path)])
    shown = capsys.readouterr().out
    assert "error mm" in shown and "chatter Hz" in shown


def test_a_band_that_ends_below_the_resonance_leaves_rough_limits_first_in_the_notes(folder, tmp_path, capsys):
    found = run(capsys, "lobes", "--frf", str(folder / "tip.txt"), "--band", "100:960", *CUT, *SLOT, "-o", str(tmp_path))
    assert "missing is the band above 960 Hz" in found["notes"][0] and "no stated error holds it" in found["notes"][0]
    assert any("limits: the stated error is" in note for note in found["notes"])
    assert found["status"].startswith("doubtful: limits: the stated error is")
    page = (tmp_path / "index.html").read_text()
    order = ("Before you rely on this", "missing is the band above 960 Hz", "What this rests on")
    places = [page.index(words) for words in order]
    assert places == sorted(places)


@pytest.mark.parametrize(("direction", "wall"), [("up", "teeth enter the cut"), ("down", "teeth leave the cut"),
                                                 ("centred", None)])
def test_the_location_error_is_that_of_the_wall_that_is_left(folder, tmp_path, direction, wall):
    main(["lobes", "--modes", str(folder / "modes.h5"), *CUT, "--direction", direction, "--immersion", "0.1", "--speeds",
          "5000:25000:3", "--feed", "0.1", "-o", str(tmp_path)])
    page = (tmp_path / "index.html").read_text()
    assert (wall in page) if wall else "Surface location error" not in page


def test_a_ball_end_mill_with_feed_has_lobes(folder, tmp_path):
    ball = ["--corner-radius", "6", "--feed", "0.1", "-o", str(tmp_path)]
    main(["lobes", "--modes", str(folder / "modes.h5"), *CUT, *SLOT, *ball])
    assert "Surface location error" not in (tmp_path / "index.html").read_text()


@pytest.mark.slow
def test_names_of_files_by_a_pattern_serve_lobes_and_report(folder, tmp_path, capsys):
    """The same file under a shop's own name gives the same limits, by --name, as under the name of its label."""
    odd = tmp_path / "Halter_Punkt_7_links.txt"
    odd.write_text((folder / "tip.txt").read_text())
    quick = [*CUT, *SLOT, "--method", "zero-order"]
    by_name = run(capsys, "lobes", "--frf", str(odd), "--name", "Halter_Punkt_{output}_*", *quick, "-o", str(tmp_path / "a"))
    plain = run(capsys, "lobes", "--frf", str(folder / "tip.txt"), *quick, "-o", str(tmp_path / "b"))
    assert by_name["stable_intervals_m"] == plain["stable_intervals_m"]
    modes = str(folder / "modes.h5")
    for words, complaint in ((["report", "--frf", str(odd), "--name", "Punkt_{output}"], "does not fit"),
                             (["lobes", "--modes", modes, "--name", "{output}", *quick], "is for measured FRFs")):
        with pytest.raises(SystemExit):
            main(words)
        assert complaint in capsys.readouterr().err
