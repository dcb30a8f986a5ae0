"""Screening of design changes: designs, metrics, runs that resume, effects with confidence, and cheapest improvements."""
