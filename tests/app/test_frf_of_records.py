"""`toolpoint frf` of records, its test file, and `toolpoint tap`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from signals.hammer_case import struck
from toolpoint.app.main import main
from toolpoint.io import read_frf
from toolpoint.io.binary import hdf5
from toolpoint.io.yaml.testing import test_file
from toolpoint.vibration import Frf, Modes
from toolpoint.vibration.frequency_response import modal

TIP = Modes(np.array([60.0, 140.0, 260.0]), np.array([0.04, 0.03, 0.035]), np.array([[1.0, 0.8, 0.6]]) * 0.3, ["1:+x"])


def hits(folder: Path, *heights: float, name: str = "hit") -> list[Path]:
    """Write a CSV file for each hit, velocities at the struck point."""
    rng = np.random.default_rng(1)
    paths = []
    for k, height in enumerate(heights, 1):
        record = struck([height], modes=TIP, rng=rng, noise=1e-4)
        path = folder / f"{name}_{k}.csv"
        rows = (",".join(f"{v:.9g}" for v in row) for row in np.column_stack([record.time, record.samples]))
        path.write_text("time [s],force 1:+x [N],velocity 1:+x [m/s]\n" + "\n".join(rows) + "\n")
        paths.append(path)
    return paths


def run(*arguments: object, code: int = 0) -> None:
    if code:
        with pytest.raises(SystemExit) as end:
            main([str(a) for a in arguments])
        assert end.value.code == code
    else:
        main([str(a) for a in arguments])


def test_records_to_responses_page_and_test_file(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = hits(tmp_path, 100, 8, 90, 110, 95)
    run("frf", *files, "--save", "tip.h5", "--test", "tip.yaml", "-o", "page", "--refuse", "hit_5.csv")
    text = capsys.readouterr().out
    assert "weak hit" in text and "refused by hand" in text and "from 3 of 5 hits" in text
    frf = hdf5.read("tip.h5", Frf)
    exact = modal(TIP, frf.frequency[20:300], ["1:+x"], inputs=["1:+x"], quantity="mobility").values
    assert np.abs(frf.values[20:300] - exact).max() < 0.02 * np.abs(exact).max()
    assert test_file.read("tip.yaml").hits == {"hit_5.csv": "refused"}
    page = Path("page/index.html").read_text()
    assert all(word in page for word in ("weak hit", "H2", "95 %", "Checks"))
    run("frf", "tip.yaml", "-o", "again", "--accept", "hit_2.csv", "--test", "tip.yaml", "--json")
    again = json.loads(capsys.readouterr().out)
    assert [hit["accepted"] for hit in again["hits"]] == [True, True, True, True, False]
    assert test_file.read("tip.yaml").hits == {"hit_5.csv": "refused", "hit_2.csv": "accepted"}


@pytest.mark.parametrize("kind", ["uff", "mat", "npz", "csv"])
def test_responses_are_saved_in_every_format(tmp_path, kind, capsys):
    files = hits(tmp_path, 100, 90, 110)
    run("frf", *files, "--save", tmp_path / f"tip.{kind}", "-o", tmp_path / "page")
    if kind != "csv":
        frf = read_frf(tmp_path / f"tip.{kind}")
        assert frf.quantity == "mobility" and frf.values.shape[1:] == (1, 1)
    else:
        assert (tmp_path / "tip.csv").read_text().startswith("frequency [Hz],real 1:+x / 1:+x [m/s/N]")


@pytest.mark.slow
def test_wrong_uses_are_named_and_nothing_is_written_over(tmp_path, capsys):
    files = hits(tmp_path, 100, 90)
    (tmp_path / "mine.yaml").write_text("keep: this\n")
    for arguments, words in (((*files, "--test", tmp_path / "mine.yaml"), "exists already; nothing was written"),
                             ((*files, "--at", "tool:+x"), "is for a machine file"),
                             ((*files, "--save", tmp_path / "x.docx"), "must end in"),
                             ((*files, "--accept", "hit_9.csv"), "no such hit"),
                             ((*files, "--name", "Q{input}"), "does not fit")):
        run("frf", *arguments, "-o", tmp_path / "page", code=2)
        assert words in capsys.readouterr().err
    assert (tmp_path / "mine.yaml").read_text() == "keep: this\n"
    run("identify", files[0], "-o", tmp_path / "page", code=2)
    assert "toolpoint frf" in capsys.readouterr().err


@pytest.mark.slow
def test_tap_of_records_in_x_and_y(tmp_path, capsys):
    x, y = hits(tmp_path, 100, 90, 110, 95), hits(tmp_path, 100, 80, 105, name="y")
    run("tap", *x, *(part for path in y for part in ("--y", path)), "--diameter", 12, "--teeth", 4, "--kt", 800, "--kn", 200,
        "--speeds", "600:3000:10", "-o", tmp_path / "page", "--json")
    result = json.loads(capsys.readouterr().out)
    assert result["colour"] in ("green", "amber") and 1 <= len(result["speeds_to_use"]) <= 3
    assert len(result["modes"]) == 2
    for mode, true in zip(TIP.frequency, result["modes"][0]["frequency_hz"], strict=False):
        assert np.abs(np.array(result["modes"][0]["frequency_hz"]) / mode - 1).min() < 0.01, true
    least = result["least_limit_m"]
    assert least["interval"][0] < least["depth"] < least["interval"][1]
    page = (tmp_path / "page" / "index.html").read_text()
    assert "Speeds to use" in page and "hits along y" in page


@pytest.mark.slow
def test_tap_of_the_measured_tool_holder_and_of_a_single_record(tmp_path, capsys):
    data = Path(__file__).parents[2] / ".." / "shared" / "data"
    if not data.exists():
        pytest.skip("the measured data are not beside this project")
    files = sorted((data / "tool_holder_frf").glob("*.txt"))
    run("tap", *files, "--name", "Point_{input}_*", "--diameter", 12, "--teeth", 4, "--material", "Al7075", "--json", "-o",
        tmp_path / "page")
    result = json.loads(capsys.readouterr().out)
    modes = np.array(result["modes"][0]["frequency_hz"])
    for picked in (1074.0, 1961.0, 2617.0):  # by hand by the author of the data
        assert np.abs(modes / picked - 1).min() < 0.01
    assert result["colour"] == "amber" and any("strike along y" in line for line in result["again"])
    record = data / "beam_hammer" / "acceleration.lvm"
    run("tap", record, "--diameter", 12, "--teeth", 4, "--material", "Al7075", "--json", "-o",
        tmp_path / "page")
    result = json.loads(capsys.readouterr().out)
    assert result["colour"] == "red" and "Do not cut" in result["status"]  # sensor and hammer stood apart
