"""Tap test of a tool in one call: responses, modes, limits, speeds to use, what to strike again, a light for each step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint._rounding import text_below
from toolpoint.modal_identification import Identification
from toolpoint.signals.usable_band import UsableBand, find_compliant_band, usable_band
from toolpoint.studies.cuts.tip_doubts import gain_notes, question_directions, question_tip
from toolpoint.studies.cuts.tool_directions import along_positive_axes, check_driving_points, tool_directions
from toolpoint.studies.measured.hammer_study import HammerStudy
from toolpoint.studies.measured.identification import identify_modes
from toolpoint.studies.testing.tap_dynamics import (
    MIN_COMPLIANCE_RATIO,
    TappedModes,
    TappedTip,
    join_directions,
    measure_misfit,
    question_ends,
    take_modes,
)
from toolpoint.studies.testing.tap_limits import Progress, TapLimits, chart_limits
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Frf

COLOURS = ("green", "amber", "red")
MAX_STATIC_STIFFNESS = 1e12  # N/m: what is stiffer has no modal compliance at all
MIN_SCATTER_HITS = 3  # from which the scatter of hits is known
MAX_INTERVAL_RATIO = 2.0  # upper over lower end of the interval of the least limit
HAND_BLOW_FORCE_RANGE = (4.0, 2e4)  # N, of blows of hand-held hammers
MODE_COLUMNS = ("direction", "mode", "frequency Hz", "± Hz (95 %)", "damping %", "± % (95 %)", "")
SPEED_COLUMNS = ("rev/min", "depth mm", "removal %", "deeper chatters at Hz")


@dataclass(frozen=True)
class Light:
    """Verdict on a step: the step, ``green`` ``amber`` or ``red``, the finding, and the remedy (empty: none)."""

    step: str
    colour: str
    words: str
    remedy: str = ""


@dataclass(frozen=True, eq=False)
class TappedDirection:
    """One direction of a tap test.

    frf : all responses; tip : that of the tip; band : to be believed; modes : identified in it; hits : study of the hits, None
    for responses without records.
    """

    name: str
    frf: Frf
    tip: Frf
    band: UsableBand
    modes: Identification
    hits: HammerStudy | None = None

    @property
    def spread(self) -> FloatArray | None:
        """Relative standard deviation of the tip's response on each line of the band, None where nothing is known."""
        inside = self.tip.between(*self.band.ends)
        if inside.variance is None:
            return None
        return np.sqrt(inside.variance[:, 0, 0]) / np.maximum(np.abs(inside.values[:, 0, 0]), 1e-300)


