r"""What responses alone betray of wrong signs, delays, scales and swapped channels; named and proposed, never repaired.

Driving points are judged by `signals.driving_doubts`. Reciprocity, :math:`H_{ab} = H_{ba}`, tells sign and scale of two points,
and which channels are swapped. Source: Ewins, Modal Testing, 2nd ed., sections 3.9 and 4.3 (checks of measured data).
"""

from __future__ import annotations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.signals.checks import Reciprocity, reciprocity
from toolpoint.signals.driving_doubts import question_driving_point
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.unit_factor import scale_words

RECIPROCAL = 0.7  # agreement below which two points are not the same pair
UNLIKE = 2.0
ALIKE = 0.9  # agreement above which two responses are one but for sign and scale


def question(frf: Frf) -> tuple[Doubt, ...]:
    """Return the doubts about the channels of measured responses of one pose, each with what to look at; empty where none."""
    inside = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    if inside.frequency.size < 3:
        return ()
    return (*_driving_doubts(inside), *_reciprocity_doubts(reciprocity(inside)))


def _driving_doubts(frf: Frf) -> list[Doubt]:
    return [doubt for dof in frf.outputs if dof in frf.inputs for doubt in question_driving_point(frf.selected([dof], [dof]))]


def _reciprocity_doubts(pairs: list[Reciprocity]) -> list[Doubt]:
    lines: list[Doubt] = []
    for pair in pairs:
        both = f"{pair.first} struck at {pair.second} and {pair.second} struck at {pair.first}"
        if pair.agreement < RECIPROCAL:
            lines.append(Doubt(both, f"not alike (agreement {pair.agreement:.2f}, must be near 1): two channels or two labels "
                               "may be swapped", "compare the labels with the test's notes", figure=1 - pair.agreement))
        elif pair.agreement > ALIKE and pair.ratio < 0:
            lines.append(Doubt(both, "have opposite signs: one sensor or one blow has the other direction than its label",
                               "compare the labels with the mounting"))
        elif pair.agreement > ALIKE and not 1 / UNLIKE < abs(pair.ratio) < UNLIKE:
            lines.append(Doubt(both, f"differ by a factor {abs(pair.ratio):.4g}{scale_words(pair.ratio)}",
                               "check calibration and unit of both channels", figure=abs(pair.ratio)))
    return lines
