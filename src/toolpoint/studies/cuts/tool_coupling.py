"""Tool-point response of a tool that was never measured, by coupling a spindle with a described tool, and its stick-out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt, doubts_among, grave_among
from toolpoint._notebook import NotebookText
from toolpoint._rounding import text_below
from toolpoint.cutting import StabilityChart
from toolpoint.studies.cuts.coupling.gauge_doubts import question_gauge, with_noise
from toolpoint.studies.cuts.coupling.machine_spindle import couple_tips, tip_frf
from toolpoint.studies.cuts.coupling.peaks import TipPeak, peaks_of, question_peaks
from toolpoint.studies.cuts.lobes_study import END_OF_SEARCH, LobesStudy, chart_lobes
from toolpoint.studies.cuts.tool_dynamics import response_dynamics
from toolpoint.studies.text_table import text_table
from toolpoint.substructuring.gauge import identify_base
from toolpoint.substructuring.receptance import DEFAULT_DRAW_COUNT, SLOPES, PlaneReceptance, plane_receptance
from toolpoint.substructuring.shaft import ShaftDescription
from toolpoint.substructuring.spindle import CoupledTip, SpindleReceptance
from toolpoint.vibration import Dof, Frf

DEFAULT_GAIN_DEVIATION = 0.01  # of hammer and sensor, one standard deviation, where nothing is stated
NamedProgress = Callable[[str, int, int], None]
HEADER = ("", "Hz", "95 %", "|G| µm/N", "95 %")
STICK_OUT_HEADER = ("length mm", "largest peak Hz", "95 %", "|G| µm/N", "95 %", "stable at every charted speed mm",
                    "best rev/min",
                    "depth mm")


@dataclass(frozen=True, eq=False)
class StickOut:
    """One length of the varied segment (m): the tip in every plane, and its chart, None without a cut."""

    length: float
    coupled: CoupledTip
    chart: StabilityChart | None = None
    end_words: tuple[str, ...] = ()

    @property
    def tips(self) -> tuple[PlaneReceptance, ...]:
        """Receptance at the tip in each plane."""
        return self.coupled.tips


@dataclass(frozen=True, eq=False)
class ToolCoupling(NotebookText):
    """A tool coupled to a spindle.

    tool : what was coupled; coupled : receptance at the tip, with draws; stick_outs : other lengths; lobes : of the
    tool as described, None where no cut was given; notes : doubts first, then what was assumed.
    """

    tool: ShaftDescription
    coupled: CoupledTip
    stick_outs: tuple[StickOut, ...]
    lobes: LobesStudy | None
    notes: tuple[str, ...]

    @property
    def tips(self) -> tuple[PlaneReceptance, ...]:
        """Receptance at the tip in each plane, with draws."""
        return self.coupled.tips

    @property
    def frf(self) -> Frf:
        """The tool-point receptance along x and y (or x alone), with draws and their variance."""
        return tip_frf(self.coupled, self.notes)

    def rows(self) -> list[list[str]]:
        """Return rows (plane, Hz, µm/N, each with its 95 % interval) of the largest peaks."""
        return [[f"{tip.plane}, peak {k + 1}", *_peak_words(peak)]
                for tip in self.tips for k, peak in enumerate(peaks_of(tip))]

    @property
    def withheld(self) -> list[Doubt]:
        """The grave doubts for which no cut is recommended."""
        return grave_among(self.notes)

    def stick_out_rows(self) -> list[list[str]]:
        """Return a row for each length of the stick-out study; without a cut where advice is withheld."""
        rows = []
        for part in self.stick_outs:
            peak = peaks_of(part.tips[0])[0]
            # A chart behind a grave doubt recommends nothing: dashes in its columns.
            chart = [] if part.chart is None else ["-"] * 3 if self.withheld else _chart_words(part.chart)
            rows.append([f"{1e3 * part.length:.4g}", *_peak_words(peak), *chart])
        return rows

    def stick_out_header(self) -> list[str]:
        """Return the header of the rows; columns of charts are left out without a cut."""
        return list(STICK_OUT_HEADER if self.lobes is not None else STICK_OUT_HEADER[:5])

    def table(self) -> str:
        """Return peaks, lobes and stick-outs as text."""
        parts = [text_table(f"Tool point of {self.tool.words}", list(HEADER), self.rows())]
        if self.lobes is not None:
            parts.append(self.lobes.table())
        if self.stick_outs:
            parts.append(text_table("Stick-out", self.stick_out_header(), self.stick_out_rows()))
        return "\n".join(parts)

    def to_dict(self) -> dict[str, Any]:
        """Return peaks (Hz, m/N, 95 % interval), stick-outs and lobes as plain data, SI."""
        peaks = [{"plane": tip.plane, "frequency_hz": peak.frequency, "receptance_m_n": peak.height,
                  "intervals_hz_m_n": peak.intervals} for tip in self.tips for peak in peaks_of(tip)]
        lengths = [{"length_m": s.length, "frequency_hz": peaks_of(s.tips[0])[0].frequency,
                    "stable_at_every_charted_speed_m": None if s.chart is None or self.withheld else _least_limit(s.chart),
                    "depth_max_m": None if s.chart is None else s.chart.depth_max,
                    "is_end_of_search": None if s.chart is None else (~np.isfinite(s.chart.limit)).tolist()}
                   for s in self.stick_outs]
        return {"peaks": peaks, "stick_out": lengths, "lobes": None if self.lobes is None else self.lobes.to_dict(),
                "doubts": doubts_among(self.notes), "withheld": self.withheld, "notes": list(self.notes)}


def bases_from_gauge(frf: Frf, gauge: ShaftDescription, *, noise: float | None = None,
                     calibration: float = DEFAULT_GAIN_DEVIATION,
                     draws: int = DEFAULT_DRAW_COUNT, generator: np.random.Generator | None = None) -> list[PlaneReceptance]:
    """Return the spindle's receptance in every plane in which the gauge was struck.

    noise : standard deviation of the responses as a share of each, where they state no variance; without it the scatter of
    neighbouring lines. calibration : standard deviation of the gain of hammer and sensor together, a share, the same for all
    responses.

    Examples
    --------
    Runs in ``examples/couple_a_tool_to_a_spindle.py``.
    """
    frf = with_noise(frf, noise)
    doubts = question_gauge(frf, gauge)
    struck = {dof.direction for dof in frf.outputs if str(dof.point) in gauge.stations}
    planes = [plane for plane in SLOPES if f"+{plane}" in struck]
    if not planes:
        fail("frf", f"responses at {', '.join(map(str, frf.outputs))}", "must be of the gauge's stations "
             f"{', '.join(gauge.stations) or '(it has none)'} along +x or +y", remedy="name files like 1=+x__2=+x.txt")
    said = [*doubts, f"hammer and sensor: calibrated to {100 * calibration:g} % (one standard deviation), alike in all "
            "responses"]
    if len(gauge.stations) < 3:
        said.append("two stations: they check labels and signs, but not the gauge's length, diameter, material and stations, "
                    "which are taken as described (a third station does; deviations in the gauge's file carry what is not "
                    "known)")
    # One hammer and one gauge for both planes: their draws are the same in each.
    seed = None if generator is None else int(generator.integers(2**63))
    bases = [identify_base(frf, gauge, plane, calibration=calibration, draws=draws, generator=generator,
                           common=None if seed is None else np.random.default_rng(seed)) for plane in planes]
    return [replace(base, notes=tuple(dict.fromkeys([*said, *base.notes]))) for base in bases]


def bases_of_responses(frf: Frf, point: str, *, draws: int = DEFAULT_DRAW_COUNT, generator: np.random.Generator | None = None
                       ) -> list[PlaneReceptance]:
    """Return the receptance of a point that was measured or computed with its rotations, in the planes that are there.

    >>> dofs = ["nose:+x", "nose:+ry"]
    >>> frf = Frf([10.0, 20.0], np.tile(np.diag([1e-8, 1e-6]) + 0j, (2, 1, 1)), dofs, dofs)
    >>> [base.plane for base in bases_of_responses(frf, "nose")]
    ['x']
    """
    planes = [plane for plane in SLOPES if Dof(point, f"+{plane}") in frf.outputs]
    if not planes:
        fail("point", repr(point), f"must be a point of the responses along +x or +y, of {', '.join(map(str, frf.outputs))}")
    return [plane_receptance(frf, point, plane, draws=draws, generator=generator) for plane in planes]


def study_tool(bases: Sequence[PlaneReceptance] | SpindleReceptance, tool: ShaftDescription, *,
               cut: Mapping[str, Any] | None = None,
               stick_out: tuple[str, FloatArray] | None = None, speeds: FloatArray | None = None,
               generator: np.random.Generator | None = None,
               progress: NamedProgress = lambda name, finished, total: None) -> ToolCoupling:
    """Couple a tool to a spindle; chart its cut, and do the same at other stick-outs.

    Parameters
    ----------
    bases : PlaneReceptance in x, and in y where it is known; or SpindleReceptance
    tool : ShaftDescription
    cut : mapping of flat keys of a CuttingDescription to values, optional
        Without it no stability is charted.
    stick_out : name of a segment and its lengths (m), optional
    speeds : (n,) floats, optional
        rev/min, of the charts.
    generator : numpy Generator, optional
        For the deviations of the tool.
    progress : function of name, done and total

    >>> from toolpoint.substructuring import SegmentDescription, ShaftDescription
    >>> lines = np.arange(1.0, 9.0)
    >>> rod = ShaftDescription({"rod": SegmentDescription(0.1, 0.02)})
    >>> spindle = PlaneReceptance(lines, np.tile(np.diag([1e-8, 1e-6]), (8, 1, 1)), "x")  # m/N and rad/(N m)
    >>> tip = study_tool([spindle], rod).tips[0].values[0, 0, 0].real
    >>> bending = 0.1**3 / (3 * 2.1e11 * np.pi * 0.02**4 / 64)
    >>> bool(abs(tip / (1e-8 + 0.1**2 * 1e-6 + bending) - 1) < 0.05)  # shear is left out by hand
    True
    """
    lengths = () if stick_out is None else tuple(float(v) for v in stick_out[1])
    tools = [] if stick_out is None else [tool.with_length(stick_out[0], length) for length in lengths]
    progress("tool", 0, 1)
    # One tool in one collet for both planes and all lengths: its draws are the same in each.
    seed = None if generator is None else int(generator.integers(2**63))
    coupled = couple_tips(bases, tool, seed)
    tips = coupled.tips
    notes = tuple(dict.fromkeys([*_doubts(tips), *_assumptions(tool, tips), *(n for tip in tips for n in tip.notes)]))
    grave = grave_among(notes)
    lobes = None if cut is None else _lobes(coupled, cut, speeds, grave)
    parts = []
    for k, (length, changed) in enumerate(zip(lengths, tools, strict=True)):
        # The spindle stays as it is: another length changes the tool alone.
        parts.append(_stick_out(length, couple_tips(bases, changed, seed), cut, speeds))
        progress("stick-outs", k + 1, len(lengths))
    ended = [words for part in parts for words in part.end_words]
    return ToolCoupling(tool, coupled, tuple(parts), lobes, (*_chart_doubts(lobes, parts), *ended, *notes))


def _stick_out(length: float, coupled: CoupledTip, cut: Mapping[str, Any] | None, speeds: FloatArray | None) -> StickOut:
    if cut is None:
        return StickOut(length, coupled)
    chart = _lobes(coupled, cut, speeds).chart
    return StickOut(length, coupled, chart, tuple(f"stick-out {1e3 * length:.4g} mm: {line}" for line in chart.notes
                                               if line.startswith(END_OF_SEARCH)))


def _chart_doubts(lobes: LobesStudy | None, parts: Sequence[StickOut]) -> tuple[Doubt, ...]:
    """Return the doubts of the charts about their own limits."""
    if lobes is None:
        return ()
    charts = [("lobes", lobes.chart), *((f"lobes at {1e3 * part.length:.4g} mm", part.chart) for part in parts)]
    said = [Doubt(name, chart.status) for name, chart in charts
            if chart is not None and not chart.status.startswith("complete")]
    return (*said, *(doubt for doubt in lobes.doubts if doubt not in lobes.chart.status))


def _lobes(coupled: CoupledTip, cut: Mapping[str, Any], speeds: FloatArray | None, grave: Sequence[Doubt] = ()
           ) -> LobesStudy:
    frf = tip_frf(coupled)
    band = (float(frf.frequency[0]), float(frf.frequency[-1]))
    dynamics = response_dynamics(frf, band=band, what="the coupled tool")
    return chart_lobes(replace(dynamics, notes=(*grave, *dynamics.notes)), cut, speeds=speeds)


def _peak_words(peak: TipPeak) -> list[str]:
    size = f"{1e6 * peak.height:.4g}"
    if peak.intervals is None:
        return [f"{peak.frequency:.1f}", "not known", size, "not known"]
    (frequency_min, frequency_max), (height_min, height_max) = peak.intervals
    return [f"{peak.frequency:.1f}", f"{frequency_min:.1f} .. {frequency_max:.1f}", size,
            f"{1e6 * height_min:.4g} .. {1e6 * height_max:.4g}"]


def _least_limit(chart: StabilityChart) -> float | None:
    limit = float(np.min(chart.limit))
    return limit if np.isfinite(limit) else None


def _chart_words(chart: StabilityChart) -> list[str]:
    limit = np.where(np.isfinite(chart.limit), chart.limit, chart.depth_max)
    best = int(np.argmax(limit))
    least_limit = _least_limit(chart)
    # The best speed may have no limit: then the end of the search is printed, marked as such.
    is_end = not np.isfinite(chart.limit[best])
    deepest = f"{1e3 * chart.depth_max:.4g} (end of the search)" if is_end else text_below(1e3 * limit[best])
    shallowest = f"above {1e3 * chart.depth_max:.3g}" if least_limit is None else text_below(1e3 * least_limit)
    return [shallowest, f"{chart.speeds[best]:.0f}", deepest]


def _doubts(tips: Sequence[PlaneReceptance]) -> list[Doubt]:
    unknown = [Doubt("interval", f"the noise of the spindle's response along {tip.plane} is not known, so the prediction has "
                     "none", "give responses with variance, or `noise`") for tip in tips if tip.draws is None]
    return [*unknown, *(doubt for tip in tips for doubt in question_peaks(tip))]


def _assumptions(tool: ShaftDescription, tips: Sequence[PlaneReceptance]) -> list[str]:
    lines = []
    if not any(part.contact for part in tool.segments.values()):
        lines.append("the tool is joined rigidly: no contact is described; a collet or taper that gives way makes it softer")
    lines.append(f"the tool is {1e3 * tool.length:.4g} mm long from the plane of the base: nothing in a test of a "
                 "gauge tells another stick-out")
    # Any value that the file leaves out comes from the handbook.
    usual = [name for name, part in tool.segments.items() if None in (part.modulus, part.density, part.poisson)]
    if usual:
        lines.append(f"handbook values of the material: {', '.join(usual)}")
    fluted = [name for name, part in tool.segments.items() if part.fluted]
    if fluted:
        shares = ", ".join(f"{tool.segments[name].equivalent:g}" for name in fluted)
        lines.append(f"{', '.join(fluted)} (fluted): counted as round with {shares} of their diameter" + (
            "" if tool.equivalent_deviation else ", taken as exact (equivalent_deviation is 0)"))
    if len(tips) == 1:
        lines.append(f"only the plane of {tips[0].plane} is known")
    return lines
