"""Figures of machines: maps over poses and places, points, joints, sensitivities."""
