"""Machines beside measurements: correlation, joints, updating."""
