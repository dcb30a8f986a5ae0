"""Robots: from the datasheet to a machine, statics and stops, places and poses, even regions, the redundant turn."""
