"""First study of measured responses: modes by quadrature picking, lobes straight from the lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, grave_among
from toolpoint._notebook import NotebookText
from toolpoint.cutting import StabilityChart, stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.cuts.example_cut import EXAMPLE_CUT
from toolpoint.studies.cuts.lobes_study import end_words
from toolpoint.studies.cuts.tip_doubts import gain_notes, question_tip, withheld_words
from toolpoint.studies.cuts.tool_directions import along_positive_axes, check_driving_points, tool_directions
from toolpoint.studies.cuts.tool_dynamics import lines_to_judge, take_band
from toolpoint.studies.machines.tool_point import depth_limit, milling_problem
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Frf, Modes

CHARTED_SPEED_COUNT = 400  # spindle speeds of the chart of measured responses

@dataclass(frozen=True, eq=False)
class MeasuredResponse(NotebookText):
    """Measured responses (receptance, the band used), their modes, and the chart of the driving point where there is one.

    cut : what the chart is of; notes : what was assumed, and what could not be computed.
    """

    frf: Frf
    modes: Modes | None
    chart: StabilityChart | None
    cut: CuttingDescription
    notes: tuple[str, ...]

    @property
    def withheld(self) -> list[Doubt]:
        """The grave doubts for which no stable depth is given."""
        return grave_among(self.notes)

    def table(self) -> str:
        """Return modes and the lowest limit as text."""
        lines = []
        if self.modes is not None:
            rows = [[str(i + 1), f"{f:.1f}", f"{100 * z:.2f}"]
                    for i, (f, z) in enumerate(zip(self.modes.frequency, self.modes.damping_ratio, strict=True))]
            lines.append(text_table("Modes by quadrature picking", ["mode", "frequency Hz", "damping %"], rows))
        if self.withheld:
            lines.append(f"Lobes from the measured FRF: {withheld_words(self.withheld)}")
        elif self.chart is not None:
            limit, end = float(np.min(self.chart.limit)), f"{1e3 * self.chart.depth_max:.4g} mm, the end of the searched depths"
            lines.append("Lobes from the measured FRF: stable at every charted speed "
                         + (f"below {1e3 * limit:.3f} mm" if np.isfinite(limit) else f"to {end}"))
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return modes (Hz) and the lowest stable depth (m, None: none) as plain data."""
        limit = None if self.chart is None or self.withheld else float(np.min(self.chart.limit))
        return {"frequency_hz": [] if self.modes is None else self.modes.frequency.tolist(),
                "damping_ratio": [] if self.modes is None else self.modes.damping_ratio.tolist(),
                "stable_at_every_speed_m": limit if limit is not None and np.isfinite(limit) else None,
                "depth_max_m": None if self.chart is None else self.chart.depth_max,
                "is_end_of_search": None if self.chart is None else (~np.isfinite(self.chart.limit)).tolist(),
                "withheld": list(self.withheld), "notes": list(self.notes)}


def study_responses(frf: Frf, cut: CuttingDescription | None = None, band: tuple[float, float] | None = None
                      ) -> MeasuredResponse:
    """Return modes by quadrature picking and the stability chart from the driving point.

    Where only one direction was measured, the response along y is that along x.

    cut : an example's where left out, which a note says; band : Hz, see `tool_dynamics.take_band`.

    Examples
    --------
    Runs in ``examples/study_one_measured_response.py``.
    """
    frf = take_band(along_positive_axes(frf), band)
    notes = list(frf.notes)
    modes: Modes | None = None
    try:
        from toolpoint.modal_identification.poles.quadrature import quadrature

        modes = quadrature(frf)
    except ToolpointError as error:
        notes.append(f"No modes were picked: {error}")
    used = cut or EXAMPLE_CUT
    if cut is None:
        notes.append(f"No cut was given; the lobes are those of an {used.source}.")
    chart: StabilityChart | None = None
    try:
        chart = _chart(frf, used, notes, band=band)
        notes += [*end_words(chart, *used.depth_end), *chart.notes]
    except ToolpointError as error:  # unequal pitch, process damping and the like need modes
        notes.append(f"No stability chart from the measured lines: {error}")
    return MeasuredResponse(frf, modes, chart, used, tuple(dict.fromkeys(notes)))


def _chart(frf: Frf, cut: CuttingDescription, notes: list[str], *, band: tuple[float, float] | None) -> StabilityChart:
    ways = tool_directions(check_driving_points(frf, "the measurement"), what="the measurement")
    notes.append(f"The lobes take the response of {ways.x} to {ways.x} as driving-point response of the tool tip, "
                 + ("and the same across." if ways.y == "same" else f"and that of {ways.y} across."))
    labels = [ways.x] if ways.y in (None, "same") else [ways.x, str(ways.y)]
    tip = frf.selected(labels, labels)
    judged = lines_to_judge(tip, band)
    notes[:] = [*question_tip(judged), *notes, *gain_notes(judged)]
    problem = milling_problem(cut, tip, ways.x, y=ways.y)
    return stability.chart(problem, np.linspace(*cut.speeds, CHARTED_SPEED_COUNT),
                           depth_max=min(depth_limit(problem), cut.depth_end[0]))
