r"""Two states of one machine: test against test, or machine against machine (before and after, wear, two dates).

Modes are paired by MAC. A frequency has moved where its change lies outside the 95 % interval of the difference,
:math:`\sqrt{h_1^2 + h_2^2}` of both half widths; a shape where its MAC is below what noise alone leaves of two tests of one
shape (the 5 % point of drawn ones). Points are named by the rms over the pairs of how far the shapes differ there, the second
scaled to the first (by the least sum of differences), beside what their noise gives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.modal_identification import real_modes
from toolpoint.studies.measured.state_noise import PointChange, compare_responses, mac_of_noise, point_changes
from toolpoint.studies.measured.state_numbers import NumberChange
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Frf, Modes, correlation

_SHOWN_POINTS = 5


@dataclass(frozen=True, eq=False)
class ComparedState:
    """One state: its name, its modes (real ones), its responses or None, and the half widths (95 %) of its frequencies, Hz.

    interval : not a number where nothing tells it.
    """

    name: str
    modes: Modes
    interval: FloatArray
    frf: Frf | None = None


@dataclass(frozen=True, eq=False)
class StateComparison(NotebookText):
    """Two states of a machine.

    pairs : of their modes; change : (n,) of the paired frequencies, relative, and interval : its half width (95 %), not a
    number where nothing tells it; mac_noise : (n,), MAC that noise alone leaves, not a number likewise; points : the most
    changed first; frac, frac_noise : of every output-input pair, None without responses of both; numbers : that differ between
    two machine files, None for tests.
    """

    older: ComparedState
    newer: ComparedState
    pairs: correlation.Pairing
    change: FloatArray
    interval: FloatArray
    mac_noise: FloatArray
    points: tuple[PointChange, ...]
    frac: FloatArray | None = None
    frac_noise: FloatArray | None = None
    numbers: tuple[NumberChange, ...] | None = None
    doubts: tuple[Doubt, ...] = ()

    @property
    def moved(self) -> np.ndarray:
        """Whether each paired frequency changed beyond its interval; never where there is no interval."""
        return np.abs(self.change) > self.interval

    @property
    def turned(self) -> np.ndarray:
        """Whether each paired shape changed beyond noise; never where its noise is not known."""
        return self.pairs.values < self.mac_noise

    def answer(self) -> str:
        """Return what moved, in words."""
        if not len(self.pairs.pairs):
            return "No mode of one state has a partner in the other."
        k = int(np.abs(self.change).argmax())
        frequency = self.older.modes.frequency[self.pairs.pairs[k, 0]]
        known_count = int(np.isfinite(self.interval).sum())
        words = (f"{int(self.moved.sum())} of {known_count} frequencies with an interval moved beyond it" if known_count
                 else "no frequency has an interval")
        return (f"{len(self.pairs.pairs)} modes are paired; {words}. The largest change is {100 * self.change[k]:+.2f} % "
                f"at {frequency:.2f} Hz, the lowest MAC {self.pairs.values.min():.3f}.")

    def rows(self) -> list[list[str]]:
        """Return the rows of the table of modes."""
        rows = []
        for k, (i, j) in enumerate(self.pairs.pairs):
            width = "not known" if np.isnan(self.interval[k]) else f"± {100 * self.interval[k]:.3g}"
            noise = "not known" if np.isnan(self.mac_noise[k]) else f"{self.mac_noise[k]:.4f}"
            verdict = ", ".join(word for word, holds in (("frequency moved", self.moved[k]), ("shape changed", self.turned[k]))
                                if holds)
            rows.append([str(i + 1), f"{self.older.modes.frequency[i]:.3f}", f"{self.newer.modes.frequency[j]:.3f}",
                         f"{100 * self.change[k]:+.3f}", width, f"{self.pairs.values[k]:.4f}", noise, verdict])
        return rows

    def single_lines(self) -> list[str]:
        """Return a line on every mode without a partner."""
        return [f"mode at {state.modes.frequency[i]:.2f} Hz {where} has no partner" for state, singles, where in (
            (self.older, self.pairs.single_first, "before"), (self.newer, self.pairs.single_second, "after")) for i in singles]

    def point_lines(self) -> list[str]:
        """Return a line on each of the points that changed most."""
        lines = []
        for entry in self.points[:_SHOWN_POINTS]:
            noise = "noise not known" if np.isnan(entry.noise) else f"noise gives {100 * entry.noise:.2g} %"
            lines.append(f"point {entry.point}: shapes differ by {100 * entry.size:.2g} % of their largest entry ({noise})"
                         + (", stands out" if entry.stands_out else ""))
        return lines

    def frac_line(self) -> str:
        """Return FRAC in words; empty without responses of both."""
        if self.frac is None:
            return ""
        noise = "" if self.frac_noise is None else f"; noise alone leaves {self.frac_noise.min():.4f} (least, 5 % point)"
        return f"FRAC of {self.frac.size} responses: lowest {self.frac.min():.4f}, mean {self.frac.mean():.4f}{noise}"

    def table(self) -> str:
        """Return doubts, the answer, modes, points, responses and numbers as text."""
        names = [f"{state.name} Hz" for state in (self.older, self.newer)]
        header = ["mode", *names, "change %", "95 %", "MAC", "noise leaves", "verdict"]
        lines = [*mark_notes(self.doubts), self.answer(), text_table("Paired modes", header, self.rows()), *self.single_lines(),
                 *self.point_lines(), *filter(None, [self.frac_line()])]
        lines += [number.line(self.change) for number in self.numbers or ()]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as plain data, None where something is not known."""
        def known(value: float) -> float | None:
            return None if np.isnan(value) else float(value)

        return {"doubts": list(self.doubts), "older": self.older.name, "newer": self.newer.name, "modes": [
            {"older_hz": float(self.older.modes.frequency[i]), "newer_hz": float(self.newer.modes.frequency[j]),
             "change": float(self.change[k]), "half_width": known(self.interval[k]), "mac": float(self.pairs.values[k]),
             "mac_of_noise": known(self.mac_noise[k]), "moved": bool(self.moved[k]), "turned": bool(self.turned[k])}
            for k, (i, j) in enumerate(self.pairs.pairs)],
            "single": self.single_lines(),
            "points": [{"point": str(p.point), "size": p.size, "noise": known(p.noise)} for p in self.points],
            "frac": None if self.frac is None else self.frac.tolist(),
            "numbers": None if self.numbers is None else [number.to_dict() for number in self.numbers]}

    def __repr__(self) -> str:
        return f"StateComparison({self.older.name!r}, {self.newer.name!r}, {len(self.pairs.pairs)} pairs)"


