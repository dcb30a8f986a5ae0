"""`toolpoint operational`: from records of a machine at work to a table, saved modes with their scale, and a page."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from toolpoint._check import ToolpointError
from toolpoint.app.main import main
from toolpoint.io import uff
from toolpoint.io.binary import hdf5
from toolpoint.studies import study_operational
from toolpoint.vibration import Modes, Record, SecondOrderSystem, eigen, frequency_response

DOFS = ("1:+x", "2:+x", "3:+x")
RATE = 80.0
STIFFNESS = 1e4 * np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.2]])


def system(added: float = 0.0) -> SecondOrderSystem:
    return SecondOrderSystem(np.diag([2.0, 1.0 + added, 1.5]), STIFFNESS, damping=2e-4 * STIFFNESS, outputs=DOFS, inputs=DOFS)


def working(added: float = 0.0, seed: int = 0, seconds: float = 600.0) -> Record:
    """Return accelerations of the system under white loads, with a harmonic of 9 Hz."""
    rng = np.random.default_rng(seed)
    modes = eigen.solve_damped(system(added))
    real = eigen.solve_undamped(system(added))
    motion = []
    for k in range(3):
        mu = np.exp(modes.poles[k] / RATE)
        noise = rng.standard_normal(int(seconds * RATE) + 8000)
        motion.append(signal.lfilter([1.0, -2.0, 1.0], [1.0, -2 * mu.real, abs(mu) ** 2], noise)[8000:])
    values = np.array(motion).T @ real.shape.T
    time = np.arange(values.shape[0]) / RATE
    values += values.std() * np.cos(2 * np.pi * 9.0 * time)[:, None] * rng.standard_normal(3)
    return Record(values, RATE, DOFS, "acceleration")


@pytest.fixture(scope="module")
def record_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    record = working()
    path = tmp_path_factory.mktemp("work") / "work.csv"
    names = ",".join(f"acceleration {dof} [m/s^2]" for dof in DOFS)
    np.savetxt(path, np.column_stack([record.time, record.samples]), delimiter=",", header=f"time [s],{names}", comments="")
    return path


def test_table_modes_and_page(record_file, tmp_path, capsys) -> None:
    main(["operational", str(record_file), "-m", str(tmp_path / "modes.h5"), "-o", str(tmp_path / "page")])
    printed = capsys.readouterr().out
    truth = eigen.solve_damped(system())
    saved = hdf5.read(tmp_path / "modes.h5", Modes)
    assert saved.count == 3 and saved.scaling == "unscaled"
    assert np.all(np.abs(saved.frequency - truth.frequency) < 2 * saved.frequency_interval)
    assert "harmonic" in printed and "9.0000" in printed
    page = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    assert "is no mode" in page and "the modes have no scale" in page


def test_json_holds_modes_harmonics_and_intervals(record_file, tmp_path, capsys) -> None:
    main(["operational", str(record_file), "--json", "-o", str(tmp_path / "page")])
    data = json.loads(capsys.readouterr().out)
    assert len(data["frequency_hz"]) == 3 and data["harmonics"][0]["frequency_hz"] == pytest.approx(9.0, abs=0.01)
    assert data["scaling"] == "unscaled" and min(data["frequency_interval_hz"]) > 0


def test_a_blow_gives_the_scale(record_file, tmp_path, capsys) -> None:
    blow = frequency_response.direct(system(), np.arange(2.0, 40.0, 0.05)).selected(["1:+x"], ["1:+x"])
    uff.write(tmp_path / "blow.uff", blow)
    main(["operational", str(record_file), "--blow", str(tmp_path / "blow.uff"), "-m", str(tmp_path / "modes.h5"),
          "-o", str(tmp_path / "page")])
    saved = hdf5.read(tmp_path / "modes.h5", Modes)
    assert saved.scaling == "unit modal mass"
    assert np.abs(saved.shape) == pytest.approx(np.abs(eigen.solve_undamped(system()).shape), rel=0.2, abs=0.02)
    assert "scale" not in capsys.readouterr().err


def test_added_masses_give_the_scale() -> None:
    result = study_operational(working(seed=1), loaded=[working(0.08, seed=2)], masses={"2:+x": 0.08})
    truth = eigen.solve_undamped(system())
    for k in range(result.modes.count):
        expected = truth.shape[:, int(np.argmin(np.abs(truth.frequency - result.modes.frequency[k])))]
        deviation = np.sqrt(result.modes.shape_variance[:, k])
        # First order in the mass: what the shape changes by comes beside the deviation.
        error = np.abs(np.abs(result.modes.shape[:, k]) - np.abs(expected))
        assert np.all(error < 3.5 * deviation + 0.04 * np.abs(expected).max())
    assert result.scale.startswith("added masses at 2:+x")


def test_one_source_of_the_scale_alone() -> None:
    record = working(seconds=60.0)
    with pytest.raises(ToolpointError, match="one source of the scale"):
        study_operational(record, loaded=[record], masses={"2:+x": 0.1}, blow=frequency_response.direct(system(), [5.0, 6.0]))
    with pytest.raises(ToolpointError, match="one without the other"):
        study_operational(record, loaded=[record])


def test_a_mass_without_unit_of_mass_is_refused(record_file, capsys) -> None:
    with pytest.raises(SystemExit):
        main(["operational", str(record_file), "--loaded", str(record_file), "--mass", "2:+x=3mm"])
    assert "--mass" in capsys.readouterr().err


def test_roving_files_are_set_ups(tmp_path, capsys) -> None:
    record = working(seconds=300.0)
    for name, picks in (("a", ["1:+x", "2:+x"]), ("b", ["1:+x", "3:+x"])):
        part = record.selected(picks)
        names = ",".join(f"acceleration {dof} [m/s^2]" for dof in picks)
        np.savetxt(tmp_path / f"{name}.csv", np.column_stack([part.time, part.samples]), delimiter=",",
                   header=f"time [s],{names}", comments="")
    main(["operational", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "-m", str(tmp_path / "modes.h5"),
          "-o", str(tmp_path / "page")])
    saved = hdf5.read(tmp_path / "modes.h5", Modes)
    assert [str(dof) for dof in saved.dofs] == list(DOFS)
    capsys.readouterr()