@dataclass(frozen=True, eq=False)
class TapStudy(NotebookText):
    """Result of a tap test: directions, limits with speeds to use, lights, and what to strike again."""

    directions: tuple[TappedDirection, ...]
    limits: TapLimits
    lights: tuple[Light, ...]

    @property
    def colour(self) -> str:
        """The worst of the lights."""
        return max((light.colour for light in self.lights), key=COLOURS.index)

    @property
    def again(self) -> tuple[str, ...]:
        """Remedies, most urgent first: what to strike or look at again."""
        ordered = sorted(self.lights, key=lambda light: -COLOURS.index(light.colour))
        return tuple(dict.fromkeys(light.remedy for light in ordered if light.remedy))

    @property
    def status(self) -> str:
        """The answer in a sentence."""
        limit, lower, upper, speed = self.limits.lowest
        if self.colour == "red":
            return "Do not cut by this test: " + "; ".join(light.words for light in self.lights if light.colour == "red") + "."
        first = self.limits.speeds[0] if self.limits.speeds else None
        limit_words = f"least limit {1e3 * limit:.2g} mm, {1e3 * lower:.2g} .. {1e3 * upper:.2g} mm, at {speed:.0f} rev/min"
        if not np.isfinite(self.limits.chart.limit).any():
            limit_words = f"no limit to {1e3 * limit:.3g} mm, the end of the searched depths"
        words = f"Stable at every speed up to {text_below(1e3 * lower, 2)} mm, 95 % certain ({limit_words})"
        use = "" if first is None else f"; best use: {first.speed:.0f} rev/min with {text_below(1e3 * first.depth, 2)} mm"
        return words + use + (", with doubts (amber)." if self.colour == "amber" else ".")

    def mode_rows(self) -> list[list[str]]:
        """Return a row for every mode: direction, number, frequency, damping with intervals, mark."""
        rows = []
        for direction in self.directions:
            identified = direction.modes
            for i in range(identified.modes.count):
                intervals = ["unknown", "unknown"]
                if identified.modes.covariance is not None:
                    ends = identified.modes.frequency_interval[i], 100 * identified.modes.damping_interval[i]
                    intervals = [f"{float(f'{end:.2g}'):g}" if np.isfinite(end) else "unknown" for end in ends]
                mark = "doubtful" if identified.doubtful[i] else "stands out" if i in identified.dominant else ""
                rows.append([direction.name, str(i + 1), f"{identified.modes.frequency[i]:.1f}", intervals[0],
                             f"{100 * identified.modes.damping_ratio[i]:.2f}", intervals[1], mark])
        return rows

    def speed_rows(self) -> list[list[str]]:
        """Return a row for every speed to use; none where a light is red."""
        if self.colour == "red":
            return []
        return [[f"{use.speed:.0f}", text_below(1e3 * use.depth, 2), f"{100 * use.worth:.0f}",
                 "-" if np.isnan(use.chatter) else f"{use.chatter:.0f}"] for use in self.limits.speeds]

    def light_rows(self) -> list[list[str]]:
        """Return a row for every light."""
        return [[light.step, light.colour, light.words, light.remedy] for light in self.lights]

    def table(self) -> str:
        """Return answer, lights, modes and speeds as text."""
        speeds = self.speed_rows()
        title = "Speeds to use (95 % certain there and 2 % beside, a tenth of depth in hand)"
        tables = [text_table("Steps", ("step", "light", "what is so", "what to do"), self.light_rows()),
                  text_table("Modes", MODE_COLUMNS, self.mode_rows())]
        return "\n".join([self.status, *tables, *([text_table(title, SPEED_COLUMNS, speeds)] if speeds else [])])

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI: status, lights, modes, limits with intervals, speeds to use, what to strike again."""
        limit, lower, upper, speed = self.limits.lowest
        chart = self.limits.chart
        return {"status": self.status, "colour": self.colour, "again": list(self.again),
                "lights": [vars(light) for light in self.lights],
                "modes": [{"direction": d.name, "frequency_hz": d.modes.modes.frequency.tolist(),
                           "damping_ratio": d.modes.modes.damping_ratio.tolist(), "doubtful": d.modes.doubtful.tolist(),
                           "band_hz": list(d.band.ends)} for d in self.directions],
                "least_limit_m": {"depth": limit, "interval": [lower, upper], "speed_rpm": speed},
                "speed_rpm": chart.speeds.tolist(), "limit_m": np.minimum(chart.limit, chart.depth_max).tolist(),
                "depth_max_m": chart.depth_max, "is_end_of_search": (~np.isfinite(chart.limit)).tolist(),
                "interval_over_limit": [self.limits.low.tolist(), self.limits.high.tolist()],
                "speeds_to_use": [vars(use) for use in self.limits.speeds], "notes": list(self.limits.notes)}


def study_tap(x: HammerStudy | Frf, y: HammerStudy | Frf | None = None, values: Mapping[str, Any] | None = None, *,
              tip: str | None = None, speeds: tuple[float, float] | None = None, rng: np.random.Generator,
              progress: Progress = lambda name, finished, total: None) -> TapStudy:
    """Return the result of a tap test of a tool.

    Parameters
    ----------
    x, y : HammerStudy or Frf
        Hits (or responses) along x, the feed, and along y; without y it is taken as x, and the light is amber.
    values : mapping of flat keys of a CuttingDescription to values
        Cutter and material, as for `chart_lobes`.
    tip : label, optional
        The tool's tip along x where there are several driving points.
    speeds : (lowest, highest), rev/min, optional
    rng : numpy.random.Generator

    Examples
    --------
    Runs in ``examples/tap_a_tool.py``.
    """
    directions = [_direction("x", x, tip, progress)]
    if y is not None:
        directions.append(_direction("y", y, None, progress))
    struck = _tip_of(directions)
    limits = chart_limits(struck, values or {}, speeds=speeds, rng=rng, progress=progress)
    parts = (struck.x,) if struck.y is None else (struck.x, struck.y)
    lights = [light for direction, part in zip(directions, parts, strict=True) for light in _lights_of(direction, part)]
    lights.append(_direction_light(struck, directions))
    # Limits rest on every step before them.
    sound = not any(light.colour == "red" for light in lights)
    return TapStudy(tuple(directions), limits, (*lights, _limit_light(limits, dict(values or {}), sound)))


def _direction(name: str, test: HammerStudy | Frf, tip: str | None, progress: Progress) -> TappedDirection:
    hits = test if isinstance(test, HammerStudy) else None
    frf = along_positive_axes(test.frf if isinstance(test, HammerStudy) else test)
    label = tool_directions(check_driving_points(frf, f"the test along {name}"), tip, "same", what=f"the test along {name}").x
    tip_alone = frf.selected([label], [label])
    band = find_compliant_band(tip_alone, usable_band(frf) if hits is None else hits.band)
    progress(f"modes along {name}", 0, 1)
    return TappedDirection(name, frf, tip_alone, band, identify_modes(frf, band=band.ends), hits)


def _tip_of(directions: list[TappedDirection]) -> TappedTip:
    parts = [take_modes(d.modes, d.tip, str(d.tip.outputs[0])) for d in directions]
    notes = [f"along {d.name}: the modes of {d.tip.outputs[0]}, {d.tip.quantity}, {d.band.low:.4g} .. {d.band.high:.4g} Hz"
             for d in directions]
    # Both tests may name their own direction x: the direction of the cut tells them apart.
    notes += [f"along {d.name}: {note}" for d in directions for note in gain_notes(d.tip.between(*d.band.ends))]
    return join_directions(parts[0], parts[1] if len(parts) > 1 else None, tuple(notes))


def _lights_of(direction: TappedDirection, part: TappedModes) -> list[Light]:
    return [_hits_light(direction), _response_light(direction), _modes_light(direction, part)]


def _hits_light(direction: TappedDirection) -> Light:
    step, name = f"hits along {direction.name}", direction.name
    study = direction.hits
    if study is None:
        return Light(step, "amber", "responses without records: hits cannot be judged", "")
    words = f"{study.used} of {len(study.verdicts)} hits used"
    disputed = [doubt for doubt in study.doubts if "contradict" in doubt or "no majority" in doubt]
    if disputed:
        return Light(step, "red", disputed[0], f"strike again along {name}, at one spot and in one direction")
    if windowed := [doubt for doubt in study.doubts if doubt.what == "window"]:
        return Light(step, "red", windowed[0].why, windowed[0].remedy)
    force = float(np.median([verdict.hit.force for verdict in study.verdicts if verdict.hit.accepted]))
    if not HAND_BLOW_FORCE_RANGE[0] < force < HAND_BLOW_FORCE_RANGE[1]:
        return Light(step, "red", f"{words}, of {force:.2g} N: no blow of a hand-held hammer",
                     "check the sensitivity of the hammer and its unit (mV/N, V/N)")
    if study.used < MIN_SCATTER_HITS:
        more_hits = MIN_SCATTER_HITS - study.used
        return Light(step, "amber", f"{words}: scatter is hardly known", f"strike at least {more_hits} times more along {name}")
    if 2 * study.used < len(study.verdicts):
        return Light(step, "amber", f"{words}: most were refused", f"look at the reasons and strike again along {name}")
    other_doubts = [doubt for doubt in study.doubts if doubt.what not in _lit_elsewhere(direction)]
    if other_doubts:
        return Light(step, "amber", str(other_doubts[0].within(words)), other_doubts[0].remedy)
    return Light(step, "green", f"{words}, of {force:.3g} N")


def _lit_elsewhere(direction: TappedDirection) -> set[str]:
    """Return the subjects of doubts that other lights show: those of the driving point."""
    return {str(direction.tip.outputs[0]), "one hit only"}


def _response_light(direction: TappedDirection) -> Light:
    step = f"response along {direction.name}"
    inside = direction.tip.between(*direction.band.ends)
    band = f"from {direction.band.low:.4g} to {direction.band.high:.4g} Hz"
    # What lies below the band was measured, and is drift.
    lowest = float(direction.tip.frequency[direction.tip.frequency > 0][0])
    if doubts := sorted(question_tip(inside, measured_from=lowest), key=lambda doubt: not doubt.grave):
        gravest = doubts[0]
        return Light(step, "red" if gravest.grave else "amber", f"{gravest.why} ({band})",
                     f"along {direction.name}: {gravest.remedy}")
    spread = direction.spread
    if spread is None:
        return Light(step, "amber", f"passive {band}; its scatter is not known", "")
    size = np.abs(inside.values[:, 0, 0])
    # Only lines near the peaks decide the limits.
    scatter = float(np.median(spread[size > 0.3 * size.max()]))
    if scatter > 0.05:
        return Light(step, "amber", f"scatters by {100 * scatter:.1f} % at its peaks {band}",
                     f"strike more often along {direction.name}, at one spot")
    return Light(step, "green", f"passive, scatters by {100 * scatter:.2g} % at its peaks, {band}")


def _modes_light(direction: TappedDirection, part: TappedModes) -> Light:
    step, identified = f"modes along {direction.name}", direction.modes
    # Doubts about stiff modes hardly move the tool point.
    soft = part.compliance > MIN_COMPLIANCE_RATIO * part.compliance.max(initial=0.0)
    # The identification's own fit, or that of the modes as they are used for the limits, whichever is worse.
    fit = min(identified.fit, 1 - measure_misfit(identified, direction.tip, direction.band.ends))
    words = (f"{identified.modes.count} modes, {len(identified.dominant)} stand out, {int(identified.doubtful.sum())} doubtful "
             f"({int((identified.doubtful[part.vibrates] & soft).sum())} of them soft); they explain {100 * fit:.1f} %; "
             + (f"static stiffness {part.stiffness / 1e6:.3g} N/µm" if part.stiffness < MAX_STATIC_STIFFNESS else
                "no mode that yields at rest: such a response is none of a structure"))
    if len(identified.dominant) == 0 or fit < 0.8:
        return Light(step, "red", words, f"strike harder or with another tip along {direction.name}")
    if ends := question_ends(direction.name, part, direction.band.ends):
        return Light(step, "amber", ends[0].why, ends[0].remedy)
    if (identified.doubtful[part.vibrates] & soft).any() or fit < 0.97:
        return Light(step, "amber", words, f"strike more often along {direction.name}, or take longer records")
    return Light(step, "green", words)


def _direction_light(struck: TappedTip, directions: list[TappedDirection]) -> Light:
    if doubts := question_directions({direction.name: direction.tip for direction in directions}):
        return Light("directions", "red" if doubts[0].grave else "amber", doubts[0].why, doubts[0].remedy)
    if struck.y is None:
        return Light("directions", "amber", "only x was struck: y is taken as alike", "strike along y too")
    if struck.turned:
        shared = ", ".join(f"{frequency:.0f}" for frequency in struck.turned[:4])
        return Light("directions", "amber", f"x and y share modes ({shared} Hz) that may be turned between them; their cross "
                     "response was not measured: the interval holds for either sign",
                     "strike along x with the sensor along y, and give all three to `toolpoint lobes --frf-x --frf-y --frf-xy`")
    return Light("directions", "green", "x and y were struck and share no mode: their cross response is taken as zero")


def _limit_light(limits: TapLimits, values: Mapping[str, Any], sound: bool) -> Light:
    limit, lower, upper, _ = limits.lowest
    if not sound:
        return Light("limits", "red", "limits stand on a step above that is red: none is to be used")
    words = f"least limit {1e3 * limit:.3g} mm, 95 % interval {1e3 * lower:.3g} .. {1e3 * upper:.3g} mm"
    band_notes = [note for note in limits.notes if "the FRF ends at" in note or "missing is the band" in note]
    if band_notes:
        return Light("limits", "amber", f"{words}; the chatter band goes on beyond the measurement: limits may be too high",
                     "strike with a harder tip")
    if not {"material", "tangential"} & set(values):
        return Light("limits", "amber", f"{words}; the coefficients are an example's", "give --material or --kt and --kn")
    if limits.chart.doubts:
        doubt = limits.chart.doubts[0]
        return Light("limits", "amber", f"{words}; {doubt.why}", doubt.remedy)
    if upper > MAX_INTERVAL_RATIO * lower:
        return Light("limits", "amber", f"{words}: wide", "strike more often; calibrate the coefficients of this material")
    return Light("limits", "green", words)
