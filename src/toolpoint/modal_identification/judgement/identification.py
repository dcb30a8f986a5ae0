"""Identification: modes with the evidence for them: diagram, synthesis, fit quality and what to try next."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.modal_identification.basis import scale_powers
from toolpoint.modal_identification.judgement.complexity import mean_phase_deviation, phase_collinearity, real_modes
from toolpoint.modal_identification.judgement.relative_motion import Significance
from toolpoint.modal_identification.judgement.repeated_modes import RepeatedModes
from toolpoint.modal_identification.judgement.resonances import Resonance
from toolpoint.modal_identification.judgement.steadiness import Steadiness
from toolpoint.modal_identification.poles.choice import PoleChoice
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Responses of identified modes and of the terms outside the band, on the lines that were identified.

    `terms` (n_f, n) complex are the functions of frequency, `coefficients` (n, n_outputs, n_inputs) their real factors.
    """

    terms: ComplexArray
    coefficients: FloatArray

    def values(self, lines: slice | np.ndarray = slice(None)) -> ComplexArray:
        """Return the responses on these lines, shape (n_lines, n_outputs, n_inputs)."""
        flat = self.coefficients.reshape(self.coefficients.shape[0], -1)
        part = self.terms[lines]
        result = np.empty((part.shape[0], flat.shape[1]), complex)
        result.real, result.imag = part.real @ flat, part.imag @ flat
        return result.reshape(part.shape[0], *self.coefficients.shape[1:])


