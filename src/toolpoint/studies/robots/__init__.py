"""Robots: from the datasheet to a machine, statics and stops, places and poses, regions of even properties, the redundant
turn."""
