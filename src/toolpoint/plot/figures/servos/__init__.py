"""Figures of servos: signals, contour, circles."""
