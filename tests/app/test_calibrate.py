"""`toolpoint calibrate` on simulated dynamometer records: the true coefficients and run-out lie within the intervals."""

import json

import numpy as np
import pytest
from ruamel.yaml import YAML
from scipy.io import savemat

from toolpoint.app.main import main
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.io.binary import hdf5
from toolpoint.io.text import record_table
from toolpoint.vibration import Dof, Record

MATERIAL = CuttingCoefficients(767e6, 168.8e6, 222e6, 27.7e3, 26.6e3, 0.7e3)
TRUTH = {"kt": 767e6, "kn": 168.8e6, "ka": 222e6, "edge_t": 27.7e3, "edge_n": 26.6e3, "edge_a": 0.7e3}
FEEDS = (0.04, 0.08, 0.12, 0.16, 0.2)
EVERY = ",".join(map(str, FEEDS))
SPEED, RATE = 3000.0, 10000.0
TOOL = Tool(0.016, 4, helix=np.radians(30), runout=12e-6, runout_angle=0.7)
OPTIONS = ["--diameter", "16", "--teeth", "4", "--helix", "30", "--direction", "down", "--immersion", "0.5", "--speed", "3000",
           "--depth", "2"]


def dynamometer(feed, rng, tool=TOOL, arc=None, phase=0.0, turns=20, noise=0.02, speed=SPEED):
    """A record of `turns` revolutions that begins at an unknown angle, with noise of 2 % of the largest force."""
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    problem = MillingProblem(tool, arc or Engagement.down(0.5), MATERIAL, rigid, feed_per_tooth=1e-3 * feed)
    angle = phase + 2 * np.pi * speed / 60 / RATE * np.arange(int(turns * RATE * 60 / speed))
    force = rigid_forces(problem, 2e-3, angle, slices=100).force
    return force + noise * np.abs(force).max() * rng.standard_normal(force.shape)


