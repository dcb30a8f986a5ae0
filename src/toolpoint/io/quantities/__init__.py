"""Quantities with units in files, converted to SI at the door."""
