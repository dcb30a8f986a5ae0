"""Programs in the manner of ten controls run whole, and take what their contours say."""

from __future__ import annotations

import numpy as np
import pytest
from programs_of_controls import PROGRAMS

from toolpoint import studies
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse

CUT = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8, flute_length=0.03)


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.default_cases(10)
def test_a_program_of_the_shop_floor_takes_its_volume(name: str) -> None:
    text, volume = PROGRAMS[name]
    stock = studies.stock_of("box", (0, 0, -0.02, 0.08, 0.06, 0))
    setup = studies.describe_machining(stock, CUT, spacing=1.25e-3, speed=3000.0)
    study = studies.run_program(parse(text, start=(0, 0, 0.1), cutter_radius=0.005), setup)
    assert 1e9 * study.removed.total_volume == pytest.approx(volume, rel=3e-3)
    assert all(np.isfinite(values).all() for values in study.blocks.loads.values())
    assert not any(doubt.what.startswith("rapid") for doubt in study.doubts)
