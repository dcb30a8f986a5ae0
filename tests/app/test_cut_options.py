"""Options of cuts: their units, and what a given option stands instead of."""

import numpy as np
import pytest

from toolpoint.app.cut_options import CutOptions
from toolpoint.app.main import main
from toolpoint.cutting import Engagement
from toolpoint.cutting.build import coefficients_of, engagement_of
from toolpoint.cutting.description import CuttingDescription, SpeedVariationDescription

FULL = CuttingDescription.of(diameter=0.016, teeth=4, immersion=0.4, tangential=8e8, normal=3e8, direction="up", edge_axial=1e3)


def test_options_of_the_command_line_become_si():
    """Every option in its own unit: mm, um, degrees, um/mm, N/mm^2, N/mm, N/m."""
    def in_si(given):
        cut = CutOptions()
        return cut.gather(dict.fromkeys(cut.keys) | {f"cut_{name}": value for name, value in given.items()})

    given = {"diameter": 16.0, "teeth": 4, "helix": (30.0,), "pitch": (80.0, 280.0), "corner_radius": 2.0, "runout": 5.0,
             "runout_angle": 90.0, "tilt": 0.2, "immersion": None, "direction": None, "entry": 30.0, "exit": 90.0, "kt": 800.0,
             "kn": 300.0, "ka": 100.0, "kte": 20.0, "kne": 10.0, "kae": 1.0, "material": None, "process_damping": 50.0,
             "damping_friction": 0.2, "speed_variation": (0.1, 4, 0.5), "feed": 0.1}
    found = in_si(given)
    assert found.pop("pitch") == pytest.approx(np.radians([80, 280]))
    assert found.pop("speed_variation") == SpeedVariationDescription(0.1, 4, 0.5)
    assert found == pytest.approx({
        "diameter": 0.016, "teeth": 4, "helix": np.pi / 6, "corner_radius": 2e-3,
        "runout": 5e-6, "runout_angle": np.pi / 2, "tilt": 2e-4, "entry": np.pi / 6, "exit": np.pi / 2, "tangential": 8e8,
        "normal": 3e8, "axial": 1e8, "edge_tangential": 2e4, "edge_normal": 1e4, "edge_axial": 1e3, "process_damping": 50.0,
        "damping_friction": 0.2, "feed_per_tooth": 1e-4})
    assert in_si({"helix": (30.0, 35.0)})["helix"] == pytest.approx(np.radians([30, 35]))


def test_a_material_replaces_given_coefficients_and_an_arc_replaces_the_other():
    other = FULL.with_values({"material": "al7075"})
    assert coefficients_of(other).kt == 767e6 and coefficients_of(other).edge_a == 700
    arc = FULL.with_values({"entry": 0.1, "exit": 0.6})
    assert engagement_of(arc) == Engagement(0.1, 0.6)
    assert engagement_of(arc.with_values({"immersion": 0.3})) == Engagement.up(0.3)


def test_an_unknown_material_is_refused_before_a_file_is_read(tmp_path, capsys):
    (tmp_path / "no_response.csv").write_text("this is no response\n")
    with pytest.raises(SystemExit):
        main(["tap", str(tmp_path / "no_response.csv"), "--material", "al 7065"])
    assert "did you mean 'Al 7075'" in capsys.readouterr().err
