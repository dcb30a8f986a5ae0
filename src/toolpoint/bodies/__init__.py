"""Bodies: what moves, with its mass, and where others hold on to it."""

from toolpoint.bodies.body import Body, Interface
from toolpoint.bodies.inertia import MassProperties

__all__ = ["Body", "Interface", "MassProperties"]
