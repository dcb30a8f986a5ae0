"""Turning: the direction of the chip, charts of widths, and doubts about measured lines."""
