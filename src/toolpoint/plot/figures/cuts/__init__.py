"""Figures of cuts: charts, forces, probability."""
