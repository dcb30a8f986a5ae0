"""Figures: one module for each family; functions take a result or arrays and return a plotly figure."""
