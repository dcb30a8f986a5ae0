"""Cutting: tool, engagement, force law, stability by several methods on one problem, time domain, surface."""

from toolpoint.cutting import stability
from toolpoint.cutting.automatic import Automatic
from toolpoint.cutting.chart import StabilityChart
from toolpoint.cutting.coefficients import CuttingCoefficients
from toolpoint.cutting.collocation import Collocation
from toolpoint.cutting.discretization import FullDiscretization, SemiDiscretization
from toolpoint.cutting.floquet import FloquetDeterminant
from toolpoint.cutting.hill import HillDeterminant
from toolpoint.cutting.multi_frequency import MultiFrequency
from toolpoint.cutting.panel_arnoldi import PanelArnoldi
from toolpoint.cutting.problem import MillingProblem, SpeedVariation, TurningProblem
from toolpoint.cutting.tool import Engagement, Tool
from toolpoint.cutting.warm_start import WarmStart
from toolpoint.cutting.zero_order import ZeroOrder

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
