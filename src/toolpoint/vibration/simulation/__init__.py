"""Motion in time: of one system, and of one that changes along a path."""
