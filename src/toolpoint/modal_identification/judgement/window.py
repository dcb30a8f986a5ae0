r"""Removal of the damping that the exponential window added to measured responses.

A window of decay a turns H(s) into H(s + a). The response of the identified modes at i w less that at i w + a is added to
the measured lines: exact for the modes; modes far outside the band are not corrected.
"""

from __future__ import annotations

from dataclasses import replace

from toolpoint.modal_identification.judgement.resonances import modal_part
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes


def without_window(frf: Frf, modes: Modes) -> Frf:
    """Return responses (one pose) without the decay of their window, by the modes that were identified from them.

    >>> import numpy as np
    >>> omega = 2 * np.pi * 100.0
    >>> s = omega * (-0.01 + 1j * np.sqrt(1 - 0.01**2))
    >>> modes = Modes([100.0], [0.01], [[1 / np.sqrt(2j * s.imag)]], ["tool:+x"], scaling="modal A")
    >>> def receptance(p):  # of a unit modal mass
    ...     return (1 / ((p - s) * (p - s.conjugate())))[:, None, None]
    >>> frequency = np.arange(80.0, 121.0)
    >>> iw = 2j * np.pi * frequency  # a window of 5 1/s moves the response from i w to i w + 5
    >>> windowed = Frf(frequency, receptance(iw + 5.0), ["tool:+x"], ["tool:+x"], decay=5.0)
    >>> bool(np.allclose(without_window(windowed, modes).values, receptance(iw), rtol=1e-9, atol=0))
    True
    """
    if frf.decay == 0:
        return frf
    bare = replace(frf, decay=0.0)
    all_lines = slice(0, frf.frequency.size)
    change = modal_part(bare, modes, all_lines) - modal_part(frf, modes, all_lines)
    return replace(bare, values=frf.values + change.reshape(frf.values.shape), draws=None,
                   notes=(*frf.notes, "the damping of the exponential window is taken out by the identified modes"))
