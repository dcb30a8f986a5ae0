"""Motion in time: of one system, and of one whose matrices change along a path."""
