"""The door of tip responses: slips are grave and withhold the cut in every command, good responses pass."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tapped_tools import Tip
from toolpoint import io
from toolpoint.app.main import main
from toolpoint.signals.usable_band import find_compliant_band, usable_band
from toolpoint.studies import modal_dynamics, response_dynamics, separate_dynamics
from toolpoint.studies.cuts.tip_doubts import gain_notes, question_directions, question_tip
from toolpoint.vibration import Dof, Frf

TIP = Tip(np.array([640.0, 1480.0, 2900.0]), np.array([0.03, 0.02, 0.025]), np.array([1.5e7, 9e6, 3e7]),
          np.tile([1.0, 0.0], (3, 1)))
LINES = np.arange(20.0, 4200.0, 2.0)


def response(values=None, way="+x", lines=LINES, quantity="receptance"):
    rng = np.random.default_rng(1)
    values = TIP.receptance(lines)[:, 0, 0] if values is None else values
    noisy = values * (1 + 0.003 * (rng.standard_normal(lines.size) + 1j * rng.standard_normal(lines.size)))
    return Frf(lines, noisy[:, None, None], (Dof(1, way),), (Dof(1, way),), quantity)


def turned(delay):
    return TIP.receptance(LINES)[:, 0, 0] * np.exp(-2j * np.pi * LINES * delay)


WHOLE = TIP.receptance(LINES)[:, 0, 0]
SLIPS = {"delay": (turned(3e-5), "delay of about +0.03"), "advance": (turned(-2e-5), "delay of about -0.0"),
         "sign": (-WHOLE, "sign of one channel"), "conjugate": (WHOLE.conj(), "other time factor"),
         "columns": (1j * WHOLE.conj(), "real and imaginary part exchanged"), "millimetres": (1e3 * WHOLE, "static stiffness"),
         "a mobility": (WHOLE * 2j * np.pi * LINES * 1e-3, "passive as mobility")}


@pytest.mark.parametrize("first", [1.0, 12.0])
def test_structural_damping_is_not_taken_for_modes_below_the_band(first):
    """Its loss at low lines has no real part that follows from it; the closed form of three modes with loss factors."""
    lines = np.arange(first, 400.0, 0.1)
    resonances, stiffness, loss = np.array([24.0, 61.0, 110.0]), np.array([4e7, 9e7, 6e7]), np.array([0.07, 0.09, 0.06])
    values = (1 / (stiffness * (1 + 1j * loss - (lines[:, None] / resonances) ** 2))).sum(axis=1)
    assert question_tip(response(values, lines=lines)) == []


@pytest.mark.parametrize("name", list(SLIPS))
@pytest.mark.default_cases(4)
def test_a_slip_is_grave_and_named(name):
    values, words = SLIPS[name]
    doubts = question_tip(response(values))
    assert any(doubt.grave and words in doubt for doubt in doubts), doubts


def test_a_gain_that_the_response_cannot_tell_is_said():
    accelerance = response(WHOLE * -((2 * np.pi * LINES) ** 2), quantity="accelerance")
    (note,) = gain_notes(accelerance)
    assert "this response alone does not tell" in note
    stiffness = 1e-6 / abs(TIP.receptance(np.array([1.0]))[0, 0, 0])
    assert float(note.split("static stiffness ")[1].split()[0]) == pytest.approx(stiffness, rel=0.1)
    assert gain_notes(response()) == []  # no g where the file holds displacements


def test_one_direction_in_another_unit_is_doubted():
    ways = {"x": response(), "y": response(WHOLE / 9.80665, way="+y")}
    (doubt,) = question_directions(ways)
    assert doubt.why.startswith("x is 9.8")
    assert "g for m/s^2" in doubt and not doubt.grave
    assert question_directions({"x": response(), "y": response(1.4 * WHOLE, way="+y")}) == []


def test_a_good_response_has_no_doubt():
    assert question_tip(response()) == [] and response_dynamics(response()).withheld == []


@pytest.mark.parametrize(("low", "high", "words"), [(20, 1300, "above"), (1700, 4200, "below")])
def test_a_band_without_the_softest_mode_is_grave(low, high, words):
    doubts = question_tip(response().between(low, high))
    assert [doubt.grave for doubt in doubts] == [True] and f"what vibrates {words}" in doubts[0]


@pytest.mark.parametrize("start", [670, 720, 800])
def test_the_flank_of_a_mode_below_the_band_is_not_taken_for_structural_damping(start):
    """A soft mode at 620 Hz, the band from its flank on: its loss falls with frequency, that of structural damping does not."""
    modes = [(620.0, 0.025, 1.5e7), (1900.0, 0.03, 9e6), (14000.0, 0.02, 2e8)]
    lines = np.arange(start, 5000.0, 2.0)
    values = sum(1 / stiffness / (1 - (lines / f) ** 2 + 2j * zeta * lines / f) for f, zeta, stiffness in modes)
    doubts = [doubt for doubt in question_tip(response(values, lines=lines)) if doubt.grave]
    assert len(doubts) == 1 and f"below {start} Hz" in doubts[0]
    assert not question_tip(response(sum(1 / stiffness / (1 - (lines / f) ** 2 + 2j * zeta * lines / f)
                                         for f, zeta, stiffness in modes[1:]), lines=lines))


def test_a_sensor_is_doubted_where_its_mass_tells():
    loaded = WHOLE / (1 - 0.06 * (2 * np.pi * LINES) ** 2 * WHOLE)
    assert question_tip(response(loaded)) == []  # any structure may be so heavy
    assert "60 g" in question_tip(response(loaded), sensor_mass=0.06)[0]
    assert question_tip(response(), sensor_mass=2e-4) == []


def test_exchanged_directions_are_told_by_their_labels():
    x, y = response(way="+x"), response(way="+y")
    assert separate_dynamics(x, y).withheld == []
    assert "exchanged" in separate_dynamics(y, x).withheld[0]


def test_modes_of_a_turned_response_are_grave():
    modes = TIP.modes
    assert modal_dynamics(modes, "tip:+x", "same").withheld == []
    scaled = replace(modes, shape=modes.shape * 1j)
    assert modal_dynamics(scaled, "tip:+x", "same").withheld


@pytest.mark.slow
@pytest.mark.parametrize("command", [["lobes", "--speeds", "6000:9000:3"], ["turn", "--kf", "1000", "--speeds", "1000:2000:3"],
                                     ["mill", "--speed", "9000", "--depth", "0.2", "--revolutions", "20"], ["report"], ["tap"]])
def test_every_command_withholds_the_cut_of_a_late_response(command, tmp_path, capsys):
    for name, values in (("good", None), ("late", turned(5e-5))):
        io.write_frf(response(values), tmp_path / f"{name}.csv")
        source = [str(tmp_path / f"{name}.csv")] if command == ["tap"] else ["--frf", str(tmp_path / f"{name}.csv")]
        main([*command, *source, "-o", str(tmp_path / name), "--json"])
        said = json.loads(capsys.readouterr().out)
        said = said.get("measured") or said
        withheld = bool(said.get("withheld")) or said.get("colour") == "red"
        assert withheld == (name == "late")
        if command[0] != "tap":
            page = (tmp_path / name / "index.html").read_text()
            assert ("a delay of about" in page) == (name == "late")


def other_point(shares):
    """Return the response at another point, at which every mode of the tip has a share of its own."""
    parts = [Tip(TIP.frequency[[k]], TIP.damping[[k]], TIP.stiffness[[k]], TIP.way[[k]]).receptance(LINES)[:, 0, 0]
             for k in range(3)]
    return np.einsum("k,kf->f", shares, parts)


def test_a_small_mode_of_the_opposite_sign_is_grave():
    """It gives off power at fewer lines than are doubted for their share."""
    assert any(doubt.grave for doubt in question_tip(response(other_point((-0.1, 0.9, 0.5)))))


def test_another_point_at_which_all_modes_move_in_phase_leaves_no_sign():
    """It is the driving point of the structure whose modal stiffnesses are divided by the shares, digit by digit."""
    shares = np.array([0.3, 0.9, 0.6])
    structure = Tip(TIP.frequency, TIP.damping, TIP.stiffness / shares, TIP.way)
    np.testing.assert_allclose(other_point(shares), structure.receptance(LINES)[:, 0, 0], rtol=1e-12)
    assert question_tip(response(other_point(shares))) == []


def test_a_narrow_resonance_of_few_lines_is_not_taken_for_noise():
    """Third differences of lines see such a resonance; were it noise, the lines above it alone would be judged."""
    lines = np.arange(10.0, 6000.0, 2.4)
    tip = Tip(np.array([573.4, 2426.3]), np.array([0.006, 0.0158]), np.array([1e7, 1.2e7]), np.tile([1.0, 0.0], (2, 1)))
    noise = 1e-9 * (1e2 / lines) ** 2 * np.random.default_rng(3).standard_normal((2, lines.size))
    frf = response(tip.receptance(lines)[:, 0, 0] + noise[0] + 1j * noise[1], lines=lines)
    assert find_compliant_band(frf, usable_band(frf)).low < 400


def test_a_narrow_soft_resonance_at_the_lowest_lines_is_no_drift():
    """A machine on its feet at 12.6 Hz, two lines wide, far below loud modes; drift over the same lines is left out."""
    lines = np.arange(1.0, 1200.0, 0.1)
    ways = np.tile([1.0, 0.0], (3, 1))
    tip = Tip(np.array([12.6, 90.0, 300.0]), np.array([0.007, 0.04, 0.03]), np.array([6e7, 3e8, 1e8]), ways)
    values = tip.receptance(lines)[:, 0, 0]
    assert usable_band(response(values, lines=lines)).low == 1.0
    drift = 1e-6 / lines**2 * np.random.default_rng(3).standard_normal((2, lines.size))
    assert usable_band(response(values + drift[0] + 1j * drift[1], lines=lines)).low > 8


def test_a_delay_too_small_for_one_direction_shows_in_both():
    """Phases of peaks that grow with frequency in both directions, by the same channels, are no chance."""
    parts = {"x": [0, 1], "y": [0, 2]}
    true = {way: Tip(TIP.frequency[k], TIP.damping[k], TIP.stiffness[k], TIP.way[k]).receptance(LINES)[:, 0, 0]
            for way, k in parts.items()}
    ways = {way: response(each * np.exp(2j * np.pi * LINES * 6e-6), way=f"+{way}") for way, each in true.items()}
    assert all(question_tip(frf) == [] for frf in ways.values())
    assert question_directions({way: response(each, way=f"+{way}") for way, each in true.items()}) == []
    (doubt,) = question_directions(ways)
    assert doubt.grave and float(doubt.why.split("about ")[1].split()[0]) == pytest.approx(-6e-3, rel=0.1)


def test_the_receptance_of_noise_at_the_lowest_lines_makes_no_tip_soft():
    """Noise of an accelerometer grows as 1/frequency^2 in the receptance: 1e-6 m/N at 1 Hz, of either sign."""
    lines = np.arange(1.0, 4200.0, 2.0)
    noise = 4e-6 / lines**2 * np.random.default_rng(5).standard_normal((2, lines.size))
    assert question_tip(response(TIP.receptance(lines)[:, 0, 0] + noise[0] + 1j * noise[1], lines=lines)) == []


def test_a_band_that_begins_just_below_its_largest_peak_hides_no_softer_mode_below():
    lines = np.arange(1180.0, 5900.0, 2.4)
    tip = Tip(np.array([790.0, 985.0, 1222.0, 2542.0]), np.array([0.06, 0.006, 0.0075, 0.054]),
              np.array([6.4e6, 2.1e7, 4.4e7, 8.1e6]), np.tile([1.0, 0.0], (4, 1)))
    doubts = question_tip(response(tip.receptance(lines)[:, 0, 0], lines=lines))
    assert any(doubt.grave and "below" in doubt for doubt in doubts)
