"""Thin walls: the dynamics of the work itself while a program takes its material, at the places where it cuts."""
