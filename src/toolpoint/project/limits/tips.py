"""Tip of a tool from its measured responses, as `studies.study_tap` takes it."""

from __future__ import annotations

from pathlib import Path

from toolpoint import io
from toolpoint.signals.usable_band import find_compliant_band, usable_band
from toolpoint.studies.cuts.tool_directions import along_positive_axes, check_driving_points, tool_directions
from toolpoint.studies.measured.identification import identify_modes
from toolpoint.studies.testing.tap_dynamics import TappedModes, TappedTip, join_directions, take_modes


def read_tip(x: Path, y: Path | None) -> TappedTip:
    """Return the tip of a tool from files of its responses along x and, where it was struck, along y."""
    return join_directions(_modes_along("x", x), None if y is None else _modes_along("y", y))


def _modes_along(way: str, file: Path) -> TappedModes:
    frf = along_positive_axes(io.read_frf([file]))
    what = f"the test along {way}"
    label = tool_directions(check_driving_points(frf, what), None, "same", what=what).x
    tip = frf.selected([label], [label])
    band = find_compliant_band(tip, usable_band(frf))
    return take_modes(identify_modes(frf, band=band.ends), tip, str(tip.outputs[0]))
