"""Signals: hammer and shaker records in, frequency responses with coherence and variance out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.signals.calibration import calibrate
    from toolpoint.signals.checks import mass_loading, reciprocity, without_mass
    from toolpoint.signals.driven_axis import DrivenAxisTest, driven_axis_test
    from toolpoint.signals.driving_doubts import driving_points
    from toolpoint.signals.hammer import HammerTest, hammer_test
    from toolpoint.signals.hits import Hit, HitRules
    from toolpoint.signals.setups import by_reciprocity, join_bands, join_setups
    from toolpoint.signals.shaker import coherences, shaker_test
    from toolpoint.signals.shaker_doubts import ShakerSettings

__all__ = [
           "DrivenAxisTest",
           "HammerTest",
           "Hit",
           "HitRules",
           "ShakerSettings",
           "by_reciprocity",
           "calibrate",
           "coherences",
           "driven_axis_test",
           "driving_points",
           "hammer_test",
           "join_bands",
           "join_setups",
           "mass_loading",
           "reciprocity",
           "shaker_test",
           "without_mass",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "calibration": ("calibrate",),
    "checks": ("mass_loading", "reciprocity", "without_mass"),
    "driven_axis": ("DrivenAxisTest", "driven_axis_test"),
    "driving_doubts": ("driving_points",),
    "hammer": ("HammerTest", "hammer_test"),
    "hits": ("Hit", "HitRules"),
    "setups": ("by_reciprocity", "join_bands", "join_setups"),
    "shaker": ("coherences", "shaker_test"),
    "shaker_doubts": ("ShakerSettings",),
})
