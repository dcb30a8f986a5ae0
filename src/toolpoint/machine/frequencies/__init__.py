"""Natural frequencies at many poses, without shapes: NumPy and compiled paths, trees and closed chains."""

from toolpoint.machine.frequencies.natural import natural_frequencies

__all__ = ["natural_frequencies"]
