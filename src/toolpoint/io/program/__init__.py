"""Programs and records of controllers: G-code, command streams, Sinumerik traces."""

from toolpoint.io.program.gcode import read_path

__all__ = ["read_path"]
