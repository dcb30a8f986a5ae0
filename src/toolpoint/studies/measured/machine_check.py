"""Identified machine, run as it stands in its file, beside the measured modes: frequencies, damping, MAC."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2

from toolpoint._check import FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.machine import Machine, assemble
from toolpoint.vibration import Modes
from toolpoint.vibration.correlation import assign_modes
from toolpoint.vibration.damped_modes import solve_as_damped, upper_poles

HEADER = ("mode", "computed Hz", "measured Hz", "difference %", "computed damping %", "measured damping %", "MAC")
# A machine that is farther from its own test than this is not the machine of the test.
_MAX_FREQUENCY_DIFFERENCE, _MAX_DAMPING_DIFFERENCE = 0.005, 0.15
# MAC that is left of two equal shapes when noise is taken off, and the chance of more noise than is taken off.
_MIN_MODE_MAC, _MAX_NOISE_EXCESS_PROBABILITY = 0.95, 1e-3
# Distance from the measured band (share of the frequency) within which the test should have shown a mode.
_BAND_MARGIN_FRACTION = 0.03
# A driving point that moves less than this share of the largest motion hardly drives a mode.
_MIN_DRIVING_MOTION = 0.1


@dataclass(frozen=True, eq=False)
class MachineCheck:
    """Modes of a machine (frequency ``|s| / 2 pi`` in Hz, damping ratio) and the measured ones that they look like.

    partner : (n,) of every mode of the machine among the measured ones, -1 for none; mac : (n,) with it; driven : (n,) motion
    of the driving points over the largest, 1 where they are not known; noise : of every measured mode, what the noise of its
    shape alone takes from a MAC, 0 where it is not known.
    """

    frequency: FloatArray
    ratio: FloatArray
    measured: Modes
    partner: IndexArray
    mac: FloatArray
    driven: FloatArray
    noise: FloatArray

    @property
    def unseen(self) -> IndexArray:
        """Modes of the machine (indices) in the measured band or just beside it that the test did not show."""
        frequency_min, frequency_max = self.measured.frequency.min(), self.measured.frequency.max()
        inside = (self.frequency > (1 - _BAND_MARGIN_FRACTION) * frequency_min) & (self.frequency <
                                                                                   (1 + _BAND_MARGIN_FRACTION) * frequency_max)
        return np.flatnonzero(inside & (self.partner < 0))

    @property
    def missed(self) -> tuple[Doubt, ...]:
        """Modes of the machine between the measured ones that the test did not show, each with a reason."""
        lines = []
        for j in self.unseen:
            width = self.ratio[j] * self.frequency[j]
            others = np.delete(self.frequency, j)
            neighbour = float(others[int(np.argmin(np.abs(others - self.frequency[j])))])
            half_widths = abs(neighbour - self.frequency[j]) / max(width, 1e-9)
            why = f"lies {half_widths:.2g} half widths beside that at {neighbour:.4g} Hz"
            if self.driven[j] < _MIN_DRIVING_MOTION:
                why = f"moves the driving points by {100 * self.driven[j]:.2g} % of its largest motion"
            lines.append(Doubt(f"mode of the machine at {self.frequency[j]:.4g} Hz", f"the test does not show it: it {why}",
                               "another driving point would"))
        return tuple(lines)

    @property
    def single(self) -> list[int]:
        """Measured modes without a partner."""
        return [i for i in range(self.measured.count) if i not in self.partner]

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts where the machine does not reproduce its own test."""
        lines = []
        for j, i in enumerate(self.partner):
            if i < 0:
                continue
            if words := self._difference_words(j, i):
                lines.append(Doubt(f"mode of the machine at {self.frequency[j]:.4g} Hz",
                                   f"is not the measured one: {words}",
                                   "check the components, their masses, and the sensors of this mode",
                                   figure=abs(self.frequency[j] / self.measured.frequency[i] - 1)))
        return (*lines, *self.partnerless, *self.missed)

    def _difference_words(self, mode: int, partner: int) -> str:
        """Return what of a mode differs from its measured partner by more than it may: shape, frequency, damping."""
        frequency_difference = self.frequency[mode] / self.measured.frequency[partner] - 1
        damping_difference = self.ratio[mode] / max(self.measured.damping_ratio[partner], 1e-6) - 1
        words = {f"its shape has a MAC of {self.mac[mode]:.3f} only":
                 self.mac[mode] + self.noise[partner] < _MIN_MODE_MAC,
                 f"its frequency is {100 * frequency_difference:+.2g} % off":
                 abs(frequency_difference) > _MAX_FREQUENCY_DIFFERENCE,
                 f"its damping is {100 * damping_difference:+.2g} % off": abs(damping_difference) > _MAX_DAMPING_DIFFERENCE}
        return ", ".join(text for text, is_beyond in words.items() if is_beyond)

    @property
    def partnerless(self) -> tuple[Doubt, ...]:
        """The doubt about measured modes without a partner, where there are any."""
        if not self.single:
            return ()
        frequencies = ", ".join(f"{self.measured.frequency[i]:.4g}" for i in self.single)
        return (Doubt(f"measured modes at {frequencies} Hz", "are without a partner among the machine's modes",
                      "check them, the components and the chain"),)

    @property
    def status(self) -> str:
        """Whether the machine gives back its test."""
        if self.doubts:
            return "the machine does not give back all of its test: see the doubts"
        return f"the machine was run and gives back the {int((self.partner >= 0).sum())} measured modes"

    def rows(self) -> list[list[str]]:
        """Return the computed modes beside their measured partners, then the measured ones without a partner."""
        rows = []
        for j, i in enumerate(self.partner):
            row = [str(j + 1), f"{self.frequency[j]:.3f}", "", "", f"{100 * self.ratio[j]:.3f}", "", ""]
            if i >= 0:
                f = self.measured.frequency[i]
                row[2:] = (f"{f:.3f}", f"{100 * (self.frequency[j] / f - 1):+.2f}", row[4],
                           f"{100 * self.measured.damping_ratio[i]:.3f}", f"{self.mac[j]:.4f}")
            rows.append(row)
        return rows + [["no partner", "", f"{self.measured.frequency[i]:.3f}", "", "",
                        f"{100 * self.measured.damping_ratio[i]:.3f}", ""] for i in self.single]

    def to_dict(self) -> dict[str, Any]:
        """Return computed and measured frequencies (Hz), damping ratios and MAC as plain lists."""
        partner = self.partner
        return {"frequency_hz": self.frequency.tolist(), "damping_ratio": self.ratio.tolist(),
                "measured_hz": [float(self.measured.frequency[i]) if i >= 0 else None for i in partner],
                "measured_damping_ratio": [float(self.measured.damping_ratio[i]) if i >= 0 else None for i in partner],
                "mac": [float(m) if i >= 0 else None for m, i in zip(self.mac, partner, strict=True)],
                "without_partner_hz": [float(self.measured.frequency[i]) for i in self.single], "status": self.status}


