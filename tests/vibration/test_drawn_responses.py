"""Law: what is done to responses with draws is done to each draw as to a response of its own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from toolpoint import io
from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.signals import without_mass
from toolpoint.signals.setups import by_reciprocity, join_bands
from toolpoint.studies.cuts.tool_directions import along_positive_axes
from toolpoint.substructuring.virtual_point import VirtualPoint, reduce_to_points
from toolpoint.vibration import Dof, Frf
from toolpoint.vibration.frf import join_frfs, relative

LABELS = [Dof(point, way) for point in ("tool", "table") for way in ("-x", "+y")]
LINES = np.arange(10.0, 30.0)


def drawn_frf(labels: list[Dof] = LABELS, count: int = 3) -> Frf:
    rng = np.random.default_rng(5)
    values = rng.normal(size=(count + 1, LINES.size, len(labels), len(labels), 2)) @ np.array([1e-7, 1e-7j])
    return Frf(LINES, values[0], tuple(labels), tuple(labels), draws=values[1:])


def reduced(frf: Frf) -> Frf:
    places = {"tool": [0.0, 0, 0], "table": [0.1, 0, 0]}
    return reduce_to_points(frf, [VirtualPoint("tcp", [0, 0, 0], LABELS, LABELS, places, ("+x", "+y"))])


CHANGES: dict[str, Callable[[Frf], Frf]] = {
    "quantity": lambda frf: frf.converted_to("accelerance"),
    "band": lambda frf: frf.between(12.0, 20.0),
    "labels": lambda frf: frf.selected(["tool:+y"], ["table:-x", "tool:+y"]),
    "other lines": lambda frf: frf.interpolated(np.array([11.3, 12.9])),
    "relative": lambda frf: relative(frf.selected(["tool:+y", "table:+y"], ["tool:+y", "table:+y"]), "tool", "table",
                                     directions=["y"]),
    "sign": along_positive_axes,
    "sensor": lambda frf: without_mass(frf, "tool:+y", 0.02),
    "reciprocity": by_reciprocity,
    "side by side": lambda frf: join_frfs([frf.selected(["tool:+y"]), frf.selected(["table:+y"])]),
    "bands": lambda frf: join_bands([frf.between(10, 15), frf.between(16, 40)])[0],
    "virtual point": reduced,
}


@pytest.mark.filterwarnings("ignore:doubt")  # the values are noise: no virtual point moves as one
@pytest.mark.filterwarnings("ignore:virtual point")
@pytest.mark.parametrize("name", CHANGES)
def test_a_draw_is_changed_as_a_response_of_its_own(name: str) -> None:
    frf, change = drawn_frf(), CHANGES[name]
    changed = change(frf)
    assert changed.draws is not None
    for k in range(3):
        np.testing.assert_allclose(changed.at_draw(k).values, change(frf.at_draw(k)).values, rtol=1e-9)


def test_hdf5_keeps_draws_and_other_formats_warn(tmp_path) -> None:
    frf = drawn_frf([Dof("tool", "+x")])
    io.write_frf(frf, tmp_path / "tip.h5")
    np.testing.assert_allclose(io.read_frf(tmp_path / "tip.h5").draws, frf.draws, rtol=1e-6)
    with pytest.warns(ToolpointWarning, match="does not hold how uncertain"):
        io.write_frf(frf, tmp_path / "tip.uff")


def test_draws_must_fit_the_values() -> None:
    with pytest.raises(ToolpointError, match=r"Frf\.draws"):
        Frf(LINES, np.zeros((LINES.size, 1, 1)), ["tool:+x"], ["tool:+x"], draws=np.zeros((4, LINES.size + 1, 1, 1)))
    with pytest.raises(ToolpointError, match="no draws"):
        Frf(LINES, np.zeros((LINES.size, 1, 1)), ["tool:+x"], ["tool:+x"]).at_draw(0)
