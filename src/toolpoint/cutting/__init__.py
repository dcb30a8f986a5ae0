"""Cutting: tool, engagement, force law, stability by several methods on one problem, time domain, surface."""

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