def check_machine(machine: Machine, modes: Modes) -> MachineCheck:
    """Return the modes of a machine that has the measured points, beside the measured ones (at the pose of the test)."""
    points = machine.description.points
    rows = [i for i, dof in enumerate(modes.dofs) if str(dof.point) in points]
    system = assemble(machine, outputs=[modes.dofs[i] for i in rows])
    computed, test = solve_poles(system), modes.at_dofs([modes.dofs[i] for i in rows])
    poles = upper_poles(computed)
    frequency = np.abs(poles) / (2 * np.pi)
    partner, score = np.full(len(frequency), -1), np.zeros(len(frequency))
    for i, j, value in zip(*assign_modes(test, computed), strict=True):
        if value >= 0.3:
            partner[j], score[j] = i, value
    return MachineCheck(frequency, -poles.real / np.maximum(np.abs(poles), 1e-12), modes, partner, score,
                        _driving_motion(machine, modes, computed), _mac_noise(modes, rows))


def _mac_noise(modes: Modes, rows: list[int]) -> FloatArray:
    """Return the decrease (k,) of a MAC with the true shape by the stated noise of measured shapes.

    The share of the noise in their power, with the scatter of so many numbers.
    """
    if modes.shape_variance is None:
        return np.zeros(modes.count)
    share = modes.shape_variance[rows].sum(axis=0) / np.maximum((np.abs(modes.shape[rows]) ** 2).sum(axis=0), 1e-300)
    freedom = len(rows) * (2 if np.iscomplexobj(modes.shape) else 1)
    return np.asarray(share * chi2.isf(_MAX_NOISE_EXCESS_PROBABILITY, freedom) / freedom)


def _driving_motion(machine: Machine, modes: Modes, computed: Modes) -> FloatArray:
    """Return the motion of the driving points in every computed mode, over its largest motion."""
    driven = [dof for dof in modes.input_dofs if str(dof.point) in machine.description.points]
    if not driven or modes.participation is None:
        return np.ones(computed.count)
    motion = np.abs(solve_poles(assemble(machine, outputs=driven)).shape).max(axis=0)
    return np.asarray(motion / np.maximum(np.abs(computed.shape).max(axis=0), 1e-300))


def solve_poles(system: Any) -> Modes:
    """Return the modes of a system with damping of any kind, coupled between modes where it is."""
    return solve_as_damped(system)
