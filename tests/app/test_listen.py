"""The command `listen` on files as a phone writes them."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.io import wavfile

from signals.heard_signals import RATE, comb, side_bands, with_noise
from toolpoint.app.main import cli
from toolpoint.io import write_nouns
from toolpoint.vibration import Modes


@pytest.fixture
def cut(tmp_path):
    """A chattering cut as a WAV file: 4 teeth, 8004 rev/min, 1417 Hz."""
    rng = np.random.default_rng(0)
    sound = with_noise(comb(133.4, 4, 2.0, rng) + side_bands(1417.0, 533.6, 2.0, rng), 0.3, rng)
    wavfile.write(tmp_path / "cut.wav", RATE, (0.5 * sound / np.abs(sound).max() * 32767).astype(np.int16))
    return tmp_path / "cut.wav"


def test_the_answer_is_the_first_sentence_and_the_page_is_written(cut, tmp_path):
    done = CliRunner().invoke(cli, ["listen", str(cut), "--teeth", "4", "--speed", "8000", "-o", str(tmp_path / "page")],
                              catch_exceptions=False)
    assert done.exit_code == 0
    first = next(line for line in done.output.splitlines() if not line.startswith("doubt: "))
    assert first.startswith("Chatter at ") and "regenerative (Hopf)" in done.output
    page = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    assert "Chatter at" in page and "Speeds to try" in page and "Spectrogram" in page


def test_json_says_the_same(cut, tmp_path):
    done = CliRunner().invoke(cli, ["listen", str(cut), "--teeth", "4", "--json", "-o", str(tmp_path / "page")])
    data = json.loads(done.stdout)
    assert data["verdict"] == "chatter" and data["speed_rpm"] == pytest.approx(8004, rel=2e-3)
    assert pytest.approx(min([data["frequency_hz"], *data["side_bands_hz"]], key=lambda f: abs(f - 1417)), abs=0.5) == 1417
    assert any("--speed" in doubt for doubt in data["doubts"])


def test_lobes_takes_a_recording_for_the_outcome_of_a_tried_cut(cut, tmp_path):
    shape = 2 * np.pi * 900 / np.sqrt(2e7) * np.eye(2)
    write_nouns(Modes([900.0, 905.0], [0.03, 0.03], shape, ["t:+x", "t:+y"]), tmp_path / "modes.h5")
    arguments = ["lobes", "--modes", str(tmp_path / "modes.h5"), "--teeth", "4", "--diameter", "12", "--kt", "800",
                 "--kn", "240", "--immersion", "1", "--direction", "slot", "--speeds", "7000:9000:5", "--probability", "5",
                 "-o", str(tmp_path / "page")]
    done = CliRunner().invoke(cli, [*arguments, "--tried", f"8000:2:{cut}"], catch_exceptions=False)
    assert done.exit_code == 0 and "tried cut cut.wav: Chatter at" in done.output
