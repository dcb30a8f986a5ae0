"""How accurate an axis moves: contour error, circular test, positioning."""
