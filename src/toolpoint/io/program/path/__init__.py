"""Path of a program: its segments, their corners, and their offset by the radius of the tool."""
