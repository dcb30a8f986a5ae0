"""Cutting: tool, engagement, force law, stability by several methods on one problem, time domain, surface.

Names below are loaded on first use: the command line asks for the description of a cut only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.cutting import stability
    from toolpoint.cutting.cut.coefficients import CuttingCoefficients
    from toolpoint.cutting.cut.problem import MillingProblem, SpeedVariation, TurningProblem
    from toolpoint.cutting.cut.tool import Engagement, Tool
    from toolpoint.cutting.stability.automatic import Automatic
    from toolpoint.cutting.stability.floquet.method import FloquetDeterminant
    from toolpoint.cutting.stability.hill.method import HillDeterminant
    from toolpoint.cutting.stability.methods.collocation import Collocation
    from toolpoint.cutting.stability.methods.discretization import FullDiscretization, SemiDiscretization
    from toolpoint.cutting.stability.methods.multi_frequency import MultiFrequency
    from toolpoint.cutting.stability.methods.zero_order import ZeroOrder
    from toolpoint.cutting.stability.panels.method import PanelArnoldi
    from toolpoint.cutting.stability.result import StabilityChart
    from toolpoint.cutting.stability.warm_start import WarmStart

__all__ = [
    "Automatic",
    "Collocation",
    "CuttingCoefficients",
    "Engagement",
    "FloquetDeterminant",
    "FullDiscretization",
    "HillDeterminant",
    "MillingProblem",
    "MultiFrequency",
    "PanelArnoldi",
    "SemiDiscretization",
    "SpeedVariation",
    "StabilityChart",
    "Tool",
    "TurningProblem",
    "WarmStart",
    "ZeroOrder",
    "stability",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "cut.coefficients": ("CuttingCoefficients",),
    "cut.problem": ("MillingProblem", "SpeedVariation", "TurningProblem"),
    "cut.tool": ("Engagement", "Tool"),
    "stability": (),
    "stability.automatic": ("Automatic",),
    "stability.floquet.method": ("FloquetDeterminant",),
    "stability.hill.method": ("HillDeterminant",),
    "stability.methods.collocation": ("Collocation",),
    "stability.methods.discretization": ("FullDiscretization", "SemiDiscretization"),
    "stability.methods.multi_frequency": ("MultiFrequency",),
    "stability.methods.zero_order": ("ZeroOrder",),
    "stability.panels.method": ("PanelArnoldi",),
    "stability.result": ("StabilityChart",),
    "stability.warm_start": ("WarmStart",),
})
