"""Machines that move: modes over the travel or the speed of an axis, and which joint changes on the way."""
