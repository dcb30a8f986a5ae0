"""Where a machine is at a pose: bodies, named points, and the tool against its work."""
