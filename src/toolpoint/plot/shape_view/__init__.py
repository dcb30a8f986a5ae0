"""Animated shapes: scenes, complex displacements of their nodes, and the view that a page holds."""