def as_record(force):
    return Record(force, RATE, tuple(Dof("tool", f"+{way}") for way in "xyz"), ("force",) * 3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("forces")
    rng = np.random.default_rng(5)
    for i, feed in enumerate(FEEDS):
        record_table.write(as_record(dynamometer(feed, rng, phase=rng.uniform(0, 2 * np.pi), turns=8)), folder / f"f{i}.csv")
    return folder


def files(folder):
    return [str(folder / f"f{i}.csv") for i in range(len(FEEDS))]


def run(capsys, *arguments):
    main(["calibrate", *arguments, "--json"])
    return json.loads(capsys.readouterr().out)


def held(fit, truth, widened=1.0):
    for name, value in truth.items():
        low, high = fit["parameters"][name]["interval"]
        middle, half = (low + high) / 2, widened * (high - low) / 2
        assert abs(value - middle) <= half, (name, low, value, high)


@pytest.mark.slow
def test_coefficients_and_runout_of_records_that_begin_anywhere(folder, tmp_path, capsys):
    yaml_file = tmp_path / "cutting.yaml"
    found = run(capsys, *files(folder), *OPTIONS, "--feed", EVERY, "--yaml", str(yaml_file), "-o", str(tmp_path))
    fit = found["instantaneous"]
    truth = {**TRUTH, "runout": 12e-6}
    held(fit, truth, 1.5)  # seven intervals of 95 % at once: of three seeds one has a value a little outside
    ends = {name: fit["parameters"][name]["interval"] for name in truth}
    assert sum(ends[name][0] <= value <= ends[name][1] for name, value in truth.items()) >= 6
    assert fit["status"] == "converged"
    # The teeth are named by the fit: the true angle up to whole tooth pitches.
    turned = (fit["parameters"]["runout_angle"]["value"] - 0.7) / (np.pi / 2)
    assert abs(turned - round(turned)) < 0.05
    assert fit["parameters"]["kt"]["interval"][1] < 1.05 * fit["parameters"]["kt"]["interval"][0]
    # The mean forces are blind to run-out, which lifts the thin end of the chip out of the work.
    assert found["average"]["parameters"]["kt"]["value"] == pytest.approx(767e6, rel=0.06)
    section = YAML(typ="safe", pure=True).load(yaml_file.read_text())["cutting"]
    assert section["tangential"] == fit["parameters"]["kt"]["value"] and section["helix"] == pytest.approx(np.pi / 6)
    assert "Measured and fitted forces" in (tmp_path / "index.html").read_text()


@pytest.mark.slow
def test_intervals_hold_the_truth_over_many_records(capsys, tmp_path):
    """Known trigger angle, two feeds, opposite sign of a table dynamometer, HDF5: about 95 % of the intervals hold."""
    rng, inside = np.random.default_rng(11), []
    for _ in range(4):
        for i, feed in enumerate((0.06, 0.15)):
            hdf5.write(as_record(-dynamometer(feed, rng, turns=5, phase=0.3)), tmp_path / f"{i}.h5")
        fit = run(capsys, str(tmp_path / "0.h5"), str(tmp_path / "1.h5"), *OPTIONS, "--feed", "0.06,0.15", "--force-on", "work",
                  "--angle", str(np.degrees(0.3)), "-o", str(tmp_path))["instantaneous"]
        for name, value in {**TRUTH, "runout": 12e-6, "runout_angle": 0.7}.items():
            low, high = fit["parameters"][name]["interval"]
            inside.append(low <= value <= high)
    assert np.mean(inside) >= 0.85


@pytest.mark.slow
def test_one_file_with_a_column_of_the_feed_and_matlab_give_the_same(tmp_path, capsys):
    rng = np.random.default_rng(2)
    parts = [dynamometer(feed, rng, noise=0.0) for feed in (0.06, 0.12)]
    force, feed = np.concatenate(parts), np.repeat([0.06, 0.12], len(parts[0]))
    time = np.arange(len(force)) / RATE
    head = "Dynamometer of the test\ntime [ms];Fx [kN];Fy [kN];Fz [kN];feed [mm]\n"
    lines = "\n".join(";".join(f"{v:.10g}" for v in row) for row in np.column_stack([1e3 * time, 1e-3 * force, feed]))
    (tmp_path / "steps.csv").write_text(head + lines)
    savemat(tmp_path / "steps.mat", {"Fx": force[:, 0], "Fy": force[:, 1], "Fz": force[:, 2], "fs": RATE, "feed": 1e-3 * feed})
    for name in ("steps.csv", "steps.mat"):
        fit = run(capsys, str(tmp_path / name), *OPTIONS, "-o", str(tmp_path))["instantaneous"]
        assert fit["status"] == "converged"
        for key, value in TRUTH.items():
            assert fit["parameters"][key]["value"] == pytest.approx(value, rel=0.02)


@pytest.mark.slow
def test_ball_end_mill_and_unequal_pitch(tmp_path, capsys):
    """The edge of a ball is fitted slice by slice with its own chip normal; unequal pitch names the teeth by itself."""
    rng, arc = np.random.default_rng(3), Engagement(0.3, 1.9)
    pitch = np.radians([80.0, 95.0, 85.0, 100.0])
    for tool, more in ((Tool(0.016, 2, helix=0.4, corner_radius=0.008), ["--teeth", "2", "--corner-radius", "8"]),
                       (Tool(0.016, 4, helix=0.4, pitch=pitch, runout=8e-6, runout_angle=1.0),
                        ["--teeth", "4", "--pitch", "80,95,85,100"])):
        for i, feed in enumerate((0.06, 0.12)):
            record_table.write(as_record(dynamometer(feed, rng, tool, arc, 1.1 + i, noise=0.01)), tmp_path / f"{i}.txt")
        angles = ["--helix", str(np.degrees(0.4)), "--entry", str(np.degrees(0.3)), "--exit", str(np.degrees(1.9))]
        found = run(capsys, str(tmp_path / "0.txt"), str(tmp_path / "1.txt"), "--diameter", "16", *more, *angles,
                    "--speed", "3000", "--depth", "2", "--feed", "0.06,0.12", "-o", str(tmp_path),
                    *(["--no-runout"] if tool.corner_radius else []))
        fit = found["instantaneous"]
        held(fit, TRUTH, 1.7)
        assert found["average"]["parameters"]["kt"]["value"] == pytest.approx(767e6, rel=0.05)
        if tool.runout:
            assert fit["parameters"]["runout_angle"]["value"] == pytest.approx(1.0, abs=0.1)
            assert fit["parameters"]["runout"]["value"] == pytest.approx(8e-6, rel=0.1)


def test_a_written_record_reads_back_equal(tmp_path):
    record = as_record(np.random.default_rng(0).standard_normal((50, 3)))
    record_table.write(record, tmp_path / "r.csv")
    back = record_table.read(tmp_path / "r.csv")
    np.testing.assert_array_equal(back.samples, record.samples)
    assert back.channels == record.channels and back.sample_rate == pytest.approx(RATE)


TEXT = "time,Fx,Fy\n" + "\n".join(f"{i / 1000},{i},{-i}" for i in range(100))


@pytest.mark.parametrize(("text", "more", "words"), [
    (TEXT, ["--feed", "0.1,0.2"], "2 feeds for 1 files"), (TEXT, [], "no column 'feed'"),
    (TEXT, ["--feed", "0"], "must be above 0"), (TEXT.replace("Fy", "My"), ["--feed", "0.1"], "no force along y"),
    (TEXT.replace("0.05,", "0.0503,"), ["--feed", "0.1"], "evenly"),
    (TEXT.replace("3,3,", "3,nan,"), ["--feed", "0.1"], "not finite"),
    (TEXT.replace("time", "Fz"), ["--feed", "0.1"], "first column"), (TEXT.split("\n", 1)[1], ["--feed", "0.1"], "name them"),
    (TEXT.replace("Fx", "Fx [mm]"), ["--feed", "0.1"], "not one of force"),
    (TEXT.replace("\n0.003,3", "\n0.003,x"), ["--feed", "0.1"], "not a line of numbers"),
    (TEXT, ["--feed", "0.1", "--speed", "0"], "above zero"), (TEXT, ["--feed", "0.1", "--speed", "9000"], "at least 24"),
    (TEXT, ["--feed", "a"], "separated by commas"), (TEXT, ["--feed", "0.1", "--speed", "100"], "must hold a revolution"),
    (TEXT.replace("0.001,1,", "0,001;1;"), ["--feed", "0.1"], "decimal comma"),
    (TEXT, ["--feed", "0.1", "--pitch", "90,90,90,80", "--speed", "1500"], "add up to 360")])
def test_wrong_input(tmp_path, capsys, text, more, words):
    (tmp_path / "f.csv").write_text(text)
    with pytest.raises(SystemExit) as stopped:
        main(["calibrate", str(tmp_path / "f.csv"), *OPTIONS, *more, "-o", str(tmp_path)])
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown


@pytest.mark.slow
def test_a_speed_that_is_not_that_of_the_record_is_told_with_the_one_it_shows(folder, tmp_path, capsys):
    """Four teeth at 3000 rev/min pass 200 times a second."""
    record = [str(folder / "f2.csv"), *OPTIONS, "--feed", "0.12", "-o", str(tmp_path)]
    main(["calibrate", *record])
    assert "repeat with a revolution" not in capsys.readouterr().err
    main(["calibrate", *[word if word != "3000" else "3470" for word in record]])
    told = " ".join(capsys.readouterr().err.split())
    assert "line at 200 Hz is the tooth passing of 3000 rev/min" in told and "--speed" in told


@pytest.mark.slow
@pytest.mark.parametrize(("more", "words"), [
    (["--depth", "nan"], "--depth: nan mm"), (["--depth", "-2"], "above zero and at most 500 mm"),
    (["--yaml", "/nowhere/at/all.yaml"], "the folder /nowhere/at does not exist")])
def test_wrong_numbers_are_told_before_any_work(folder, more, words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["calibrate", str(folder / "f2.csv"), *OPTIONS, "--feed", "0.12", *more])
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown


@pytest.mark.slow
def test_forces_on_the_work_taken_for_those_on_the_tool_are_refused(folder, tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["calibrate", *files(folder), *OPTIONS, "--feed", EVERY, "--force-on", "work", "-o", str(tmp_path)])
    assert "must be above zero; forces measured on the workpiece" in capsys.readouterr().err


@pytest.mark.slow
def test_forces_in_another_unit_than_newton_are_doubted(folder, tmp_path, capsys):
    """In kN every coefficient is a thousandth."""
    lines = (folder / "f2.csv").read_text().splitlines()
    small = [",".join([row.split(",")[0], *(repr(float(v) / 1000) for v in row.split(",")[1:])]) for row in lines[1:]]
    (tmp_path / "kilo.csv").write_text("\n".join([lines[0], *small]))
    main(["calibrate", str(tmp_path / "kilo.csv"), *OPTIONS, "--feed", "0.12", "-o", str(tmp_path)])
    assert "forces must be in N (not kN" in " ".join(capsys.readouterr().err.split())


@pytest.mark.slow
@pytest.mark.parametrize(("wrong", "cause"), [
    (("--speed", "3010"), "repeat at 3000"), (("--helix", "0"), "`helix` near 30"), (("--teeth", "2"), "`teeth` 4"),
    (("--direction", "up"), "`direction` down"), ((), "")])
def test_wrong_inputs_are_seen_in_the_forces_and_named(folder, tmp_path, capsys, wrong, cause):
    """The record knows its speed; a wrong tool leaves a residual far above the scatter between turns. True inputs: no mark."""
    options = list(OPTIONS)
    for name, value in zip(wrong[::2], wrong[1::2], strict=True):
        options[options.index(name) + 1] = value
    found = run(capsys, *(files(folder)[i] for i in (0, 4)), *options, "--feed", "0.04,0.2", "-o", str(tmp_path))
    fit, said = found["instantaneous"], " ".join(found["doubts"]).replace("--", "`").replace("``", "`")
    if not wrong:
        assert fit["status"] == "converged" and found["doubts"] == []
        return
    assert found["average"]["status"].startswith("doubtful")  # mean forces know no course that could refuse the tool
    assert fit["status"].startswith("doubtful") and cause.replace("`", "") in said.replace("`", "")
    held(fit, {name: TRUTH[name] for name in ("kt", "kn")})  # the widened intervals hold the truth
