"""Signals: hammer and shaker records in, frequency responses with coherence and variance out."""

from toolpoint.signals.calibration import calibrated
from toolpoint.signals.checks import driving_points, mass_loading, reciprocity, without_mass
from toolpoint.signals.hammer import HammerTest, hammer_test
from toolpoint.signals.hits import Hit, HitRules
from toolpoint.signals.setups import assembled, by_reciprocity
from toolpoint.signals.shaker import coherences, shaker_test

__all__ = [
           "HammerTest",
           "Hit",
           "HitRules",
           "assembled",
           "by_reciprocity",
           "calibrated",
           "coherences",
           "driving_points",
           "hammer_test",
           "mass_loading",
           "reciprocity",
           "shaker_test",
           "without_mass",
]