def state_of_test(name: str, modes: Modes, frf: Frf | None = None) -> ComparedState:
    """Return a measured state; intervals are those of its modes, where they carry a covariance."""
    real = real_modes(modes)
    unknown = np.full(real.count, np.nan)
    return ComparedState(name, real, unknown if modes.covariance is None else modes.frequency_interval, frf)


def compare_states(older: ComparedState, newer: ComparedState, *, lowest_mac: float = 0.5, rng: np.random.Generator
                   ) -> StateComparison:
    """Return how two states differ.

    lowest_mac : pairs below are left single; rng : draws the noise of shapes and responses.

    Raises ToolpointError where the states share no point and direction.
    """
    shared = [dof for dof in older.modes.dofs if dof in newer.modes.dofs]
    if not shared:
        fail("newer", f"{newer.name}: no point and direction of {older.name}", "both states must be seen at the same points",
             remedy="rename the channels, see --name")
    first, second = older.modes.at_dofs(shared), newer.modes.at_dofs(shared)
    pairs = correlation.pair_modes(first, second, lowest_mac)
    i, j = pairs.pairs[:, 0], pairs.pairs[:, 1]
    f, g = first.frequency[i], second.frequency[j]
    width = np.hypot(newer.interval[j] / f, older.interval[i] * g / f**2)
    noise = np.array([mac_of_noise(first, second, (a, b), rng=rng) for a, b in pairs.pairs]).reshape(-1)
    frac, frac_noise = compare_responses(older.frf, newer.frf, rng)
    return StateComparison(older, newer, pairs, g / f - 1, width, noise, point_changes(first, second, pairs), frac, frac_noise,
                           None, _doubts(older, newer, len(shared), pairs))


def _doubts(older: ComparedState, newer: ComparedState, shared: int, pairs: correlation.Pairing) -> tuple[Doubt, ...]:
    """Return what the comparison cannot tell."""
    doubts = []
    measured = [state for state in (older, newer) if np.isfinite(state.interval).any()]
    if measured:
        doubts.append(Doubt("intervals", "they hold each test's own noise alone; two tests of an unchanged machine differ by "
                            "more (temperature, place of the axes, sensors fixed anew), and one in twenty that did not move "
                            "lies outside",
                            "test one state twice and compare the two: what moves there is no change"))
    for state in (older, newer):
        if shared < len(state.modes.dofs):
            count = len(state.modes.dofs)
            doubts.append(Doubt(f"state {state.name}", f"{count - shared} of {count} points and directions are not in the "
                                "other and are left out", "MAC is of what both have"))
    if shared < 2 * max(len(pairs.pairs), 1):
        doubts.append(Doubt("MAC", f"{shared} points and directions tell {len(pairs.pairs)} modes hardly apart",
                            "measure more points: with few, shapes look alike"))
    return tuple(doubts)

