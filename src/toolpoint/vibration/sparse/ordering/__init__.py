"""The order of elimination: separators of a graph by levels or coordinates, refined by cuts."""
