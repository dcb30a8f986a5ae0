"""Robots in URDF: read as machines with rigid joints, and their inertias questioned, which makers' files often get wrong."""

from toolpoint.io.urdf.machine import read, read_robot

__all__ = ["read", "read_robot"]
