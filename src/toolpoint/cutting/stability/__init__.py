"""Stability of cuts: the verbs, the methods as small objects, one kind of result."""

from toolpoint.cutting.stability.automatic import default_method
from toolpoint.cutting.stability.catalogue import METHODS, method_named
from toolpoint.cutting.stability.chain import chart_poses
from toolpoint.cutting.stability.compute import chart
from toolpoint.cutting.stability.lowest import LowestLimit, lowest_limit
from toolpoint.cutting.stability.method import Problem, StabilityMethod

__all__ = ["METHODS", "LowestLimit", "Problem", "StabilityMethod", "chart", "chart_poses", "default_method", "lowest_limit",
           "method_named"]
