"""Operational modal analysis: records of a machine at work in, modes with their confidence out; no force is measured."""
