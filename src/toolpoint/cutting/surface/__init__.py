"""Surfaces left by milling: topography, location error, filters and roughness parameters."""
