"""Measured cutting forces: records, doubts, coefficients, and the table of materials."""
