"""`toolpoint machining`: what cannot be judged is refused in the words of the options, and nothing is written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from toolpoint.app.main import main

PROGRAM = "G21 G90\nS9000 M3\nG0 X-20 Y10 Z5\nG0 Z-2\nG1 X40 F1800\nG0 X10 Y10\nG0 Z5\n"
TOOL = ["--diameter", "10", "--teeth", "4", "--kt", "800", "--kn", "300", "--spacing", "0.5"]
STOCK = ["--stock", "box=0,0,-10,30,20,0"]


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Pages without a place go to the current folder: not to one where a user may keep his own."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "part.nc"
    path.write_text(PROGRAM)
    return path


def test_blocks_come_as_json(program: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["machining", str(program), *STOCK, *TOOL, "--json"])
    data = json.loads(capsys.readouterr().out)
    (block,) = data["blocks"]
    assert block["line"] == 5 and block["verdict"] == "not known" and block["depth_m"] == pytest.approx(2e-3)
    assert data["removed_m3"] == pytest.approx(600e-9, rel=1e-3)


@pytest.mark.parametrize(("arguments", "message"), [
    ([*TOOL, "--stock", "box=500,500,-10,530,520,0"], "is met by no cutting move"),
    ([*TOOL, "--stock", "pyramid=1,2,3"], "a box, a cylinder, an STL or a STEP file"),
    ([*TOOL, "--stock", "box=0,0,0,30,20,-10"], "two corners, the second above the first"),
    ([*STOCK, "--diameter", "10", "--teeth", "4", "--material", "unobtainium"], "unobtainium"),
    ([*STOCK, "--diameter", "10", "--teeth", "4"], "--kt, --kn missing"),
    ([*STOCK, *TOOL, "--flute-length", "22", "--stick-out", "15"], "at least the 22 mm of the edges"),
])
def test_refusals_name_the_option(program: Path, arguments: list[str], message: str,
                                  capsys: pytest.CaptureFixture[str]) -> None:
    page = program.parent / "page.html"
    with pytest.raises(SystemExit):
        main(["machining", str(program), *arguments, "--output", str(page)])
    assert message in " ".join(capsys.readouterr().err.split())
    assert not page.exists()


def test_a_rapid_through_stock_comes_first(program: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program.write_text(PROGRAM.replace("G1 X40 F1800\nG0 X10 Y10", "G1 X10 F1800\nG0 X-20 Y16"))
    main(["machining", str(program), *STOCK, *TOOL])
    out = capsys.readouterr().out
    assert out.startswith("doubt: rapid through stock: line 6, 2 mm deep at X ")


def test_the_program_itself_is_never_written_over(program: Path) -> None:
    with pytest.raises(SystemExit):
        main(["machining", str(program), *STOCK, *TOOL, "--write", str(program)])
    assert program.read_text() == PROGRAM


def test_a_record_beside_the_program_comes_as_json(program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Constant power over the record is no load of this program: it is doubted, and no coefficient is told."""
    record = tmp_path / "power.csv"
    rows = "\n".join(f"{0.01 * k:.2f},{0.4 + 0.001 * (k % 7)}" for k in range(400))
    record.write_text("time [s],spindle power [kW]\n" + rows)
    main(["machining", str(program), *STOCK, *TOOL, "--record", str(record), "--json"])
    data = json.loads(capsys.readouterr().out)["record"]
    assert data["unit"] == "W" and data["tangential_pa"] is None and data["doubts"]


def test_tilted_planes_are_stages_and_write_nothing_without_advice(program: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program.write_text("G21 G90\nS9000 M3\nG68.2 J45\nG53.1\nG0 X-7 Y0 Z5\nZ-1\nG1 X40 F1800\nG0 Z9\nG69\n")
    main(["machining", str(program), *STOCK, *TOOL, "--json"])
    (stage,) = json.loads(capsys.readouterr().out)["stages"]
    assert stage["removed_m3"] == pytest.approx(30e-9, rel=0.02)  # a ridge 1 mm deep, 2 mm wide at its foot, 30 mm long
    with pytest.raises(SystemExit):
        main(["machining", str(program), *STOCK, *TOOL, "--write", str(program.with_name("new.nc"))])
    assert "advice: none was made" in capsys.readouterr().err  # no dynamics were given
    assert not program.with_name("new.nc").exists()


def test_the_curve_of_the_spindle_is_read_from_its_option(program: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["machining", str(program), *STOCK, *TOOL, "--spindle-curve", "1000:0.2,12000:0.2"])
    assert "spindle torque: " in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main(["machining", str(program), *STOCK, *TOOL, "--spindle-curve", "1000"])
    assert "RPM:NM" in capsys.readouterr().err


def test_a_shaft_of_a_tool_needs_the_machine_and_its_point(program: Path, tmp_path: Path,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    drill = tmp_path / "drill.yaml"
    drill.write_text("toolpoint: 1\nsegments:\n  shank: {length: 60 mm, diameter: 10 mm}\n")
    shaft = ["--shaft", f"1={drill}"]
    for more, words in ((shaft, "--at"), ([*shaft, "--at", "nose"], "--machine")):
        with pytest.raises(SystemExit):
            main(["machining", str(program), *STOCK, *TOOL, *more])
        assert words in capsys.readouterr().err


def test_a_tool_of_a_number_needs_no_arc_and_a_file_of_another_kind_is_named(program: Path, tmp_path: Path,
                                                                             capsys: pytest.CaptureFixture[str]) -> None:
    tool = tmp_path / "tool.yaml"
    tool.write_text("cutting: {diameter: 10 mm, teeth: 4, tangential: 800 MPa, normal: 300 MPa}\n")
    main(["machining", str(program), *STOCK, *TOOL, "--tool", f"0={tool}", "--json"])
    assert json.loads(capsys.readouterr().out)["removed_m3"] == pytest.approx(600e-9, rel=1e-3)
    tool.write_text("segments: {shank: {length: 60 mm, diameter: 10 mm}}\n")
    with pytest.raises(SystemExit):
        main(["machining", str(program), *STOCK, *TOOL, "--tool", f"0={tool}"])
    assert "no section 'cutting', but segments" in " ".join(capsys.readouterr().err.split())
