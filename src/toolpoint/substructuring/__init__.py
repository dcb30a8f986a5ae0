"""Substructuring: parts reduced to what their neighbours see, and joined; receptance coupling of holders and tools."""

from toolpoint.substructuring.receptance import PlaneReceptance, couple_tool
from toolpoint.substructuring.shaft import ContactDescription, SegmentDescription, ShaftDescription

__all__ = ["ContactDescription", "PlaneReceptance", "SegmentDescription", "ShaftDescription", "couple_tool"]
