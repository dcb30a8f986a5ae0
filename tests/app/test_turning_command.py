"""`toolpoint turn`: limits of the closed form from modes, measured lines and a machine; directions and their units."""

import json
from dataclasses import replace

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint._doubt import Doubt
from toolpoint.app.main import main
from toolpoint.cutting import stability
from toolpoint.cutting.cut.problem import TurningProblem
from toolpoint.cutting.force import materials
from toolpoint.cutting.stability.methods.turning import least_width, lobe_tips
from toolpoint.io.binary import hdf5
from toolpoint.io.text import frf_table
from toolpoint.io.yaml import machine_file
from toolpoint.studies import describe_turning, modal_dynamics
from toolpoint.studies.cuts.turning.study import build_turning
from toolpoint.studies.machines.tool_point import tool_point
from toolpoint.vibration import Modes, frequency_response

MASS, FREQUENCY, RATIO = 2.0, 150.0, 0.03
BAR = Modes([FREQUENCY, 260.0], RATIO, np.diag([1.0, 0.5]) / np.sqrt(MASS), ("bar:+x", "bar:+y"))
STIFFNESS = MASS * (2 * np.pi * FREQUENCY) ** 2
MACHINE = str(MACHINES / "three_axis_vertical_drives.yaml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("turning")
    hdf5.write(BAR, folder / "bar.h5")
    for way in "xy":
        frf = frequency_response.modal(BAR, np.arange(2.0, 900.0, 0.25), [f"bar:+{way}"], inputs=[f"bar:+{way}"])
        frf_table.write(frf, folder / f"bar_{way}.txt")
    return folder


def turn(capsys, *arguments):
    main(["turn", *map(str, arguments), "--json"])
    return json.loads(capsys.readouterr().out)


def limits(found):
    return [intervals[0][1] for intervals in found["stable_intervals_m"]]


@pytest.mark.slow
def test_modes_give_the_closed_form_at_its_worst_speeds(folder, tmp_path, capsys):
    """b = 2 k z (1 + z)/K_f at the lobes' tips (Tlusty), deeper between them."""
    tips = np.sort(lobe_tips(FREQUENCY, RATIO, 4)[2:])
    ends = f"{tips[0]:.10g}:{tips[-1]:.10g}:2"
    found = turn(capsys, "--modes", folder / "bar.h5", "--kf", 1500, "--speeds", ends, "-o", tmp_path)
    least = least_width(STIFFNESS, RATIO, 1500e6)
    assert found["unconditional"]["width_m"] == pytest.approx(least, rel=1e-9)
    np.testing.assert_allclose(limits(found), least, rtol=1e-5)
    np.testing.assert_allclose(found["unconditional"]["speed_rpm"][2:4], tips[::-1], rtol=1e-6)
    many = turn(capsys, "--modes", folder / "bar.h5", "--kf", 1500, "-o", tmp_path)
    assert len(many["speed_rpm"]) == 400 and min(limits(many)) >= least * (1 - 1e-9)
    assert many["best_cut"]["width_m"] > least


@pytest.mark.slow
def test_measured_lines_angle_and_vector_give_the_same_cut(folder, tmp_path, capsys):
    """At 30 deg from x towards y: G = cos^2 G_xx + sin^2 G_yy; b = -1/(2 K_f min Re G)."""
    pair = ["--frf-x", folder / "bar_x.txt", "--frf-y", folder / "bar_y.txt", "--band", "2:900", "--kf", 1200, "-o", tmp_path]
    by_angle = turn(capsys, *pair, "--direction", "30deg")
    by_vector = turn(capsys, *pair, "--direction", f"{np.sqrt(3)},1,0")
    for key in ("width_m", "chatter_frequency_hz", "speed_rpm"):
        assert by_angle["unconditional"][key] == pytest.approx(by_vector["unconditional"][key])
    f = np.linspace(100, 400, 100_001)
    g = frequency_response.modal(BAR, f).values
    least = (0.75 * g[:, 0, 0].real + 0.25 * g[:, 1, 1].real).min()
    assert by_angle["unconditional"]["width_m"] == pytest.approx(-1 / (2 * 1200e6 * least), rel=1e-3)
    assert any("bar_y.txt" in note for note in by_angle["notes"])
    alone = turn(capsys, "--frf", folder / "bar_x.txt", "--band", "2:900", "--kf", 1500, "-o", tmp_path)
    assert alone["unconditional"]["width_m"] == pytest.approx(least_width(STIFFNESS, RATIO, 1500e6), rel=1e-3)


@pytest.mark.slow
def test_a_machine_at_a_pose_and_its_cross_response(tmp_path, capsys):
    """The chart of the Python problem whose receptance is n^T G (n + K_t/K_f c), of the machine's tool against its table."""
    found = turn(capsys, MACHINE, "--pose", "X=100mm", "--kf", 800, "--kt", 1600, "--direction", "z", "--speeds", "800:1600:3",
                 "-o", tmp_path)
    study = tool_point(machine_file.read(MACHINE), [{"X": 0.1}])
    modes = study.modes.at_pose(0)
    f = np.linspace(5, 700, 60_001)
    g = frequency_response.modal(modes, f).values
    least = (g[:, 2, 2] + 2 * g[:, 2, 1]).real.min()
    assert found["unconditional"]["width_m"] == pytest.approx(-1 / (2 * 800e6 * least), rel=1e-5)
    along_z = turn(capsys, MACHINE, "--pose", "X=0.1", "--kf", 800, "--direction", "z", "--speeds", "800:1600:3", "-o",
                   tmp_path)
    problem = TurningProblem(800e6, modes.at_dofs([f"{study.point}:+z"]))
    chart = stability.chart(problem, np.array([800.0, 1200.0, 1600.0]), None, depth_max=2 * max(limits(along_z)))
    np.testing.assert_allclose(limits(along_z), chart.limit, rtol=1e-6)


@pytest.mark.slow
def test_process_damping_holds_low_speeds(folder, tmp_path, capsys):
    common = ["--modes", folder / "bar.h5", "--kf", 1500, "--speeds", "100:100:1", "-o", tmp_path]
    free = turn(capsys, *common)
    damped = turn(capsys, *common, "--process-damping", 6e4, "--diameter", 60)
    speed = np.pi * 0.06 * 100 / 60
    held = turn(capsys, *common, "--process-damping", 6e4, "--cutting-speed", 60 * speed)
    assert limits(damped)[0] > 1.1 * limits(free)[0] and damped["unconditional"] is None
    assert limits(damped) == pytest.approx(limits(held))
    # No width of the closed form with the same damping is above the chart's limit at this speed.
    assert limits(damped)[0] >= least_width(STIFFNESS, RATIO, 1500e6, process_damping=6e4, cutting_speed=speed,
                                            modal_mass=MASS) * (1 - 1e-6)


@pytest.mark.parametrize(("more", "words"), [
    (["--kf", "-3"], "range x>0"), (["--kf", "800", "--direction", "w"], "an angle from x towards y"),
    (["--kf", "800", "--direction", "0,0,1"], "along z is not known"), (["--kf", "800", "--direction", "0,0,0"], "zero length"),
    (["--kf", "800", "--kt", "1600", "--direction", "y"], "not normal to the chip"),
    (["--kf", "800", "--process-damping", "5"], "needs it"), ([], "--kf"), (["--kf", "nan"], "nan is not in the range x>0"),
    (["--kf", "800", "--process-damping", "5", "--diameter", "50", "--cutting-speed", "200"], "must be one of them"),
    (["--material", "C45"], "give --kf"), (["--material", "chocolate"], "chocolate")])
def test_wrong_input(folder, more, words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["turn", "--modes", str(folder / "bar.h5"), *more])
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown


@pytest.mark.slow
def test_limits_that_no_lathe_has_are_doubted(folder, tmp_path, capsys):
    ordinary = turn(capsys, "--modes", folder / "bar.h5", "--kf", 1500, "-o", tmp_path)
    assert not any("doubtful" in note for note in ordinary["notes"])
    pascal = turn(capsys, "--modes", folder / "bar.h5", "--kf", 1500e6, "-o", tmp_path)
    assert any("hardly that of a machine; check the units" in note for note in pascal["notes"])


def test_a_material_gives_its_coefficients_and_a_doubt():
    """Own coefficients take the place of the table's; what is of milling tests is said before the widths."""
    table = materials.literature("Al 7075").sets[1]
    cut = describe_turning(material="al7075:2")
    assert (cut.cutting, cut.tangential) == (table.kn, table.kt)
    assert describe_turning(9e8, material="al7075:2") == replace(cut, cutting=9e8)
    assert describe_turning(9e8, 2e9, material="al7075:2").source == ""
    doubts = [note for note in build_turning(modal_dynamics(BAR), cut)[1] if isinstance(note, Doubt)]
    assert len(doubts) == 1 and "milling tests" in doubts[0] and f"{table.kn / 1e6:.4g}" in doubts[0]
