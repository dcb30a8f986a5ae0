"""Traverse study: modes of a machine at work over the position or the speed of an axis, beside the machine's own prediction."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, ToolpointWarning, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import probability_text
from toolpoint.machine import Machine
from toolpoint.modal_identification import identify_operational
from toolpoint.studies.moving.mode_tracks import MIN_TRACK_WINDOWS, ModeTrack, TraverseWindow, track_modes
from toolpoint.studies.moving.moving_joints import JointChange, PredictedTracks, predict_tracks, weigh_joints
from toolpoint.studies.moving.pole_course import PoleCourse, fit_course
from toolpoint.studies.text_table import text_table

CHANGE_ALARM = 0.01  # of a mode that does not change, of being called changed, for all modes together
MAX_WINDOW_SMEAR = 0.5  # of the half width of a resonance, that its frequency may move within a window
MIN_NAMED_JOINT_PROBABILITY = 0.8  # of a joint that is named alone


@dataclass(frozen=True, eq=False)
class TraverseStudy(NotebookText):
    """Modes over a value.

    quantity : what the value is, with its unit; values : (n_windows,); tracks : of the modes; frequency, damping : course of
    each; predicted : by the machine, None without one; joints : that could change on the way, likeliest first; unchanged :
    probability that none does, nan without a machine.

    Examples
    --------
    Runs in ``examples/follow_modes_over_a_traverse.py``.
    """

    quantity: str
    values: FloatArray
    tracks: tuple[ModeTrack, ...]
    frequency: tuple[PoleCourse, ...]
    damping: tuple[PoleCourse, ...]
    predicted: PredictedTracks | None
    joints: tuple[JointChange, ...]
    unchanged: float
    doubts: tuple[Doubt, ...]
    notes: tuple[str, ...]

    @property
    def changed(self) -> list[int]:
        """Modes whose frequency changes over the value, by Holm's rule at one in a hundred for all together."""
        order = np.argsort([course.change_probability for course in self.frequency])
        result = list[int]()
        for place, k in enumerate(order.tolist()):
            if self.frequency[k].change_probability >= CHANGE_ALARM / (len(order) - place):
                break
            result.append(k)
        return sorted(result)

    @property
    def status(self) -> str:
        """The answer in a sentence or two."""
        first, last = float(self.values[0]), float(self.values[-1])
        changed = self.changed
        if not changed:
            words = f"None of {len(self.tracks)} modes changes over {self.quantity}."
        else:
            parts = [f"mode {k + 1} from {float(self.frequency[k].at_values(self.values[:1])[0][0]):.4g} Hz by "
                     f"{_signed(self.frequency[k].change(first, last))} Hz" for k in changed[:5]]
            words = f"{len(changed)} of {len(self.tracks)} modes change over {self.quantity}: {', '.join(parts)}."
        return f"{words} {self._joint_words()}".strip()

    def _joint_words(self) -> str:
        if self.predicted is None:
            return ""
        if not self.joints or self.unchanged > MIN_NAMED_JOINT_PROBABILITY:
            return ("The machine file predicts these courses: no joint need change on the way (probability "
                    f"{probability_text(self.unchanged, 0.01)}).")
        likeliest = self.joints[0]
        words = (f"stiffness times {likeliest.factor:.2f} from end to end, {likeliest.interval[0]:.2f} to "
                 f"{likeliest.interval[1]:.2f}")
        if not likeliest.fits:
            return (f"No joint alone explains what the machine file does not predict; {likeliest.joint} comes nearest "
                    f"({words}). Look at the file first: compare it with a test at one pose.")
        if likeliest.probability >= MIN_NAMED_JOINT_PROBABILITY:
            return (f"What the machine file does not predict is best explained by {likeliest.joint} ({words}; probability "
                    f"{probability_text(likeliest.probability, 0.01)}, if one joint alone changes).")
        names = ", ".join(each.joint for each in self.joints[:3])
        return f"What the machine file does not predict may come from {names}: the modes do not tell them apart."

    def rows(self) -> list[list[str]]:
        """Return a row for every mode: frequency at both ends, its change with interval, damping ratio, windows."""
        result = []
        ends = self.values[[0, -1]]
        for k, (track, course, damping) in enumerate(zip(self.tracks, self.frequency, self.damping, strict=True)):
            (first, last), half_width = course.at_values(ends)
            ratio, ratio_width = damping.at_values(np.array([course.centre]))
            result.append([str(k + 1), f"{first:.4f} ± {half_width[0]:.2g}", f"{last:.4f} ± {half_width[1]:.2g}",
                           _signed(course.change(float(ends[0]), float(ends[1]))),
                           f"{100 * ratio[0]:.3g} ± {100 * ratio_width[0]:.2g}", str(track.windows.size),
                           "changes" if k in self.changed else ""])
        return result

    def joint_rows(self) -> list[list[str]]:
        """Return a row for every joint that could change: its probability, factor, interval."""
        return [[each.joint, probability_text(each.probability, 0.01), f"{each.factor:.3f}",
                 f"{each.interval[0]:.3f} .. {each.interval[1]:.3f}", "yes" if each.fits else "no"] for each in self.joints]

    def table(self) -> str:
        """Return the answer, the modes and the joints as text, doubts first."""
        tables = [text_table(f"Modes over {self.quantity}, 95 % intervals", MODE_HEADER, self.rows())]
        if self.joints:
            tables.append(text_table("Joints, one alone", JOINT_HEADER, self.joint_rows()))
        return "\n".join([*mark_notes(self.doubts), self.status, *tables])

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: values, courses (at the windows' values) with half widths, joints, doubts."""
        courses = [course.at_values(self.values) for course in self.frequency]
        damping = [course.at_values(self.values) for course in self.damping]
        return {"status": self.status, "doubts": list(self.doubts), "notes": list(self.notes), "quantity": self.quantity,
                "values": self.values.tolist(), "changed": self.changed,
                "modes": [{"frequency_hz": f.tolist(), "frequency_interval_hz": fw.tolist(), "damping_ratio": z.tolist(),
                           "damping_interval": zw.tolist(), "windows": track.windows.tolist(),
                           "measured_hz": track.frequency.tolist()}
                          for track, (f, fw), (z, zw) in zip(self.tracks, courses, damping, strict=True)],
                "joints": [vars(each) for each in self.joints],
                "unchanged_probability": None if np.isnan(self.unchanged) else self.unchanged}


MODE_HEADER = ("mode", "first, Hz", "last, Hz", "change, Hz", "damping, %", "windows", "")
JOINT_HEADER = ("joint", "probability", "factor end to end", "95 %", "explains all")


def study_traverse(windows: Sequence[TraverseWindow], *, quantity: str = "position, m", machine: Machine | None = None,
                   poses: Sequence[Mapping[str, float]] | None = None, band: tuple[float, float] | None = None
                   ) -> TraverseStudy:
    """Return the modes over the value of windows, with what a machine predicts.

    Parameters
    ----------
    windows : sequence of TraverseWindow
        Of the same channels, in the order of their values; see `cut_windows` for one long traverse. Records of steady
        traverses at several speeds are windows whose value is the speed.
    quantity : str
    machine : Machine, optional
        Its points bear the names of the channels.
    poses : sequence of mappings, optional
        Of the windows; with a machine they must be given.
    band : (low, high) in Hz, optional

    Raises
    ------
    ToolpointError
        For fewer than four windows, poses without machine or the reverse, and windows in which no mode is found.

    Examples
    --------
    Runs in ``examples/follow_modes_over_a_traverse.py``.
    """
    if len(windows) < MIN_TRACK_WINDOWS:
        fail("windows", str(len(windows)), f"must be at least {MIN_TRACK_WINDOWS}", remedy="cut the record into more")
    if (machine is None) != (poses is None):
        fail("machine and poses", "one without the other", "must be both or none")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToolpointWarning)
        identified = [identify_operational(window.record, band=band) for window in windows]
    values = np.array([window.value for window in windows])
    tracks = track_modes([each.modes for each in identified])
    if not tracks:
        raise ToolpointError(f"windows: no mode is seen in {MIN_TRACK_WINDOWS} of {len(windows)} windows; take longer "
                             "windows, or a band around the modes")
    courses = [fit_course(values[track.windows], track.frequency, track.deviations[:, 0]) for track in tracks]
    damping = [fit_course(values[track.windows], track.damping_ratio, track.deviations[:, 1], degree=1) for track in tracks]
    predicted, joints, unchanged = None, list[JointChange](), float("nan")
    if machine is not None and poses is not None:
        predicted = predict_tracks(machine, tracks, poses, dofs=identified[0].modes.dofs)
        joints, unchanged = weigh_joints(tracks, predicted, values)
    notes = [f"{len(windows)} windows of {windows[0].record.duration:.3g} s; each is taken as standing still, and the course "
             "through all of them as smooth"]
    harmonics = sorted({round(line.frequency, 2) for each in identified for line in each.harmonics})
    if harmonics:
        notes.append(f"lines of rotating parts were taken off: {', '.join(f'{f:g}' for f in harmonics[:8])} Hz")
    return TraverseStudy(quantity, values, tuple(tracks), tuple(courses), tuple(damping), predicted, tuple(joints), unchanged,
                         tuple(_doubts(windows, tracks, courses, damping, predicted)), tuple(notes))


