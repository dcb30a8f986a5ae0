"""Turning: the direction of chip thickness, stability charts of chip widths, and doubts about measured lines."""
