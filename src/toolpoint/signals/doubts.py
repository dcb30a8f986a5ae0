r"""Checks of responses for wrong signs, delays, scales and swapped channels: doubted and explained, never repaired.

Driving points are judged by `signals.driving_doubts`. Reciprocity, :math:`H_{ab} = H_{ba}`, determines the relative sign and
scale of two points, and which channels are swapped. Source: Ewins, Modal Testing, 2nd ed., sections 3.9 and 4.3 (checks of
measured data).
"""

from __future__ import annotations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.signals.checks import Reciprocity, reciprocity
from toolpoint.signals.driving_doubts import question_driving_point
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.unit_factor import scale_words

MIN_RECIPROCITY = 0.7  # agreement: below, two channels or labels may be swapped
MAX_RECIPROCAL_RATIO = 2.0  # of the sizes of two reciprocal responses, either way
MIN_SCALED_AGREEMENT = 0.9  # agreement: above, two responses are equal up to sign and scale


def question(frf: Frf) -> tuple[Doubt, ...]:
    """Return the doubts about the channels of measured responses of one pose, each with its remedy."""
    above_zero = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    if above_zero.frequency.size < 3:
        return ()
    return (*_driving_doubts(above_zero), *_reciprocity_doubts(reciprocity(above_zero)))


def _driving_doubts(frf: Frf) -> list[Doubt]:
    """Return the doubts about every driving point."""
    return [doubt for dof in frf.outputs if dof in frf.inputs for doubt in question_driving_point(frf.selected([dof], [dof]))]


def _reciprocity_doubts(pairs: list[Reciprocity]) -> list[Doubt]:
    """Return the doubts about pairs of reciprocal responses."""
    doubts: list[Doubt] = []
    for pair in pairs:
        responses = f"{pair.first} struck at {pair.second} and {pair.second} struck at {pair.first}"
        if pair.agreement < MIN_RECIPROCITY:
            doubts.append(Doubt(responses,
                                f"not alike (agreement {pair.agreement:.2f}, must be near 1): two channels or two labels "
                               "may be swapped", "compare the labels with the test's notes", figure=1 - pair.agreement))
        elif pair.agreement > MIN_SCALED_AGREEMENT and pair.ratio < 0:
            doubts.append(Doubt(responses, "have opposite signs: one sensor or one blow has the other direction than its label",
                               "compare the labels with the mounting"))
        elif pair.agreement > MIN_SCALED_AGREEMENT and not 1 / MAX_RECIPROCAL_RATIO < abs(pair.ratio) < MAX_RECIPROCAL_RATIO:
            doubts.append(Doubt(responses, f"differ by a factor {abs(pair.ratio):.4g}{scale_words(pair.ratio)}",
                               "check calibration and unit of both channels", figure=abs(pair.ratio)))
    return doubts
