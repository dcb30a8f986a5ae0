"""Klartext of Heidenhain controls: its lines as moves, cycles and ways to a contour."""
