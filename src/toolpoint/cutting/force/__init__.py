"""Cutting forces: laws beside the linear-edge one, literature of materials, calibration from measured forces."""
