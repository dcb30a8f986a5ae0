"""Stability of cuts: the verbs, the methods as small objects, one kind of result."""

from toolpoint.cutting.stability.compute import Method, Problem, chart, default_method

__all__ = ["Method", "Problem", "chart", "default_method"]
