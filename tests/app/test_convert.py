"""`toolpoint convert`: responses, modes, records between formats, joined bands; tables and pictures of pages; lines of
geometry."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from toolpoint import Frf, Modes, Record, ToolpointError
from toolpoint.app.main import main
from toolpoint.io import read_frf, read_records
from toolpoint.io.binary import hdf5
from toolpoint.io.measured import geometry_files, mode_files
from toolpoint.io.page_tables import read_tables, write_tables
from toolpoint.plot import Report, Table
from toolpoint.vibration.frequency_response import modal

MODES = Modes(np.array([40.0, 90.0]), np.array([0.02, 0.03]), np.array([[1.0, 0.5], [0.4, -0.8]]), ["1:+x", "2:+x"])


def responses(low: float, high: float) -> Frf:
    return modal(MODES, np.arange(low, high), ["1:+x", "2:+x"], inputs=["1:+x"])


def run(*arguments: object) -> None:
    main(["convert", *[str(a) for a in arguments]])


def refused(capsys, *arguments: object) -> str:
    with pytest.raises(SystemExit) as end:
        run(*arguments)
    assert end.value.code == 2
    return capsys.readouterr().err


def texts(folder: Path, frf: Frf, name: str) -> list[Path]:
    """Write one text table a response, named as measuring systems do."""
    paths = []
    for k, dof in enumerate(frf.outputs):
        path = folder / f"{name}_{dof.point}_Ch1.txt"
        rows = zip(frf.frequency.tolist(), frf.values[:, k, 0].tolist(), strict=True)
        path.write_text("\n".join(f"{f!r}\t{v.real!r}\t{v.imag!r}" for f, v in rows))
        paths.append(path)
    return paths


@pytest.mark.parametrize("kind", ["h5", "uff", "mat", "npz"])
def test_text_tables_of_two_bands_become_one_file(tmp_path, kind, capsys):
    files = texts(tmp_path, responses(10, 60), "LowBand") + texts(tmp_path, responses(60, 130), "HighBand")
    run(*files, "--to", tmp_path / f"all.{kind}", "--name", "*Band_{output}_*", "--struck", "1:+x", "--quantity", "receptance")
    frf = read_frf(tmp_path / f"all.{kind}")
    whole = responses(10, 130)
    assert frf.frequency.tolist() == whole.frequency.tolist() and frf.outputs == whole.outputs
    assert np.abs(frf.values - whole.values).max() < 1e-12 * np.abs(whole.values).max()


def test_overlapping_bands_and_equal_names_are_refused(tmp_path, capsys):
    files = texts(tmp_path, responses(10, 80), "Low") + texts(tmp_path, responses(60, 130), "High")
    assert "would both be 1:+x" in refused(capsys, *files, "--to", tmp_path / "a.h5", "--name", "*_{output}_*")
    first, second = responses(10, 80), responses(60, 130)
    hdf5.write(first, tmp_path / "f.h5")
    hdf5.write(second, tmp_path / "s.h5")
    assert "overlap" in refused(capsys, tmp_path / "f.h5", tmp_path / "s.h5", "--to", tmp_path / "a.h5")


def test_variables_of_other_names(tmp_path, capsys):
    from scipy.io import savemat

    frf = responses(10, 60)
    savemat(tmp_path / "x.mat", {"hz": frf.frequency, "H": frf.values, "other": frf.values * 2})
    np.savez(tmp_path / "x.npz", hz=frf.frequency, H=frf.values[:, :, 0])
    for kind in ("mat", "npz"):
        run(tmp_path / f"x.{kind}", "--to", tmp_path / f"{kind}.h5", "--variables", "frequency=hz,values=H", "--quantity",
            "receptance")
        assert np.allclose(hdf5.read(tmp_path / f"{kind}.h5", Frf).values, frf.values)
    assert "no variable 'G'" in refused(capsys, tmp_path / "x.mat", "--to", tmp_path / "y.h5", "--variables",
                                        "frequency=hz,values=G")


@pytest.mark.parametrize("kind", ["uff", "csv", "mat", "npz", "h5"])
def test_modes(tmp_path, kind, capsys):
    hdf5.write(MODES, tmp_path / "modes.h5")
    target = tmp_path / f"out.{kind}"
    run(tmp_path / "modes.h5", "--to", target)
    if kind == "csv":
        rows = list(csv.DictReader(target.open()))
        assert len(rows) == 4 and float(rows[3]["real"]) == -0.8 and float(rows[3]["frequency [Hz]"]) == 90
    elif kind == "npz":
        assert np.allclose(np.load(target)["shape"], MODES.shape)
    elif kind in ("uff", "h5"):
        assert np.allclose(mode_files.read(target).frequency, MODES.frequency, rtol=1e-5)
        run(target, "--to", tmp_path / "back.csv")
    assert "exists already; nothing was written" in refused(capsys, tmp_path / "modes.h5", "--to", target)
    run(tmp_path / "modes.h5", "--to", target, "--replace")


@pytest.mark.parametrize("kind", ["uff", "csv", "mat", "npz", "h5"])
def test_records(tmp_path, kind, capsys):
    samples = np.random.default_rng(0).standard_normal((50, 2))
    hdf5.write(Record(samples, 1000.0, ["5:-z", "6:+x"], ("force", "acceleration")), tmp_path / "r.h5")
    run(tmp_path / "r.h5", "--to", tmp_path / f"out.{kind}")
    record = read_records(tmp_path / f"out.{kind}").records[0]
    assert np.allclose(record.samples, samples) and [str(dof) for dof in record.channels] == ["5:-z", "6:+x"]


def test_a_windows_decay_is_not_lost_in_silence(tmp_path, capsys):
    frf = responses(10, 60)
    hdf5.write(Frf(frf.frequency, frf.values, frf.outputs, frf.inputs, decay=2.0), tmp_path / "a.h5")
    run(tmp_path / "a.h5", "--to", tmp_path / "a.uff")
    assert "does not hold the decay" in capsys.readouterr().err


def test_tables_of_a_page(tmp_path, capsys):
    part = Table(["mode", "Hz_1"], [[1, 12.5], ["2 %", 80.0]])
    page = Report("Modes").with_section("Modes & more", part).save(tmp_path / "p")
    (table,) = read_tables(page)
    assert table.title == "Modes & more" and table.rows[0] == ["1", "12.5"]
    run(page, "--to", tmp_path / "tables", "--tables", "csv")
    assert (tmp_path / "tables" / "modes_more.csv").read_text().splitlines()[0] == "mode,Hz_1"
    run(tmp_path / "p", "--to", tmp_path / "tables", "--tables", "tex")
    latex = (tmp_path / "tables" / "modes_more.tex").read_text()
    assert r"Hz\_1" in latex and r"2 \%" in latex and r"\bottomrule" in latex
    with pytest.raises(ToolpointError, match="exists already"):
        write_tables(page, tmp_path / "tables", "csv")
    assert "with --pictures png" in refused(capsys, page, "--to", tmp_path / "x")


@pytest.mark.slow
@pytest.mark.browser
def test_pictures_of_a_page(tmp_path):
    pytest.importorskip("playwright")
    import shutil

    if not any(map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))):
        pytest.skip("no browser")
    from toolpoint.plot import Chart, bode

    page = Report("Responses").with_section("Bode", Chart(bode(responses(10, 130)), name="bode")).save(tmp_path / "p")
    run(page, "--to", tmp_path / "pictures", "--pictures", "png")
    run(page, "--to", tmp_path / "pictures", "--pictures", "svg")
    assert (tmp_path / "pictures" / "bode.png").read_bytes()[:4] == b"\x89PNG"
    assert (tmp_path / "pictures" / "bode.svg").read_text().startswith("<svg")


@pytest.mark.slow
@pytest.mark.browser
def test_pictures_are_drawn_beside_a_loop_that_runs(tmp_path):
    """A notebook, and a test with a browser of its own, have an event loop in their thread."""
    pytest.importorskip("playwright")
    import asyncio
    import shutil
    from concurrent.futures import ThreadPoolExecutor

    if not any(map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))):
        pytest.skip("no browser")
    from toolpoint.io import write_pictures
    from toolpoint.plot import Chart, bode

    page = Report("Responses").with_section("Bode", Chart(bode(responses(10, 130)), name="bode")).save(tmp_path / "p")

    async def draw():
        return write_pictures(page, tmp_path / "pictures", "svg")
    with ThreadPoolExecutor(1) as pool:  # a browser test before may have left its own loop running in this thread
        assert [file.name for file in pool.submit(lambda: asyncio.run(draw())).result()] == ["bode.svg"]


def test_lines_of_a_geometry(tmp_path):
    points, lines = tmp_path / "points.csv", tmp_path / "lines.csv"
    points.write_text("point,x,y,z\n1,0,0,0\n2,1,0,0\n3,1,1,0\n")
    lines.write_text("# outline\n1,2,3\n3,1\n")
    shape = geometry_files.read_lines(lines, geometry_files.read(points))
    assert shape.lines == [(1, 2), (2, 3), (3, 1)]
    lines.write_text("1,9\n")
    with pytest.raises(ToolpointError, match=r"lines\.csv:1: point 9 is not in the geometry"):
        geometry_files.read_lines(lines, geometry_files.read(points))
