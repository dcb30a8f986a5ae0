"""Functional mock-up units: a servo written as an FMI 2.0 co-simulation unit whose C source holds the exact step."""

from toolpoint.io.fmu.unit import write

__all__ = ["write"]
