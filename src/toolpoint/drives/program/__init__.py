"""Set points from a path: lines, arcs, corner blends, jerk-limited look-ahead planning, limits."""