def _doubts(windows: Sequence[TraverseWindow], tracks: Sequence[ModeTrack], courses: Sequence[PoleCourse],
            damping: Sequence[PoleCourse], predicted: PredictedTracks | None) -> list[Doubt]:
    """Return what the windows may have falsified: resonances smeared, courses that are not smooth, modes without a partner."""
    result = []
    span = float(np.ptp([window.value for window in windows])) or 1.0
    for k, (track, course, ratio) in enumerate(zip(tracks, courses, damping, strict=True)):
        within = abs(course.change(windows[0].value, windows[-1].value)[0]) * windows[0].extent / span
        half_width = float(np.median(track.frequency)) * max(float(ratio.at_values(np.array([course.centre]))[0][0]), 1e-9)
        if within > MAX_WINDOW_SMEAR * half_width:
            result.append(Doubt(f"damping of mode {k + 1}", f"its frequency moves by {100 * within / half_width:.0f} % of its "
                                "half width within a window, which widens it", "travel slower, or cut more windows",
                                figure=within / half_width))
        if course.misfit > 3:
            result.append(Doubt(f"mode {k + 1}", f"its windows scatter {np.sqrt(course.misfit):.1f} times as much as a "
                                "parabola and their intervals allow; the intervals of the course are widened by it",
                                "look at the loads: they must be random and alike all along"))
        if predicted is not None and not np.isfinite(predicted.frequency[k]).any():
            result.append(Doubt(f"mode {k + 1}", "the machine has no mode of this shape", "compare both at one pose "
                                "(toolpoint correlate)"))
    return result


def _signed(change: tuple[float, float]) -> str:
    return f"{change[0]:+.3g} ± {change[1]:.2g}"
