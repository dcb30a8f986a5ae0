r"""Resonances: peaks that dominate the responses, and the modes that describe each together.

A fit to the level of the noise needs a mode for every feature of the responses, also for small ones, those hidden under the
flank of a strong mode, and those that are no mode (a structure that is not linear, channels that disagree, drift). Chi-squared
calls all of them evident. A person would pick by the share of the responses H at one frequency that belongs to one resonance,

.. math:: \frac{\|C\|^2}{\|C\|^2 + \|H - C\|^2},

with C the part of its modes, every response weighted by its rms: above one half the resonance moves the responses more than all
others together. Neighbours that overlap with similar shapes count as one resonance, as no single response separates them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.modal_identification.basis import factor, laplace, pole_terms, scale_powers
from toolpoint.vibration.correlation import mac
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

MIN_SIMILAR_MAC = 0.5  # of overlapping neighbours that are one resonance
MIN_DOMINANT_SHARE = 0.5  # of the power of the responses at one frequency
MAX_FAINT_SHARE = 1e-3  # of the same: so little may be an error that all responses share


@dataclass(frozen=True)
class Resonance:
    """Modes that describe one resonance together.

    Parameters
    ----------
    modes : tuple of int
        Indices of its modes.
    strongest : int
        The one of them that moves the responses most at its frequency.
    share : float
        Share of the responses at that frequency that belongs to the resonance, 0 .. 1.
    doubtful : bool
        Whether it is faint, or does not stand out while the residual is not noise: it may then stand for a misfit of
        stronger modes.
    frequency : float
        Frequency at which its modes together move the responses most, Hz: between them where they overlap.

    >>> Resonance((0, 1), strongest=1, share=0.9).stands_out  # two modes that together make nine tenths of the response
    True
    """

    modes: tuple[int, ...]
    strongest: int
    share: float
    doubtful: bool = False
    frequency: float = float("nan")

    @property
    def stands_out(self) -> bool:
        """Whether it moves the responses at its frequency more than all the rest together."""
        return self.share > MIN_DOMINANT_SHARE

    @property
    def faint(self) -> bool:
        """Whether it carries less than a thousandth of the power of the responses at its frequency."""
        return self.share < MAX_FAINT_SHARE


def resonances(frf: Frf, modes: Modes, smooth_residual: bool) -> tuple[Resonance, ...]:
    """Return the resonances of modes with participation, lowest first.

    `smooth_residual`: neighbouring lines share their residual, so the model misses something.
    """
    flat = frf.values.reshape(frf.frequency.size, -1)
    power = np.einsum("fr,fr->r", flat.real, flat.real) + np.einsum("fr,fr->r", flat.imag, flat.imag)
    weight = np.where(power > 0, 1 / np.sqrt(scale_powers(power)), 0.0)
    groups = []
    for members in group_similar(modes):
        lines = [int(np.argmin(np.abs(frf.frequency - modes.frequency[i]))) for i in members]
        single_powers = [_power(modal_part(frf, modes.selected([i]), slice(line, line + 1)) * weight)[0]
                 for i, line in zip(members, lines, strict=True)]
        # A group is judged where its modes together move the responses most: between them where they overlap.
        between = slice(min(lines), max(lines) + 1)
        parts = modal_part(frf, modes.selected(members), between) * weight
        peak = int(np.argmax(_power(parts)))
        strength, others = float(_power(parts)[peak]), float(_power(flat[between] * weight - parts)[peak])
        share = strength / (strength + others) if strength > 0 else 0.0
        groups.append(Resonance(tuple(members), members[int(np.argmax(single_powers))], share,
                                share < MAX_FAINT_SHARE or (smooth_residual and share <= MIN_DOMINANT_SHARE),
                                float(frf.frequency[min(lines) + peak])))
    return tuple(groups)


def _power(values: ComplexArray) -> FloatArray:
    """Return the power of the responses (n_lines, n_responses) on every line."""
    return np.asarray((np.abs(values) ** 2).sum(axis=-1))


def group_similar(modes: Modes) -> list[list[int]]:
    """Return the modes, lowest first, in runs of neighbours whose half-power bands overlap and whose MAC is above one half."""
    width = np.abs(modes.damping_ratio) * modes.frequency
    correlation = mac(modes.shape) if modes.count > 1 else np.eye(1)
    runs = [[0]]
    for i in range(1, modes.count):
        if modes.frequency[i] - modes.frequency[i - 1] < width[i] + width[i - 1] and correlation[i, i - 1] > MIN_SIMILAR_MAC:
            runs[-1].append(i)
        else:
            runs.append([i])
    return runs


def modal_part(frf: Frf, modes: Modes, lines: slice) -> ComplexArray:
    """Return the contribution of modes to the responses on some lines, (n_lines, n_responses)."""
    residue = (modes.shape_at(frf.outputs)[:, None, :] * modes.participation_at(frf.inputs)).reshape(-1, modes.count)
    terms = pole_terms(laplace(frf)[lines], modes.poles) * factor(frf)[lines, None, None]
    return np.asarray(terms[:, :, 0] @ residue.real.T + terms[:, :, 1] @ residue.imag.T, complex)


def resonance_remarks(groups: tuple[Resonance, ...], modes: Modes) -> list[str]:
    """Return remarks on the dominant resonances and the doubtful modes; empty where there are none doubtful."""
    faint_remarks = [f"{_numbers(group.modes)} at {modes.frequency[group.strongest]:.4g} Hz "
             f"{'carry' if len(group.modes) > 1 else 'carries'} only {100 * group.share:.2g} % of the responses "
             "there: look at the shape before using it; noise that the responses share makes such modes, and another "
             "band or reference does not" for group in groups if group.faint]
    doubtful = [i for group in groups if group.doubtful and not group.faint for i in group.modes]
    if not doubtful:
        return faint_remarks
    dominant = ", ".join(f"{modes.frequency[group.strongest]:.4g} Hz ({_numbers(group.modes)})"
                      for group in groups if group.stands_out)
    return [f"{dominant or 'no resonance'} stand{'s' * (not dominant)} out of the responses; {_numbers(doubtful)} "
            f"{'lie' if len(doubtful) > 1 else 'lies'} under stronger ones and, as the residual is not noise, may be small "
            "modes or stand for what the strong ones do not follow: real ones return in another band and in other responses "
            "alone", *faint_remarks]


def _numbers(modes: tuple[int, ...] | list[int]) -> str:
    """Return the numbers of modes, from 1, as text."""
    return f"mode{'s' * (len(modes) > 1)} " + ", ".join(str(i + 1) for i in modes)
