"""Placement of a machine at a pose: bodies, named points, and the tool against its work."""
