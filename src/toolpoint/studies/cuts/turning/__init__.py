"""Turning: the direction of the chip, charts of widths, and what measured lines can carry of them."""
