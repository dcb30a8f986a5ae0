"""Rigid-body geometry: rotations, transforms, twists and wrenches, screws, registration."""

from toolpoint.spatial.registration import Registration, iterative_closest_point, rigid
from toolpoint.spatial.screw import Screw, screw

__all__ = ["Registration", "Screw", "iterative_closest_point", "rigid", "screw"]