@dataclass(frozen=True, eq=False)
class Identification(NotebookText):
    """Result of `identify`: modes with the evidence for them.

    Parameters
    ----------
    modes : Modes
        Identified modes, scaling ``modal A`` (``unit modal mass`` from methods for real modes) where a driving point
        gives it; covariance of frequency and damping where the method estimates it.
    frf : Frf
        The measured responses within the band, less channels that are dead.
    model : Model
        Synthesised responses.
    quality : (n_outputs, n_inputs) floats
        Share of each response's energy in the band that the synthesis explains, at most 1.
    mode_quality : (n_modes,) floats
        The same over all responses within the half-power width of each mode.
    method : str
    diagram : Diagram, optional
        Poles of all orders, where the method has orders.
    support : (n_modes,) floats, optional
        Share of the orders that hold each mode.
    significance : (n_modes,) floats, optional
        Chi-squared of each mode per degree of freedom: about 1 for a mode that is not there.
    advice : tuple of str
        Remarks on doubtful results, with the next step; empty if there are none.
    resonances : tuple of Resonance
        The modes as a person would count them: those that overlap and look alike as one, each with its share of the
        responses at its frequency.
    doubts : tuple of str
        Doubts about signs, delays, scales and labels of the responses; first in table, status and plain data.
    smooth : bool
        Whether the residual is a misfit of the model rather than noise.
    steadiness : Steadiness, optional
        Changes of the modes when the band is cut; judged where the residual is smooth.
    choice : PoleChoice, optional
        Changes that a person made in the identified modes.
    repeated : RepeatedModes, optional
        Modes that are seen once in every set-up of sensors: one mode under another mass.
    tool_motion : Significance, optional
        Which modes move the tool against the table, where the two points were named.

    >>> from toolpoint.modal_identification import identify
    >>> from toolpoint.vibration import frequency_response
    >>> modes = Modes([60.0, 100.0], [0.01, 0.02], [[0.1, 0.05]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(30.0, 150.0, 0.25), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> identify(frf).quality.round(6).tolist()  # responses without noise are explained whole
    [[1.0]]
    """

    modes: Modes
    frf: Frf
    model: ModalModel
    quality: FloatArray
    mode_quality: FloatArray
    method: str
    diagram: Diagram | None = None
    support: FloatArray | None = None
    significance: FloatArray | None = None
    advice: tuple[str, ...] = field(default=())
    resonances: tuple[Resonance, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    smooth: bool = False
    steadiness: Steadiness | None = None
    choice: PoleChoice | None = None
    repeated: RepeatedModes | None = None
    tool_motion: Significance | None = None

    @cached_property
    def synthesis(self) -> Frf:
        """Synthesised responses on the identified lines, in the measured quantity."""
        return Frf(self.frf.frequency, self.model.values(), self.frf.outputs, self.frf.inputs, self.frf.quantity,
                   decay=self.frf.decay)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks of the responses that are no doubts: left out, corrected or assumed."""
        return tuple(note for note in self.frf.notes if not isinstance(note, Doubt))

    @property
    def real_modes(self) -> Modes:
        """The modes as real ones, of unit modal mass where the scale is known."""
        return real_modes(self.modes)

    @property
    def dominant(self) -> np.ndarray:
        """Indices of the strongest mode of every resonance that stands out: `modes.selected(found.dominant)`."""
        return np.array([resonance.strongest for resonance in self.resonances if resonance.stands_out], int)

    @property
    def doubtful(self) -> np.ndarray:
        """Whether each mode is doubtful: it is faint, or it does not stand out and the residual is not noise or the bands that
        are cut do not show it, or it repeats another one in a further set-up."""
        doubtful_modes = {i for resonance in self.resonances if resonance.doubtful for i in resonance.modes}
        if self.steadiness is not None:
            doubtful_modes |= set(np.flatnonzero(self.steadiness.unsteady).tolist()) - set(self.dominant.tolist())
        if self.repeated is not None:
            doubtful_modes |= {i for member in self.repeated.members for i in member} - set(self.repeated.strongest)
        return np.array([i in doubtful_modes for i in range(self.modes.count)])

    @property
    def share(self) -> FloatArray:
        """Share of the responses, 0 .. 1, that belongs to the resonance of each mode at its frequency."""
        result = np.ones(self.modes.count)
        for resonance in self.resonances:
            result[list(resonance.modes)] = resonance.share
        return result

    @property
    def fit(self) -> float:
        """Share of the energy of all responses that the synthesis explains, each response weighted alike."""
        return float(self.quality.mean())

    @property
    def status(self) -> str:
        """Summary in words: number of modes, fit, doubts and advice."""
        count = self.modes.count
        head = (f"{count} mode{'s' * (count != 1)} by {self.method} within {self.frf.frequency[0]:g} .. "
                f"{self.frf.frequency[-1]:g} Hz; the synthesis explains {100 * self.fit:.5g} % of the responses "
                f"(worst {100 * float(self.quality.min()):.5g} %).")
        return "\n".join([head, *(f"- {line}" for line in (*self.doubts, *self.advice))])

    def table(self) -> str:
        """Return frequency, damping, 95 % intervals, phase collinearity, fit and share of every mode as text.

        The share is that of its resonance in the responses at its frequency: ``*`` marks the strongest mode of one that
        stands out, ``?`` a doubtful mode.
        """
        collinear = phase_collinearity(self.modes.shape)
        deviation = mean_phase_deviation(self.modes.shape)
        lines = self.modes.table().split("\n")
        lines[0] += "     MPC   MPD deg     fit %  share %"
        mark = np.where(self.doubtful, "?", " ")
        mark[self.dominant] = "*"
        for i in range(self.modes.count):
            lines[i + 1] += (f" {collinear[i]:7.4f} {deviation[i]:9.3f} {100 * self.mode_quality[i]:9.4f} "
                             f"{100 * self.share[i]:7.1f} {mark[i]}").rstrip()
        return "\n".join([*mark_notes(self.doubts), *lines, *([] if self.tool_motion is None else [self.tool_motion.table()])])

    def to_dict(self) -> dict[str, Any]:
        """Return the modes as plain lists: frequencies and intervals (95 %) in Hz; None where an interval is unknown."""
        modes, strongest = self.modes, self.dominant.tolist()
        result: dict[str, Any] = {"doubts": list(self.doubts), "frequency_hz": modes.frequency.tolist(),
                                  "damping_ratio": modes.damping_ratio.tolist()}
        if modes.covariance is not None:
            for name, widths in (("frequency_interval_hz", modes.frequency_interval),
                                 ("damping_interval", modes.damping_interval)):
                result[name] = [width if np.isfinite(width) else None for width in widths.tolist()]
        if self.tool_motion is not None:
            result["tool_motion"] = self.tool_motion.to_dict()
        return result | {"fit": self.mode_quality.tolist(), "share": self.share.tolist(), "doubtful": self.doubtful.tolist(),
                         "stands_out": [i in strongest for i in range(modes.count)], "status": self.status,
                         "notes": list(self.notes)}

    def __repr__(self) -> str:
        return (f"Identification({self.modes!r} by {self.method}, fit {100 * self.fit:.4g} %, "
                f"{len(self.advice)} remarks)")


def mode_quality(frf: Frf, model: ModalModel, modes: Modes) -> FloatArray:
    """Return the share of energy explained within the half-power width of each mode (three lines at least)."""
    result = np.empty(modes.count)
    scale = np.sqrt(scale_powers((np.abs(frf.values) ** 2).mean(axis=0)))
    for i in range(modes.count):
        distance = np.abs(frf.frequency - modes.frequency[i])
        third_distance = np.partition(distance, 2)[2]
        lines = np.flatnonzero(distance <= max(abs(modes.damping_ratio[i]) * modes.frequency[i], third_distance))
        measured = frf.values[lines] / scale
        misfit = measured - model.values(lines) / scale
        result[i] = 1 - float((np.abs(misfit) ** 2).sum() / max((np.abs(measured) ** 2).sum(), np.finfo(float).tiny))
    return result
