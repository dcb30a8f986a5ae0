"""Machines written for multibody programs: MuJoCo's MJCF, and a script for Exudyn."""

from toolpoint.io.multibody import exudyn_script, mjcf

__all__ = ["exudyn_script", "mjcf"]
