"""From a path to set points: lines, arcs, corner blends, jerk-limited look-ahead planning, limits."""
