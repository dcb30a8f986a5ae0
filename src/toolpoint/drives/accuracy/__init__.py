"""Accuracy of axes: contour error, circular test, positioning."""
