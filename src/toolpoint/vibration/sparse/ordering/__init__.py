"""Order of elimination: separators of a graph by levels or coordinates, refined by moves of vertices."""
