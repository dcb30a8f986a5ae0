"""Substructuring: parts reduced to what their neighbours see, and joined; receptance coupling of holders and tools.

Names below are loaded on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.substructuring.coupling import couple, couple_dual, join_elastically
    from toolpoint.substructuring.estimate import CoupledModes, Surroundings, couple_reduced, reduce_automatically
    from toolpoint.substructuring.frequency_coupling import couple_responses, decouple_responses
    from toolpoint.substructuring.large_body import LargeBody
    from toolpoint.substructuring.methods import ActingLoads, CraigBampton, ResidualFlexibility
    from toolpoint.substructuring.receptance import PlaneReceptance, couple_tool
    from toolpoint.substructuring.reduction import Reduction, reduce
    from toolpoint.substructuring.shaft import ContactDescription, SegmentDescription, ShaftDescription
    from toolpoint.substructuring.sliding import SlidingBody, fit_to_surroundings, tabulate
    from toolpoint.substructuring.spindle import SpindleReceptance, couple_spindle
    from toolpoint.substructuring.virtual_point import VirtualPoint, reduce_to_points

__all__ = [
    "ActingLoads",
    "ContactDescription",
    "CoupledModes",
    "CraigBampton",
    "LargeBody",
    "PlaneReceptance",
    "Reduction",
    "ResidualFlexibility",
    "SegmentDescription",
    "ShaftDescription",
    "SlidingBody",
    "SpindleReceptance",
    "Surroundings",
    "VirtualPoint",
    "couple",
    "couple_dual",
    "couple_reduced",
    "couple_responses",
    "couple_spindle",
    "couple_tool",
    "decouple_responses",
    "fit_to_surroundings",
    "join_elastically",
    "reduce",
    "reduce_automatically",
    "reduce_to_points",
    "tabulate",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "coupling": ("couple", "couple_dual", "join_elastically"),
    "estimate": ("CoupledModes", "Surroundings", "couple_reduced", "reduce_automatically"),
    "frequency_coupling": ("couple_responses", "decouple_responses"),
    "large_body": ("LargeBody",),
    "methods": ("ActingLoads", "CraigBampton", "ResidualFlexibility"),
    "receptance": ("PlaneReceptance", "couple_tool"),
    "reduction": ("Reduction", "reduce"),
    "shaft": ("ContactDescription", "SegmentDescription", "ShaftDescription"),
    "sliding": ("SlidingBody", "fit_to_surroundings", "tabulate"),
    "spindle": ("SpindleReceptance", "couple_spindle"),
    "virtual_point": ("VirtualPoint", "reduce_to_points"),
})
