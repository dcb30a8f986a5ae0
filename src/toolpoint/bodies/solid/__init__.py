"""Solid bodies by finite elements: elements, models in parts that scale, castings on planes, faces for interfaces."""

from toolpoint.bodies.solid.casting import Casting, Cuboid
from toolpoint.bodies.solid.drawn_region import CylinderFaces, PlaneFaces, RingFaces
from toolpoint.bodies.solid.material import CAST_IRON, STEEL, Material
from toolpoint.bodies.solid.model import ElementBlock, SolidModel
from toolpoint.bodies.solid.patch import Patch
from toolpoint.bodies.solid.region import JoinedPlaces, NamedNodes, NamedSurface
from toolpoint.bodies.solid.round_casting import RoundCasting, RoundPart

__all__ = ["CAST_IRON", "STEEL", "Casting", "Cuboid", "CylinderFaces", "ElementBlock", "JoinedPlaces", "Material", "NamedNodes",
           "NamedSurface", "Patch", "PlaneFaces", "RingFaces", "RoundCasting", "RoundPart", "SolidModel"]
