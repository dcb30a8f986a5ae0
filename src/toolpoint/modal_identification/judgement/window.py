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
    """Return responses (one pose) without the decay of their window, by the modes that were identified from them."""
    if frf.decay == 0:
        return frf
    bare = replace(frf, decay=0.0)
    all_lines = slice(0, frf.frequency.size)
    change = modal_part(bare, modes, all_lines) - modal_part(frf, modes, all_lines)
    return replace(bare, values=frf.values + change.reshape(frf.values.shape), draws=None,
                   notes=(*frf.notes, "the damping of the exponential window is taken out by the identified modes"))
