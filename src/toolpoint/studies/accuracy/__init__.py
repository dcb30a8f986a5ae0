"""Milling accuracy along a path: paths and motion laws, the structure along them, the cut at the moving tool, errors."""
