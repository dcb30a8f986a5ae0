"""Friction and contact: laws with one interface, their compiled steps, identification from records."""
