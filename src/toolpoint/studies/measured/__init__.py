"""Measurements beside machines: correlation, joints, updating."""
