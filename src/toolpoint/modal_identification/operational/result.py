"""OperationalIdentification: modes of a machine at work, with the harmonics that were taken off and the evidence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import BoolArray, FloatArray
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.modal_identification.judgement.complexity import phase_collinearity
from toolpoint.modal_identification.operational.harmonics import Harmonic
from toolpoint.modal_identification.operational.spectra import SingularSpectra
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.vibration.modes import Modes


@dataclass(frozen=True, eq=False)
class OperationalIdentification(NotebookText):
    """Result of `identify_operational`.

    Parameters
    ----------
    modes : Modes
        Lowest first, ``unscaled``, with the covariance of frequency and damping and the variance of the shapes. Shapes are
        those of displacement, whatever the channels measured.
    harmonics : tuple of Harmonic
        Lines of rotating parts, lowest first; they are no modes.
    support : (n_modes,) floats
        Share of the model orders with each mode.
    power_share : (n_modes,) floats
        Share of the power of the channels (each over its rms) that each mode has.
    confirmed : (n_modes,) bools
        Whether another method (pLSCF on half spectra) finds the mode too.
    spectra : tuple of SingularSpectra
        Of every band, widest first.
    diagrams : tuple of Diagram
        Poles of all orders, of every band.
    method : str
    duration : float
        Length of all records, s.
    doubts : tuple of Doubt
    notes : tuple of str

    >>> none = np.zeros(0)
    >>> modes = Modes(none, none, np.zeros((1, 0)), ["tool:+x"], scaling="unscaled")
    >>> line = Harmonic(50.0, wander=1e-4, power_share=0.2, kurtosis=1.01, is_removed=True)
    >>> OperationalIdentification(modes, (line,), none, none, none, (), (), "ssi-cov", 60.0).status.splitlines()
    ['No mode was found.', '1 harmonic of rotating parts (no modes): 50 Hz.']
    """

    modes: Modes
    harmonics: tuple[Harmonic, ...]
    support: FloatArray
    power_share: FloatArray
    confirmed: BoolArray
    spectra: tuple[SingularSpectra, ...]
    diagrams: tuple[Diagram, ...]
    method: str
    duration: float
    doubts: tuple[Doubt, ...] = field(default=())
    notes: tuple[str, ...] = field(default=())

    @property
    def status(self) -> str:
        """Summary in words: the modes, the harmonics, the doubts."""
        return "\n".join([*self.answer, *(f"- {line}" for line in (*self.doubts, *self.notes))])

    @property
    def answer(self) -> tuple[str, ...]:
        """The modes in a sentence, and the harmonics in another where there are any."""
        modes = self.modes
        names = ", ".join(f"{f:.4g} Hz ({100 * z:.2g} %)" for f, z in zip(modes.frequency, modes.damping_ratio, strict=True))
        lines = [f"{modes.count} mode{'s' * (modes.count != 1)}: {names}." if modes.count else "No mode was found."]
        removed = [h for h in self.harmonics if h.is_removed]
        if removed:
            lines.append(f"{len(removed)} harmonic{'s' * (len(removed) != 1)} of rotating parts (no modes): "
                         + ", ".join(f"{h.frequency:.4g} Hz" for h in removed) + ".")
        return tuple(lines)

    def table(self) -> str:
        """Return the modes with 95 % intervals, phase collinearity, share of the power and the second method, as text."""
        collinear = phase_collinearity(self.modes.shape) if self.modes.count else np.zeros(0)
        lines = self.modes.table().split("\n")
        lines[0] += "     MPC  power %  second method"
        for i in range(self.modes.count):
            second = "finds it" if self.confirmed[i] else "does not"
            lines[i + 1] += f" {collinear[i]:7.4f} {100 * self.power_share[i]:8.2f}  {second}"
        if self.harmonics:
            lines += ["", " harmonic   frequency Hz   order   wander %   power %"]
            lines += [f"{i + 1:9d} {h.frequency:14.4f} {'-' if h.order is None else h.order:>7} {100 * h.wander:10.4f} "
                      f"{100 * h.power_share:9.2f}" + ("" if h.is_removed else "  left in: mode or harmonic, cannot tell")
                      for i, h in enumerate(self.harmonics)]
        return "\n".join([*mark_notes(self.doubts), *lines])

    def to_dict(self) -> dict[str, Any]:
        """Return modes, harmonics and doubts as plain data: Hz, ratios, 95 % half widths."""
        modes = self.modes
        return {
            "doubts": list(self.doubts), "method": self.method, "duration_s": self.duration,
            "frequency_hz": modes.frequency.tolist(), "damping_ratio": modes.damping_ratio.tolist(),
            "frequency_interval_hz": modes.frequency_interval.tolist(), "damping_interval": modes.damping_interval.tolist(),
            "power_share": self.power_share.tolist(), "confirmed": self.confirmed.tolist(), "support": self.support.tolist(),
            "harmonics": [{"frequency_hz": h.frequency, "order": h.order, "wander": h.wander, "power_share": h.power_share,
                           "removed": h.is_removed} for h in self.harmonics],
            "notes": list(self.notes), "status": self.status}

    def __repr__(self) -> str:
        return (f"OperationalIdentification({self.modes!r} by {self.method}, {len(self.harmonics)} harmonics, "
                f"{len(self.doubts)} doubts)")
