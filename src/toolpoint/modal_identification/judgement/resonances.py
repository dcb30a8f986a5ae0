r"""Resonances: what stands out of the responses, and which modes describe it together.

A fit to the level of the noise needs a mode for everything in the responses, also for what is small, hidden under the flank
of a strong mode, or no mode at all (a structure that is not linear, channels that disagree, drift). Chi-squared calls all
of it evident. What a person would pick is told by the share of the responses H at one frequency that belongs to one
resonance,

.. math:: \frac{\|C\|^2}{\|C\|^2 + \|H - C\|^2},

C being the part of its modes, every response weighted by its rms: above one half the resonance moves the responses more
than all the rest together. Neighbours that overlap and look alike count as one resonance, as no single response parts them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.modal_identification.basis import factor, laplace, pole_terms
from toolpoint.vibration.correlation import mac
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

ALIKE = 0.5
HALF = 0.5
# Of the power of the responses at one frequency: what this little carries may be the error that all of them share.
FAINT = 1e-3


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
        Where its modes together move the responses most, Hz: between them where they overlap.
    """

    modes: tuple[int, ...]
    strongest: int
    share: float
    doubtful: bool = False
    frequency: float = float("nan")

    @property
    def stands_out(self) -> bool:
        """Whether it moves the responses at its frequency more than all the rest together."""
        return self.share > HALF

    @property
    def faint(self) -> bool:
        """Whether it carries less than a thousandth of the power of the responses at its frequency."""
        return self.share < FAINT


def resonances(frf: Frf, modes: Modes, smooth_residual: bool) -> tuple[Resonance, ...]:
    """Return the resonances of modes with participation, lowest first.

    `smooth_residual`: neighbouring lines share their residual, so the model misses something.
    """
    flat = frf.values.reshape(frf.frequency.size, -1)
    power = np.einsum("fr,fr->r", flat.real, flat.real) + np.einsum("fr,fr->r", flat.imag, flat.imag)
    weight = np.where(power > 0, 1 / np.sqrt(np.where(power > 0, power, 1.0)), 0.0)
    groups = []
    for members in alike(modes):
        lines = [int(np.argmin(np.abs(frf.frequency - modes.frequency[i]))) for i in members]
        alone = [_power(modal_part(frf, modes.selected([i]), slice(line, line + 1)) * weight)[0]
                 for i, line in zip(members, lines, strict=True)]
        # A group is seen where its modes together move the responses most, which lies between them where they overlap.
        between = slice(min(lines), max(lines) + 1)
        parts = modal_part(frf, modes.selected(members), between) * weight
        at = int(np.argmax(_power(parts)))
        strength, rest = float(_power(parts)[at]), float(_power(flat[between] * weight - parts)[at])
        share = strength / (strength + rest) if strength > 0 else 0.0
        groups.append(Resonance(tuple(members), members[int(np.argmax(alone))], share,
                                share < FAINT or (smooth_residual and share <= HALF), float(frf.frequency[min(lines) + at])))
    return tuple(groups)


def _power(values: ComplexArray) -> FloatArray:
    """Return the power of the responses (n_lines, n_responses) on every line."""
    return np.asarray((np.abs(values) ** 2).sum(axis=-1))


def alike(modes: Modes) -> list[list[int]]:
    """Return the modes, lowest first, in runs of neighbours whose half-power bands overlap and whose MAC is above one half."""
    half = np.abs(modes.damping_ratio) * modes.frequency
    same = mac(modes.shape) if modes.count > 1 else np.eye(1)
    runs = [[0]]
    for i in range(1, modes.count):
        if modes.frequency[i] - modes.frequency[i - 1] < half[i] + half[i - 1] and same[i, i - 1] > ALIKE:
            runs[-1].append(i)
        else:
            runs.append([i])
    return runs


def modal_part(frf: Frf, modes: Modes, lines: slice) -> ComplexArray:
    """Return what modes give to the responses on some lines, (n_lines, n_responses)."""
    residue = (modes.shape_at(frf.outputs)[:, None, :] * modes.participation_at(frf.inputs)).reshape(-1, modes.count)
    terms = pole_terms(laplace(frf)[lines], modes.poles) * factor(frf)[lines, None, None]
    return np.asarray(terms[:, :, 0] @ residue.real.T + terms[:, :, 1] @ residue.imag.T, complex)


def remark(groups: tuple[Resonance, ...], modes: Modes) -> list[str]:
    """Return which resonances stand out and which modes are doubtful; nothing where none is."""
    faint = [f"{_numbers(group.modes)} at {modes.frequency[group.strongest]:.4g} Hz "
             f"{'carry' if len(group.modes) > 1 else 'carries'} only {100 * group.share:.2g} % of the responses "
             "there: look at the shape before using it; noise that the responses share makes such modes, and another "
             "band or reference does not" for group in groups if group.faint]
    doubtful = [i for group in groups if group.doubtful and not group.faint for i in group.modes]
    if not doubtful:
        return faint
    clear = ", ".join(f"{modes.frequency[group.strongest]:.4g} Hz ({_numbers(group.modes)})"
                      for group in groups if group.stands_out)
    return [f"{clear or 'no resonance'} stand{'s' * (not clear)} out of the responses; {_numbers(doubtful)} "
            f"{'lie' if len(doubtful) > 1 else 'lies'} under stronger ones and, as the residual is not noise, may be small "
            "modes or stand for what the strong ones do not follow: real ones return in another band and in other responses "
            "alone", *faint]


def _numbers(modes: tuple[int, ...] | list[int]) -> str:
    return f"mode{'s' * (len(modes) > 1)} " + ", ".join(str(i + 1) for i in modes)
