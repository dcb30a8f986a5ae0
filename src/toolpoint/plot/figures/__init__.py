"""Figures: one module a family, a noun or a result in, a plotly figure out."""
