"""Motion of measured points: rigid parts, places, errors, strangers, and the points that move together."""
